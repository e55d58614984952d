"""Teacher and student where s_priv has a part in a file of the user's own."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from mirrored import mirror_tensor
from own_parts import VELOCITY, own_part
from stage_jobs import make_job
from training_jobs import small_recipe

from iowbc.control.action import action_mirror
from iowbc.errors import StageFailed
from iowbc.evaluation.trials.plan import command_script
from iowbc.evaluation.trials.protocol import evaluated_world
from iowbc.evaluation.trials.rollout import play_episodes
from iowbc.learning.acting import load_policy
from iowbc.learning.storage import load_teacher
from iowbc.pipeline.stage import START
from iowbc.recipe.recipe import Recipe
from iowbc.robot.description import Robot, robot_folder
from iowbc.stages import distill, teacher
from iowbc.task.episodes import Episode
from iowbc.task.layout import full_layout
from iowbc.task.specification import Specification


def own_recipe(folder: Path, source: str = VELOCITY, /, **said: Any) -> Recipe:
    """The smallest training, whose policy is not told of one of two parts."""
    parts = {"told": own_part(folder, source, **said), "hidden": own_part(folder, source, **said)}
    values = small_recipe(value_only=["hidden"]).model_dump(mode="json")
    values["task"]["observation"]["own"] = parts
    values["distill"]["withheld"] = ["told"]
    return Recipe.model_validate(values)


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where a teacher and its student were trained in worker processes."""
    place = tmp_path_factory.mktemp("trained")
    recipe = own_recipe(place)
    (place / "parts.py").unlink()
    assert not [*teacher.STAGE.problems(recipe), *distill.STAGE.problems(recipe)]
    teacher.STAGE.run(make_job(place / "teacher", recipe, workers=1))
    inputs = {"teacher": place / "teacher" / "out"}
    distill.STAGE.run(make_job(place / "distill", recipe, inputs=inputs, workers=1))
    return place


def test_the_teacher_sees_what_it_is_told_and_obeys_the_mirror(trained: Path, robot: Robot, tmp_path: Path) -> None:
    layout = full_layout(own_recipe(tmp_path), robot)
    network, _ = load_teacher(trained / "teacher" / "out")
    torch.manual_seed(0)
    rows = torch.randn(20, layout.size)
    action = network(rows)
    mirrored = network(mirror_tensor(layout.mirror, rows))
    torch.testing.assert_close(mirrored, mirror_tensor(action_mirror(robot), action), rtol=0, atol=1e-5)
    for name, sees in (("told", True), ("hidden", False)):
        others = rows.clone()
        others[:, layout.privileged_places([name])] += 1.0
        assert torch.equal(network(others), action) != sees, name


def test_only_a_policy_that_sees_s_priv_has_the_file_executed_in_trials(trained: Path, tmp_path: Path) -> None:
    mark = tmp_path / "executed"
    recipe = own_recipe(tmp_path, f"open({str(mark)!r}, 'w').close()\n{VELOCITY}")
    script = command_script(recipe.teacher.check.sequence, recipe.task.commands)
    for policy, stage in (("student", "distill"), ("teacher", "teacher")):
        asked = recipe.model_copy(update={"eval": recipe.eval.model_copy(update={"policy": policy})})
        world = evaluated_world(Specification(asked, robot_folder("g1")))
        episodes = [Episode("free", 1, 0.1, {}, script, None)]
        (outcome,) = play_episodes(world, episodes, load_policy(trained / stage / "out"), workers=0)
        assert np.isclose(outcome.seconds, 0.1)
        assert mark.exists() == (policy == "teacher")


@pytest.mark.parametrize("change", [{"mirror": [-1, 1, 1]}, {"source": f"{VELOCITY}\n"}])
def test_a_training_does_not_begin_from_a_teacher_with_another_part(
    trained: Path, tmp_path: Path, change: dict[str, Any]
) -> None:
    said = dict(change)
    recipe = own_recipe(tmp_path, said.pop("source", VELOCITY), **said)
    job = make_job(tmp_path / "job", recipe, inputs={START: trained / "teacher" / "out"}, workers=0)
    with pytest.raises(StageFailed, match="observes something else"):
        teacher.STAGE.run(job)
