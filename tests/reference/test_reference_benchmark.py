"""`iowbc bench rg` measures both methods and names its figures."""

import pytest

from iowbc.benchmarks import reference
from iowbc.recipe.recipe import Recipe


def test_both_methods_are_measured_for_each_number_of_workers(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(reference, "SAMPLES", {"static": (64, 8), "ocp": (8, 1)})
    figures = reference.main(Recipe(name="bench"), workers=(1,), turns=1)
    lines = capsys.readouterr().out.splitlines()
    assert set(figures) == {f"{method}{name}_1" for method in ("static", "ocp") for name in ("", "_a_core", "_scaling")}
    assert figures["static_scaling_1"] == 1.0
    assert figures["static_a_core_1"] > figures["ocp_a_core_1"] > 0.0
    assert [line.split()[:2] for line in lines[2:]] == [["static", "1"], ["ocp", "1"]]
