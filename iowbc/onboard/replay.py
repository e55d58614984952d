"""A logged run through the state machine again: every command must come out bit for bit."""

from dataclasses import dataclass
from pathlib import Path

from iowbc.deploy.controller import Controller
from iowbc.errors import UsageError
from iowbc.onboard.limits import Limits
from iowbc.onboard.log import read_about, read_turns
from iowbc.onboard.machine import Machine


@dataclass(frozen=True)
class Replayed:
    """Result of a replay."""

    turns: int
    different: int
    first: float | None
    """Time of the first command that differs [s]."""


def export_digest(controller: Controller) -> str:
    """Names of the exported programs in a log: the digests of their files."""
    return ",".join(f"{name}:{value}" for name, value in sorted(controller.contract.files.items()))


def replay(path: Path, folder: Path) -> Replayed:
    """Compares the commands of a log with those of the exported controller in `folder`.

    Raises UsageError for the log of another export, Damaged for a file that is no log.
    """
    about = read_about(path)
    controller = Controller.load(folder)
    if export_digest(controller) != about["export"]:
        raise UsageError(f"{path}: logged with another export ({about['recipe']}); give the folder of that one")
    machine = Machine(controller, about["scene"], Limits.model_validate_json(about["limits"]))
    turns = different = 0
    first: float | None = None
    for turn in read_turns(path):
        turns += 1
        if machine.turn(turn.given).tobytes() != turn.command.tobytes():
            different += 1
            first = turn.given.now if first is None else first
    return Replayed(turns, different, first)
