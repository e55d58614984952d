"""Description of a robot: its joints, branches, gains, limits and named frames."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from iowbc.arrays import Array, Indices
from iowbc.errors import UsageError, shown
from iowbc.robot.mjcf import Hinge, Tree, read_tree, small_text

GRAVITY = 9.81
"""Acceleration of gravity [m/s²], as MuJoCo and pinocchio have it by default."""
DESCRIPTION = "robot.yaml"
NEEDED = ("name", "mjcf", "base", "torso", "soles", "wrists", "support", "joints")
ROW_KEYS = frozenset({"kp", "kd", "velocity", "default", "scale", "mirrored"})


@dataclass(frozen=True)
class Robot:
    """A robot's description. Arrays are in the MJCF's joint order, shape (joints,), unless said otherwise."""

    folder: Path
    name: str
    mjcf: Path
    tree: Tree
    """The MJCF as bodies, joints, sites and collision capsules."""
    joints: tuple[str, ...]
    """Joint names in MJCF order."""
    support: Indices
    """Support branch S: indices of its joints, in the order of the policy's action."""
    interaction: Indices
    """Interaction branch I: indices of the arm joints."""
    waist: Indices
    """Places of the joints from base to torso, in that order, among the support joints."""
    waist_pitch: Indices
    """Those of `waist` that turn about y."""
    lateral: Indices
    """Places of joints that do not turn about the lateral axis, among the support joints: height and torso pitch are
    reached without them."""
    kp: Array
    """Position gains [N·m/rad]."""
    kd: Array
    """Velocity gains [N·m·s/rad]."""
    effort: Array
    """Torque limits [N·m]."""
    armature: Array
    """Rotor inertias at the joints [kg·m²]."""
    velocity_limit: Array
    """Joint speeds at which the motors have no torque left [rad/s]."""
    linkages: Indices
    """Pairs of joints that two motors move together, shape (linkages, 2)."""
    lower: Array
    upper: Array
    """Joint ranges [rad]."""
    default_position: Array
    """The default posture [rad]."""
    action_scale: Array
    """Radians that one unit of the policy's action adds, shape (support joints,)."""
    wrists: tuple[str, str]
    """Sites that the wrist commands move (left, right): the grip points."""
    wrist_bodies: tuple[str, str]
    """Bodies that carry those sites: the last that move on a joint."""
    grip_offset: Array
    """Position of the wrist sites in those bodies' frames, shape (2, 3) [m]."""
    soles: tuple[str, str]
    """Sites at the centre of each sole, on the sole plane."""
    sole_bodies: tuple[str, str]
    """Bodies that carry those sites."""
    sole_polygon: Array
    """Corners of the contact polygon in the frames of the sole sites: x and y, shape (2, 4, 2) [m]."""
    torso: str
    base: str
    """Body names of the torso and of the floating base."""
    default_height: float
    """Height of the base above the ground in the default posture, soles flat [m]."""


def robot_folder(name: str) -> Path:
    """Finds `robots/<name>`: in the current folder, else in the checkout, else in the installed package. A name with a
    slash is the path of a folder. Raises `UsageError` with the known robots."""
    if Path(name).name != name and (Path(name) / DESCRIPTION).is_file():
        return Path(name)
    found = robot_folders()
    if name not in found:
        raise UsageError(
            f"no robot {shown(name)}: looked for its robot.yaml in {', '.join(dict.fromkeys(map(str, _roots())))}; "
            f"known robots: {', '.join(found) or 'none'}"
        )
    return found[name]


def robot_folders() -> dict[str, Path]:
    """Folders of the known robots by name, alphabetically."""
    found = {path.parent.name: path.parent for root in reversed(_roots()) for path in root.glob(f"*/{DESCRIPTION}")}
    return dict(sorted(found.items()))


def _roots() -> list[Path]:
    """Search path of robots, highest precedence first."""
    package = Path(__file__).resolve().parents[1]
    return [Path.cwd() / "robots", package.parent / "robots", package / "robots"]


def load_robot(folder: Path) -> Robot:
    """Reads `robot.yaml` and the MJCF beside it that it names. Raises OSError for a file that is not there, ValueError
    with the file, the entry, and what would be valid."""
    source = folder / DESCRIPTION
    text = small_text(source)
    try:
        return _described(folder, yaml.safe_load(text))
    except ValueError as error:
        raise ValueError(f"{source}: {error}") from error
    except (yaml.YAMLError, LookupError, TypeError, AttributeError, RecursionError) as error:
        raise ValueError(f"{source}: describes no robot: {type(error).__name__}: {error}") from error


