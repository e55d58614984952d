"""The stage `eval` from a policy on disk to its tables, figures and film."""

import json
from contextlib import closing
from dataclasses import replace
from functools import partial
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pandas as pd
import pytest
import torch
from made_up_trials import COSTS
from stage_jobs import Backwards, make_job

from iowbc.errors import Interrupted
from iowbc.evaluation.paper import LIFTING
from iowbc.evaluation.trials.errors import ERRORS
from iowbc.evaluation.trials.metrics import replayed
from iowbc.evaluation.trials.plan import planned_sweeps
from iowbc.evaluation.trials.protocol import Protocol, evaluated_world
from iowbc.evaluation.trials.quick import FIGURES, QuickEvaluation, figures, quick_trials
from iowbc.evaluation.trials.rollout import in_batch, play_episodes
from iowbc.learning.acting import load_policy
from iowbc.learning.networks import StudentNetwork, TeacherNetwork
from iowbc.learning.storage import save_network
from iowbc.pipeline.stage import Job
from iowbc.recipe.recipe import Recipe
from iowbc.recipe.teacher import Check
from iowbc.robot.description import load_robot, robot_folder
from iowbc.stages import eval as evaluate
from iowbc.stages.eval import play_everywhere
from iowbc.task.layout import full_layout
from iowbc.task.specification import Specification

SOMETIMES = (
    "foot_slip_per_metre",
    "foot_drift_per_metre",
    "hand_weight_share",
    "partner_weight_share",
    "weight_in_hands",
    "object_jerk",
    "E_v_partner",
    "partner_work",
    *(f"{place}_force_{part}" for place in ("hand", "handle") for part in ("mean", "p95", "peak")),
    *("push_force", "push_force_share", "impedance_real", "impedance_imag"),
    *("touchdown_speed", "touchdown_speed_peak", "pressure_margin", "pressure_margin_low"),
    *("friction_use", "friction_use_high"),
)
"""Figures that a trial without a walk, an object in the hands for a second, a partner or a pull does not have."""
QUESTION = {
    "name": "test",
    "task": {"references": {"use_rg": False}},
    "eval": {
        "trials": 2,
        "label": "w/o RG",
        "sequence": [{"duration": 0.3, "ramp": 0.0}, {"duration": 0.1, "velocity": [0.3, 0, 0], "ramp": 0.1}],
        "lifting": {"masses": [4], "partner_shares": [0]},
        "pushing": {
            "scene": "push",
            "masses": [20],
            "rolling_resistance": 0.05,
            "partner_shares": [0],
            "no_object": False,
        },
        "batch": 4,
        "heavy": [{"name": "18 kg tyre", "scene": "tyre", "mass": 18.0}],
        "video": {"count": 1, "width": 96, "height": 64, "fps": 10, "duration": 1.0},
    },
}


@pytest.fixture(scope="session")
def recipe() -> Recipe:
    return Recipe.model_validate(QUESTION)


