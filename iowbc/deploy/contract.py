"""Contract of an exported policy: all that a caller on the robot must know, as JSON beside the graph."""

import math
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from textwrap import shorten
from typing import Literal, Self, TypeVar

from pydantic import Field, NonNegativeFloat, ValidationError, model_validator

from iowbc.control.command import COMMAND
from iowbc.control.feasible_map import FEASIBLE
from iowbc.control.generator import ARCHITECTURE, WEIGHTS
from iowbc.deploy.exported_folder import CONTRACT, GENERATOR, ROBOT, SETTLE, STEP
from iowbc.errors import ContractBroken
from iowbc.files import file_digest
from iowbc.recipe.section import Section
from iowbc.recipe.simulation.simulation import SensorNoise
from iowbc.recipe.task.commands import Commands
from iowbc.recipe.task.joint_references import References
from iowbc.robot.description import DESCRIPTION

Kind = TypeVar("Kind", bound=Section)
LARGEST_CONTRACT = 1_000_000
"""Largest contract that is read [bytes]."""
GENERATOR_FILES = (WEIGHTS, ARCHITECTURE, FEASIBLE)
TORQUE = (
    "torque = clip(kp * (target - position) - kd * velocity, -effort, effort) for each joint [N·m], computed at "
    "physics_frequency or faster; target holds between two steps of the graph"
)


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


class Latency(Section):
    """Ranges of the delays in training [control periods]."""

    action: tuple[float, float]
    """Delay from the graph's output to the motors."""
    sensors: tuple[float, float]
    """Delay of joint and inertial measurements."""
    object: tuple[float, float]
    """Delay of the object's pose."""


class Contract(Section):
    """Content of `contract.json`."""

    format: Literal[4] = 4
    """Raised when a reader of the old format would misread the new one."""
    recipe: str
    """Name of the recipe that was exported."""
    robot: str
    """Name of the robot."""
    files: dict[str, str] = Field(default_factory=dict)
    """SHA-256 of every other file of the folder, by its path in the folder."""
    opset: int
    """ONNX operator set."""
    control_frequency: float = Field(gt=0)
    """Rate at which step.onnx is to be called [Hz]."""
    physics_frequency: float = Field(gt=0)
    """Rate of the joints' PD loop in training [Hz]."""
    inputs: tuple[PortEntry, ...]
    """Inputs of step.onnx."""
    outputs: tuple[PortEntry, ...]
    """Outputs of step.onnx."""
    settle: tuple[str, ...]
    """Inputs of settle.onnx, by their names in `inputs`; its output is `state`."""
    state: tuple[PortEntry, ...]
    """Parts of `state`, in order, each flattened; a program passes it on and need not look into it."""
    joints: tuple[str, ...]
    """All joints in the order of every 29-vector."""
    support: tuple[int, ...]
    """Places of the support joints in `joints`, in the order of every 15-vector."""
    interaction: tuple[int, ...]
    """Places of the arm joints in `joints`, in the order of `arm_reference`."""
    kp: tuple[NonNegativeFloat, ...]
    """Position gains of the PD loop, all joints [N·m/rad]."""
    kd: tuple[NonNegativeFloat, ...]
    """Velocity gains of the PD loop, all joints [N·m·s/rad]."""
    effort: tuple[NonNegativeFloat, ...]
    """Torque limits [N·m]."""
    velocity_limit: tuple[NonNegativeFloat, ...]
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
    history: int = Field(ge=1)
    """Length K of the observation history."""
    observation: tuple[PartEntry, ...]
    """Parts of s_t, in order; the graph builds it."""
    command: tuple[str, ...]
    """Entries of the command C, in order."""
    commands: Commands
    """Ranges and rates of the command in training; outside of them the policy was never tried."""
    references: References
    """Base grasps, arm kinematics and gait clock."""
    torque: str = TORQUE
    """Equation of a motor's torque from the targets."""
    sensing: SensorNoise
    """Noise of the sensors in training, standard deviations."""
    latency: Latency
    """Delays in training."""
    sentences: dict[str, str] = Field(default_factory=dict)
    """Meaning of each entry of this file, by its dotted path."""
    versions: dict[str, str]
    """Versions of the packages that made the graph."""
    sources: dict[str, str]
    """Artifact keys of the stages that went into the graph."""

    @model_validator(mode="after")
    def _sizes_and_ports_fit(self) -> Self:
        """Checks one number per joint, and the ports of the graph that the control loop needs."""
        joints = len(self.joints)
        for name in ("kp", "kd", "effort", "velocity_limit", "lower", "upper", "default_position"):
            values = getattr(self, name)
            if len(values) != joints:
                raise ValueError(f"{name}: {len(values)} numbers {values} for {joints} joints")
        if sorted((*self.support, *self.interaction)) != list(range(joints)):
            raise ValueError(f"support {self.support} and interaction {self.interaction} do not cover {joints} joints")
        if outside := [name for name in self.files if ".." in Path(name).parts or Path(name).is_absolute()]:
            raise ValueError(f"files: {', '.join(outside)} lie outside of the folder")
        if len(self.action_scale) != len(self.support):
            raise ValueError(f"action_scale: {len(self.action_scale)} numbers for {len(self.support)} support joints")
        if not all(low < high for low, high in zip(self.lower, self.upper, strict=True)):
            raise ValueError(f"lower {self.lower} does not lie below upper {self.upper}")
        support, size = len(self.support), sum(math.prod(part.shape) for part in self.state)
        inputs = {"command": (len(COMMAND),), "grasp": (2, 3), "load": (1,), "state": (size,)}
        outputs = {"target": (joints,), "action": (support,), "support_reference": (support,), "state_next": (size,)}
        for side, shapes in (("inputs", inputs), ("outputs", outputs)):
            found = {port.name: port.shape for port in getattr(self, side)}
            for name, shape in shapes.items():
                if found.get(name) != shape:
                    raise ValueError(f"{side}: {name} should have the shape {shape}, found {found.get(name)}")
        if absent := set(self.settle) - {port.name for port in self.inputs}:
            raise ValueError(f"settle: {', '.join(sorted(absent))} are no inputs")
        if "action" not in {part.name for part in self.state}:
            raise ValueError("state: has no part `action`")
        return self


