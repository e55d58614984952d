"""A plan says what would run and why, with the recipe's line, the old value and the new one."""

import dataclasses
import hashlib
from pathlib import Path
from typing import Any

import fake_stages
import pytest
from workplace import RECIPE, Workplace

from iowbc.commands.plan import time_of
from iowbc.errors import RecipeError
from iowbc.files import data_digest
from iowbc.pipeline import planner as planning
from iowbc.pipeline.code import stage_code, syntax_digest
from iowbc.pipeline.console.wording import duration
from iowbc.pipeline.stage import slice_value
from iowbc.pipeline.store.artifact import MANIFEST, Manifest, write_manifest
from iowbc.pipeline.store.runs import Runs
from iowbc.pipeline.store.workspace import Workspace

pytestmark = pytest.mark.unit


def test_a_first_plan_says_that_nothing_is_stored(workplace: Workplace) -> None:
    assert {step.reasons for step in workplace.plan().values()} == {("nothing stored yet",)}
    assert not workplace.store.runs.root.exists()


def test_what_has_run_is_cached(workplace: Workplace) -> None:
    workplace.run()
    assert workplace.ran() == ["rg-dataset", "rg-fit", "teacher", "distill", "eval", "export"]
    assert all(step.cached for step in workplace.plan().values())
    workplace.run()
    assert workplace.ran() == []


def test_a_changed_field_is_named_with_its_line_and_both_values(workplace: Workplace) -> None:
    workplace.run()
    workplace.recipe.write_text(RECIPE.replace("steps: 4096", "gamma: 0.95\n  steps: 8192"))
    steps = workplace.plan()
    assert steps["teacher"].reasons == (
        f"teacher.gamma ({workplace.recipe}:3:3): 0.99 -> 0.95",
        f"teacher.steps ({workplace.recipe}:4:3): 4096 -> 8192",
    )
    assert steps["distill"].reasons == ("teacher is made anew",)
    assert steps["rg-fit"].cached


def test_an_override_is_named_as_the_place(workplace: Workplace) -> None:
    workplace.run()
    assert workplace.plan("eval.trials=9")["eval"].reasons == ("eval.trials (--set eval.trials=9): 5 -> 9",)


def test_a_value_that_went_back_to_its_default_says_so(workplace: Workplace) -> None:
    workplace.run("eval.trials=9")
    assert workplace.plan()["eval"].reasons == ("eval.trials (default): 9 -> 5",)


def test_a_change_of_eval_reruns_eval_alone(workplace: Workplace) -> None:
    workplace.run()
    workplace.ran()
    workplace.run("eval.trials=9")
    assert workplace.ran() == ["eval"]


def test_an_unchanged_result_keeps_what_reads_it(workplace: Workplace) -> None:
    """The inputs' contents are in the key, not their keys: the fake teacher leaves the same files for any `gamma`."""
    workplace.run()
    workplace.ran()
    workplace.run("teacher.gamma=0.9")
    assert workplace.ran() == ["teacher"]


def test_how_a_machine_runs_a_recipe_is_in_no_key(workplace: Workplace) -> None:
    workplace.run()
    steps = workplace.plan("execution.workers=7", "execution.experiment=other", "name=small", "description=new")
    assert all(step.cached for step in steps.values())


def test_what_only_changes_how_it_looks_is_in_no_key_and_is_told(workplace: Workplace) -> None:
    workplace.run()
    step = workplace.plan("eval.video.count=7")["eval"]
    assert step.cached
    assert step.notes == ("eval.video.count is 2 in it; `--force eval` makes it with 7",)
    workplace.run("eval.video.count=7", force=frozenset({"eval"}))
    assert workplace.plan("eval.video.count=7")["eval"].notes == ()


def test_going_back_to_an_earlier_recipe_finds_its_artifacts(workplace: Workplace) -> None:
    workplace.run()
    workplace.run("seed=4")
    workplace.ran()
    workplace.run()
    assert workplace.ran() == []


