"""The tutorials, as a reader follows them, at the smallest size."""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import typer
import yaml
from pages import DOCS, commands, write
from stage_jobs import make_job
from typer.core import TyperGroup

from iowbc.cli import app
from iowbc.learning.curves import TABLE
from iowbc.recipe.reading.loading import load_recipe
from iowbc.reference.labels.plan import SamplePlan
from iowbc.robot.description import load_robot
from iowbc.stages import teacher
from iowbc.stages.registry import STAGES
from iowbc.task.specification import Specification
from iowbc.task.vector.vector_env import VectorEnv

pytestmark = pytest.mark.system

ROOT = DOCS.parent
TINY = (
    *("task.references.use_rg=false", "task.episode_duration=[0.2, 1.0]", "teacher.environments=4"),
    *("teacher.rollout=16", "teacher.steps=64", "teacher.minibatches=2", "teacher.epochs=1", "teacher.hidden=[16, 8]"),
    *("teacher.check.every=1", "teacher.check.trials=1", "teacher.check.sequence=[{duration: 0.2, ramp: 0.0}]"),
)
TUTORIALS = sorted(path.relative_to(DOCS).as_posix() for path in DOCS.glob("tutorials/*.md"))
PAGES = [
    *("../README.md", "../CHANGELOG.md", "../CONTRIBUTING.md"),
    *sorted(path.relative_to(DOCS).as_posix() for path in DOCS.rglob("*.md")),
]


@pytest.fixture
def place(tmp_path: Path) -> Path:
    """A folder such as `iowbc init` makes."""
    for name in ("recipes", "robots"):
        shutil.copytree(ROOT / name, tmp_path / name)
    return tmp_path


def test_there_are_six_and_the_site_lists_them() -> None:
    listed = (ROOT / "mkdocs.yml").read_text()
    assert len(TUTORIALS) == 6
    assert all(page in listed for page in TUTORIALS)
    assert all(path.name in listed for path in DOCS.glob("*.md"))


@pytest.mark.parametrize("page", PAGES)
def test_every_command_that_a_page_names_is_understood(page: str) -> None:
    program = typer.main.get_command(app)
    for words in commands(page):
        command, context = program, typer.Context(program, info_name="iowbc")
        rest = command.make_parser(context).parse_args(list(words))[1]
        while rest and isinstance(command, TyperGroup):
            name, found, rest = command.resolve_command(context, rest)
            command = found.make_context(name, [], parent=context, resilient_parsing=True).command
            context = typer.Context(command, info_name=name, parent=context)
            rest = command.make_parser(context).parse_args(rest)[1]


def trained(recipe_file: Path, folder: Path) -> list[str]:
    """Names of the curves of the smallest training."""
    job = make_job(folder, load_recipe(recipe_file, TINY).recipe, workers=1)
    teacher.run(job)
    return list(pd.read_parquet(job.out / TABLE))


def test_change_a_reward(place: Path, tmp_path: Path) -> None:
    write("tutorials/reward.md", place)
    changed = load_recipe(place / "recipes" / "calmer.yaml").recipe.task.reward
    assert (changed.smooth.action_rate, changed.sync.height.weight) == (-0.05, 2.0)
    curves = trained(place / "recipes" / "symmetric.yaml", tmp_path / "job")
    assert "reward/own.leg_symmetry" in curves
    trained(place / "recipes" / "feet.yaml", tmp_path / "feet")
    told = json.loads((tmp_path / "feet" / "out" / "teacher.json").read_text())["layout"]["privileged"]
    assert (told[-1]["name"], told[-1]["size"]) == ("foot_height", 2)


