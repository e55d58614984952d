"""Multi-contact optimal control problem over a horizon (paper eq. 4), with the arms locked, solved by BoxFDDP.

Full dynamics and both feet in contact. The robot starts at rest in a posture that meets the command by kinematics, and
settles into that of least cost. The label is a node before the end, where neither start nor end have an influence.
"""

from typing import Any

import crocoddyl
import numpy as np
import pinocchio

from iowbc.arrays import Array
from iowbc.errors import Rejected
from iowbc.recipe.generator import ReferenceGenerator
from iowbc.reference.labels.gauss_newton import UNBOUNDED, PostureCost, constrained_step, cost_weights
from iowbc.reference.labels.support_model import Posture, Sample, SupportModel

STOP = 1e-10
"""Expected improvement at which the solver stops; crocoddyl's 5e-5 leaves flat postures where they started."""
FACETS = 4
"""Sides of the friction pyramid."""


class OptimalControlMethod:
    """Solves samples one after the other; a label does not depend on the samples before it."""

    def __init__(self, support: SupportModel, recipe: ReferenceGenerator) -> None:
        self.support, self.problem, self.ocp = support, recipe.problem, recipe.ocp
        self.state = crocoddyl.StateMultibody(support.model)
        self.actuation = crocoddyl.ActuationModelFloatingBase(self.state)

    def solve(self, sample: Sample) -> Posture:
        """The posture at the label's node, with the sole wrenches that hold it at rest. Raises `Rejected`."""
        self.support.lock(sample)
        states = self.trajectory(sample)
        if not np.isfinite(np.concatenate(states)).all():
            raise Rejected("not converged")
        if np.linalg.norm(states[-1][self.support.model.nq :]) > self.ocp.settled:
            raise Rejected("not settled")
        configuration = states[round(self.ocp.label_at * self.ocp.nodes)][: self.support.model.nq]
        return Posture(configuration, distribute(self.support, configuration))

    def trajectory(self, sample: Sample) -> list[Array]:
        """States (configuration, velocity) at the nodes. The support model must be locked to the sample."""
        posture = kinematic_start(self.support, sample)
        start = np.concatenate([posture, np.zeros(self.support.model.nv)])
        contacts = self._contacts()
        running = self._action(self._costs(sample, terminal=False), contacts, self.ocp.step)
        terminal = self._action(self._costs(sample, terminal=True), contacts, 0.0)
        problem = crocoddyl.ShootingProblem(start, [running] * self.ocp.nodes, terminal)
        problem.nthreads = 1  # parallel over processes; its own threads would busy-wait
        states = [start] * (self.ocp.nodes + 1)
        solver = crocoddyl.SolverBoxFDDP(problem)
        solver.th_stop = STOP
        solver.solve(states, list(problem.quasiStatic(states[:-1])), self.ocp.iterations, False)
        return list(solver.xs)

    def _action(self, costs: Any, contacts: Any, step: float) -> Any:
        dynamics = crocoddyl.DifferentialActionModelContactFwdDynamics(
            self.state, self.actuation, contacts, costs, 0.0, True
        )
        action = crocoddyl.IntegratedActionModelEuler(dynamics, step)
        action.u_lb, action.u_ub = -self.support.effort, self.support.effort
        return action

    def _contacts(self) -> Any:
        contacts = crocoddyl.ContactModelMultiple(self.state, self.actuation.nu)
        for sole, place in zip(self.support.soles, self.support.stance, strict=True):
            contact = crocoddyl.ContactModel6D(
                self.state, sole, place, pinocchio.LOCAL, self.actuation.nu, np.array(self.ocp.contact_gains)
            )
            contacts.addContact(f"sole_{sole}", contact)
        return contacts

    def _costs(self, sample: Sample, *, terminal: bool) -> Any:
        """The running cost, or the terminal one: no torques or contact forces, velocities held to rest."""
        state, nu, nv = self.state, self.actuation.nu, self.support.model.nv
        problem, support, limits = self.problem, self.support, self.support.limits
        factor = self.ocp.terminal_factor if terminal else 1.0
        velocity = self.ocp.terminal_velocity_weight / factor if terminal else self.ocp.velocity_weight
        costs = crocoddyl.CostModelSum(state, nu)

        def add(name: str, residual: Any, weights: Array) -> None:
            activation = crocoddyl.ActivationModelWeightedQuad(weights)
            costs.addCost(name, crocoddyl.CostModelResidual(state, activation, residual), factor)

        def limit(name: str, residual: Any, lower: Array, upper: Array, weight: float) -> None:
            barrier = crocoddyl.ActivationModelQuadraticBarrier(crocoddyl.ActivationBounds(lower, upper))
            costs.addCost(name, crocoddyl.CostModelResidual(state, barrier, residual), weight)

        of_com = support.height == "com"
        com_height, base_height = (problem.height_weight, 0.0) if of_com else (0.0, problem.height_weight)
        place = np.array([0.0, 0.0, sample.height])
        plane = np.array([problem.com_weight, problem.com_weight, com_height])
        add("centre of mass", crocoddyl.ResidualModelCoMPosition(state, place, nu), plane)
        lift = crocoddyl.ResidualModelFrameTranslation(state, support.base, place, nu)
        add("base height", lift, np.array([0.0, 0.0, base_height]))
        turn = crocoddyl.ResidualModelFrameRotation(state, support.torso, sample.torso_rotation(), nu)
        add("torso", turn, np.full(3, problem.torso_weight))
        rest, free = np.concatenate([support.rest(sample), np.zeros(nv)]), np.full(nv, np.inf)
        deviation, angle = crocoddyl.ResidualModelState(state, rest, nu), rest[7 : support.model.nq]
        add("posture", deviation, np.concatenate([np.zeros(6), support.posture_weights, np.full(nv, velocity)]))
        lower = np.concatenate([-free[:6], support.lower - angle, -free])
        upper = np.concatenate([free[:6], support.upper - angle, free])
        limit("joint limits", deviation, lower, upper, factor * self.ocp.limit_weight)
        if terminal:
            return costs
        add("torque", crocoddyl.ResidualModelControl(state, nu), np.full(nu, problem.torque_weight))
        size = 2.0 * np.array([limits.half_length, limits.half_width])
        cone = crocoddyl.WrenchCone(np.eye(3), limits.friction, size, FACETS, True, limits.smallest_load, np.inf)
        for sole in support.soles:
            wrench = crocoddyl.ResidualModelContactWrenchCone(state, sole, cone, nu)
            limit(f"wrench of sole {sole}", wrench, cone.lb, cone.ub, self.ocp.cone_weight)
        return costs