def test_a_new_version_of_a_stage_reruns_it(workplace: Workplace) -> None:
    workplace.run()
    workplace.registry["eval"] = dataclasses.replace(workplace.registry["eval"], version=2)
    assert workplace.plan()["eval"].reasons == ("stage version 1 -> 2",)


def test_changed_robot_files_rerun_everything(workplace: Workplace) -> None:
    workplace.run()
    (workplace.robot / "robot.yaml").write_text("name: g1\nkp: 3\n")
    assert workplace.plan()["rg-dataset"].reasons == ("the robot's files changed",)


def test_a_new_recipe_is_compared_with_its_own_kind_and_says_whose(workplace: Workplace) -> None:
    workplace.run()
    steps = workplace.plan("name=other", "seed=4")
    assert steps["teacher"].reasons == (
        "compared with recipe small",
        "rg-fit is made anew",
        "seed (--set seed=4): 3 -> 4",
    )
    assert steps["eval"].reasons == ("distill is made anew",)


def test_forced_stages_run_although_they_are_stored(workplace: Workplace) -> None:
    workplace.run()
    workplace.ran()
    workplace.run(force=frozenset({"teacher"}))
    assert workplace.ran() == ["teacher"]


def test_until_ends_the_run_early(workplace: Workplace) -> None:
    workplace.run(until="rg-fit")
    assert workplace.ran() == ["rg-dataset", "rg-fit"]


def test_an_unknown_stage_lists_the_recipes_stages(workplace: Workplace) -> None:
    with pytest.raises(RecipeError, match=r"--force nothing: .* valid: rg-dataset, rg-fit, teacher"):
        workplace.plan(force=frozenset({"nothing"}))


def test_a_stage_whose_input_the_recipe_leaves_out_is_named_with_its_line(workplace: Workplace) -> None:
    workplace.registry["teacher"] = dataclasses.replace(workplace.registry["teacher"], reads=lambda _: ("rg-fit",))
    workplace.recipe.write_text(RECIPE + "stages: [teacher, eval]\n")
    with pytest.raises(RecipeError, match=r"small\.yaml:5:\d+: key 'stages': teacher reads rg-fit"):
        workplace.plan()


def test_what_a_stage_cannot_do_is_named_with_its_line_before_anything_runs(workplace: Workplace) -> None:
    asks = dataclasses.replace(
        workplace.registry["eval"], problems=lambda recipe: iter([("teacher.steps", "too few to evaluate")])
    )
    workplace.registry["eval"] = asks
    with pytest.raises(RecipeError, match=r"small\.yaml:3:3: key 'teacher.steps': too few to evaluate"):
        workplace.plan()
    assert len(workplace.plan(until="teacher")) == 3


def test_it_is_compared_with_the_artifact_that_differs_least(workplace: Workplace) -> None:
    workplace.run("name=near", "teacher.gamma=0.9", "teacher.steps=8192")
    workplace.run()
    near = workplace.plan("teacher.gamma=0.9", "teacher.steps=8192", "teacher.hidden=[8]")["teacher"].reasons
    assert near[0] == "compared with recipe near"
    assert [reason.split()[0] for reason in near[1:]] == ["teacher.hidden"]


def test_of_two_equally_near_artifacts_the_recipes_own_is_taken(workplace: Workplace) -> None:
    workplace.run()
    workplace.run("name=other", "eval.trials=7")
    assert workplace.plan("eval.trials=9")["eval"].reasons == ("eval.trials (--set eval.trials=9): 5 -> 9",)


def test_what_is_made_anew_comes_before_a_long_list_of_changes(workplace: Workplace) -> None:
    workplace.run()
    reasons = workplace.plan("name=other", "seed=4", "distill.steps=9", "distill.rollout=8")["distill"].reasons
    assert reasons[:3] == ("compared with recipe small", "rg-fit is made anew", "teacher is made anew")


