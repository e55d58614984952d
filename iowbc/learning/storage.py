"""Trained networks on disk: safetensors for the numbers, JSON for the architecture; nothing is unpickled."""

import json
from pathlib import Path
from typing import Any

from safetensors.torch import load_file, save_file
from torch import nn

from iowbc.learning.networks import StudentNetwork, TeacherNetwork

KINDS: dict[str, type[nn.Module]] = {"teacher": TeacherNetwork, "student": StudentNetwork}


def save_network(
    network: nn.Module, architecture: dict[str, Any], folder: Path, kind: str, about: dict[str, Any]
) -> None:
    """Write `<kind>.safetensors` and `<kind>.json` (the constructor's arguments and what else to know)."""
    save_file(
        {name: value.contiguous() for name, value in network.state_dict().items()}, folder / f"{kind}.safetensors"
    )
    text = json.dumps({"kind": kind, "architecture": architecture, **about}, indent=1)
    (folder / f"{kind}.json").write_text(text + "\n")


def load_network(folder: Path, kind: str) -> tuple[nn.Module, dict[str, Any]]:
    """Read what `save_network` wrote; returns the network in evaluation mode and the JSON."""
    path = folder / f"{kind}.json"
    if kind not in KINDS or not path.is_file():
        found = sorted(p.name for p in folder.glob("*.json"))
        raise FileNotFoundError(f"{path}: no such network; the folder holds {found}, known kinds are {sorted(KINDS)}")
    about = json.loads(path.read_text())
    network = KINDS[kind](**about["architecture"])
    network.load_state_dict(load_file(folder / f"{kind}.safetensors"))
    network.requires_grad_(False)
    return network.eval(), about


def load_teacher(folder: Path) -> tuple[TeacherNetwork, dict[str, Any]]:
    """The teacher in a stage's artifact."""
    network, about = load_network(folder, "teacher")
    assert isinstance(network, TeacherNetwork)
    return network, about


def load_student(folder: Path) -> tuple[StudentNetwork, dict[str, Any]]:
    """The student in a stage's artifact."""
    network, about = load_network(folder, "student")
    assert isinstance(network, StudentNetwork)
    return network, about
