"""Options that would have no effect are refused before anything runs."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from iowbc.cli import app
from iowbc.errors import IowbcError

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("robot-sim", "full", "--mass", "4"), "--mass 4: scene free has no object"),
        (("robot-sim", "full", "--scene", "lift", "--mass", "inf"), "above 0 and at most 1000 kg"),
        (("robot", "full", "--dry-run", "--log", "new.mcap"), "--log new.mcap: --dry-run logs nothing"),
        (("report", "full", "wbc", "--log", "old.mcap"), "--log: name only the recipe whose export wrote it"),
        (("robot", "nobody"), "nobody: neither an export folder nor a recipe with an export; those with one: "),
        (("play", "full", "--scene", "free", "--mass", "4"), "--mass above 0 and --partner-share need an object"),
        (
            ("play", "full", "--mass", "0", "--partner-share", "0.5"),
            "--mass above 0 and --partner-share need an object",
        ),
    ],
)
def test_options_that_would_have_no_effect_are_refused(
    words: tuple[str, ...], message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ROOT)
    done = CliRunner().invoke(app, list(words))
    assert isinstance(done.exception, IowbcError)
    assert message in str(done.exception)
