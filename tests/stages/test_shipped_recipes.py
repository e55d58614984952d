"""The recipes that come with the package: they can be run, and variants differ from IO-WBC in what they say alone."""

import json
from pathlib import Path
from typing import Any

import pytest
import torch
from typer.testing import CliRunner

from iowbc.cli import app
from iowbc.evaluation.paper import VARIANTS as VARIANTS_OF_THE_PAPER
from iowbc.learning.networks import StudentNetwork
from iowbc.pipeline.stage import slice_value
from iowbc.recipe.reading.loading import load_recipe
from iowbc.recipe.reading.study import load_study
from iowbc.recipe.recipe import Recipe
from iowbc.recipe.section import deciding
from iowbc.stages.registry import STAGES

RECIPES = Path(__file__).parents[2] / "recipes"
VARIANTS = {
    "wbc": {
        "stages",
        *(f"simulation.scenes.{name}_arms" for name in ("lift", "tyre", "push")),
        *(f"task.scenes.{name}" for name in ("lift", "tyre", "push", "lift_arms", "tyre_arms", "push_arms")),
        *(f"task.references.{kind}.{name}_arms" for kind in ("grasps", "loads") for name in ("lift", "tyre", "push")),
        *(f"task.references.loads.{name}" for name in ("lift", "squeeze", "tyre")),
        "task.observation.observe_object",
        *(f"task.reward.object.{name}" for name in ("position", "orientation", "vertical_velocity")),
    },
    "wo_rg": {
        "stages",
        "task.references.use_rg",
        "task.reward.sync.support_reference.weight",
        "task.reward.sync.lateral_reference.weight",
    },
    "wo_distill": {
        "stages",
        *(f"teacher.history.{name}" for name in ("length", "encoder", "frame_features", "latent", "estimate")),
    },
    "blind": {"distill.observe_object"},
}
"""What each variant changes, beside its name, description and label."""
SUITES = {"eval.robustness", "eval.map"}
FEWER = {"eval.trials", *SUITES}
"""How much less is played with controllers that are to be trained again."""
NAMES = {"name", "description", "eval.label", *FEWER}


def recipe(name: str) -> Recipe:
    return load_recipe(RECIPES / f"{name}.yaml").recipe


def leaves(value: Any, path: str = "") -> dict[str, Any]:
    if not isinstance(value, dict):
        return {path: value}
    return {name: leaf for key, inner in value.items() for name, leaf in leaves(inner, f"{path}.{key}").items()}


def differences(one: Recipe, other: Recipe) -> set[str]:
    """Dotted paths of the values that differ; a whole world pinned for the evaluation, or a scene of one's own, counts
    as one."""
    a, b = leaves(one.model_dump()), leaves(other.model_dump())
    found = {name.removeprefix(".") for name in a.keys() | b.keys() if a.get(name) != b.get(name)}
    whole = ["eval.simulation", *SUITES, *(f"simulation.scenes.{name}" for name in one.simulation.scenes.own)]
    return {next((path for path in whole if name.startswith(f"{path}.")), name) for name in found}


def trial_world(recipe: Recipe) -> dict[str, Any]:
    """The world of a recipe's trials, in which no scene of its own is played."""
    simulation = recipe.eval.simulation or recipe.simulation
    own = set(simulation.scenes.own)
    return {name: value for name, value in leaves(simulation.model_dump()).items() if name.split(".")[2] not in own}


STUDIES = {"paper", "public"}
PUBLIC = sorted(f"public/{path.stem}" for path in (RECIPES / "public").glob("*.yaml") if "carry" not in path.stem)
"""Controllers that others trained; the suites `carry.yaml` and `carry_drake.yaml` name none."""


@pytest.mark.parametrize("name", sorted({path.stem for path in RECIPES.glob("*.yaml")} - STUDIES) + PUBLIC)
def test_each_recipe_loads_and_no_stage_objects(name: str) -> None:
    asked = recipe(name)
    assert [problem for stage in asked.stages for problem in STAGES[stage].problems(asked)] == []


@pytest.mark.parametrize("name", VARIANTS)
def test_a_variant_changes_what_it_says_and_nothing_else(name: str) -> None:
    assert differences(recipe(name), recipe("full")) - NAMES == VARIANTS[name]


@pytest.mark.parametrize("name", VARIANTS)
def test_a_variant_shares_the_reference_generator(name: str) -> None:
    own, full = deciding(recipe(name)), deciding(recipe("full"))
    for stage in (STAGES["rg-dataset"], STAGES["rg-fit"]):
        for path in stage.slice:
            assert slice_value(own, path, stage) == slice_value(full, path, stage), path


