"""Every value of a recipe that decides a stage's result is in its key, and no other."""

from collections.abc import Iterator
from typing import Any, Literal, get_args, get_origin

import pytest

from iowbc.files import data_digest
from iowbc.pipeline.stage import slice_value
from iowbc.recipe.recipe import Recipe
from iowbc.recipe.section import Section, deciding
from iowbc.stages import eval as evaluate
from iowbc.stages.registry import STAGES

SKILL = {"skill", "skill-eval"}
SIMULATING = {"teacher", "distill", "eval", "export", *SKILL}
ALL = {"rg-dataset", "rg-fit", *SIMULATING}
MOVED = {
    "name": {"export"},
    "seed": {"rg-dataset", "rg-fit", "teacher", "distill", "export", "skill"},
    "rg.method": {"rg-dataset"},
    "rg.height": ALL,
    "rg.sampling": {"rg-dataset", "rg-fit"},
    "rg.problem": {"rg-dataset", "rg-fit"},
    "rg.ocp": {"rg-dataset"},
    "rg.gates": {"rg-dataset"},
    "rg.crosscheck": {"rg-dataset"},
    "rg.feasible": {"rg-dataset", "rg-fit"},
    "rg.fit": {"rg-fit"},
    "simulation": SIMULATING,
    "task": SIMULATING,
    "teacher": {"teacher"},
    "teacher.symmetry": {"teacher", "distill"},
    "teacher.normalization_clip": {"teacher", "distill"},
    "distill": {"distill"},
    "eval": {"eval"},
    "export": {"export"},
    "export.opset": {"export", "skill"},
    "skill": SKILL,
    "skill.learning": {"skill"},
    "skill.eval": {"skill-eval"},
    "skill.partners.held_out": {"skill-eval"},
}
"""Stages whose own values change with a part of the recipe; the longest name that fits counts."""
COSMETIC = {
    "description",
    "stages",
    "robot",
    "execution",
    "teacher.start",
    "teacher.history.student",
    "distill.experts",
    "teacher.checkpoint_every",
    "distill.checkpoint_every",
    "eval.label",
    "eval.success.capacity_rate",
    "eval.video",
    "export.timing_steps",
    "skill.learning.checkpoint_every",
    "skill.eval.others",
    "skill.eval.controllers",
    "skill.eval.games",
}
"""Parts that move no key: they say how it is shown or carried out. (The robot's files count, not their folder.)"""


def leaves(value: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    """Paths of a recipe's values; a list of sections counts by the section, any other as one value."""
    if isinstance(value, Section):
        for name in type(value).model_fields:
            yield from leaves(getattr(value, name), (*path, name))
    elif isinstance(value, tuple) and any(isinstance(item, Section) for item in value):
        for index, item in enumerate(value):
            yield from leaves(item, (*path, str(index)))
    else:
        yield path


def other(section: Section, name: str) -> Any:
    """Another value of the same kind for a field."""
    value, annotation = getattr(section, name), type(section).model_fields[name].annotation
    choices = get_args(annotation) if get_origin(annotation) is Literal else ()
    if choices:
        return next((choice for choice in choices if choice != value), f"{value}x")
    if isinstance(value, bool):
        return not value
    if isinstance(value, (int, float)):
        return value + 1
    if isinstance(value, str):
        return f"{value}x"
    if isinstance(value, tuple):
        return (*value, *value) or (1,)
    if isinstance(value, dict):
        return {**value, "other": 1.0}
    return 1.0


def changed(value: Any, path: tuple[str, ...]) -> Any:
    """A recipe, or a part of it, with another value at a path."""
    name, rest = path[0], path[1:]
    if isinstance(value, tuple):
        return tuple(changed(item, rest) if index == int(name) else item for index, item in enumerate(value))
    below = changed(getattr(value, name), rest) if rest else other(value, name)
    return value.model_copy(update={name: below})


def digests(recipe: Recipe) -> dict[str, str]:
    """The digest of what each stage takes from a recipe."""
    values = deciding(recipe)
    return {
        name: data_digest([slice_value(values, part, stage) for part in stage.slice]) for name, stage in STAGES.items()
    }


def expected(path: str) -> set[str]:
    def fits(part: str) -> bool:
        return path == part or path.startswith(f"{part}.")

    if any(fits(part) for part in COSMETIC):
        return set()
    return MOVED[max((part for part in MOVED if fits(part)), key=len)]


@pytest.mark.filterwarnings("ignore:Pydantic serializer warnings")
def test_each_value_moves_the_keys_of_the_stages_that_it_decides_and_of_no_other() -> None:
    usual = Recipe(name="usual")
    before = digests(usual)
    wrong = {}
    paths = list(leaves(usual))
    for path in paths:
        after = digests(changed(usual, path))
        moved = {name for name in STAGES if after[name] != before[name]}
        if moved != expected(".".join(path)):
            wrong[".".join(path)] = moved
    assert wrong == {}
    assert len(paths) > 250


def variant(stages: list[str], use_rg: bool) -> Recipe:
    return Recipe.model_validate({"name": "x", "stages": stages, "task": {"references": {"use_rg": use_rg}}})


@pytest.mark.parametrize("name", sorted(SIMULATING))
def test_a_variant_without_the_generators_posture_still_heeds_its_feasible_map(name: str) -> None:
    whole, stage = list(STAGES), STAGES[name]
    assert "rg-fit" in stage.reads(variant(whole, use_rg=False))
    assert "rg-fit" not in stage.reads(variant(whole[2:], use_rg=False))
    assert "rg-fit" in stage.reads(variant(whole[2:], use_rg=True))


def test_the_default_sequences_are_in_the_key_of_an_evaluation_that_names_none(monkeypatch: pytest.MonkeyPatch) -> None:
    recipe = Recipe(name="any")
    before = data_digest(dict(STAGES["eval"].defaults(recipe)))
    own = recipe.model_copy(update={"eval": recipe.eval.model_copy(update={"sequence": evaluate.PUSHING})})
    assert STAGES["eval"].defaults(own) == {}
    monkeypatch.setattr(evaluate, "LIFTING", evaluate.LIFTING[:-1])
    assert data_digest(dict(STAGES["eval"].defaults(recipe))) != before


def test_the_probed_history_of_a_policy_without_one_is_in_the_key() -> None:
    def probed(policy: str, **teacher: object) -> bool:
        given = {"name": "x", "eval": {"policy": policy, "probe": {}}, "teacher": teacher}
        return "distill.history" in STAGES["eval"].defaults(Recipe.model_validate(given))

    assert probed("teacher")
    assert not probed("student")
    assert not probed("teacher", history={})


def test_a_student_that_ppo_trained_observes_what_the_task_shows() -> None:
    def sees(*stages: str) -> bool:
        given = {"name": "x", "stages": ["teacher", *stages], "distill": {"observe_object": False}}
        return Recipe.model_validate(given).student_sees_object

    assert not sees("distill")
    assert sees()
