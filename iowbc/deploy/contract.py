"""The contract of an exported policy: everything that a caller on the robot must know, as JSON beside the graph."""

import hashlib
from pathlib import Path
from typing import Literal

from pydantic import ValidationError

from iowbc.errors import ContractBroken
from iowbc.recipe.section import Section
from iowbc.recipe.task.commands import Commands
from iowbc.recipe.task.joint_references import References

CONTRACT = "contract.json"
GRAPH = "policy.onnx"
GOLDEN = "golden.npz"
RECIPE = "recipe.json"
"""The recipe's world: with it the policy can be played in the simulation that accepted it."""
ROBOT = "robot"
"""Folder with the robot's description inside the exported folder."""
GENERATOR = "rg"
"""Folder with the reference generator: its feasible map clamps commands; its network is in the graph already."""
FEASIBLE = "feasible.npz"
GENERATOR_FILES = ("rg.safetensors", "rg.json", FEASIBLE)


class PortEntry(Section):
    """An input or output of the graph; its leading axis, not listed, is the number of robots."""

    name: str
    shape: tuple[int, ...]
    """Without the leading axis."""
    dtype: Literal["float32"] = "float32"
    unit: str
    frame: str
    """Frame in which the values are given; "joint" for joint coordinates, "-" where there is none."""
    meaning: str


class PartEntry(Section):
    """A part of the observation s_t, in order."""

    name: str
    size: int
    unit: str
    frame: str


class Contract(Section):
    """What `contract.json` says."""

    format: Literal[1] = 1
    """Raised when a reader of the old format would misread the new one."""
    recipe: str
    """Name of the recipe that was exported."""
    robot: str
    """Name of the robot."""
    sha256: str
    """Digest of the graph's file."""
    opset: int
    """ONNX operator set."""
    control_frequency: float
    """Rate at which the graph is to be called [Hz]."""
    physics_frequency: float
    """Rate of the joints' PD loop in training [Hz]."""
    inputs: tuple[PortEntry, ...]
    outputs: tuple[PortEntry, ...]
    joints: tuple[str, ...]
    """All joints in the order of every 29-vector."""
    support: tuple[int, ...]
    """Places of the support joints in `joints`, in the order of every 15-vector."""
    interaction: tuple[int, ...]
    """Places of the arm joints in `joints`, in the order of `arm_reference`."""
    kp: tuple[float, ...]
    """Position gains of the PD loop, all joints [N·m/rad]."""
    kd: tuple[float, ...]
    """Velocity gains of the PD loop, all joints [N·m·s/rad]."""
    effort: tuple[float, ...]
    """Torque limits [N·m]."""
    velocity_limit: tuple[float, ...]
    """Joint speed limits [rad/s]."""
    lower: tuple[float, ...]
    """Lower joint limits [rad]."""
    upper: tuple[float, ...]
    """Upper joint limits [rad]."""
    default_position: tuple[float, ...]
    """The default posture [rad]."""
    action_scale: tuple[float, ...]
    """Radians per unit of action; already inside the graph."""
    action_bound: float
    """Bound of the action; already inside the graph."""
    history: int
    """Length K of the observation history."""
    observation: tuple[PartEntry, ...]
    """Parts of s_t, in order; the graph builds it."""
    command: tuple[str, ...]
    """Entries of the command C, in order."""
    commands: Commands
    """Ranges and rates of the command in training; outside of them the policy was never tried."""
    references: References
    """Base grasps, arm kinematics and gait clock."""
    versions: dict[str, str]
    """Of the packages that made the graph."""
    sources: dict[str, str]
    """Artifact keys of the stages that went into the graph."""


def digest(path: Path) -> str:
    """SHA-256 of a file, in hexadecimal digits."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def write_contract(contract: Contract, folder: Path) -> None:
    """Write `contract.json`."""
    (folder / CONTRACT).write_text(contract.model_dump_json(indent=1) + "\n")


def read_contract(folder: Path | str) -> Contract:
    """The contract of an exported folder that is whole and unchanged. Raises ContractBroken."""
    folder = Path(folder)
    missing = [name for name in (CONTRACT, GRAPH, f"{ROBOT}/robot.yaml") if not (folder / name).is_file()]
    if missing:
        raise ContractBroken(
            f"{folder}: no exported policy, {' and '.join(missing)} missing; give the folder that `export` made"
        )
    try:
        contract = Contract.model_validate_json((folder / CONTRACT).read_text())
    except ValidationError as error:
        raise ContractBroken(f"{folder / CONTRACT}: not a contract of format 1: {error}; export again") from error
    found = digest(folder / GRAPH)
    if found != contract.sha256:
        raise ContractBroken(
            f"{folder / GRAPH}: SHA-256 is {found}, the contract says {contract.sha256}; "
            "the graph was changed or damaged after the export: export again"
        )
    return contract
