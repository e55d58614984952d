"""Whatever a recipe file holds: what is accepted can be planned, and what is refused names file, line and key."""

import re
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from iowbc.commands.request import prepared
from iowbc.errors import Problem, RecipeError
from iowbc.pipeline.nested import flattened
from iowbc.pipeline.stage_plan import Options
from iowbc.pipeline.store.runs import Runs
from iowbc.recipe.reading.loading import LoadedRecipe, load_recipe
from iowbc.recipe.recipe import Recipe

DEFAULTS = flattened(Recipe(name="default").model_dump(mode="json", exclude={"name"}))
"""What a recipe says that says nothing, by dotted path."""
PLACE = re.compile(r"(.*/)?mine\.yaml:\d+:\d+")
EXAMPLES = settings(max_examples=60, deadline=None, derandomize=True, database=None)

anything = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=5,
)


@st.composite
def changes(draw: st.DrawFn) -> dict[str, Any]:
    """A few of a recipe's values, scaled or replaced by anything."""
    found = {}
    for path in draw(st.lists(st.sampled_from(sorted(DEFAULTS)), min_size=1, max_size=3, unique=True)):
        default = DEFAULTS[path]
        if isinstance(default, (int, float)) and not isinstance(default, bool) and draw(st.booleans()):
            scaled = default * draw(st.sampled_from([0, 0.5, 1, 2, 1e3, -1]))
            found[path] = type(default)(scaled)
        else:
            found[path] = draw(anything)
    return found


def as_tree(values: dict[str, Any]) -> dict[str, Any]:
    """Values by dotted path as a tree; an entry of a list stands for the whole list."""
    tree: dict[str, Any] = {}
    for path, value in values.items():
        *above, name = [part for part in path.split(".") if not part.isdecimal()]
        branch = tree
        for part in above:
            branch = branch.setdefault(part, {}) if isinstance(branch.get(part, {}), dict) else {}
        branch[name] = value
    return tree


def planned(loaded: LoadedRecipe, folder: Path) -> None:
    planner = prepared(loaded, Runs(folder / "runs"), Options())
    assert [step.stage.name for step in planner.plan()] == list(loaded.recipe.stages)


def assert_placed(error: RecipeError, key: str = "key '|the recipe") -> None:
    for problem in error.problems:
        assert PLACE.fullmatch(problem.place) or problem.place == "default", problem
        assert re.search(key, problem.text), problem
        assert len(str(problem)) < 4000


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("recipes")


@EXAMPLES
@given(values=changes())
def test_what_is_accepted_can_be_planned_and_what_is_refused_names_its_place(
    place: Path, values: dict[str, Any]
) -> None:
    file = place / "mine.yaml"
    file.write_text(yaml.safe_dump(as_tree(values), allow_unicode=True), encoding="utf-8")
    try:
        planned(load_recipe(file), place)
    except RecipeError as error:
        assert_placed(error)


@EXAMPLES
@given(content=st.binary(max_size=200) | st.text(alphabet="a:[]{}-&*!|>#'\"\n\t ,0~%@`", max_size=60).map(str.encode))
def test_any_bytes_are_a_recipe_or_refused_with_their_place(place: Path, content: bytes) -> None:
    file = place / "mine.yaml"
    file.write_bytes(content)
    try:
        load_recipe(file)
    except RecipeError as error:
        assert_placed(error, "")


@EXAMPLES
@given(
    override=st.text(max_size=30) | st.builds("{}={}".format, st.sampled_from(sorted(DEFAULTS)), st.text(max_size=9))
)
def test_any_override_is_taken_or_refused_with_its_words(place: Path, override: str) -> None:
    file = place / "base.yaml"
    file.write_text("seed: 1\n")
    refused: list[Problem] = []
    try:
        load_recipe(file, (override,))
    except RecipeError as error:
        refused = error.problems
    assert all(problem.place.startswith(("--set", "'--set", '"--set', "default")) for problem in refused)