def _described(folder: Path, entries: Any) -> Robot:
    if not isinstance(entries, Mapping):
        raise ValueError(f"expected a mapping of entries, found {type(entries).__name__}")
    if missing := [key for key in NEEDED if key not in entries]:
        raise ValueError(f"missing {', '.join(missing)}")
    if unknown := [str(key) for key in entries if key not in (*NEEDED, "linkages")]:
        raise ValueError(f"unknown entry {', '.join(unknown)}; valid: {', '.join(NEEDED)}, linkages")
    mjcf = folder / entries["mjcf"]
    if mjcf.name != entries["mjcf"]:
        raise ValueError(f"mjcf: {shown(entries['mjcf'])} is not the name of a file in this folder")
    tree = read_tree(mjcf)
    hinges = tree.hinges()
    joints = tuple(hinge.name for hinge in hinges)
    for key in ("base", "torso"):
        if entries[key] not in tree.bodies:
            raise ValueError(f"{key}: no body {entries[key]!r} in {mjcf.name}; it has {', '.join(tree.bodies)}")
    support = _indices("support", entries["support"], joints)
    pairs = entries.get("linkages") or []
    if not isinstance(entries["joints"], Mapping):
        raise ValueError(f"joints: expected a mapping from kinds of joints, found {type(entries['joints']).__name__}")
    if any(len(pair) != 2 for pair in pairs):
        raise ValueError(f"linkages: expected pairs of joints, found {pairs}")
    rows = [_row(entries["joints"], name) for name in joints]
    if unused := set(entries["joints"]) - {kind_of(name) for name in joints}:
        raise ValueError(f"joints: no joint of {mjcf.name} is of kind {', '.join(sorted(unused))}")
    default = np.array([side_sign(row, name) * float(row["default"]) for row, name in zip(rows, joints, strict=True)])
    lower = np.array([hinge.lower for hinge in hinges])
    upper = np.array([hinge.upper for hinge in hinges])
    for name, low, value, high in zip(joints, lower, default, upper, strict=True):
        if not low <= value <= high:
            raise ValueError(f"default position {value} of {name} is outside its range {low} to {high} rad")
    scales = [rows[index].get("scale") for index in support]
    if None in scales:
        raise ValueError(f"joints: support joint {joints[support[scales.index(None)]]} has no `scale`")
    wrists, soles = _pair(entries, "wrists"), _pair(entries, "soles")
    grips, sole_bodies = [tree.carrier(site) for site in wrists], [tree.body_of_site(site) for site in soles]
    waist = tree.hinges_between(entries["torso"], entries["base"])
    legs = _sides("soles", [tree.hinges_between(body.name, entries["base"]) for body in sole_bodies])
    arms = _sides("wrists", [tree.hinges_between(body.name, entries["torso"]) for body, _ in grips])
    interaction = np.setdiff1d(np.arange(len(joints)), support)
    others = [joints[index] for index in interaction]
    if others != arms or not set(legs) <= {joints[index] for index in support}:
        text = f"legs and waist belong to it, and no joint of the arms {', '.join(arms)}"
        raise ValueError(
            f"support: {text}; outside of it are {', '.join(others)}, expected the left, then the right arm"
        )
    if few := [body.name for body in sole_bodies if len(body.feet) < 3 or len(body.feet) != len(sole_bodies[0].feet)]:
        raise ValueError(f"soles: {few[0]} needs a geom of class foot at each corner, the same number on both sides")
    posture = dict(zip(joints, default.tolist(), strict=True))
    return Robot(
        folder=folder,
        name=str(entries["name"]),
        mjcf=mjcf,
        tree=tree,
        joints=joints,
        support=support,
        interaction=interaction,
        waist=_places(waist, support, joints),
        waist_pitch=_places([hinge for hinge in waist if _is_pitch(hinge)], support, joints),
        lateral=np.flatnonzero([not _is_pitch(hinges[index]) for index in support]),
        kp=np.array([float(row["kp"]) for row in rows]),
        kd=np.array([float(row["kd"]) for row in rows]),
        effort=np.array([hinge.effort for hinge in hinges]),
        armature=np.array([hinge.armature for hinge in hinges]),
        velocity_limit=np.array([float(row["velocity"]) for row in rows]),
        linkages=_indices("linkages", [name for pair in pairs for name in pair], joints).reshape(-1, 2),
        lower=lower,
        upper=upper,
        default_position=default,
        action_scale=np.array(scales, dtype=np.float64),
        wrists=wrists,
        wrist_bodies=(grips[0][0].name, grips[1][0].name),
        grip_offset=np.stack([position for _, position in grips]),
        soles=soles,
        sole_bodies=(sole_bodies[0].name, sole_bodies[1].name),
        sole_polygon=np.stack(
            [body.feet - body.sites[site][:2] for body, site in zip(sole_bodies, soles, strict=True)]
        ),
        torso=str(entries["torso"]),
        base=str(entries["base"]),
        default_height=-float(tree.forward(posture, entries["base"], soles[0])[0][2]),
    )


