"""The linear probe: what it fits, on which trials it is tested, and what it tells of a policy."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import torch
from numpy.typing import NDArray

from iowbc.errors import StageFailed
from iowbc.evaluation.probe import (
    HISTORY,
    LATENT,
    NEWEST,
    PRIVILEGED,
    Features,
    RecordingPolicy,
    gathered,
    inferred_masses,
)
from iowbc.evaluation.report.probe import figures_of, probe_figure, probe_table, write_probe
from iowbc.evaluation.report.statistics import determination_interval, r_squared
from iowbc.learning.acting import StudentPolicy, TeacherPolicy
from iowbc.learning.networks import StudentNetwork, TeacherNetwork

KINDS = ("md", "tex", "csv", "json", "png")
TRIALS, MOMENTS = 60, 6


def readings() -> tuple[dict[str, Features], pd.DataFrame]:
    """Trials of 1 to 10 kg in which a sensor shows the mass with an error of 0.5 kg, and others name the trial."""
    trial = np.repeat(np.arange(TRIALS), MOMENTS)
    mass = np.linspace(1.0, 10.0, TRIALS)[trial]
    random = np.random.default_rng(0)
    names = random.normal(size=(TRIALS, 5))[trial]
    shown = mass + random.normal(scale=0.5, size=len(mass))
    features = {"sensor": np.column_stack([0.3 * shown - 2.0, names]), "names": names}
    seconds = np.tile(np.arange(MOMENTS) * 0.5, TRIALS)
    moments = pd.DataFrame({"trial": trial, "seconds": seconds, "settled": seconds > 0, "mass": mass})
    return {name: values.astype(np.float32) for name, values in features.items()}, moments


@pytest.fixture(scope="module")
def inferred() -> pd.DataFrame:
    return inferred_masses(*readings()).assign(variant="IO-WBC", scene="lift", partner_share=0.0)


def test_what_shows_the_mass_infers_it_in_trials_of_other_masses(inferred: pd.DataFrame) -> None:
    shown = inferred[(inferred["source"] == "sensor") & inferred["settled"]]
    assert set(shown["trial"] % 2) == {1}
    assert figures_of(shown)["RMSE"] == pytest.approx(0.5, abs=0.15)
    assert figures_of(shown)["R2"] > 0.93


def test_what_names_the_trial_alone_infers_nothing(inferred: pd.DataFrame) -> None:
    assert figures_of(inferred[inferred["source"] == "names"])["R2"] < 0.2


def test_trials_that_end_at_once_are_no_probe() -> None:
    features, moments = readings()
    with pytest.raises(StageFailed, match=r"only 0 of the trials.*eval.probe.masses"):
        inferred_masses(features, moments.assign(settled=False))


def test_means_over_a_second_and_a_trial_say_more_than_a_reading(inferred: pd.DataFrame) -> None:
    found = figures_of(inferred[inferred["source"] == "sensor"])
    assert found["R2"] < found["R2_second"] < found["R2_trial"]
    assert found["RMSE_trial"] < found["RMSE"]


def test_readings_end_with_their_trial_and_settle_with_a_full_history() -> None:
    kept = [{"x": np.full((2, 1), moment, np.float32)} for moment in range(3)]
    going = np.array([[True, True], [True, True], [True, False]])
    features, moments = gathered(kept, going, np.array([0.0, 0.5, 1.0]), np.array([2.0, 4.0]), span=0.5)
    assert moments["trial"].tolist() == [0, 1, 0, 1, 0]
    assert moments["mass"].tolist() == [2.0, 4.0, 2.0, 4.0, 2.0]
    assert features["x"][:, 0].tolist() == [0, 0, 1, 1, 2]
    assert moments["settled"].tolist() == [False, False, True, True, True]


def rows(size: int, seed: int = 0) -> NDArray[np.float32]:
    return np.random.default_rng(seed).normal(size=(3, size)).astype(np.float32)


def test_a_listener_leaves_the_policy_as_it_is_and_reads_its_latent() -> None:
    torch.manual_seed(0)
    network = StudentNetwork(6, 4, 2, 3, 5, [8], "elu", 10.0)
    listener, alone = RecordingPolicy(StudentPolicy(network), 3, 2, 25), StudentPolicy(network)
    for policy in (listener, alone):
        policy.reset(np.ones(3, np.bool_))
    for moment in range(5):
        observation, privileged = rows(6, moment), rows(7, moment)
        assert np.array_equal(listener.act(observation, privileged), alone.act(observation, privileged))
    assert len(listener.kept) == 3, "every other step"
    last = listener.kept[-1]
    assert alone.history is not None
    assert np.array_equal(last[HISTORY], alone.history.frames.reshape(3, -1))
    assert np.array_equal(last[NEWEST], observation)
    assert np.array_equal(last[PRIVILEGED], privileged)
    with torch.inference_mode():
        assert np.array_equal(last[LATENT], network.read(torch.from_numpy(alone.history.frames))[1].numpy())


def test_a_teacher_is_listened_to_without_a_latent() -> None:
    listener = RecordingPolicy(TeacherPolicy(TeacherNetwork(13, 2, [4], "elu", 10.0)), 3, 1, 25)
    listener.reset(np.ones(3, np.bool_))
    listener.act(rows(6), rows(7))
    assert list(listener.kept[0]) == [HISTORY, NEWEST, PRIVILEGED]
    assert listener.kept[0][HISTORY].shape == (3, 25 * 6)


def test_r_squared_is_that_of_the_textbooks() -> None:
    mass = np.array([1.0, 2.0, 3.0, 4.0])
    assert r_squared(mass, mass) == 1.0
    assert r_squared(mass, np.full(4, 2.5)) == 0.0
    assert r_squared(mass, mass + np.array([1.0, -1.0, 1.0, -1.0])) == pytest.approx(1 - 4 / 5)
    assert np.isnan(r_squared(np.ones(3), np.ones(3)))


def test_repeating_the_readings_of_a_trial_makes_no_interval_narrower() -> None:
    mass = np.linspace(1.0, 10.0, 30)
    read, trial = mass + np.random.default_rng(0).normal(size=30), np.arange(30)
    low, high = determination_interval(mass, read, trial)
    assert low < r_squared(mass, read) < high
    assert determination_interval(np.tile(mass, 5), np.tile(read, 5), np.tile(trial, 5)) == pytest.approx((low, high))


def test_the_probes_of_several_variants_stand_in_one_table_and_figure(inferred: pd.DataFrame, tmp_path: Path) -> None:
    blind = inferred.assign(variant="IO-WBC, blind", inferred=5.5)
    both = pd.concat([blind, inferred], ignore_index=True)
    write_probe(both, tmp_path)
    assert {path.name for path in tmp_path.rglob("*.*")} == {
        f"probe.{kind}" for kind in ("md", "tex", "csv", "json", "png")
    }
    table = probe_table(both)
    assert [row[:2] for row in table.rows[:2]] == [("sensor (6)", "IO-WBC"), ("sensor (6)", "IO-WBC, blind")]
    assert "1.2 to 10.0 kg in 30 trials, without a partner" in table.caption
    left, right = probe_figure(both).axes
    assert len(left.get_legend().get_texts()) == 2
    assert len(right.get_legend().get_texts()) == 4, "two sources of two variants"
