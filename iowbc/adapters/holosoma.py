"""Walking policies of the package `holosoma-inference` (Apache-2.0): 29 joints, gait clock with two phases.

Joints, gains and ranges are in the metadata of the ONNX file, the other numbers in the package's locomotion
configuration for the G1.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from iowbc.adapters.adapter import Adapter, Seen, scaled
from iowbc.adapters.networks import metadata, network
from iowbc.arrays import Array
from iowbc.errors import StageFailed
from iowbc.robot.description import kind_of
from iowbc.robot.rotations import wrapped

DEFAULT = {
    "hip_pitch": -0.312,
    "knee": 0.669,
    "ankle_pitch": -0.363,
    "shoulder_pitch": 0.2,
    "left_shoulder_roll": 0.2,
    "right_shoulder_roll": -0.2,
    "elbow": 0.6,
}
"""Nonzero joint angles of the default posture, for both sides if no side is named [rad]."""
ACTION_SCALE = 0.25
FREQUENCY = 50.0
GAIT_PERIOD = 1.0
RANGES = {"v_x": "lin_vel_x", "v_y": "lin_vel_y", "yaw_rate": "ang_vel_yaw"}
"""Names of the ranges in the metadata."""
LARGEST_ACTION = 100.0


def adapter(policy: Path) -> Adapter:
    """The adapter of an ONNX file of the package. Raises StageFailed if metadata entries are missing."""
    said, run = metadata(policy), network(policy)
    if missing := [name for name in ("dof_names", "kp", "kd", "command_ranges") if name not in said]:
        raise StageFailed(f"{policy}: its metadata lacks {', '.join(missing)}, which walkers of holosoma have")
    try:
        return _described(said, run)
    except (LookupError, TypeError, ValueError, AttributeError) as error:
        text = "its metadata describe no walker of holosoma that is read here"
        raise StageFailed(f"{policy}: {text}: {type(error).__name__}: {error}") from error


def _described(said: Mapping[str, Any], run: Callable[[Array], Array]) -> Adapter:
    joints = tuple(said["dof_names"])
    default = [DEFAULT.get(name.removesuffix("_joint"), DEFAULT.get(kind_of(name), 0.0)) for name in joints]
    return Adapter(
        joints=joints,
        default=np.array(default),
        kp=np.array(said["kp"]),
        kd=np.array(said["kd"]),
        acted=joints,
        scale=np.full(len(joints), ACTION_SCALE),
        frequency=FREQUENCY,
        terms=(
            scaled("action"),
            scaled("angular_velocity", 0.25),
            lambda seen: seen.velocity[:, 2:],
            lambda seen: seen.velocity[:, :2],
            lambda seen: np.cos(feet_phase(seen)),
            scaled("joint_deviation"),
            scaled("joint_velocity", 0.05),
            scaled("gravity"),
            lambda seen: np.sin(feet_phase(seen)),
        ),
        network=lambda observation: run(observation).clip(-LARGEST_ACTION, LARGEST_ACTION),
        ranges={own: tuple(said["command_ranges"][name]) for own, name in RANGES.items()},
    )


def feet_phase(seen: Seen) -> Array:
    """Phases of the left and right foot, (n, 2) [rad]: half a period apart in walking, both π in standing."""
    phase = 2.0 * np.pi * seen.walked / GAIT_PERIOD + np.array([0.0, np.pi])
    return np.where(seen.walking[:, None], wrapped(phase), np.pi)
