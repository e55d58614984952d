"""What a run shows on a terminal and elsewhere."""

import io
import time

import pytest
from rich.console import Console

from iowbc.pipeline.console.display import CURVE_POINTS, PlainDisplay, StageView
from iowbc.pipeline.console.live_table import LiveTable, sparkline
from iowbc.pipeline.console.wording import short, size


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
        view.measured("reward", value)
    assert len(view.curve) <= CURVE_POINTS
    assert view.curve == sorted(view.curve)


def test_plain_lines_come_once_in_an_interval() -> None:
    stream = io.StringIO()
    display = PlainDisplay(interval=3600.0, stream=stream)
    view = StageView("teacher", state="runs")
    display.changed(view)
    for done in range(100):
        view.progress(done, 100, "")
        display.moved(view)
    assert stream.getvalue() == "teacher: runs\n"


def test_the_live_table_shows_every_stage() -> None:
    console = Console(file=io.StringIO(), force_terminal=True, width=120)
    display = LiveTable(console)
    views = [StageView("rg-fit", state="cached"), StageView("teacher", state="runs", started=0.0)]
    views[1].progress(1, 4, "at 1")
    views[1].measured("reward", 2.5)
    display.begin(views)
    display.say("a line")
    display.end()
    assert isinstance(console.file, io.StringIO)
    shown = console.file.getvalue()
    for text in ("rg-fit", "cached", "teacher", "reward 2.5", "at 1", "a line"):
        assert text in shown


def test_many_reasons_are_counted() -> None:
    assert short(["a", "b", "c"], 2) == "a\nb (and 1 more)"
    assert short(["a"], 2) == "a"


@pytest.mark.parametrize(("count", "text"), [(812, "812 B"), (1200, "1.2 kB"), (3.4e6, "3.4 MB"), (5e9, "5.00 GB")])
def test_a_size_is_told_for_people(count: float, text: str) -> None:
    assert size(count) == text
