"""Errors of feet, height and torso of a support posture by forward kinematics, and their Jacobian."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio

from iowbc.arrays import Array
from iowbc.reference.labels.support_model import Sample, SupportModel, support_edges, support_margin

ROWS = 10
"""Foot position 3, foot rotation 3, height 1, torso rotation 3."""
LENGTH_ROWS = (0, 1, 2, 6)


@dataclass(frozen=True)
class TaskErrors:
    """Errors of postures that stand on both soles, the soles fitted together to their places, (n,) [m, rad]."""

    height: Array
    pitch: Array
    """Height and torso pitch reached minus commanded."""
    foot: Array
    """Distance of each sole centre from its place, shape (n,) [m]."""
    foot_rotation: Array
    """Angle of each sole from the common sole plane, shape (n,) [rad]."""
    margin: Array
    """Distance of the projected centre of mass inside the support polygon, shape (n,) [m]."""


class TaskKinematics:
    """Places postures on the ground: mean position and mean orientation of the soles at the middle of the stance."""

    def __init__(self, support: SupportModel) -> None:
        self.support = support
        self.edges = support_edges(support.robot, support.problem)

    def errors(self, samples: list[Sample], postures: Array) -> TaskErrors:
        """Errors of support postures (n, 15) for these samples."""
        found = np.array([self._error(sample, posture) for sample, posture in zip(samples, postures, strict=True)])
        return TaskErrors(*found.T)

    def _error(self, sample: Sample, posture: Array) -> tuple[Any, ...]:
        """One row of `TaskErrors`."""
        support = self.support
        model, data = support.model, support.data
        support.lock(sample)
        q = pinocchio.neutral(model)
        q[7:] = posture
        centre = pinocchio.centerOfMass(model, data, q).copy()
        pinocchio.updateFramePlacements(model, data)
        soles = [data.oMf[sole] for sole in support.soles]
        turn = soles[0].rotation.T @ soles[1].rotation
        rotation = soles[0].rotation @ pinocchio.exp3(0.5 * pinocchio.log3(turn))
        middle = pinocchio.SE3(rotation, 0.5 * (soles[0].translation + soles[1].translation))
        com, base, torso = map(middle.actInv, (centre, data.oMf[support.base], data.oMf[support.torso]))
        left = middle.actInv(soles[0]).translation - support.stance[0].translation
        reached = com[2] if support.height == "com" else base.translation[2]
        turned = sample.torso_rotation().T @ torso.rotation
        foot, foot_rotation = np.linalg.norm(left), 0.5 * np.linalg.norm(pinocchio.log3(turn))
        margin = support_margin(self.edges, com[:2])
        return reached - sample.height, pinocchio.log3(turned)[1], foot, foot_rotation, margin

    def jacobian(self, sample: Sample, configuration: Array) -> Array:
        """Derivative of foot position and rotation, height and torso rotation by the support joints, (10, 15), where
        `configuration` (22,) stands on the ground; the base follows so that the soles stay fitted to their places."""
        support = self.support
        model, data = support.model, support.data
        support.lock(sample)
        com_rows = pinocchio.jacobianCenterOfMass(model, data, configuration)[:, 6:]
        pinocchio.updateFramePlacements(model, data)
        left, right, torso = (
            pinocchio.getFrameJacobian(model, data, frame, pinocchio.LOCAL_WORLD_ALIGNED)[:, 6:]
            for frame in (*support.soles, support.torso)
        )
        places = [data.oMf[sole].translation for sole in support.soles]
        middle = 0.5 * (places[0] + places[1])
        turn, lift = -0.5 * (left[3:] + right[3:]), -0.5 * (left[2] + right[2])
        centre = data.com[0] if support.height == "com" else data.oMf[support.base].translation
        risen = lift - (pinocchio.skew(centre - middle) @ turn)[2]
        if support.height == "com":
            risen = risen + com_rows[2]
        foot = 0.5 * (left[:3] - right[:3]) - pinocchio.skew(places[0] - middle) @ turn
        rotation = 0.5 * (left[3:] - right[3:])
        return np.concatenate([foot, rotation, risen[None], torso[3:] + turn])
