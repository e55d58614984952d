"""The physical gates of a label, judged on the whole robot and independent of the method that made it."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
import pinocchio

from iowbc.arrays import Array
from iowbc.errors import Rejected
from iowbc.recipe.generator import LabelGates
from iowbc.reference.labels.sample import Posture, Sample
from iowbc.reference.labels.self_collision import SelfCollision
from iowbc.reference.labels.soles import sole_limits, support_edges, support_margin
from iowbc.reference.labels.support_model import SupportModel


@dataclass(frozen=True)
class Evidence:
    """Findings of the gates about a label."""

    torque: Array
    """Torques of the support joints in equilibrium, shape (15,) [N·m]."""
    margin: float
    """Distance of the projected centre of mass inside the support polygon [m]."""
    height: float
    """Height reached [m]."""


class LabelJudge:
    """Holds the limits and buffers; one judge serves many labels."""

    def __init__(self, support: SupportModel, gates: LabelGates, height: Literal["pelvis", "com"]) -> None:
        self.support, self.gates, self.height = support, gates, height
        robot, model = support.robot, support.full
        self.collision = SelfCollision(robot, model)
        self.edges = support_edges(robot, support.problem)
        self.cone, self.bound = sole_limits(robot, support.problem).rows()
        self.soles = [model.getFrameId(site) for site in robot.soles]
        self.torso, self.base = model.getFrameId(robot.torso), model.getFrameId(robot.base)
        self.effort = support.problem.effort_fraction * robot.effort
        self.forces = pinocchio.StdVec_Force()
        for _ in range(model.njoints):
            self.forces.append(pinocchio.Force.Zero())

    def arms(self, sample: Sample) -> None:
        """Rejects arms that collide with each other or the trunk, before anything is solved; legs at their default."""
        support = self.support
        q = support.whole(support.start(), sample.arm)
        pinocchio.forwardKinematics(support.full, support.full_data, q)
        if self.collision.clearance(support.full_data)[0] < self.gates.collision_clearance:
            raise Rejected("arms collide")

    def label(self, sample: Sample, posture: Posture) -> Evidence:
        """Passes a label or raises `Rejected`. The support model must be locked to the sample."""
        support, gates, robot = self.support, self.gates, self.support.robot
        model, data = support.full, support.full_data
        q = support.whole(posture.configuration, sample.arm)
        if not (np.isfinite(q).all() and np.isfinite(posture.wrench).all()):
            raise Rejected("not finite")
        for sole, wrench in zip(self.soles, posture.wrench, strict=True):
            frame = model.frames[sole]
            self.forces[frame.parentJoint] = frame.placement.act(pinocchio.Force(wrench))
        torque = pinocchio.computeStaticTorque(model, data, q, self.forces).copy()
        pinocchio.framesForwardKinematics(model, data, q)
        com = pinocchio.centerOfMass(model, data, q)
        errors = [place.actInv(data.oMf[sole]) for sole, place in zip(self.soles, support.stance, strict=True)]
        height = float(com[2] if self.height == "com" else data.oMf[self.base].translation[2])
        turned = pinocchio.log3(sample.torso_rotation().T @ data.oMf[self.torso].rotation)
        margin = float(support_margin(self.edges, com[:2]))
        moved, tilted = (
            max(map(np.linalg.norm, sizes))
            for sizes in ([one.translation for one in errors], [pinocchio.log3(one.rotation) for one in errors])
        )
        failed = {
            "feet": moved > gates.foot_position or tilted > gates.foot_rotation,
            "height": abs(height - sample.height) > gates.height,
            "orientation": np.linalg.norm(turned) > gates.orientation,
            "equilibrium": np.abs(torque[:6]).max() > gates.equilibrium,
            "torque": (np.abs(torque[6:]) > self.effort + gates.equilibrium).any(),
            "friction or centre of pressure": (posture.wrench @ self.cone.T > self.bound + gates.wrench).any(),
            "joint limits": (q[7:] < robot.lower).any() or (q[7:] > robot.upper).any(),
            "support margin": margin < gates.support_margin,
            "self-collision": self.collision.clearance(data)[0] < gates.collision_clearance,
        }
        for reason, found in failed.items():
            if found:
                raise Rejected(reason)
        return Evidence(torque[6 + robot.support], margin, height)
