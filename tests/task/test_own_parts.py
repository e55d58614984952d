"""Parts of s_priv in a file of the user's own: what rows make of them, and what leaves them alone."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from own_parts import VELOCITY, own_part
from task_worlds import rollout

from iowbc.errors import RecipeError, StageFailed, WorkerFailed
from iowbc.pipeline.stage import slice_value
from iowbc.recipe.reading.loading import load_recipe
from iowbc.recipe.recipe import Recipe
from iowbc.recipe.section import deciding
from iowbc.robot.description import Robot
from iowbc.stages.registry import STAGES
from iowbc.task.episodes import Episode
from iowbc.task.layout import full_layout
from iowbc.task.specification import Specification
from iowbc.task.vector.vector_env import VectorEnv

Open = Callable[..., VectorEnv]


def own_recipe(folder: Path, source: str = VELOCITY, /, **said: Any) -> Recipe:
    return named_parts({"mine": own_part(folder, source, **said)})


def named_parts(parts: dict[str, Any]) -> Recipe:
    task = {"observation": {"own": parts}, "scenes": {"free": 1.0, "lift": 0.0}}
    return Recipe.model_validate({"name": "mine", "task": task})


def parts(env: VectorEnv, rows: Any) -> tuple[Any, Any]:
    """The part of one's own and what it copies."""
    places = env.layout.slices
    return rows[..., places["privileged/mine"]], rows[..., places["privileged/base_linear_velocity"]]


def test_its_values_are_in_the_rows_of_worker_processes_too(opened: Open, tmp_path: Path) -> None:
    for workers in (0, 1):
        env = opened(own_recipe(tmp_path), workers)
        (tmp_path / "parts.py").unlink()
        mine, copied = parts(env, rollout(env, 3)["observation"])
        assert np.array_equal(mine, copied)
        assert mine.any()


def test_its_signs_are_those_of_the_rows_mirror(opened: Open, tmp_path: Path) -> None:
    env = opened(own_recipe(tmp_path))
    rows = rollout(env, 3)["observation"]
    mine, copied = parts(env, env.layout.mirror(rows))
    assert np.array_equal(mine, copied)
    assert np.array_equal(mine[..., 1], -parts(env, rows)[0][..., 1])


@pytest.mark.parametrize(
    ("returned", "text"),
    [
        ("truth.motion.heading", r"returned shape \(2,\), expected \(2, 3\); it takes the Truth"),
        ("truth.motion.base_velocity[:, :2]", r"returned shape \(2, 2\), expected \(2, 3\)"),
        ("truth.motion.base_velocity * float('nan')", r"returned \[nan nan nan\] for environment 0 of 2; .* finite"),
        ("truth.motion.base_velocity * 0.0 + 1e39", r"returned \[1.e\+39 1.e\+39 1.e\+39\] for environment 0 of 2"),
        ("truth.moton", r"raised AttributeError: .*moton.* in line 2; it takes the Truth"),
    ],
)
def test_what_it_returns_is_held_against_what_it_must(opened: Open, tmp_path: Path, returned: str, text: str) -> None:
    where = r"task.observation.own.mine: parts.py, function velocity: "
    with pytest.raises(StageFailed, match=where + text):
        opened(own_recipe(tmp_path, f"def velocity(truth):\n    return {returned}\n"))


def test_it_is_held_at_every_step(opened: Open, tmp_path: Path) -> None:
    late = "left = [None] * 4\ndef velocity(truth):\n    left.pop()\n    return truth.motion.base_velocity\n"
    env = opened(own_recipe(tmp_path, late))
    with pytest.raises(StageFailed, match="raised IndexError"):
        rollout(env, 6)


def test_a_worker_process_says_in_one_line_what_it_did(opened: Open, tmp_path: Path) -> None:
    with pytest.raises(WorkerFailed, match=r"parts.py, function velocity: returned shape \(\)") as caught:
        opened(own_recipe(tmp_path, "def velocity(truth):\n    return 1\n"), workers=1)
    assert "Traceback" not in str(caught.value)


