"""Checks of labels: physical gates on the whole robot, whatever the method; static labels against optimal control;
mirrored samples against their originals."""

from dataclasses import dataclass
from itertools import combinations
from typing import Any

import coal
import numpy as np
import pinocchio

from iowbc.arrays import Array
from iowbc.errors import Rejected
from iowbc.recipe.generator import LabelGates, ReferenceGenerator
from iowbc.reference.labels.dataset import Dataset, Shard
from iowbc.reference.labels.plan import SamplePlan
from iowbc.reference.labels.support_model import Posture, Sample, SupportModel, ground_forces
from iowbc.robot.description import Robot
from iowbc.robot.mirror import support_mirror
from iowbc.robot.mjcf import Capsule

WORST = 5


class LabelChecker:
    """Holds the limits and buffers; one judge serves many labels."""

    def __init__(self, support: SupportModel, gates: LabelGates) -> None:
        self.support, self.gates = support, gates
        robot, model = support.robot, support.full
        self.collision = SelfCollision(robot, model)
        self.cone, self.bound = support.limits.rows()
        self.soles = [model.getFrameId(site) for site in robot.soles]
        self.torso, self.base = model.getFrameId(robot.torso), model.getFrameId(robot.base)
        self.effort = support.problem.effort_fraction * robot.effort

    def arms(self, sample: Sample) -> None:
        """Rejects arms that collide with each other or the trunk, with the legs at their default, before solving."""
        support = self.support
        q = support.whole(support.start(), sample.arm)
        pinocchio.forwardKinematics(support.full, support.full_data, q)
        if self.collision.clearance(support.full_data) < self.gates.collision_clearance:
            raise Rejected("arms collide")

    def label(self, sample: Sample, posture: Posture) -> dict[str, Array]:
        """Torque, margin and height reached of a label, named as in the dataset, or raises `Rejected`. The support
        model must be locked to the sample."""
        support, gates, robot = self.support, self.gates, self.support.robot
        model, data = support.full, support.full_data
        q = support.whole(posture.configuration, sample.arm)
        if not (np.isfinite(q).all() and np.isfinite(posture.wrench).all()):
            raise Rejected("not finite")
        torque = pinocchio.computeStaticTorque(model, data, q, ground_forces(model, self.soles, posture.wrench)).copy()
        pinocchio.framesForwardKinematics(model, data, q)
        com = pinocchio.centerOfMass(model, data, q)
        errors = [place.actInv(data.oMf[sole]) for sole, place in zip(self.soles, support.stance, strict=True)]
        height = float(com[2] if support.height == "com" else data.oMf[self.base].translation[2])
        turned = pinocchio.log3(sample.torso_rotation().T @ data.oMf[self.torso].rotation)
        margin = float(support.margin(com[:2]))
        moved = max(np.linalg.norm(one.translation) for one in errors)
        tilted = max(np.linalg.norm(pinocchio.log3(one.rotation)) for one in errors)
        failed = {
            "feet": moved > gates.foot_position or tilted > gates.foot_rotation,
            "height": abs(height - sample.height) > gates.height,
            "orientation": np.linalg.norm(turned) > gates.orientation,
            "equilibrium": np.abs(torque[:6]).max() > gates.equilibrium,
            "torque": (np.abs(torque[6:]) > self.effort + gates.equilibrium).any(),
            "friction or centre of pressure": (posture.wrench @ self.cone.T > self.bound + gates.wrench).any(),
            "joint limits": (q[7:] < robot.lower).any() or (q[7:] > robot.upper).any(),
            "support margin": margin < gates.support_margin,
            "self-collision": self.collision.clearance(data) < gates.collision_clearance,
        }
        for reason, found in failed.items():
            if found:
                raise Rejected(reason)
        return {"torque": torque[6 + robot.support], "margin": np.asarray(margin), "reached": np.asarray(height)}


