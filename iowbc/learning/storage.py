"""Trained networks on disk: safetensors for the weights, JSON for the architecture, no pickle."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from safetensors.torch import load_file, save_file

from iowbc.errors import StageFailed
from iowbc.learning.networks import StudentNetwork, TeacherNetwork

Network = TeacherNetwork | StudentNetwork
KINDS: dict[str, type[Network]] = {"teacher": TeacherNetwork, "student": StudentNetwork}
"""Network classes by kind: a teacher receives s_t and s_priv, a student H_t."""
NAMES = ("teacher", "student")
"""Base names of the files written by the stages `teacher` and `distill`."""


def save_network(
    network: Network, architecture: dict[str, Any], folder: Path, name: str, about: dict[str, Any]
) -> None:
    """Write `<name>.safetensors` and `<name>.json` (kind, constructor arguments and the entries of `about`)."""
    save_file({key: value.contiguous() for key, value in network.state_dict().items()}, folder / f"{name}.safetensors")
    kind = next(kind for kind, made in KINDS.items() if isinstance(network, made))
    text = json.dumps({"kind": kind, "architecture": architecture, **about}, indent=1)
    (folder / f"{name}.json").write_text(text + "\n")


def load_network(folder: Path, names: Sequence[str] = NAMES) -> tuple[Network, dict[str, Any]]:
    """The network of a stage's artifact, the first of these base names, in evaluation mode, and the JSON."""
    path = next((folder / f"{name}.json" for name in names if (folder / f"{name}.json").is_file()), None)
    if path is None:
        found = sorted(p.name for p in folder.glob("*.json"))
        wanted = " or ".join(f"{name}.json" for name in names)
        raise FileNotFoundError(f"{folder}: no {wanted} there; the folder holds {found}")
    about = json.loads(path.read_text())
    network = KINDS[about["kind"]](**about["architecture"])
    network.load_state_dict(load_file(path.with_suffix(".safetensors")))
    network.requires_grad_(False)
    return network.eval(), about


def require_layout(folder: Path, about: Mapping[str, Any], layout: Mapping[str, Any]) -> None:
    """Raises StageFailed if a network of `load_network` was trained on other parts than it would receive. `layout`: the
    parts of s_t and of s_priv, as `FullLayout` describes them; a student receives the first of s_t."""
    student = about["kind"] == "student"
    for kind in ("observation",) if student else ("observation", "privileged"):
        own, given = ([(part["name"], part["size"]) for part in parts[kind]] for parts in (about["layout"], layout))
        if own != (given := given[: len(own)] if student else given):
            differ = ", ".join(f"{name} ({size})" for name, size in sorted(set(own) ^ set(given))) or "their order"
            raise StageFailed(
                f"{folder}: this policy was trained on another {kind}; what differs: {differ}. Use the code and the "
                "task.observation with which it was trained, or train it again (`iowbc run RECIPE --force STAGE`)"
            )


def load_teacher(folder: Path, name: str = "teacher") -> tuple[TeacherNetwork, dict[str, Any]]:
    """A teacher in a stage's artifact, and the JSON. Raises StageFailed for a student, as of `teacher.history`."""
    network, about = load_network(folder, (name,))
    if not isinstance(network, TeacherNetwork):
        raise StageFailed(f"{folder}: its policy acts on a history; name a teacher with privileged information")
    return network, about


def load_student_network(folder: Path) -> tuple[StudentNetwork, dict[str, Any]]:
    """The student in a stage's artifact. Raises StageFailed if the policy is not a student."""
    network, about = load_network(folder)
    if not isinstance(network, StudentNetwork):
        raise StageFailed(
            f"{folder} holds no student: a policy that needs privileged observations can neither run on a robot nor "
            "act below a skill; name an artifact of `distill`, or add that stage to the recipe"
        )
    return network, about
