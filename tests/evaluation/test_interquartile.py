"""Aggregates over masses and trainings, of made-up trials whose figures are known."""

import numpy as np
import pandas as pd
import pytest
from made_up_trials import trials_of

from iowbc.evaluation.report.aggregate import TRAINING, aggregate
from iowbc.evaluation.report.differences import difference_table, paired
from iowbc.evaluation.report.error_tables import error_table, paper_table
from iowbc.evaluation.report.interquartile import blocks, figures, improvement, interquartile_table
from iowbc.evaluation.report.report import report_tables
from iowbc.evaluation.report.statistics import bootstrapped, interquartile_mean
from iowbc.results.table import latex, markdown


def training(seed: str, survivors: dict[float, int], error: float = 0.1, variant: str = "IO-WBC") -> pd.DataFrame:
    return trials_of(variant, "lifting", survivors, error=error).assign(**{TRAINING: seed})


TWO = pd.concat([training("0", {0.0: 5, 4.0: 5}), training("1", {0.0: 5, 4.0: 5}, 0.2)], ignore_index=True)
RIVAL = trials_of("WBC", "lifting", {0.0: 5, 4.0: 1, 8.0: 0}, error=0.3).assign(**{TRAINING: "0"})


def test_the_interquartile_mean_is_that_of_the_middle_half() -> None:
    assert interquartile_mean(np.array([9.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, -50.0])) == pytest.approx(3.5)
    assert interquartile_mean(np.array([1.0, 2.0, 3.0, np.inf])) == pytest.approx(2.5), "the worst quarter is left out"
    assert interquartile_mean(np.array([1.0, np.inf, 3.0, np.inf])) == np.inf


def test_an_interval_may_reach_to_infinity_without_becoming_no_number() -> None:
    values = np.r_[np.ones(1900), np.full(100, np.inf)]
    assert bootstrapped(2.0, values) == (2.0, 1.0, np.inf)


def test_all_trainings_play_the_same_masses_and_failures_are_worse_than_any_error() -> None:
    found = blocks(pd.concat([TWO, RIVAL], ignore_index=True))
    assert list(found) == ["IO-WBC", "WBC"]
    assert {seed: values.shape for seed, values in found["IO-WBC"].items()} == {"0": (2, 5, 6), "1": (2, 5, 6)}, (
        "8 kg is the rival's alone"
    )
    assert np.isinf(found["WBC"]["0"][1, 1:, 1:]).all()
    estimates = figures(found["WBC"])
    assert estimates["success"].value == pytest.approx(0.6)
    assert np.isinf(estimates["E_alpha"].value), "four of ten trials were not survived"


def test_the_interval_of_two_trainings_spans_both() -> None:
    found = blocks(TWO)["IO-WBC"]
    alone = [figures({seed: values})["E_alpha"] for seed, values in found.items()]
    both = figures(found)["E_alpha"]
    assert [one.value for one in alone] == pytest.approx([0.3, 0.4])
    assert both.value == pytest.approx(0.35)
    assert both.low <= alone[0].value < alone[1].value <= both.high
    assert both.high - both.low > max(one.high - one.low for one in alone)


def test_the_probability_of_improvement_counts_pairs_at_the_same_mass() -> None:
    found = blocks(pd.concat([training("0", {0.0: 5}), training("0", {0.0: 5}, 0.25, "WBC")], ignore_index=True))
    theirs = improvement(found["WBC"], found["IO-WBC"])
    assert theirs.value == pytest.approx(6 / 25), "0.25 beats 0.3, 0.4, 0.5; 0.35 beats 0.4, 0.5; 0.45 beats 0.5"
    assert improvement(found["IO-WBC"], found["WBC"]).value == pytest.approx(1 - 6 / 25)
    assert improvement(found["WBC"], found["WBC"]).value == pytest.approx(0.5), "ties count half"
    assert theirs.low <= theirs.value <= theirs.high


def test_a_table_shows_trainings_together_and_each_below() -> None:
    table = interquartile_table(pd.concat([TWO, RIVAL], ignore_index=True))
    assert table is not None
    assert [row[1:4] for row in table.rows] == [
        ("IO-WBC", "2", "20"),
        ("IO-WBC, seed 0", "1", "10"),
        ("IO-WBC, seed 1", "1", "10"),
        ("WBC", "1", "10"),
        ("stands still", "–", "–"),
    ]
    assert table.rows[4][4:] == ("none", "0.250", "0.250", "0.250", "0.250", "–")
    assert table.rows[0][-1] == "–"
    assert table.rows[3][5] == "Fails (0.383 to Fails)", "four of ten trials were not survived"
    assert latex(table).count(r"\toprule") == 1


def test_rows_of_several_trainings_say_so_and_each_training_is_paired_with_each() -> None:
    trials = pd.concat([TWO, RIVAL], ignore_index=True)
    summary = aggregate(trials)
    assert summary.loc[summary["variant"] == "IO-WBC", "trials"].tolist() == [10, 10]
    assert "(IO-WBC: 2 trainings)" in error_table(summary, "lifting").caption
    assert "trainings" not in error_table(aggregate(RIVAL), "lifting").caption
    pairs = paired(trials, "WBC", "IO-WBC")
    assert len(pairs) == 20
    own = trials.groupby("variant", sort=False)["E_v"].mean()
    change = pairs["E_v_variant"].mean() - pairs["E_v_reference"].mean()
    assert change == pytest.approx(own["WBC"] - own["IO-WBC"])
    assert difference_table(trials) is not None
    assert {"interquartile", "differences"} <= {table.name for table in report_tables(trials, summary, 0.8)}
    assert "interquartile" not in {table.name for table in report_tables(RIVAL, aggregate(RIVAL), 0.8)}


def test_every_cell_of_the_papers_tables_has_ours_theirs_and_the_ratio() -> None:
    trials = pd.concat([training("0", {0.0: 5, 1.0: 5, 8.0: 0}), RIVAL.assign(variant="load-agnostic")])
    table = paper_table(aggregate(trials, {"load-agnostic": "WBC"}))
    assert table is not None
    lines = markdown(table).splitlines()
    assert "| II, lifting | IO-WBC | 0 kg | 5/5 | 0.300 / 0.125 = 2.40 |" in lines[4]
    assert "| IO-WBC | 8 kg | 0/5 | Fails / 0.145 = – |" in lines[5]
    assert "| load-agnostic | 8 kg | 0/5 | Fails / Fails = – |" in lines[8]
    assert "| stands still | any | – | 0.250 | 0.250 | 0.250 | 0.250 |" in lines[9]
    assert len(lines) == 10, "1 kg is in none of the paper's tables"
    assert "IO-WBC in lifting 0 of 8, load-agnostic in lifting 0 of 8" in table.caption
    assert paper_table(aggregate(trials.assign(variant="mine"))) is None
