"""What a run shows on a terminal and elsewhere."""

import io
import os
import signal
import time

import pytest
from rich.console import Console

from iowbc.pipeline.console.display import CURVE_POINTS, LiveTable, PlainDisplay, StageView, sparkline
from iowbc.pipeline.console.wording import short
from iowbc.pipeline.stop_request import StopRequest


def test_a_sparkline_rises_with_its_values() -> None:
    assert sparkline([0, 1, 2, 3, 4, 5, 6, 7]) == "▁▂▃▄▅▆▇█"
    assert sparkline([5.0]) == "▁"
    assert sparkline([]) == ""
    assert sparkline([float("nan"), 1.0, float("inf"), 2.0]) == "▁█"
    assert len(sparkline(list(range(1000)), width=24)) == 24


def test_rate_and_time_left_follow_the_progress(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter([0.0, 2.0, 4.0])
    monkeypatch.setattr(time, "monotonic", lambda: next(clock))
    view = StageView("teacher")
    for done in (0, 200, 400):
        view.progress(done, 1000, "")
    assert (view.rate, view.left, view.share) == (100.0, 6.0, 0.4)


def test_a_new_phase_begins_a_new_rate(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter([0.0, 2.0, 4.0, 6.0])
    monkeypatch.setattr(time, "monotonic", lambda: next(clock))
    view = StageView("rg-dataset")
    for done in (0, 900):
        view.progress(done, 1000, "labels")
    view.progress(0, 50, "map")
    assert view.rate is None
    view.progress(10, 50, "map")
    assert view.rate == 5.0


def test_a_long_curve_is_thinned() -> None:
    view = StageView("teacher")
    for value in range(5 * CURVE_POINTS):
        view.measured("reward", value, value)
    assert len(view.record.curve) <= CURVE_POINTS
    assert view.values == sorted(view.values)
    assert view.values[-1] == 5 * CURVE_POINTS - 1


def test_a_curve_goes_on_where_the_checkpoint_was() -> None:
    view = StageView("teacher")
    for step in (1, 2, 3, 2, 3):
        view.measured("reward", step, 10.0 * step)
    assert view.record.curve == [(1, 10.0), (2, 20.0), (3, 30.0)]


def test_plain_lines_come_once_in_an_interval() -> None:
    stream = io.StringIO()
    display = PlainDisplay(interval=3600.0, stream=stream)
    view = StageView("teacher", state="runs")
    display.changed(view)
    for done in range(100):
        view.progress(done, 100, "")
        display.moved(view)
    assert stream.getvalue() == "teacher: runs\n"


def drawn(width: int, stopping: str = "", total: float = 1.0) -> str:
    """The live table of a run whose teacher has trained 0.4 of a total, as a terminal of this width shows it."""
    console = Console(file=io.StringIO(), force_terminal=True, width=width, record=True)
    display = LiveTable(console, lambda: stopping)
    views = [StageView("rg-dataset", state="cached", note="published"), StageView("teacher", state="runs")]
    views[1].began = time.monotonic() - 7500.0
    for step in range(1, 9):
        views[1].progress(0.05 * step, total, "12.3 s an episode, 5 % fall, level 1.23, KL 0.012, 4,500 steps/s")
        views[1].measured("episode_seconds", step, 1.5 * step)
    display.begin(views)
    display.end()
    return "stage " + console.export_text().rpartition("stage ")[2]


@pytest.mark.parametrize("width", [80, 100, 120])
def test_the_live_table_keeps_every_stage_state_and_time_at_any_width(width: int) -> None:
    lines = drawn(width).splitlines()
    assert all(len(line.rstrip()) <= width for line in lines)
    row = next(line for line in lines if line.startswith("teacher"))
    assert row.split()[:2] == ["teacher", "runs"]
    for text in ("40 %", "2 h 05 min"):
        assert text in row
    assert any(line.split() == ["rg-dataset", "cached"] for line in lines)
    assert "rg-dataset: published" in lines[-2].strip()
    assert lines[-1].startswith("teacher: 12.3 s an episode, 5 % fall")


@pytest.mark.parametrize("width", [60, 80, 120])
def test_a_typed_ctrl_c_that_the_terminal_echoes_fits_behind_every_line(width: int) -> None:
    assert max(map(len, drawn(width).splitlines())) <= width - len("^C")


def test_a_narrow_terminal_leaves_out_the_curve_then_the_notes() -> None:
    assert "▁▂▃▄▅▆▇█ episode_seconds 12" in drawn(120)
    assert "▁▃▆█ episode_seconds 12" in drawn(100)
    assert "episode_seconds" not in drawn(99)
    assert "an episode" in drawn(60)
    assert "an episode" not in drawn(59)


def test_a_stage_whose_work_is_done_says_that_it_finishes() -> None:
    row = next(line for line in drawn(80, total=0.4).splitlines() if line.startswith("teacher"))
    assert "100 %" in row
    assert "finishing" in row
    assert "0.0 s" not in row


def test_lines_that_are_said_scroll_by_above_the_live_table() -> None:
    console = Console(file=io.StringIO(), force_terminal=True, width=80)
    display = LiveTable(console)
    display.begin([StageView("teacher")])
    display.say("a line")
    display.end()
    assert isinstance(console.file, io.StringIO)
    assert "a line\n" in console.file.getvalue()


def test_the_live_table_says_that_it_was_asked_to_stop() -> None:
    assert drawn(80, "SIGINT: stopping at the next checkpoint").splitlines()[-1].startswith("SIGINT")


def test_a_stop_that_the_live_table_shows_is_not_written_into_it(capfd: pytest.CaptureFixture[str]) -> None:
    for shown in (True, False):
        with StopRequest(shown=shown) as stop:
            os.kill(os.getpid(), signal.SIGINT)
            assert stop.text.startswith("SIGINT: stopping at the next checkpoint")
        assert ("SIGINT" in capfd.readouterr().err) is not shown


def test_many_reasons_are_counted() -> None:
    assert short(["a", "b", "c"], 2) == "a\nb (and 1 more)"
    assert short(["a"], 2) == "a"