def test_a_file_that_cannot_be_used_is_named_before_processes_start(opened: Open, tmp_path: Path) -> None:
    text = "task.observation.own.mine: parts.py: has no function 'velocity'; there are: velocty; did you mean 'velocty'"
    with pytest.raises(StageFailed, match=text):
        opened(own_recipe(tmp_path, VELOCITY.replace("velocity(", "velocty(")), workers=1)


def test_what_does_not_fill_s_priv_does_not_execute_the_file(opened: Open, robot: Robot, tmp_path: Path) -> None:
    mark = tmp_path / "executed"
    recipe = own_recipe(tmp_path, f"open({str(mark)!r}, 'w').close()\n{VELOCITY}")
    deciding(Recipe.model_validate(recipe.model_dump(mode="json")))
    assert not [text for stage in STAGES.values() for _, text in stage.problems(recipe)]
    assert full_layout(recipe, robot).size == full_layout(recipe.deployed, robot).size + 3
    trial = Episode("free", 1, 0.1, {}, None, None)
    rollout(opened(recipe.deployed, episodes=(trial, trial)), 2)
    assert not mark.exists()
    opened(recipe, episodes=(trial, trial))
    assert mark.exists()


def test_rows_do_not_depend_on_the_order_of_a_file(robot: Robot, tmp_path: Path) -> None:
    part = own_part(tmp_path)
    one, other = (named_parts(dict.fromkeys(names, part)) for names in (("b", "a"), ("a", "b")))
    assert list(one.task.observation.own) != list(other.task.observation.own)
    assert full_layout(one, robot).slices == full_layout(other, robot).slices


def test_only_a_recipe_that_has_parts_has_them_in_its_key_by_the_content_of_their_file(tmp_path: Path) -> None:
    def observation(recipe: Recipe) -> Any:
        return slice_value(deciding(recipe), "task", STAGES["teacher"])["observation"]

    assert observation(Recipe(name="usual")) == {"observe_object": True}
    found = observation(own_recipe(tmp_path))
    assert set(found["own"]["mine"]["module"]) == {"sha256"}
    assert found != observation(own_recipe(tmp_path, VELOCITY + "\n"))
    assert found != observation(own_recipe(tmp_path, mirror=[1, 1, 1]))


def test_a_name_that_is_taken_is_refused(folder: Path, tmp_path: Path) -> None:
    recipe = named_parts({"object_mass": own_part(tmp_path)})
    (path, text), *others = STAGES["teacher"].problems(recipe)
    assert (path, others) == ("task.observation.own.object_mass", [])
    assert text == "s_priv has a part of this name already; take another"
    with pytest.raises(StageFailed, match=r"task.observation.own.object_mass: s_priv has a part of this name"):
        VectorEnv(Specification(recipe, folder), num_envs=1, workers=0, seed=1)


@pytest.mark.parametrize(
    ("name", "said", "text"),
    [
        ("Mine", {}, r"own.Mine"),
        ("mine", {"mirror": []}, "own.mine.mirror"),
        ("mine", {"mirror": [1, 0]}, r"own.mine.mirror.1' = 0: should be -1 or 1"),
        ("mine", {"module": "gone.py"}, "own.mine.module' = 'gone.py': .*gone.py"),
    ],
)
def test_a_recipe_says_what_is_wrong_with_a_part(tmp_path: Path, name: str, said: Any, text: str) -> None:
    (tmp_path / "parts.py").write_text(VELOCITY)
    entry = {"module": "parts.py", "function": "velocity", "mirror": [1, -1, 1], **said}
    (tmp_path / "mine.yaml").write_text(yaml.safe_dump({"task": {"observation": {"own": {name: entry}}}}))
    with pytest.raises(RecipeError, match=text):
        load_recipe(tmp_path / "mine.yaml")
