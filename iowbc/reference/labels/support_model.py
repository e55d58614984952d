"""The robot on two soles in pinocchio, with its arms locked to a sample; limits of the soles."""

from dataclasses import dataclass
from itertools import product
from typing import Any, Literal

import numpy as np
import pinocchio
from scipy.spatial import ConvexHull

from iowbc.arrays import Array
from iowbc.recipe.generator import PostureProblem
from iowbc.robot import rotations
from iowbc.robot.description import Robot

BASE_RANGE = 10.0
"""Bound on the floating base's position [m]; pinocchio's reader sets ±1.01, which optimisers take for a limit."""
ROOT = "root_joint"
"""Name that crocoddyl's floating-base actuation looks for."""


@dataclass(frozen=True)
class Sample:
    """One arm posture and base command."""

    arm: Array
    """Positions of the interaction branch, shape (14,) [rad]."""
    command: Array
    """Height [m] and torso pitch [rad], shape (2,)."""

    @property
    def height(self) -> float:
        """Commanded height [m]."""
        return float(self.command[0])

    def torso_rotation(self) -> Array:
        """Commanded torso orientation relative to the feet: a pitch about the lateral axis, shape (3, 3)."""
        return rotations.matrix(rotations.from_euler(np.zeros(()), self.command[1], np.zeros(())))


@dataclass(frozen=True)
class Posture:
    """A support posture in equilibrium on two soles."""

    configuration: Array
    """Reduced pinocchio configuration: base position, base quaternion xyzw, support joints, shape (22,)."""
    wrench: Array
    """Wrench of the ground on each sole in the sole's frame, force then moment, shape (2, 6) [N, N·m]."""

    @property
    def support(self) -> Array:
        """Support joint positions, shape (15,) [rad]."""
        return self.configuration[7:]


def build_model(robot: Robot) -> Any:
    """A `pinocchio.Model` in MuJoCo's joint order (nq 7 + joints, nv 6 + joints), with armature and limits."""
    model = pinocchio.buildModelFromMJCF(str(robot.mjcf))
    names = tuple(model.names)[2:]
    if model.names[1] != ROOT or names != robot.joints:
        raise ValueError(
            f"{robot.mjcf}: pinocchio reads joints {model.names[1]}, {names}; the free joint must be named {ROOT!r} "
            f"and the others be {robot.joints}"
        )
    model.armature = np.concatenate([np.zeros(6), robot.armature])
    model.rotorInertia = np.zeros(model.nv)
    effort, velocity = (np.concatenate([np.full(6, np.inf), limit]) for limit in (robot.effort, robot.velocity_limit))
    model.lowerEffortLimit, model.upperEffortLimit = -effort, effort
    model.lowerVelocityLimit, model.upperVelocityLimit = -velocity, velocity
    model.lowerPositionLimit = np.concatenate([np.full(3, -BASE_RANGE), np.full(4, -1.01), robot.lower])
    model.upperPositionLimit = np.concatenate([np.full(3, BASE_RANGE), np.full(4, 1.01), robot.upper])
    return model


@dataclass(frozen=True)
class SoleLimits:
    """Limits of one flat sole: friction pyramid, centre of pressure in a rectangle, torsion, least load."""

    friction: float
    half_length: float
    half_width: float
    """Half sides of the rectangle for the centre of pressure [m]."""
    smallest_load: float
    """Least normal force [N]."""

    def rows(self) -> tuple[Array, Array]:
        """A and b of A f ≤ b for a wrench f (force, moment) in the sole's frame, shapes (17, 6) and (17,).

        The friction coefficient is that of the pyramid inside the cone, μ/√2. The yaw rows bound the torsion that four
        corner forces inside that pyramid can make (Caron, Pham, Nakamura, ICRA 2015).
        """
        x, y, mu = self.half_length, self.half_width, self.friction / np.sqrt(2.0)
        pyramid = [[1, 0, -mu, 0, 0, 0], [-1, 0, -mu, 0, 0, 0], [0, 1, -mu, 0, 0, 0], [0, -1, -mu, 0, 0, 0]]
        pressure = [[0, 0, -y, 1, 0, 0], [0, 0, -y, -1, 0, 0], [0, 0, -x, 0, 1, 0], [0, 0, -x, 0, -1, 0]]
        torsion = [
            [a * y, b * x, -mu * (x + y), -turn * a * mu, -turn * b * mu, -turn]
            for turn, a, b in product((1.0, -1.0), repeat=3)
        ]
        rows = np.array([*pyramid, *pressure, *torsion, [0, 0, -1, 0, 0, 0]], dtype=np.float64)
        bound = np.zeros(len(rows))
        bound[-1] = -self.smallest_load
        return rows, bound


