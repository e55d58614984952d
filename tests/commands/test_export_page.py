"""`iowbc export WHAT --web DIR` says what is missing before it begins."""

import json
import subprocess
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from iowbc.commands.export import export
from iowbc.errors import UsageError
from iowbc.robot.description import robot_folder
from iowbc.web import page
from iowbc.web.page import SOURCE, npm_parts, parts_folder

PUBLISHED = Path(__file__).parents[2] / "runs" / "published" / "export"


def test_a_page_is_of_an_exported_controller(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"first/teacher: no exported controller; finished: teacher; run a recipe"):
        export("first/teacher", tmp_path / "page", folder / "runs")


def test_a_folder_with_other_files_is_left_alone(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "contract.json").write_text("{}")
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.tex").write_text("")
    with pytest.raises(UsageError, match="holds other files"):
        export(str(tmp_path), tmp_path / "mine", folder / "runs")


def test_an_interrupted_page_can_be_written_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: Any) -> None:
        raise KeyboardInterrupt

    world = SimpleNamespace(robot=robot_folder("g1"))
    for name, stand_in in (("npm_parts", lambda *_: tmp_path), ("exported_world", lambda _: world)):
        monkeypatch.setattr(page, name, stand_in)
    monkeypatch.setattr(page, "web_scenes", interrupted)
    exported = next(PUBLISHED.iterdir())
    for _ in range(2):
        with pytest.raises(KeyboardInterrupt):
            export(str(exported), tmp_path / "page", tmp_path / "runs")


def test_without_node_it_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(UsageError, match=r"needs node and npm .*install Node\.js 18 or newer"):
        npm_parts(tmp_path / "cache", print)


def test_without_a_network_it_says_so_and_leaves_nothing_half_done(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, text in (("node", "echo v20.1.0"), ("npm", "mkdir node_modules; echo ENOTFOUND >&2; exit 1")):
        (tmp_path / name).write_text(f"#!/bin/sh\n{text}\n")
        (tmp_path / name).chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:/usr/bin:/bin")
    with pytest.raises(UsageError, match=r"is there a network.*\nENOTFOUND"):
        npm_parts(tmp_path / "cache", print)
    assert not parts_folder(tmp_path / "cache").exists()


def test_the_command_line_asks_for_the_folder(
    command: Callable[..., "subprocess.CompletedProcess[str]"],
) -> None:
    done = command("export", "first")
    assert done.returncode == 2
    assert "--web" in done.stderr


def test_packages_are_pinned_by_version_and_digest_and_come_from_whatever_registry_is_set() -> None:
    packages = json.loads((SOURCE / "package-lock.json").read_text())["packages"]
    pinned = {name: about for name, about in packages.items() if name}
    assert all("integrity" in about and "resolved" not in about for about in pinned.values())
    wanted = json.loads((SOURCE / "package.json").read_text())
    for name, number in (wanted["dependencies"] | wanted["devDependencies"]).items():
        assert pinned[f"node_modules/{name}"]["version"] == number