def test_the_expected_time_is_that_of_the_last_run_with_the_same_values(workplace: Workplace) -> None:
    made = workplace.run()
    assert workplace.plan("seed=4")["teacher"].expected == made["teacher"].manifest.seconds


def test_a_changed_count_is_reckoned_from_the_stored_rate(workplace: Workplace) -> None:
    made = {name: artifact.manifest.seconds for name, artifact in workplace.run().items()}
    steps = workplace.plan("teacher.steps=40960", "eval.trials=20", "seed=4")
    assert steps["teacher"].expected == pytest.approx(10 * made["teacher"])
    assert steps["eval"].expected == pytest.approx(4 * made["eval"])
    assert workplace.plan("teacher.steps=40960", "teacher.gamma=0.9")["teacher"].expected is None


def test_what_is_left_of_an_interrupted_stage_is_reckoned_from_its_own_rate(workplace: Workplace) -> None:
    workplace.run(until="rg-fit")
    key = workplace.plan()["teacher"].key
    assert key
    workspace = Workspace(workplace.store.runs, "teacher", key)
    workspace.begin("small", False, {})
    workspace.progress(25, 100, "")
    workspace.write()
    assert workplace.plan()["teacher"].expected == pytest.approx(3 * workspace.state.seconds)


def test_a_stage_that_stops_right_after_it_was_resumed_is_as_far_as_before(tmp_path: Path) -> None:
    workspace = Workspace(Runs(tmp_path), "teacher", "key")
    workspace.begin("small", False, {})
    workspace.progress(25, 100, "at 25")
    workspace.write()
    again = Workspace(Runs(tmp_path), "teacher", "key")
    assert again.begin("small", False, {})
    record = again.state
    assert (record.done, record.total, record.note) == (25, 100, "at 25")
    again.begin("small", True, {})
    assert again.state.done == 0, "a forced attempt begins anew"


def test_an_attempt_of_other_code_is_begun_anew_when_asked(tmp_path: Path) -> None:
    workspace = Workspace(Runs(tmp_path), "teacher", "key")
    workspace.begin("small", False, {"task": "old"})
    (workspace.scratch / "checkpoint").touch()
    assert workspace.begin("small", False, {"task": "new"}), "by default it is continued"
    assert workspace.begin("small", False, {"task": "old"}, same_code=True)
    assert not workspace.begin("small", False, {"task": "new"}, same_code=True)
    assert not list(workspace.scratch.iterdir())
    assert workspace.begin("small", False, {"task": "new"}, same_code=True)


def rewritten(folder: Path, **entries: Any) -> None:
    """The manifest of an artifact with other entries."""
    manifest = Manifest.model_validate_json((folder / MANIFEST).read_bytes())
    write_manifest(folder, manifest.model_copy(update=entries))


def test_a_time_is_a_range_over_the_last_runs_here_and_a_guess_where_there_are_none(workplace: Workplace) -> None:
    for seed, seconds in enumerate((100.0, 300.0, 200.0)):
        rewritten(workplace.run(f"teacher.seed={seed}")["teacher"].folder, seconds=seconds)
    step = workplace.plan("teacher.seed=9")["teacher"]
    assert (step.expected, step.roughly) == (200.0, None)
    assert [step.expected * end for end in step.spread] == pytest.approx([80.0, 375.0])
    assert time_of([step]) == "80 s to 6 min"
    for artifact in workplace.store.artifacts("teacher"):
        rewritten(artifact.folder, host="elsewhere")
    step = workplace.plan("teacher.seed=9")["teacher"]
    assert step.expected is None
    assert step.roughly in (100.0, 200.0, 300.0)
    assert step.rate_of == "small on another machine"
    assert time_of([step]).startswith("a guess: ")


