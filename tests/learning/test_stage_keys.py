"""What decides the result of training, trials and export is in their keys."""

import pytest

from iowbc.pipeline.stage import Stage
from iowbc.recipe.recipe import Recipe
from iowbc.stages import distill, evaluate, export, teacher

SIMULATING = [teacher.STAGE, distill.STAGE, evaluate.STAGE, export.STAGE]


def recipe(stages: list[str], use_rg: bool) -> Recipe:
    return Recipe.model_validate({"name": "x", "stages": stages, "task": {"references": {"use_rg": use_rg}}})


@pytest.mark.parametrize("stage", SIMULATING, ids=lambda stage: stage.name)
def test_the_world_the_task_and_what_its_heights_mean_are_in_the_key(stage: Stage) -> None:
    assert {"simulation", "task", "rg.height"} <= set(stage.slice)


@pytest.mark.parametrize("stage", SIMULATING, ids=lambda stage: stage.name)
def test_a_variant_without_the_generators_posture_still_heeds_its_feasible_map(stage: Stage) -> None:
    whole = ["rg-dataset", "rg-fit", "teacher", "distill", "eval", "export"]
    assert "rg-fit" in stage.reads(recipe(whole, use_rg=False))
    assert "rg-fit" not in stage.reads(recipe(whole[2:], use_rg=False))
    assert "rg-fit" in stage.reads(recipe(whole[2:], use_rg=True))
