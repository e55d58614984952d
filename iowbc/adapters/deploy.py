"""Controllers with a `deploy.yaml`, which unitree_rl_lab and related projects write beside exported networks."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from iowbc.adapters.adapter import Adapter, Term
from iowbc.adapters.networks import network
from iowbc.arrays import Array
from iowbc.errors import StageFailed
from iowbc.files import read_limited
from iowbc.robot.g1_motors import MOTORS

CONFIGURATION = "deploy.yaml"
LARGEST = 1 << 20
"""Maximum size of a configuration file [bytes]."""
FIELDS = {
    "base_ang_vel": "angular_velocity",
    "projected_gravity": "gravity",
    "velocity_commands": "velocity",
    "joint_pos": "joint_position",
    "joint_pos_rel": "joint_deviation",
    "joint_vel": "joint_velocity",
    "joint_vel_rel": "joint_velocity",
    "last_action": "action",
}
"""Supported observation terms and the corresponding fields of `Seen`."""
RANGES = {"v_x": "lin_vel_x", "v_y": "lin_vel_y", "yaw_rate": "ang_vel_z"}


class _Loader(yaml.SafeLoader):
    """Safe YAML loader that reads the exporter's Python `slice` objects as None, meaning all joints."""


_Loader.add_constructor("tag:yaml.org,2002:python/object/apply:builtins.slice", lambda loader, node: None)


def adapter(policy: Path) -> Adapter:
    """The adapter of a folder with one network and one `deploy.yaml`, at any depth. Raises StageFailed."""
    said = _configuration(_only(policy, CONFIGURATION))
    try:
        return _described(said, policy)
    except (LookupError, TypeError, ValueError, AttributeError, ArithmeticError) as error:
        text = f"its {CONFIGURATION} describes no controller of joint positions that is read here"
        raise StageFailed(f"{policy}: {text}: {type(error).__name__}: {error}") from error


def _described(said: Mapping[str, Any], policy: Path) -> Adapter:
    order, action = [int(place) for place in said["joint_ids_map"]], said["actions"]["JointPositionAction"]
    if action.get("joint_ids") is not None or action.get("clip") is not None:
        raise ValueError("actions of some joints, or clipped ones, are not read")
    if min(order) < 0:
        raise ValueError(f"joint_ids_map: {min(order)} is no motor")
    joints, default = tuple(MOTORS[place] for place in order), np.array(said["default_joint_pos"], np.float64)
    if not np.array_equal(np.array(action["offset"], np.float64), default):
        raise ValueError("actions that do not begin at default_joint_pos are not read")
    observations = dict(said["observations"])
    by_term = not observations.pop("use_gym_history", False)
    lengths = {int(term.get("history_length") or 1) for term in observations.values()}
    if len(lengths) != 1:
        raise ValueError(f"histories of several lengths, {sorted(lengths)}, are not read")
    ranges = said["commands"]["base_velocity"]["ranges"]
    return Adapter(
        joints=joints,
        default=default,
        kp=np.array(said["stiffness"], np.float64)[order],
        kd=np.array(said["damping"], np.float64)[order],
        acted=joints,
        scale=np.array(action["scale"], np.float64),
        frequency=round(1.0 / float(said["step_dt"]), 6),
        terms=tuple(_term(name, term) for name, term in observations.items()),
        network=network(_only(policy, "*.onnx")),
        history=lengths.pop(),
        by_term=by_term,
        ranges={own: (float(ranges[name][0]), float(ranges[name][1])) for own, name in RANGES.items()},
    )


def _term(name: str, said: Mapping[str, Any]) -> Term:
    """Observation term, clipped and then scaled."""
    if name not in FIELDS or said.get("params", {}).get("asset_cfg"):
        raise ValueError(f"the observation {name!r} is not read; there are: {', '.join(FIELDS)}")
    factor: Array = np.array(1.0 if said.get("scale") is None else said["scale"], np.float64)
    low, high = (-np.inf, np.inf) if said.get("clip") is None else said["clip"]
    return lambda seen: getattr(seen, FIELDS[name]).clip(low, high) * factor


def _only(folder: Path, pattern: str) -> Path:
    """The only file in a folder that matches a pattern. Raises StageFailed if there is none or more than one."""
    found = sorted(folder.rglob(pattern)) if folder.is_dir() else []
    if len(found) != 1:
        names = ", ".join(str(path) for path in found) or "none"
        raise StageFailed(f"{folder}: should be a folder with one {pattern}, found {names}")
    return found[0]


def _configuration(path: Path) -> Mapping[str, Any]:
    try:
        said = yaml.load(read_limited(path, LARGEST), _Loader)
    except (yaml.YAMLError, OSError, ValueError, RecursionError) as error:
        raise StageFailed(f"{path}: cannot be read: {error}") from error
    if not isinstance(said, Mapping):
        raise StageFailed(f"{path}: holds {type(said).__name__}, expected a mapping of entries")
    return said
