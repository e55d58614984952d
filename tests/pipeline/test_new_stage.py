"""A new stage is one declaration: its name in the recipe and its `STAGE`; everything else follows from that."""

from dataclasses import replace
from typing import Literal

import pytest
from workplace import Workplace

from iowbc.commands.playable import in_training, playable
from iowbc.commands.results import headline, next_commands, policy_stages
from iowbc.commands.ui import view
from iowbc.learning.curves import Curves
from iowbc.pipeline.planner import planner_for
from iowbc.pipeline.runner import Runner
from iowbc.pipeline.stage import Job, Stage
from iowbc.pipeline.stage_plan import Options
from iowbc.pipeline.store.workspace import Workspace
from iowbc.recipe import recipe as recipes
from iowbc.recipe.reading.loading import load_recipe
from iowbc.recipe.recipe import PIPELINE, Recipe, StageName
from iowbc.recipe.section import Section
from iowbc.report.curves import learning_panels
from iowbc.report.runs import Group, Run, trainings_table
from iowbc.stages.registry import STAGES

pytestmark = pytest.mark.unit


class Juggling(Section):
    """How the new stage trains."""

    steps: int = 12


class JugglersRecipe(Recipe):
    """A recipe with a seventh stage."""

    stages: tuple[StageName | Literal["juggle"], ...] = ("rg-dataset", "rg-fit", "juggle")
    juggle: Juggling = Juggling()


def juggle(job: Job) -> None:
    """Train to keep balls in the air."""
    curves = Curves(job.work / "curves.jsonl", 0)
    for step in range(job.recipe.juggle.steps):
        curves.append(step, {"balls": step / 4, "height": 1.0})
    job.summarize(curves.write_artifact(job.out, "juggling", ["balls"]))


STAGE = Stage(
    name="juggle",
    version=1,
    slice=("seed", "juggle"),
    reads=lambda recipe: ("rg-fit",),
    run=juggle,
    headline=("balls",),
    columns=("balls",),
    curves=("balls",),
    trained_by="juggling",
    leaves_policy=True,
)


@pytest.fixture
def run(workplace: Workplace, monkeypatch: pytest.MonkeyPatch) -> Run:
    """A run of the recipe, with the new stage declared."""
    monkeypatch.setattr(recipes, "PIPELINE", (*PIPELINE, "juggle"))
    monkeypatch.setitem(STAGES, "juggle", STAGE)
    recipe = JugglersRecipe(name="small")
    loaded = replace(load_recipe(workplace.recipe), recipe=recipe)
    registry = workplace.registry | {"juggle": STAGE}
    planner = planner_for(loaded, registry, workplace.store, workplace.robot, Options())
    made = Runner(planner, workplace.display, None, lambda: False).run()
    return Run("small", made, recipe.model_dump(mode="json"))


def test_it_runs_behind_what_it_reads_and_tells_its_figures(run: Run) -> None:
    assert list(run.artifacts) == ["rg-dataset", "rg-fit", "juggle"]
    assert headline("juggle", run.artifacts["juggle"].metrics) == [("balls", 2.75)]
    assert "metrics.`juggle/balls`" in view()["selectedColumns"]


def test_its_policy_is_the_one_to_play(run: Run, workplace: Workplace) -> None:
    assert policy_stages()[0] == "juggle"
    assert next_commands(workplace.store.runs, "small", run.artifacts)[0].startswith("iowbc play ")
    assert playable(workplace.store, run.artifacts["juggle"].manifest.key, None).manifest.stage == "juggle"


def test_its_training_is_found_while_it_goes_on(run: Run, workplace: Workplace) -> None:
    Workspace(workplace.store.runs, "juggle", "f" * 64).begin("small", False, {})
    assert in_training(workplace.store, "small/juggle", None) == ("juggle of small was interrupted", None)


def test_its_curves_and_steps_are_compared(run: Run) -> None:
    groups = [Group("small", (run,))]
    main, others = learning_panels(groups, "juggle")
    assert [panel.title for panel in main] == ["balls"]
    assert [panel.title for panel in others] == ["height"]
    table = trainings_table(groups)
    assert table.rows[0][-1] == "12"
    assert table.head[-1] == "Steps of juggling"
