"""The short form of `make chaos`: a few events of drawn kinds cost nothing that was finished, nor the count."""

from pathlib import Path

import pytest
from chaos import play
from tally import ENDED, Tally, Turn, Undisturbed


def test_a_few_disturbances_lose_nothing_and_a_later_series_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FAKE_SENDER", "off")
    record = tmp_path / "record.jsonl"
    first = play(None, events=2, seed=1, folder=tmp_path, record=record)
    tally = play(None, events=5, seed=1, folder=tmp_path, record=record)
    assert tally.events == 5
    assert tally.turns[: len(first.turns)] == first.turns
    assert tally.clean, [turn.findings for turn in tally.turns]
    assert play(None, events=5, seed=1, folder=tmp_path, record=record).turns == tally.turns, "it is all done"


def test_what_was_found_is_kept_in_words_and_a_line_that_was_cut_off_does_not_count(tmp_path: Path) -> None:
    tally = Tally(tmp_path / "record.jsonl")
    tally.begin(Undisturbed(3.0, {"teacher": "0123"}))
    tally.add(Turn(0, "kill", 0.5, lost=("runs/store/teacher/0123",), tracebacks=("Traceback: a bad day",)))
    tally.add(Turn(1, "kill", 1.5, left=("python worker",)))
    tally.add(Turn(2, ENDED, 2.0))
    with tally.file.open("a") as file:
        file.write('{"number": 3, "kind": "st')
    again = Tally.of(tally.file)
    assert again.turns == tally.turns == Tally.of(tally.file).turns
    assert again.undisturbed == tally.undisturbed
    assert again.turns[0].findings == ["lost: runs/store/teacher/0123", "printed: Traceback: a bad day"]
    assert again.line == "2 events: lost 1, tracebacks 1, processes left 1"
    assert again.table().splitlines()[2:] == [
        "| kill | 2 | 1 | 1 | 1 |",
        f"| {ENDED} | 1 | 0 | 0 | 0 |",
        "| all | 3 | 1 | 1 | 1 |",
    ]