def kinematic_start(support: SupportModel, sample: Sample) -> Array:
    """Configuration (22,) with the feet in place, the centre of mass over their middle, height and torso as commanded,
    near the default posture, by Gauss-Newton steps on the cost without torques, with the feet as linearised equalities
    and the joint ranges. The support model must be locked to the sample. Raises `Rejected` if the feet cannot stay."""
    problem, weight = support.problem, np.concatenate(cost_weights(support))
    q, largest = support.rest(sample), problem.largest_step
    rest = q[7:].copy()
    for _ in range(problem.iterations):
        cost = PostureCost.at(support, q, sample, rest)
        gradient, residual = weight[:, None] * cost.gradient, weight * cost.residual
        lower, upper = np.maximum(support.lower - q[7:], -largest), np.minimum(support.upper - q[7:], largest)
        step = constrained_step(gradient, residual, cost.equality, cost.error, cost.gradient[6:], lower, upper)
        q = pinocchio.integrate(support.model, q, step)
        if np.abs(step).max() < problem.tolerance:
            break
    return q


def distribute(support: SupportModel, configuration: Array) -> Array:
    """The sole wrenches that hold a `configuration` (22,) with the least joint torques, (2, 6), in the soles' frames.
    Raises `Rejected` where the limits leave no equilibrium with gravity."""
    model, data = support.model, support.data
    gravity = pinocchio.computeGeneralizedGravity(model, data, configuration).copy()
    pinocchio.computeJointJacobians(model, data, configuration)
    pinocchio.updateFramePlacements(model, data)
    jacobians = [pinocchio.getFrameJacobian(model, data, sole, pinocchio.LOCAL).T for sole in support.soles]
    base, joints = np.split(np.concatenate(jacobians, axis=1), [6])
    cone, bound = support.limits.rows()
    rows, upper = np.kron(np.eye(2), cone), np.tile(bound, 2)
    lower = np.full(len(upper), -UNBOUNDED)
    return constrained_step(joints, -gravity[6:], base, -gravity[:6], rows, lower, upper).reshape(2, 6)
