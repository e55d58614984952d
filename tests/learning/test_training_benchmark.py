"""The benchmark of training measures both trainings and says where the time goes."""

import math

import pytest

from iowbc.benchmarks import training
from iowbc.recipe.recipe import Recipe

pytestmark = pytest.mark.integration


def test_the_benchmark_compares_both_trainings_and_splits_an_update(capsys: pytest.CaptureFixture[str]) -> None:
    teacher = {"environments": 4, "rollout": 8, "minibatches": 2, "epochs": 1, "hidden": [16, 8]}
    figures = training.main(Recipe.model_validate({"name": "small", "teacher": teacher}), turns=1, others=1)
    split = [figures[f"seconds_{part}"] for part in training.PARTS]
    assert all(seconds > 0.0 for seconds in split)
    assert sum(split) <= 32 / figures["train"]
    assert math.isclose(figures["ratio"], figures["train"] / figures["sb3"], rel_tol=1e-6)
    assert capsys.readouterr().out.endswith("times as fast\n")