def kind_of(joint: str) -> str:
    """Name of the row of a joint, without its side and ending: `left_hip_pitch_joint` is a `hip_pitch`."""
    return joint.removeprefix("left_").removeprefix("right_").removesuffix("_joint")


def _row(rows: Mapping[str, Mapping[str, Any]], joint: str) -> Mapping[str, Any]:
    row = rows.get(kind_of(joint))
    if row is None:
        raise ValueError(f"joints: no row {kind_of(joint)!r} for {joint}; rows: {', '.join(rows)}")
    unknown = set(row) - ROW_KEYS
    absent = {"kp", "kd", "velocity", "default"} - set(row)
    if unknown or absent:
        raise ValueError(
            f"joints.{kind_of(joint)}: unknown {sorted(unknown)}, missing {sorted(absent)}; "
            f"a row has {', '.join(sorted(ROW_KEYS))}"
        )
    for key in sorted({"kp", "kd", "velocity", "scale"} & set(row)):
        if not (isinstance(row[key], int | float) and 0.0 <= row[key] < np.inf and (row[key] or key == "kd")):
            raise ValueError(f"joints.{kind_of(joint)}.{key}: is {shown(row[key])}, expected a positive number")
    return row


def side_sign(row: Mapping[str, Any], joint: str) -> float:
    """Sign of a joint's default position against the one in its row."""
    return -1.0 if row.get("mirrored", False) and joint.startswith("right_") else 1.0


def _indices(key: str, names: list[str], joints: tuple[str, ...]) -> Indices:
    """Places of the joints that an entry names, each once."""
    unknown = [name for name in names if name not in joints]
    if unknown or len(set(names)) != len(names):
        raise ValueError(f"{key}: unknown or repeated joints {unknown}; the MJCF has {', '.join(joints)}")
    return np.array([joints.index(name) for name in names], np.int64)


def _is_pitch(hinge: Hinge) -> bool:
    """True if a hinge turns about the y axis of its body."""
    return bool(np.argmax(np.abs(hinge.axis)) == 1)


def _places(hinges: Sequence[Hinge], support: Indices, joints: tuple[str, ...]) -> Indices:
    names = [joints[index] for index in support]
    if missing := [hinge.name for hinge in hinges if hinge.name not in names]:
        raise ValueError(f"support: joints of legs and waist belong to it, missing {', '.join(missing)}")
    return np.array([names.index(hinge.name) for hinge in hinges], dtype=np.int64)


def _sides(key: str, chains: Sequence[Sequence[Hinge]]) -> list[str]:
    """Joints of the left, then of the right chain. Raises ValueError where their names are not those of a left and a
    right side, by which the mirror maps pair them."""
    left, right = ([hinge.name for hinge in chain] for chain in chains)
    if not all(name.startswith("left_") for name in left) or right != [f"right_{name[5:]}" for name in left]:
        text = "expected the same joints on both sides, named left_... and right_..."
        raise ValueError(
            f"{key}: the left one is moved by {', '.join(left)}, the right one by {', '.join(right)}; {text}"
        )
    return [*left, *right]


def _pair(entries: Mapping[str, Any], key: str) -> tuple[str, str]:
    value = entries[key]
    if not isinstance(value, list) or len(value) != 2:
        raise ValueError(f"{key}: expected [left, right], found {value!r}")
    return str(value[0]), str(value[1])
