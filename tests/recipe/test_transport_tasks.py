"""Transport tasks of a recipe's own."""

import pytest
from pydantic import ValidationError

from iowbc.recipe.recipe import Recipe
from iowbc.recipe.section import deciding

OWN = {"scene": "lift", "path": [{"length": 2.0, "turn": 0.5, "width": 1.2}], "mass": [10.0, 12.0], "duration": 20.0}


def test_a_recipe_may_have_transport_tasks_of_its_own() -> None:
    recipe = Recipe.model_validate({"name": "test", "skill": {"tasks": {"bend": OWN}}})
    assert recipe.skill.tasks.names[-1] == "bend"
    assert [stretch.length for stretch in recipe.skill.tasks.bend.path] == [2.0]
    assert "skill" in deciding(recipe)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"scene": "lifft"}, "no scene 'lifft' with an object"),
        ({"mass": [12.0, 10.0]}, "lower end 12 is above the upper end 10"),
        ({"share": [0.5, 1.5]}, "less than or equal to 1"),
        ({"path": []}, "at least 1 item"),
    ],
)
def test_a_wrong_task_is_refused_and_told_why(change: dict[str, object], told: str) -> None:
    with pytest.raises(ValidationError, match=told):
        Recipe.model_validate({"name": "test", "skill": {"tasks": {"bend": OWN | change}}})


def test_a_human_is_either_trained_with_or_held_out() -> None:
    with pytest.raises(ValidationError, match="leader: both in training and held out"):
        Recipe.model_validate({"name": "test", "skill": {"partners": {"held_out": ["leader"]}}})


def test_an_unknown_human_of_the_evaluation_is_refused_before_the_skill_is_trained() -> None:
    with pytest.raises(ValidationError, match="'lagging' or 'agent'"):
        Recipe.model_validate({"name": "test", "skill": {"eval": {"partners": ["legging"]}}})