@pytest.mark.parametrize("name", VARIANTS)
def test_a_variant_is_evaluated_in_the_world_where_iowbc_was_trained(name: str) -> None:
    assert trial_world(recipe(name)) == trial_world(recipe("full"))


def test_the_load_agnostic_controller_never_meets_an_object_in_training() -> None:
    agnostic = recipe("wbc")
    played = {name: getattr(agnostic.simulation.scenes, name) for name, share in agnostic.task.scenes if share > 0}
    assert {scene.object for scene in played.values()} == {None}
    assert not agnostic.task.observation.observe_object
    weights = agnostic.task.reward.object
    assert (weights.position, weights.orientation, weights.vertical_velocity, weights.beside) == (0, 0, 0, 0)


def test_the_load_agnostic_controller_practises_the_arms_of_every_grasp_as_often_as_iowbc() -> None:
    shares = {}
    for name in ("wbc", "full"):
        task = recipe(name).task
        grasps = dict(task.references.grasps)
        played = [(grasps[scene], share) for scene, share in task.scenes if share > 0]
        shares[name] = {grasp: sum(share for own, share in played if own == grasp) for grasp, _ in played}
    assert shares["wbc"] == shares["full"]


ABLATIONS = {
    "history_1": {"distill.history"},
    "history_5": {"distill.history"},
    "history_50": {"distill.history"},
    "no_auxiliary": {"distill.auxiliary"},
    "no_gait_prior": {"task.references.gait.enabled"},
    "no_r_gait": {"task.reward.without"},
    "no_r_obj": {"task.reward.without"},
    "no_randomization": {"simulation.randomization.enabled", "eval.simulation"},
}
"""What each ablation changes; the others' trials go on in the training's world."""


@pytest.mark.parametrize("name", ABLATIONS)
def test_an_ablation_is_one_line_and_changes_nothing_else(name: str) -> None:
    ablation = recipe(f"ablations/{name}")
    of_teacher = ablation.teacher.start is not None
    control = recipe("ablations/continued" if of_teacher else "full")
    stages = set() if of_teacher else {"stages"}
    assert differences(ablation, control) - NAMES == ABLATIONS[name] | stages
    text = (RECIPES / "ablations" / f"{name}.yaml").read_text().partition("eval:")[0].splitlines()
    own = [line for line in text if not line.startswith(("extends", "name", "description", "stages"))]
    assert len(own) == 1
    full = recipe("full")
    assert (ablation.eval.simulation or ablation.simulation) == (full.eval.simulation or full.simulation)


def test_all_ablations_plan_and_share_what_they_can(tmp_path: Path) -> None:
    study = RECIPES / "ablations" / "ablations.yaml"
    done = CliRunner().invoke(app, ["plan", str(study), "--json", "--runs", str(tmp_path)])
    assert done.exit_code == 0, done.output
    planned = [(one["recipe"], {stage["stage"] for stage in one["stages"]}) for one in json.loads(done.stdout)]
    whole = {name for name, stages in planned if {"teacher", "distill", "eval"} <= stages}
    assert whole == {"full", "continued", *ABLATIONS}
    full = deciding(recipe("full"))
    for name in ("history_1", "history_5", "history_50", "no_auxiliary"):
        own = deciding(recipe(f"ablations/{name}"))
        for path in STAGES["teacher"].slice:
            assert slice_value(own, path, STAGES["teacher"]) == slice_value(full, path, STAGES["teacher"])


@pytest.mark.parametrize("length", [1, 50])
def test_a_student_of_any_history_can_be_made(length: int) -> None:
    assert StudentNetwork(
        observation=10,
        history=length,
        actions=4,
        frame_features=4,
        latent=4,
        hidden=[8],
        activation="elu",
        clip=10.0,
    )(torch.zeros(2, length, 10)).shape == (2, 4)


def test_the_papers_recipe_compares_them() -> None:
    labels = tuple(dict.fromkeys(variant.recipe.eval.label for variant in load_study(RECIPES / "paper.yaml")))
    assert labels == (*VARIANTS_OF_THE_PAPER, "IO-WBC, blind")


def test_a_second_training_differs_in_its_seeds_alone() -> None:
    assert differences(recipe("full_seed_1"), recipe("full")) - NAMES == {"teacher.seed", "distill.seed"}


def test_without_distillation_the_policy_is_the_students_own_network() -> None:
    ablation, student = recipe("wo_distill").teacher, recipe("full").distill
    assert ablation.history is not None
    own = (ablation.history.length, ablation.history.encoder, ablation.history.frame_features, ablation.history.latent)
    assert own == (student.history, student.encoder, student.frame_features, student.latent)
    assert (ablation.hidden, ablation.activation) == (student.hidden, student.activation)
