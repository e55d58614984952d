"""A recipe that asks for a student and trains none is refused before anything runs."""

import pytest

from iowbc.recipe.recipe import Recipe
from iowbc.stages.registry import STAGES


def problems(stages: list[str], policy: str) -> list[str]:
    recipe = Recipe.model_validate({"name": "x", "stages": stages, "eval": {"policy": policy}})
    return [path for name in recipe.stages for path, _ in STAGES[name].problems(recipe)]


@pytest.mark.parametrize(
    ("stages", "policy", "wrong"),
    [
        (["teacher", "distill", "eval", "export"], "student", []),
        (["teacher", "eval"], "student", ["eval.policy"]),
        (["teacher", "eval"], "teacher", []),
        (["teacher", "export"], "student", ["stages"]),
    ],
)
def test_a_student_that_no_stage_leaves(stages: list[str], policy: str, wrong: list[str]) -> None:
    assert problems(stages, policy) == wrong
