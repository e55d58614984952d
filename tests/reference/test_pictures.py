"""What the pictures of the generator show and say."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from iowbc.reference.labels.checks import MethodComparison
from iowbc.reference.pictures import figures


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> dict[str, Figure]:
    """The figures that were written, by file name."""
    found: dict[str, Figure] = {}
    monkeypatch.setattr(figures, "write_figure", lambda figure, path: found.update({path.name: figure}))
    return found


def legend(axes: Any) -> list[str]:
    shown = axes.get_legend()
    return [] if shown is None else [text.get_text() for text in shown.get_texts()]


def test_the_comparison_with_optimal_control_shows_every_sample_and_its_limit() -> None:
    differences = np.r_[np.linspace(0.001, 0.01, 599), 0.3]
    (axes,) = figures.crosscheck_figure(MethodComparison(differences, {}, []), 0.02).axes
    assert sum(bar.get_height() for bar in axes.patches) == 600, "also the one far beyond the limit"
    assert "600 samples" in axes.get_title()
    (line,) = [line for line in axes.lines if line.get_linestyle() == "--"]
    assert line.get_xdata()[0] == 0.02  # type: ignore[index]
    assert legend(axes) == ["limit of the 90th percentile"]


def test_a_histogram_of_errors_says_how_many_lie_beyond_its_axis() -> None:
    axes = Figure().add_subplot()
    figures.histogram(axes, np.r_[np.linspace(0.0, 1.0, 999), 50.0], "error [rad]", 0.5, "gate")
    (beyond,) = [text.get_text() for text in axes.texts]
    assert beyond.endswith(" beyond, up to 50")
    assert sum(bar.get_height() for bar in axes.patches) + int(beyond.split()[0]) == 1000  # type: ignore[attr-defined]
    assert legend(axes) == ["gate"]


def test_colours_and_outlines_say_what_they_are(drawn: dict[str, Figure]) -> None:
    held = SimpleNamespace(pitch=np.array([0.0, 1.0]), low=np.array([0.5, 0.6]), high=np.array([0.7, 0.8]))
    plan: Any = SimpleNamespace(
        recipe=SimpleNamespace(feasible=SimpleNamespace(jump=0.05), height="pelvis"),
        pitches=np.linspace(0.0, 1.0, 4),
        heights=np.linspace(0.5, 0.8, 5),
        nominal=(0.0, 0.7),
    )
    figures.gentle_figure(Path(), plan, held, np.full((4, 5), 0.02), held)  # type: ignore[arg-type]
    axes, bar = drawn["feasible_map.png"].axes
    assert bar.get_ylabel() == "largest joint move for one step [rad]"
    assert legend(axes) == ["map of labelled commands", "feasible map"]