def seal(contract: Kind, folder: Path, name: str = CONTRACT, files: Iterable[str] = ()) -> Kind:
    """Write a contract as a file with the digests of these other files of its folder, by default all that are there."""
    every = sorted(path for path in folder.rglob("*") if path.is_file() and path != folder / name)
    sealed_files = files or [str(path.relative_to(folder)) for path in every]
    sealed = contract.model_copy(update={"files": {file: file_digest(folder / file) for file in sealed_files}})
    (folder / name).write_text(sealed.model_dump_json(indent=1) + "\n", encoding="utf-8")
    return sealed


@contextmanager
def readable(part: Path) -> Iterator[None]:
    """Turn any error on reading `part` into `ContractBroken` with the file's name."""
    try:
        yield
    except ContractBroken:
        raise
    except Exception as error:
        reason = shorten(f"{type(error).__name__}: {error}", 300)
        raise ContractBroken(f"{part}: cannot be used: {reason}; export again") from error


def require_sealed(files: Collection[str], path: Path, *names: str) -> None:
    """Raises ContractBroken for `names` without a digest in `files`, those of the contract at `path`."""
    if unsealed := [name for name in names if name not in files]:
        raise ContractBroken(f"{path}: says nothing of {' and '.join(unsealed)}; export again")


def generator_folder(contract: Contract, folder: Path) -> Path | None:
    """The reference generator's folder in an exported one; None without a generator. Raises ContractBroken for a part
    without a digest in the contract."""
    parts = [f"{GENERATOR}/{name}" for name in GENERATOR_FILES]
    if contract.files.keys().isdisjoint(parts):
        return None
    require_sealed(contract.files, folder / CONTRACT, *parts)
    return folder / GENERATOR


def parsed(kind: type[Kind], path: Path, made_by: str) -> Kind:
    """The contract in a file that the stage `made_by` wrote. Raises ContractBroken."""
    if not path.is_file():
        raise ContractBroken(f"{path.parent}: {path.name} missing; give the folder that `{made_by}` made")
    if (size := path.stat().st_size) > LARGEST_CONTRACT:
        raise ContractBroken(f"{path}: has {size:,} bytes, which no contract has; export again")
    known = kind.model_fields["format"].default
    try:
        return kind.model_validate_json(path.read_bytes())
    except ValidationError as error:
        wrong = error.errors(include_url=False)
        later = any(one["loc"] == ("format",) and isinstance(n := one["input"], int) and n > known for one in wrong)
        if later or all(one["type"] == "extra_forbidden" for one in wrong):  # only unknown entries
            text = f"made by a newer version of iowbc than {version('iowbc')}; install that here, or export again"
            raise ContractBroken(f"{path}: {text} with this one: {error}") from error
        raise ContractBroken(f"{path}: not a contract of format {known}: {error}; export again") from error


def require_unchanged(files: Mapping[str, str], folder: Path) -> None:
    """Raises ContractBroken for missing or changed files. `files`: digests by path in the folder."""
    if missing := [name for name in files if not (folder / name).is_file()]:
        raise ContractBroken(f"{folder}: {', '.join(missing)} missing; give the whole folder that was exported")
    for name, said in files.items():
        if (found := file_digest(folder / name)) != said:
            raise ContractBroken(
                f"{folder / name}: SHA-256 is {found}, the contract says {said}; "
                "the file was changed or damaged after the export: export again"
            )


def read_contract(folder: Path | str) -> Contract:
    """Contract of a complete and unchanged exported folder. Raises ContractBroken."""
    folder = Path(folder)
    contract = parsed(Contract, folder / CONTRACT, "export")
    require_sealed(contract.files, folder / CONTRACT, STEP, SETTLE, f"{ROBOT}/{DESCRIPTION}")
    require_unchanged(contract.files, folder)
    return contract