def test_add_an_object(place: Path) -> None:
    write("tutorials/object.md", place)
    corners = [(x, y, z) for x in (0, 300) for y in (0, 250) for z in (0, 200)]
    sides = [(1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4)]
    lines = [f"v {x} {y} {z}" for x, y, z in corners] + [f"f {a} {b} {c} {d}" for a, b, c, d in sides]
    (place / "recipes" / "crag.obj").write_text("\n".join(lines))
    for name in ("barrel", "crag"):
        recipe = load_recipe(place / "recipes" / f"{name}.yaml", ["task.references.use_rg=false"]).recipe
        env = VectorEnv(Specification(recipe, place / "robots" / "g1"), num_envs=10, workers=0, seed=0)
        try:
            env.reset()
            for _ in range(3):
                env.step(np.zeros((10, 15), np.float32))
            assert env.get_attr("scene").count("barrel") == 6
            assert not env.signals["diverged"].any()
        finally:
            env.close()


def test_an_object_for_a_trained_policy_changes_the_trials_alone(place: Path) -> None:
    write("tutorials/object.md", place)
    bucket, full = (load_recipe(place / "recipes" / f"{name}.yaml").recipe for name in ("bucket", "full"))
    assert (bucket.simulation, bucket.task, bucket.teacher) == (full.simulation, full.task, full.teacher)
    assert bucket.eval.scenes["bucket"].scene.object is not None
    assert set(bucket.eval.scenes) > set(full.eval.scenes)


def test_add_a_robot(place: Path) -> None:
    write("tutorials/robot.md", place)
    subprocess.run([sys.executable, "make_g1_23.py"], cwd=place, check=True)
    robot = load_robot(place / "robots" / "g1_23")
    assert len(robot.joints) == 23
    recipe = load_recipe(place / "recipes" / "g1_23.yaml", TINY).recipe
    assert recipe.robot == "g1_23"
    env = VectorEnv(Specification(recipe, robot.folder), num_envs=2, workers=0, seed=0)
    env.reset()
    env.close()
    plan = SamplePlan(robot, recipe.rg, seed=0)
    assert plan.draw(np.arange(4))[0].arm.shape == (len(robot.interaction),)


def test_add_a_transport_task(place: Path) -> None:
    write("tutorials/task.md", place)
    recipe = load_recipe(place / "recipes" / "around_the_table.yaml").recipe
    assert recipe.skill.tasks.own == ("around_the_table",)
    assert sum(stretch.length for stretch in recipe.skill.tasks.around_the_table.path) == 4.0
    assert not [text for stage in recipe.stages for _, text in STAGES[stage].problems(recipe)]


def test_the_documentations_files_are_yaml_that_recipes_can_be(place: Path) -> None:
    for page in PAGES:
        write(page, place)
    for path in (place / "recipes").glob("*.yaml"):
        assert isinstance(yaml.safe_load(path.read_text()), dict), path


def test_one_command_makes_every_published_figure_anew() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    made = makefile.partition("\nmeasure: run\n")[2].partition("\n\n")[0]
    figures = "".join((DOCS / page).read_text(encoding="utf-8") for page in ("results.md", "simulation.md"))
    benchmarks = set(re.findall(r"`(?:iowbc )?bench (\w+)", figures))
    recipes = set(re.findall(r"`iowbc run (recipes/\w+\.yaml)", figures))
    comparisons = set(re.findall(r"`iowbc (compare \w+)`", figures))
    assert {"sim", "train"} <= benchmarks
    assert "compare paper" in comparisons
    assert {"recipes/full.yaml", "recipes/teacher.yaml", "recipes/probe.yaml"} <= recipes
    asked = [line.split("iowbc ")[1] for line in made.splitlines()]
    assert {f"bench {name}" for name in benchmarks} <= {" ".join(line.split()[:2]) for line in asked}
    assert {f"run {recipe}" for recipe in recipes} | comparisons <= set(asked)


def test_every_page_stands_in_the_sites_contents_once() -> None:
    def pages(entries: list[Any]) -> list[str]:
        found: list[str] = []
        for entry in entries:
            below = next(iter(entry.values())) if isinstance(entry, dict) else entry
            found += [below] if isinstance(below, str) else pages(below)
        return found

    contents = yaml.safe_load((ROOT / "mkdocs.yml").read_text(encoding="utf-8"))["nav"]
    assert sorted(pages(contents)) == sorted(path.relative_to(DOCS).as_posix() for path in DOCS.rglob("*.md"))
