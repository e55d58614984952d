"""The contract of an exported skill: what a caller must know beside the controller's own contract."""

from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Literal

from pydantic import Field, ValidationError

from iowbc.control.skill_observation import SENSED
from iowbc.deploy.contract import LARGEST_CONTRACT, digest
from iowbc.errors import ContractBroken
from iowbc.recipe.section import Section
from iowbc.recipe.skill.skill import RobotAgent
from iowbc.recipe.task.commands import Commands

GRAPH, CONTRACT, GOLDEN = "skill.onnx", "skill_contract.json", "skill_golden.npz"
"""Files of an exported skill. The graph maps `observation` (n, size) to `action` (n, 11)."""
FILES = (GRAPH, GOLDEN)


class SkillContract(Section):
    """Content of `skill_contract.json`."""

    format: Literal[1] = 1
    """Raised when a reader of the old format would misread the new one."""
    frequency: float = Field(gt=0)
    """Decisions a second [Hz]; a whole part of the controller's frequency."""
    observation: int = Field(ge=1)
    """Size of the observation: see `iowbc.control.skill_observation.robot_observation`."""
    sees_object: bool
    """True where the robot measures the object's pose."""
    robot: RobotAgent
    """Admittance, scales of the action, and length of the history of forces."""
    commands: Commands
    """Ranges of the command."""
    sources: dict[str, str]
    """Artifact keys of the stages that the skill was trained with; `distill` is the controller's student."""
    versions: dict[str, str]
    """Of the packages that made the graph."""
    files: dict[str, str] = Field(default_factory=dict)
    """SHA-256 of the other files, by name."""

    def problems(self) -> Iterator[tuple[str, str]]:
        if self.observation != (size := SENSED + 6 * self.robot.history):
            yield "", f"observation: {self.observation}, with robot.history {self.robot.history} it is {size}"


def seal_skill(contract: SkillContract, folder: Path) -> None:
    """Write the contract with the digests of the files that the folder holds now."""
    sealed = contract.model_copy(update={"files": {name: digest(folder / name) for name in FILES}})
    (folder / CONTRACT).write_text(sealed.model_dump_json(indent=1) + "\n", encoding="utf-8")


def read_skill_contract(folder: Path) -> SkillContract:
    """The contract of an exported skill that is whole and unchanged. Raises ContractBroken."""
    path = folder / CONTRACT
    if not path.is_file():
        raise ContractBroken(f"{folder}: no exported skill, {CONTRACT} missing; give the folder that `skill` made")
    if (size := path.stat().st_size) > LARGEST_CONTRACT:
        raise ContractBroken(f"{path}: has {size:,} bytes, which no contract has; export again")
    try:
        contract = SkillContract.model_validate_json(path.read_bytes())
    except ValidationError as error:
        raise ContractBroken(
            f"{path}: not a contract of format 1, as iowbc {version('iowbc')} reads it: {error}; export again"
        ) from error
    for name in FILES:
        found = digest(folder / name) if (folder / name).is_file() else "missing"
        if found != contract.files.get(name):
            raise ContractBroken(
                f"{folder / name}: SHA-256 is {found}, the contract says {contract.files.get(name)}; "
                "the file was changed or lost after the export: export again"
            )
    return contract