def test_where_more_differs_the_time_of_what_differs_least_is_told_as_rough(workplace: Workplace) -> None:
    made = {name: artifact.manifest.seconds for name, artifact in workplace.run().items()}
    step = workplace.plan("name=other", "teacher.steps=40960", "teacher.gamma=0.9")["teacher"]
    assert step.roughly == step.guess == pytest.approx(10 * made["teacher"])
    assert step.rate_of == "small"
    assert workplace.plan("teacher.seed=9")["teacher"].roughly is None, "a seed changes no time"
    assert workplace.plan("teacher.seed=9")["teacher"].expected == made["teacher"]


def test_no_time_is_promised_for_other_values_nor_behind_them(workplace: Workplace) -> None:
    workplace.run()
    steps = workplace.plan("teacher.gamma=0.9")
    assert {name for name, step in steps.items() if not step.cached and step.expected is None} == {
        "teacher",
        "distill",
        "eval",
        "export",
    }


def test_forcing_a_stage_behind_the_end_of_the_run_is_refused(workplace: Workplace) -> None:
    with pytest.raises(RecipeError, match="teacher comes after rg-fit, where --until ends the run"):
        workplace.plan(until="rg-fit", force=frozenset({"teacher"}))


@pytest.fixture
def changing_code(workplace: Workplace, monkeypatch: pytest.MonkeyPatch) -> Workplace:
    digests = {"task": "old"}
    monkeypatch.setattr(planning, "stage_code", lambda stage: dict(digests) if stage.name == "eval" else {})
    workplace.run()
    workplace.ran()
    digests["task"] = "new"
    return workplace


def test_changed_code_is_reported_and_reruns_nothing(changing_code: Workplace) -> None:
    step = changing_code.plan()["eval"]
    assert step.cached
    assert step.notes == ("code changed since it was made: task",)


def test_changed_code_reruns_the_stage_when_asked(changing_code: Workplace) -> None:
    changing_code.run(on_code_change="rerun")
    assert changing_code.ran() == ["eval"]
    assert changing_code.plan(on_code_change="rerun")["eval"].cached


def test_comments_and_docstrings_are_not_code(tmp_path: Path) -> None:
    def digest(text: str) -> str:
        module = tmp_path / f"{len(list(tmp_path.iterdir()))}.py"
        module.write_text(text)
        return syntax_digest(module)

    first = digest('"""Doc."""\ndef f(x):\n    """Twice."""\n    return 2 * x\n')
    assert digest("def f(x):\n    # twice\n    return 2 * x\n") == first
    assert digest("def f(x):\n    return 3 * x\n") != first


def test_a_key_does_not_depend_on_the_order_of_what_is_hashed() -> None:
    assert data_digest({"a": 1, "b": [1.0, None]}) == data_digest({"b": [1.0, None], "a": 1})
    written = b'{"a":0.001,"b":"\\u00e9"}'
    assert data_digest({"b": "é", "a": 1e-3}) == hashlib.sha256(written).hexdigest()
    with pytest.raises(ValueError, match="not JSON compliant"):
        data_digest(float("nan"))


@pytest.mark.parametrize(
    ("seconds", "text"), [(0.42, "0.4 s"), (42, "42 s"), (600, "10 min"), (11_100, "3 h 05 min"), (None, "")]
)
def test_a_duration_is_told_for_people(seconds: float | None, text: str) -> None:
    assert duration(seconds) == text


def test_the_stages_of_the_package_are_light_and_whole() -> None:
    """Their slices name real parts of a recipe, their code exists, and their order is the pipeline's."""
    from iowbc.recipe.recipe import CONTROLLER, PIPELINE, Recipe
    from iowbc.recipe.section import deciding
    from iowbc.stages.registry import STAGES

    assert tuple(STAGES) == PIPELINE
    values = deciding(Recipe(name="any"))
    for stage in STAGES.values():
        assert stage_code(stage)
        for path in stage.slice:
            assert slice_value(values, path, stage) is not None or "." in path
        for read in stage.reads(Recipe(name="any")):
            assert PIPELINE.index(read) < PIPELINE.index(stage.name)
    assert tuple(fake_stages.STAGES) == CONTROLLER