class SelfCollision:
    """Distances between capsules, except on bodies fixed to each other, one joint apart, or excluded by the MJCF."""

    def __init__(self, robot: Robot, model: Any) -> None:
        self._model, self._geometry = model, pinocchio.GeometryModel()
        shapes = [(body, capsule) for body in robot.tree.bodies.values() for capsule in body.capsules]
        for body, capsule in shapes:
            frame = model.frames[model.getFrameId(body.name, pinocchio.FrameType.BODY)]
            placement, shape = _placed(capsule)
            self._geometry.addGeometryObject(
                pinocchio.GeometryObject(capsule.name, frame.parentJoint, frame.placement * placement, shape)
            )
        self.names = tuple(capsule.name for _, capsule in shapes)
        owner = [body.name for body, _ in shapes]
        self.pairs = [(a, b) for a, b in combinations(range(len(shapes)), 2) if _may_touch(robot, owner[a], owner[b])]
        for a, b in self.pairs:
            self._geometry.addCollisionPair(pinocchio.CollisionPair(a, b))
        self._found = self._geometry.createData()

    def clearance(self, data: Any) -> float:
        """Least distance [m] (negative: overlap), after forward kinematics in `data`."""
        pinocchio.updateGeometryPlacements(self._model, data, self._geometry, self._found)
        nearest = pinocchio.computeDistances(self._geometry, self._found)
        return float(self._found.distanceResults[nearest].min_distance)


def _placed(capsule: Capsule) -> tuple[Any, Any]:
    """Pose in the body's frame and shape of a capsule; coal's lies along z, about its middle."""
    middle, along = 0.5 * (capsule.start + capsule.end), capsule.end - capsule.start
    length = float(np.linalg.norm(along))
    if length == 0.0:
        return pinocchio.SE3(np.eye(3), middle), coal.Sphere(capsule.radius)
    turn = pinocchio.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), along / length)
    return pinocchio.SE3(turn.matrix(), middle), coal.Capsule(capsule.radius, length)


def _may_touch(robot: Robot, a: str, b: str) -> bool:
    """True for two bodies that are checked for collision; bodies fixed to each other count as one."""
    tree = robot.tree
    movers = [tree.mover(name) for name in (a, b)]
    inward = [None if body.parent is None else tree.mover(body.parent).name for body in movers]
    names = [body.name for body in movers]
    related = names[0] == names[1] or inward[0] == names[1] or inward[1] == names[0]
    return not related and frozenset((a, b)) not in tree.excluded


@dataclass(frozen=True)
class MethodComparison:
    """Differences between static labels and optimal control."""

    difference: Array
    """Largest joint difference of each sample, shape (n,) [rad]."""
    metrics: dict[str, float]
    worst: list[str]


def chosen_for_crosscheck(dataset: Dataset, plan: SamplePlan, recipe: ReferenceGenerator) -> list[int]:
    """Numbers of the drawn samples to solve again, spread evenly over the kept ones."""
    drawn = dataset.index[dataset.index < plan.drawn]
    count = min(recipe.crosscheck.samples, len(drawn))
    return [int(drawn[place]) for place in np.linspace(0, len(drawn) - 1, count).astype(int)] if count else []


def compare_methods(dataset: Dataset, again: Shard) -> MethodComparison | None:
    """Differences where optimal control has a label too; None where it has none."""
    if not len(again.kept):
        return None
    row = {int(index): place for place, index in enumerate(dataset.index)}
    rows = [row[int(index)] for index in again.kept]
    difference = np.abs(dataset.support[rows] - again.labels["support"]).max(axis=1)
    metrics = {
        "crosscheck_samples": float(len(difference)),
        "crosscheck_solved": len(difference) / (len(again.kept) + len(again.rejected)),
        "crosscheck_median": float(np.median(difference)),
        "crosscheck_p90": float(np.percentile(difference, 90)),
        "crosscheck_max": float(difference.max()),
    }
    worst = [
        f"number {again.kept[i]} (height {dataset.command[rows[i], 0]:.3f} m, "
        f"pitch {dataset.command[rows[i], 1]:+.3f} rad): {difference[i]:.4f} rad"
        for i in np.argsort(-difference)[:WORST]
    ]
    return MethodComparison(difference, metrics, worst)


def mirror_error(plan: SamplePlan, dataset: Dataset) -> Array | None:
    """Largest joint difference of mirrored samples from mirror images of their originals, (pairs,) [rad], if any."""
    row = {int(index): place for place, index in enumerate(dataset.index)}
    images = [index for index in row if plan.original <= index < plan.drawn and plan.group(index) in row]
    if not images:
        return None
    own = dataset.support[[row[index] for index in images]]
    source = dataset.support[[row[plan.group(index)] for index in images]]
    return np.abs(support_mirror(plan.robot)(source) - own).max(axis=1)
