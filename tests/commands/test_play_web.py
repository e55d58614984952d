"""What is said where the viewer in the browser cannot begin."""

import socket
from pathlib import Path

import pytest

from iowbc.commands import options
from iowbc.commands.play import play
from iowbc.errors import UsageError


def test_a_taken_port_is_told_before_anything_is_loaded_with_one_that_is_free(tmp_path: Path) -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        with pytest.raises(UsageError, match=rf"port {port} is taken; try --port \d+"):
            play("first", web=True, port=port, runs=tmp_path)


def test_a_page_is_no_film(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="--web and --video exclude each other"):
        play("first", web=True, port=8080, video=tmp_path / "box.mp4", runs=tmp_path)


def test_without_viser_the_command_that_installs_it_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = options.find_spec
    monkeypatch.setattr(options, "find_spec", lambda name: None if name == "viser" else found(name))
    with pytest.raises(UsageError, match=r"pip install '\.\[web\]'"):
        play("first", web=True, port=8080, runs=tmp_path)


def test_a_human_of_a_game_is_refused_for_a_policy(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    with pytest.raises(UsageError, match="--partner is the human of a skill's game"):
        play("first", web=True, port=port, partner="follower", runs=tmp_path)