@pytest.fixture(scope="session")
def student(recipe: Recipe, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An untrained student: enough to fall over with."""
    folder = tmp_path_factory.mktemp("student")
    torch.manual_seed(0)
    layout = full_layout(recipe, load_robot(robot_folder("g1")))
    architecture = {
        "observation": layout.state.size,
        "history": 25,
        "actions": 15,
        "frame_features": 4,
        "latent": 4,
        "hidden": [8],
        "activation": "elu",
        "clip": 10.0,
    }
    save_network(StudentNetwork(**architecture), architecture, folder, "student", {"layout": layout.describe()})
    return folder


def job(recipe: Recipe, student: Path, folder: Path) -> Job:
    return make_job(folder, recipe, inputs={"distill": student, "teacher": student})


@pytest.fixture(scope="session")
def done(recipe: Recipe, student: Path, tmp_path_factory: pytest.TempPathFactory) -> Job:
    finished = job(recipe, student, tmp_path_factory.mktemp("eval"))
    evaluate.run(finished)
    return finished


def test_every_trial_is_in_the_table_with_all_that_was_drawn(done: Job) -> None:
    trials = pd.read_parquet(done.out / "trials.parquet")
    assert list(zip(trials["suite"], trials["mass"], strict=True)) == [
        *[("lifting", 0.0)] * 2,
        *[("lifting", 4.0)] * 2,
        *[("pushing", 20.0)] * 2,
        *[("heavy", 18.0)] * 2,
    ]
    assert set(trials["variant"]) == {"w/o RG"}
    assert trials[list(ERRORS)].notna().all().all()
    measured = [name for name in COSTS if name not in SOMETIMES]
    assert trials[measured].notna().all().all()
    assert sum(name.startswith("peak_torque/") for name in trials) == 29
    assert (trials["distance"] < 1.0).all()
    held = trials[trials["mass"] > 0]
    assert np.array_equal(held["drawn_object_mass"], held["mass"])
    assert set(trials["drawn_push_scale"]) == {0.0}
    assert len(trials["drawn_kp_scale"].iloc[0]) == 29
    pushed = trials[trials["suite"] == "pushing"]
    assert set(pushed["drawn_object_ground_friction"]) == {0.05}


def test_trials_of_one_number_meet_the_same_world_at_every_mass(done: Job) -> None:
    trials = pd.read_parquet(done.out / "trials.parquet")
    friction = trials.pivot_table(index="trial", columns=["suite", "mass"], values="drawn_ground_friction")
    assert (friction.nunique(axis=1) == 1).all()
    assert friction.iloc[0, 0] != friction.iloc[1, 0]


def test_tables_figures_film_and_summary_are_left(done: Job) -> None:
    names = {str(path.relative_to(done.out)) for path in done.out.rglob("*.*")}
    assert {"tables/lifting.md", "tables/pushing.tex", "tables/heavy.csv", "figures/comparison.png"} <= names
    assert "w/o RG" in (done.out / "tables" / "lifting.md").read_text()
    summary = json.loads((done.out / "summary.json").read_text())["metrics"]
    assert summary["trials"] == 8
    assert 0 <= summary["lifting/4kg/success"] <= 1
    assert any("succeeded" in line for line in done.report.lines)  # type: ignore[attr-defined]


@pytest.mark.filterwarnings("ignore::ResourceWarning")  # imageio_ffmpeg leaves pipes of an ended ffmpeg open
def test_the_film_shows_the_trial(done: Job) -> None:
    (path,) = (done.out / "videos").iterdir()
    count, seconds = imageio_ffmpeg.count_frames_and_secs(str(path))
    assert 1 <= count <= 5
    assert seconds == pytest.approx(count / 10, abs=0.11)
    reader = imageio_ffmpeg.read_frames(str(path), pix_fmt="rgb24")
    assert next(reader)["size"] == (96, 64)
    picture = np.frombuffer(next(reader), np.uint8)
    reader.close()
    assert picture.std() > 10, "not a blank picture"


def test_a_row_is_played_again_bit_for_bit(done: Job, recipe: Recipe, student: Path) -> None:
    row = pd.read_parquet(done.out / "trials.parquet").iloc[2]
    policy = in_batch(load_policy(student), row)
    (again,) = play_episodes(Specification(recipe, done.robot), [replayed(row)], policy, workers=0)
    assert again.seconds == row["seconds"]
    assert again.trace.base_position.shape[0] * again.trace.dt == pytest.approx(row["seconds"])
    assert np.float32(np.sum(again.trace.power) * again.trace.dt) == row["energy"]


def test_neither_the_number_of_workers_nor_other_machines_change_anything(
    done: Job, recipe: Recipe, student: Path, tmp_path: Path
) -> None:
    spread = Backwards()
    elsewhere = partial(play_everywhere, spread, recipe, evaluate.read_by_trials(done))
    world, policy = Specification(recipe, done.robot), load_policy(student)
    reports: list[tuple[float, float]] = []
    protocol = Protocol(world, policy, work=tmp_path, workers=0, elsewhere=elsewhere)
    protocol.progress = lambda ready, total, note: reports.append((ready, total))
    pd.testing.assert_frame_equal(protocol.run(), pd.read_parquet(done.out / "trials.parquet"))
    assert spread.calls == len(list(done.work.glob("*.batch")))
    assert [ready for ready, _ in reports] == sorted({ready for ready, _ in reports}), "progress never goes back"


def test_a_damaged_batch_is_played_again(done: Job, recipe: Recipe, student: Path, tmp_path: Path) -> None:
    for batch in done.work.glob("*.batch"):
        (tmp_path / batch.name).write_bytes(batch.read_bytes())
    damaged = tmp_path / "trials-0-0.batch"
    content = bytearray(damaged.read_bytes())
    content[len(content) // 2] ^= 1
    damaged.write_bytes(content)
    protocol = Protocol(Specification(recipe, done.robot), load_policy(student), work=tmp_path, workers=0)
    pd.testing.assert_frame_equal(protocol.run(), pd.read_parquet(done.out / "trials.parquet"))
    assert damaged.with_name("trials-0-0.batch.damaged").is_file()


def test_a_batch_of_other_trials_is_played_again(done: Job, recipe: Recipe, student: Path, tmp_path: Path) -> None:
    (tmp_path / "trials-0-0.batch").write_bytes((done.work / "trials-0-1.batch").read_bytes())
    protocol = Protocol(Specification(recipe, done.robot), load_policy(student), work=tmp_path, workers=0)
    pd.testing.assert_frame_equal(protocol.run(), pd.read_parquet(done.out / "trials.parquet"))


def test_a_sweep_goes_on_after_its_last_finished_mass(done: Job, recipe: Recipe, student: Path, tmp_path: Path) -> None:
    stopping = job(recipe, student, tmp_path)
    finished = "trials-0-0.batch"
    (stopping.work / finished).write_bytes((done.work / finished).read_bytes())
    stopping = replace(stopping, interrupted=lambda: True)
    with pytest.raises(Interrupted, match="finished batches are kept"):
        evaluate.run(stopping)
    assert [path.name for path in stopping.work.iterdir()] == [finished]
    assert not (stopping.out / "trials.parquet").exists()
    evaluate.run(replace(stopping, interrupted=lambda: False))
    pd.testing.assert_frame_equal(
        pd.read_parquet(stopping.out / "trials.parquet"), pd.read_parquet(done.out / "trials.parquet")
    )


def test_a_trial_does_not_depend_on_the_batch_it_is_played_in(recipe: Recipe, student: Path, done: Job) -> None:
    trials = [trial for sweep in planned_sweeps(recipe) for trial in sweep.named()]
    table = pd.read_parquet(done.out / "trials.parquet")
    world = Specification(recipe, done.robot)
    for place, row in enumerate(table.query("kind != 'heavy'").to_dict("records")):
        policy = in_batch(load_policy(student), pd.Series(row))
        (alone,) = play_episodes(world, [trials[place].episode], policy, workers=0)
        assert np.float32(np.sum(alone.trace.power) * alone.trace.dt) == row["energy"]


def test_variants_meet_the_same_trials_in_a_pinned_world(student: Path, tmp_path: Path) -> None:
    """One was trained with everything drawn, the other in a nominal world without noise."""
    nominal = {
        "randomization": {name: {"low": 1, "high": 1, "nominal": 1} for name in ("ground_friction", "kp_scale")},
        "sensing": {"enabled": False},
    }
    asked = {"trials": 2, "sequence": [{"duration": 0.06, "ramp": 0.0}], "lifting": {"masses": [4]}, "batch": 4}
    drawn = []
    for name, simulation in (("drawn", {}), ("nominal", nominal)):
        question = {"name": name, "simulation": simulation, "task": {"references": {"use_rg": False}}}
        tables = []
        for pinned in ({}, {"simulation": {}}):
            recipe = Recipe.model_validate({**question, "eval": {**asked, **pinned}})
            world = evaluated_world(Specification(recipe, robot_folder("g1")))
            work = tmp_path / f"{name}-{len(pinned)}"
            work.mkdir()
            tables.append(Protocol(world, load_policy(student), work=work, workers=0).run())
        drawn.append([table[[column for column in table if column.startswith("drawn_")]] for table in tables])
    (own, pinned), (other, other_pinned) = drawn
    pd.testing.assert_frame_equal(pinned, other_pinned)
    assert not own["drawn_ground_friction"].equals(other["drawn_ground_friction"]), "each in its own training's world"


def test_batches_from_before_a_change_of_the_label_have_the_new_one(student: Path, tmp_path: Path) -> None:
    asked = {"trials": 2, "sequence": [{"duration": 0.06, "ramp": 0.0}], "lifting": {"masses": [4]}}
    for label in ("before", "after"):
        question = {"name": "made-up", "task": {"references": {"use_rg": False}}, "eval": {**asked, "label": label}}
        world = evaluated_world(Specification(Recipe.model_validate(question), robot_folder("g1")))
        trials = Protocol(world, load_policy(student), work=tmp_path, workers=0).run()
        assert set(trials["variant"]) == {label}


def test_the_quick_evaluation_plays_the_same_trials_again(recipe: Recipe, student: Path) -> None:
    world = Specification(recipe, robot_folder("g1"))
    trials = quick_trials(world, "lift", masses=(0.0, 4.0), count=1, seed=7)
    with closing(QuickEvaluation(world, trials, Check())) as evaluation:
        first, second = (evaluation.play(load_policy(student)) for _ in range(2))
    assert first == second
    assert {"score", "upright", "survived", "transport", *ERRORS} <= set(first)
    assert 0 < first["score"] < 1
    loads = {name.split("/")[0] for name in first if "/" in name}
    assert loads == {"lift_0_kg", "lift_4_kg"}
    for error in ERRORS:
        own = [first[f"{load}/{error}"] for load in sorted(loads)]
        assert own[0] != own[1]
        assert np.mean(own) == pytest.approx(first[error])


def test_the_score_of_a_quick_evaluation_is_one_without_error_and_a_half_at_its_scales() -> None:
    check = Check()
    assert check.scales == LIFTING[0.0]["IO-WBC"], "the paper's own without a load"
    perfect = {**dict.fromkeys(FIGURES, 1.0), **dict.fromkeys(ERRORS, 0.0), "upright": 1.0}
    assert figures([perfect], check)["score"] == 1.0
    assert figures([perfect | dict(zip(ERRORS, check.scales, strict=True))], check)["score"] == pytest.approx(0.5)
    coarse = Check(scales=(1.0, 1.0, 1.0, 1.0))
    assert figures([perfect | dict.fromkeys(ERRORS, 1.0)], coarse)["score"] == pytest.approx(0.5)
    assert figures([perfect, perfect | {"upright": 0.0}], check)["score"] == 0.5
    assert figures([perfect | {"transport_robot": np.nan}], check)["transport"] == 0.0
    fallen = perfect | {"survived": 0.0, "upright": 0.9}
    assert figures([fallen], check)["score"] == pytest.approx(0.9)
    assert figures([perfect, fallen], Check(fall=0.5))["score"] == pytest.approx((1.0 + 0.45) / 2)


def test_progress_grows_within_a_batch(recipe: Recipe, student: Path, done: Job, tmp_path: Path) -> None:
    asked = {**QUESTION["eval"], "sequence": [{"duration": 1.2, "ramp": 0.0}], "heavy": [], "pushing": None}  # type: ignore[dict-item]
    longer = Recipe.model_validate(
        {**QUESTION, "eval": asked | {"trials": 1, "lifting": {"masses": [0], "partner_shares": [0]}}}
    )
    told: list[float] = []
    Protocol(
        Specification(longer, done.robot),
        load_policy(student),
        work=tmp_path,
        workers=0,
        progress=lambda now, total, note: told.append(now / total),
    ).run()
    assert told == sorted(told)
    assert told[-1] == 1.0
    assert any(0 < share < 1 for share in told)


def test_the_teacher_can_be_evaluated_too(student: Path, tmp_path: Path) -> None:
    question = {
        "name": "test",
        "task": {"references": {"use_rg": False}},
        "eval": {
            "policy": "teacher",
            "trials": 1,
            "sequence": [{"duration": 0.1, "ramp": 0.0}],
            "lifting": {"masses": [2], "partner_shares": [0]},
            "video": {"count": 0},
        },
    }
    recipe = Recipe.model_validate(question)
    assert evaluate.STAGE.reads(recipe) == ("rg-fit", "teacher")
    layout = full_layout(recipe, load_robot(robot_folder("g1")))
    architecture = {
        "inputs": layout.size,
        "actions": 15,
        "hidden": [8],
        "activation": "elu",
        "clip": 10.0,
    }
    save_network(TeacherNetwork(**architecture), architecture, tmp_path, "teacher", {"layout": layout.describe()})
    finished = job(recipe, tmp_path, tmp_path / "job")
    evaluate.run(finished)
    assert pd.read_parquet(finished.out / "trials.parquet")["policy"].tolist() == ["teacher"] * 2


def test_a_student_that_no_stage_trains_is_refused_before_anything_runs() -> None:
    without = Recipe.model_validate({"name": "test", "stages": ["rg-dataset", "rg-fit", "teacher", "eval"]})
    ((place, text),) = evaluate.problems(without)
    assert place == "eval.policy"
    assert "add `distill`" in text
    assert not list(evaluate.problems(Recipe(name="test")))


def test_a_sweep_goes_on_while_something_survives(recipe: Recipe, student: Path, tmp_path: Path) -> None:
    asked = {
        **QUESTION["eval"],  # type: ignore[dict-item]
        "lifting": {"masses": [1], "beyond": {"step": 1, "limit": 3}, "partner_shares": [0, 0.5], "no_object": False},
        "pushing": None,
        "heavy": [],
        "trials": 1,
        "sequence": [{"duration": 0.04, "ramp": 0.0}],
    }
    longer = Recipe.model_validate({**QUESTION, "eval": asked})
    world = Specification(longer, robot_folder("g1"))
    trials = Protocol(world, load_policy(student), work=tmp_path, workers=0).run()
    assert trials["mass"].tolist() == [1.0, 2.0, 3.0] * 2, "nobody falls in two control steps"
    assert trials["suite"].tolist() == ["lifting"] * 3 + ["lifting with partner 0.5"] * 3


def test_a_probe_alone_leaves_its_readings_table_and_figure(recipe: Recipe, student: Path, tmp_path: Path) -> None:
    asked = {"lifting": None, "probe": {"trials": 20, "interval": 0.1, "sequence": [{"duration": 0.7, "ramp": 0.0}]}}
    probed = Recipe.model_validate({**QUESTION, "eval": {"label": "w/o RG", **asked}})
    finished = job(probed, student, tmp_path)
    evaluate.run(finished)
    names = {str(path.relative_to(finished.out)) for path in finished.out.rglob("*.*")}
    written = {f"tables/probe.{kind}" for kind in ("md", "tex", "csv", "json")}
    assert names == written | {"probe.parquet", "figures/probe.png", "summary.json"}
    inferred = pd.read_parquet(finished.out / "probe.parquet")
    assert list(dict.fromkeys(inferred["source"])) == ["latent", "history H_t", "newest s_t", "s_priv"]
    assert inferred["trial"].nunique() == 10, "the others are fitted"
    assert not np.allclose(inferred["inferred"], inferred["mass"])
    metrics = json.loads((finished.out / "summary.json").read_text())["metrics"]
    assert metrics["probe/latent/R2"] <= 1