class SupportModel:
    """Base and support joints in the robot's order; `lock` adds the arms' inertia."""

    def __init__(self, robot: Robot, problem: PostureProblem, height: Literal["pelvis", "com"] = "pelvis") -> None:
        """`height`: that of the pelvis or of the centre of mass, as a sample commands it."""
        self.robot, self.problem, self.height = robot, problem, height
        self.full = build_model(robot)
        self.full_data = self.full.createData()
        self._arms = [self.full.getJointId(robot.joints[index]) for index in robot.interaction]
        self._neutral = pinocchio.neutral(self.full)
        self.model = pinocchio.buildReducedModel(self.full, self._arms, self._neutral)
        expected = [robot.joints[index] for index in robot.support]
        if list(self.model.names)[2:] != expected:
            raise ValueError(
                f"{robot.folder}: the support joints must stand in the MJCF's order: {self.model.names[2:]}"
            )
        self.data = self.model.createData()
        self.soles = [self.model.getFrameId(site) for site in robot.soles]
        self.torso = self.model.getFrameId(robot.torso)
        self.base = self.model.getFrameId(robot.base)
        self._torso_joint = int(self.model.frames[self.torso].parentJoint)
        self._full_torso = self.full.getJointId(self.model.names[self._torso_joint])
        centres = 0.5 * problem.stance_width * np.array([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])
        self.stance = [pinocchio.SE3(np.eye(3), centre) for centre in centres]
        """Places of the left and of the right sole's centre on the ground."""
        margin = problem.limit_margin
        self.lower, self.upper = robot.lower[robot.support] + margin, robot.upper[robot.support] - margin
        self.effort = problem.effort_fraction * robot.effort[robot.support]
        self.posture_weights = np.full(len(robot.support), problem.sagittal_weight)
        """Weight w of ½ w (θ - θ_default)², shape (15,) [1/rad²]: waist, sagittal (axis across the body) or lateral."""
        self.posture_weights[robot.lateral] = problem.lateral_weight
        self.posture_weights[robot.waist] = problem.waist_weight
        half_length, half_width = problem.sole_fraction * np.abs(robot.sole_polygon).min(axis=(0, 1))
        self.limits = SoleLimits(problem.friction, float(half_length), float(half_width), problem.smallest_load)
        """Limits of either sole: the rectangle inside the contact points, shrunk by the recipe."""
        corners = robot.sole_polygon + centres[:, None, :2]
        edges = np.unique(ConvexHull(corners.reshape(-1, 2)).equations.round(12), axis=0)
        self._inward, self._offset = -edges[:, :2], -edges[:, 2]  # distance inside an edge: normal · point + offset

    def lock(self, sample: Sample) -> None:
        """Adds the inertia of the arms in their posture to the torso."""
        q = self._neutral.copy()
        q[7 + self.robot.interaction] = sample.arm
        pinocchio.forwardKinematics(self.full, self.full_data, q)
        torso = self.full_data.oMi[self._full_torso]
        inertia = self.full.inertias[self._full_torso].copy()
        for joint in self._arms:
            inertia += torso.actInv(self.full_data.oMi[joint]).act(self.full.inertias[joint])
        self.model.inertias[self._torso_joint] = inertia

    def whole(self, configuration: Array, arm: Array) -> Array:
        """Configuration of the full model (36,) from the reduced one (22,) and the arms (14,)."""
        q = np.empty(self.full.nq)
        q[:7] = configuration[:7]
        q[7 + self.robot.support] = configuration[7:]
        q[7 + self.robot.interaction] = arm
        return q

    def start(self) -> Array:
        """The default posture with the soles in their places, shape (22,)."""
        q: Array = pinocchio.neutral(self.model)
        q[7:] = self.robot.default_position[self.robot.support]
        pinocchio.framesForwardKinematics(self.model, self.data, q)
        soles = [self.data.oMf[sole].translation for sole in self.soles]
        q[:3] = -0.5 * (soles[0] + soles[1])
        return q

    def margin(self, point: Array) -> Array:
        """Distance of points (..., 2) to the nearest edge of both soles' convex hull, positive inside [m]."""
        return (point @ self._inward.T + self._offset).min(axis=-1)

    def rest(self, sample: Sample) -> Array:
        """Reference of the posture cost, (22,): default posture, with part of the commanded pitch in the waist."""
        q = self.start()
        waist = self.robot.waist_pitch
        lean = q[7 + waist] + self.problem.waist_share * sample.command[1] / max(len(waist), 1)
        q[7 + waist] = np.clip(lean, self.lower[waist], self.upper[waist])
        return q


def ground_forces(model: Any, soles: list[int], wrench: Array) -> Any:
    """Ground wrenches (2, 6) on a model's soles as pinocchio's list of forces in the joints' frames."""
    forces = pinocchio.StdVec_Force([pinocchio.Force.Zero()] * model.njoints)
    for sole, values in zip(soles, wrench, strict=True):
        frame = model.frames[sole]
        forces[frame.parentJoint] = frame.placement.act(pinocchio.Force(values))
    return forces
