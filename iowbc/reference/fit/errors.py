"""Errors of support postures by forward kinematics, with their Jacobian; the gates of the fitted network."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio

from iowbc.arrays import Array, Indices
from iowbc.control.feasible_map import FeasibleMap
from iowbc.control.generator import ReferenceNetwork
from iowbc.recipe.generator import FitGates, ReferenceGenerator
from iowbc.reference.labels.dataset import Dataset
from iowbc.reference.labels.support_model import Sample, SupportModel

ROWS = 10
"""Foot position 3, foot rotation 3, height 1, torso rotation 3."""
LENGTH_ROWS = (0, 1, 2, 6)
WORST = 10


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


def task_errors(support: SupportModel, samples: list[Sample], postures: Array) -> TaskErrors:
    """Errors of support postures (n, 15) for these samples."""
    found = np.array([_error(support, sample, posture) for sample, posture in zip(samples, postures, strict=True)])
    return TaskErrors(*found.T)


def _error(support: SupportModel, sample: Sample, posture: Array) -> tuple[Any, ...]:
    """One row of `TaskErrors`."""
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
    margin = support.margin(com[:2])
    return reached - sample.height, pinocchio.log3(turned)[1], foot, foot_rotation, margin


def task_jacobian(support: SupportModel, sample: Sample, configuration: Array) -> Array:
    """Derivative of foot position and rotation, height and torso rotation by the support joints, (10, 15), where
    `configuration` (22,) stands on the ground; the base follows so that the soles stay fitted to their places."""
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


def measure_jumps(
    network: ReferenceNetwork, recipe: ReferenceGenerator, feasible: FeasibleMap, arm: Array, seed: int
) -> Array:
    """Largest joint move for one step on each of some random lines between feasible commands, shape (lines,) [rad].

    Line i keeps the arms arm[i % n]. A step is one step of the height, one of the pitch, or a mixture of parts of both
    that add up to one. Steps outside the map, which need not be convex, do not count.
    """
    generator, smooth = np.random.default_rng(seed), recipe.fit.smoothness
    largest: Array = np.empty(smooth.lines)
    for line in range(smooth.lines):
        pitch = generator.uniform(feasible.pitch[0], feasible.pitch[-1], 2)
        low, high = np.interp(pitch, feasible.pitch, feasible.low), np.interp(pitch, feasible.pitch, feasible.high)
        height = generator.uniform(low, high)
        steps = abs(np.diff(height)[0]) / smooth.height_step + abs(np.diff(pitch)[0]) / smooth.pitch_step
        along = np.append(np.arange(0.0, steps) / max(steps, 1e-9), 1.0)
        command = np.stack([start + along * (end - start) for start, end in (height, pitch)], axis=1)
        inside = feasible.contains(command[:, 0], command[:, 1])
        reference = network(np.tile(arm[line % len(arm)], (len(along), 1)), command)
        moved = np.abs(np.diff(reference, axis=0)).max(axis=1) * (inside[1:] & inside[:-1])
        largest[line] = moved.max()
    return largest


@dataclass(frozen=True)
class Verdict:
    """Metrics and gates on held-out samples."""

    metrics: dict[str, float]
    gates: dict[str, dict[str, float | bool | None]]
    """Value, limit and result of each gate."""
    failures: list[str]
    worst: list[str]
    """Descriptions of the worst held-out samples."""


def check_fit(
    gates: FitGates, dataset: Dataset, held: Indices, predicted: Array, errors: TaskErrors, jumps: Array
) -> Verdict:
    """Compares predictions (n, 15) for the dataset's rows `held` with labels and commands; `jumps` (lines,) [rad]."""
    difference = predicted - dataset.support[held]
    per_sample = np.sqrt((difference**2).mean(axis=1))
    metrics = {
        "joint_rmse": float(np.sqrt((difference**2).mean())),
        "joint_median": float(np.median(np.abs(difference))),
        "joint_p99": float(np.percentile(np.abs(difference), 99)),
        "height_p95": float(np.percentile(np.abs(errors.height), 95)),
        "pitch_p95": float(np.percentile(np.abs(errors.pitch), 95)),
        "foot_p95": float(np.percentile(errors.foot, 95)),
        "foot_rotation_p95": float(np.percentile(errors.foot_rotation, 95)),
        "margin_p1": float(np.percentile(errors.margin, 1)),
        "margin_median": float(np.median(errors.margin)),
        "jump": float(jumps.max()),
        "jump_median": float(np.median(jumps)),
    }
    judged: dict[str, dict[str, float | bool | None]] = {}
    failures: list[str] = []
    for name, limit in gates:
        value = metrics[name]
        passed = limit is None or (value >= limit if name == "margin_p1" else value <= limit)
        judged[name] = {"value": value, "limit": limit, "passed": passed}
        if not passed:
            failures.append(f"{name} is {value:.4g}, the limit {limit:.4g}")
    order = np.argsort(-per_sample)[:WORST]
    worst = [
        f"number {dataset.index[held[i]]} "
        f"(height {dataset.command[held[i], 0]:.3f} m, pitch {dataset.command[held[i], 1]:+.3f} rad): "
        f"joints {per_sample[i]:.4f} rad, height {1e3 * errors.height[i]:+.1f} mm, pitch {errors.pitch[i]:+.4f} rad, "
        f"feet {1e3 * errors.foot[i]:.1f} mm"
        for i in order
    ]
    return Verdict(metrics, judged, failures, worst)
