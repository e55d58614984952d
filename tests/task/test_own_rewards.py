"""Terms of the reward in a file of the user's own: what training makes of them, and what else leaves them alone."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from task_worlds import rollout

from iowbc.errors import RecipeError, StageFailed, WorkerFailed
from iowbc.pipeline.stage import slice_value
from iowbc.recipe.reading.loading import load_recipe
from iowbc.recipe.recipe import Recipe
from iowbc.recipe.section import deciding
from iowbc.stages.registry import STAGES
from iowbc.task.episodes import CommandScript, CommandSegment, Episode
from iowbc.task.vector.vector_env import VectorEnv

HALF = "import numpy as np\n\n\ndef half(step):\n    return np.full(len(step.command), 0.5)\n"
Term = dict[str, Any]
Open = Callable[..., VectorEnv]


def own_recipe(folder: Path, source: str = HALF, /, **term: Any) -> Recipe:
    (folder / "rewards.py").write_text(source)
    entry = {"module": "rewards.py", "function": "half", "weight": 3.0, **term}
    given = {"task": {"reward": {"own": {"mine": entry}}, "scenes": {"free": 1.0, "lift": 0.0}}}
    (folder / "mine.yaml").write_text(yaml.safe_dump(given))
    return load_recipe(folder / "mine.yaml").recipe


def test_a_term_of_ones_own_counts_by_its_weight_in_worker_processes_too(opened: Open, tmp_path: Path) -> None:
    for workers in (0, 1):
        env = opened(own_recipe(tmp_path), workers)
        (tmp_path / "rewards.py").unlink()
        rollout(env, 3)
        assert env.statistics()["reward/own.mine"] == pytest.approx(1.5)


def test_with_a_width_it_is_a_kernel(opened: Open, tmp_path: Path) -> None:
    env = opened(own_recipe(tmp_path, width=0.5**0.5))
    rollout(env, 2)
    assert env.statistics()["reward/own.mine"] == pytest.approx(3.0 * np.exp(-1.0))


@pytest.mark.parametrize(
    ("source", "text"),
    [
        (
            "def hlaf(step):\n    return 0\n",
            r"has no function 'half'; there are: hlaf; did you mean 'hlaf'",
        ),
        ("import numpi\n", r"cannot be executed: ModuleNotFoundError: .*numpi.* in line 1"),
        ("raise SystemExit(3)\n", r"cannot be executed: SystemExit: 3 in line 1"),
    ],
)
def test_a_file_that_cannot_be_used_is_named_before_processes_start(
    opened: Open, tmp_path: Path, source: str, text: str
) -> None:
    with pytest.raises(StageFailed, match=f"task.reward.own.mine: rewards.py: {text}"):
        opened(own_recipe(tmp_path, source), workers=1)


def test_a_file_that_is_no_python_is_refused_as_the_recipe_is_read(tmp_path: Path) -> None:
    with pytest.raises(RecipeError, match=r"rewards.py, line 2: '\(' was never closed"):
        own_recipe(tmp_path, "x = 1\ndef half(step:\n")


def test_its_file_may_define_dataclasses_and_begin_with_a_byte_order_mark(opened: Open, tmp_path: Path) -> None:
    dataclass = "from dataclasses import dataclass\n\n\n@dataclass\nclass Scale:\n    half: float = 0.5\n"
    env = opened(own_recipe(tmp_path, f"\ufefffrom __future__ import annotations\n{dataclass}{HALF}"))
    rollout(env, 2)
    assert env.statistics()["reward/own.mine"] == pytest.approx(1.5)


@pytest.mark.parametrize(
    ("returned", "text"),
    [
        ("step.command", r"function half: returned shape \(2, 11\), expected \(2,\); it takes a Step"),
        ("step.command[:, 0] / 0.0", r"returned nan for environment 0 of 2; .* finite"),
        ("step.comand", r"raised AttributeError: .*comand.* in line 4; it takes a Step"),
    ],
)
def test_what_a_term_returns_is_held_against_what_it_must(
    opened: Open, tmp_path: Path, returned: str, text: str
) -> None:
    source = f"import numpy as np\nnp.seterr(all='ignore')\ndef half(step):\n    return {returned}\n"
    with pytest.raises(StageFailed, match=text):
        rollout(opened(own_recipe(tmp_path, source)), 1)


def test_a_worker_process_says_in_one_line_what_a_term_did(opened: Open, tmp_path: Path) -> None:
    env = opened(own_recipe(tmp_path, "def half(step):\n    return 1\n"), workers=1)
    with pytest.raises(WorkerFailed, match=r"rewards.py, function half: returned shape \(\)") as caught:
        rollout(env, 1)
    assert "Traceback" not in str(caught.value)


def test_trials_plans_and_reading_do_not_execute_the_file(opened: Open, tmp_path: Path) -> None:
    mark = tmp_path / "executed"
    recipe = own_recipe(tmp_path, f"open({str(mark)!r}, 'w').close()\n{HALF}")
    deciding(Recipe.model_validate(recipe.model_dump(mode="json")))
    command = (0.0, 0.0, 0.0, 0.72, *[0.0] * 7)
    script = CommandScript((CommandSegment(duration=0.1, ramp=0.0, command=command),))
    trial = Episode("free", 1, 0.1, {}, script, None)
    rollout(opened(recipe, episodes=(trial, trial)), 2)
    assert not mark.exists()
    rollout(opened(recipe), 1)
    assert mark.exists()


def test_only_a_term_with_a_weight_is_in_the_key_by_the_content_of_its_file(tmp_path: Path) -> None:
    def rewards(source: str = HALF, **term: Any) -> Any:
        return slice_value(deciding(own_recipe(tmp_path, source, **term)), "task", STAGES["teacher"])["reward"]

    usual = deciding(Recipe(name="usual"))["task"]["reward"]
    assert rewards(weight=0.0) == usual
    assert set(rewards()["own"]["mine"]["module"]) == {"sha256"}
    assert rewards() != rewards(HALF + "\n")


def test_a_file_that_is_not_there_is_told_where_the_recipe_names_it(tmp_path: Path) -> None:
    with pytest.raises(RecipeError, match=r"mine.yaml:\d+:9: key 'task.reward.own.mine.module' = 'gone.py': .*gone.py"):
        own_recipe(tmp_path, module="gone.py")
