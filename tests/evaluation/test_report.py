"""Aggregation, tables and figures of made-up trials."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from made_up_trials import trials_of
from matplotlib.colors import to_hex
from matplotlib.container import ErrorbarContainer

from iowbc.evaluation.paper import LIFTING, PUSHING, VARIANTS, reported
from iowbc.evaluation.report.aggregate import aggregate, case_names, variants_of
from iowbc.evaluation.report.differences import difference_table, mean_difference, paired, success_p
from iowbc.evaluation.report.error_tables import error_table, moving_table, paper_table
from iowbc.evaluation.report.figures import comparison, errors_against_mass, robustness, style_of
from iowbc.evaluation.report.interquartile import interquartile_table
from iowbc.evaluation.report.limits import (
    capacity_table,
    contact_table,
    joint_table,
    load_capacities,
    push_capacities,
    push_table,
    success_table,
)
from iowbc.evaluation.report.report import write_report
from iowbc.evaluation.trials.errors import ERRORS
from iowbc.results.table import Table, heads, latex, markdown


def test_a_case_that_two_suites_have_is_named_after_its_suite() -> None:
    cases = {"lifting": ("no object", "lifting"), "pushing": ("no object",), "stagnation": ("blocked crate",)}
    rows = pd.DataFrame([(suite, case) for suite, own in cases.items() for case in own], columns=["suite", "case"])
    assert [*case_names(rows)] == ["lifting no object", "lifting", "pushing no object", "blocked crate"]


def test_errors_are_means_over_the_survivors_alone() -> None:
    summary = aggregate(trials_of("IO-WBC", "lifting", {4.0: 3}))
    row = summary.iloc[0]
    assert (row["trials"], row["survived"]) == (5, 3)
    assert row["E_alpha"] == pytest.approx(0.2)
    assert row["E_alpha_half"] == pytest.approx(4.3027 * 0.1 / 3**0.5, abs=1e-4)
    assert row["norm"] == pytest.approx(0.4)


def test_fails_is_printed_only_where_none_survived() -> None:
    summary = aggregate(trials_of("WBC", "lifting", {0.0: 5, 7.0: 1, 8.0: 0}))
    text = markdown(error_table(summary, "lifting"))
    lines = {line.split("|")[1].strip(): line for line in text.splitlines() if " kg " in line}
    assert "Fails" not in lines["0 kg"]
    assert "0.100" in lines["7 kg"]
    assert "1/5" in lines["7 kg"]
    assert "Fails" not in lines["7 kg"]
    assert lines["8 kg"].count("Fails") == 9, "ours, one of them raw, and the paper's"


def test_kept_is_the_weight_in_the_hands_or_how_often_a_pushed_object_was_not_lost() -> None:
    lifts = trials_of("IO-WBC", "lifting", {0.0: 5, 4.0: 5})
    lifts["weight_in_hands"] = np.where(lifts["mass"] > 0, 0.98, np.nan)
    pushes = trials_of("IO-WBC", "pushing", {0.0: 5, 30.0: 5}).assign(weight_in_hands=np.nan)
    pushes.loc[pushes["mass"] == 0, "object_beside"] = np.nan
    pushes["kept"] = pushes["trial"] > 0
    for trials, suite, kept in ((lifts, "lifting", ["–", "98 %"]), (pushes, "pushing", ["–", "4/5"])):
        table = error_table(aggregate(trials), suite)
        assert [row[table.head.index("Kept")] for row in table.rows[:2]] == kept


def test_the_papers_numbers_stand_beside_ours() -> None:
    summary = aggregate(trials_of("IO-WBC", "pushing", {30.0: 5}))
    table = error_table(summary, "pushing")
    unknown = "the paper's μ is unknown"
    assert f"| 0.131 (2.29) | 0.016 (18.75) | 0.225 (1.33; {unknown}) | 0.143 (2.10) |" in markdown(table)
    assert table.numbers["ratio_E_alpha"].iloc[0] == pytest.approx(0.3 / 0.131)
    assert table.numbers["paper_E_v"].iloc[0] == 0.225


def test_the_papers_pushes_never_stand_beside_ours_without_their_unknown_friction_and_ours_in_their_regime() -> None:
    grid = [
        trials_of("IO-WBC", "map", {60.0: count}, f"μ {friction:g}", error=error).assign(rolling_resistance=friction)
        for friction, count, error in ((0.06, 5, 0.05), (0.1, 5, 0.2), (0.15, 0, 0.3))
    ]
    pushes = trials_of("IO-WBC", "pushing", {0.0: 5, 60.0: 5})
    lifts = trials_of("IO-WBC", "lifting", {4.0: 5})
    helped = aggregate(pd.concat([pushes.assign(partner_share=0.5), *grid]))
    assert "in its regime" not in markdown(error_table(helped, "pushing")), "the map has no partner"
    summary = aggregate(pd.concat([pushes, lifts, *grid]))
    said = "the paper's μ is unknown; ours in its regime 0.400 at μ 0.1, Fails at μ 0.15"
    beside = paper_table(summary)
    assert beside is not None
    for table in (error_table(summary, "pushing"), beside):
        loaded = [row for row in table.texts() if any("0.486" in cell for cell in row)]
        assert len(loaded) == 1
        assert all(said in next(cell for cell in row if "0.486" in cell) for row in loaded), table.name
        assert sum("unknown" in cell for row in table.texts() for cell in row) == 1, "neither lifts nor empty hands"


def test_the_row_without_an_object_says_so() -> None:
    trials = pd.concat(
        [trials_of("IO-WBC", "lifting", {0.0: 5}, "no object"), trials_of("IO-WBC", "lifting", {0.05: 5, 4.0: 5})]
    )
    assert [row[0] for row in error_table(aggregate(trials), "lifting").rows[:3]] == ["no object", "0.05 kg", "4 kg"]


def test_the_velocity_error_stands_in_the_tables_raw_too() -> None:
    summary = aggregate(trials_of("IO-WBC", "lifting", {4.0: 5}).assign(E_v_raw=0.77, E_v_raw_moving=0.88))
    beside = paper_table(summary)
    assert beside is not None
    for table, value in (
        (error_table(summary, "lifting"), "0.770"),
        (moving_table(summary, "lifting"), "0.880"),
        (beside, "0.770"),
    ):
        assert table.rows[0][table.head.index("E_v raw [m/s]")] == value
        assert table.head.index("E_v raw [m/s]") == table.head.index("E_v [m/s]") + 1


def test_trials_of_an_earlier_version_lack_what_it_did_not_record() -> None:
    later = ["E_v_raw_moving", "hand_force_peak", "touchdown_speed", "torque_rms/hip", "torque_rms/knee"]
    summary = aggregate(trials_of("IO-WBC", "lifting", {4.0: 5}).drop(columns=later))
    assert summary[["E_v_raw_moving", "hand_force_peak", "torque_rms"]].isna().all(axis=None)
    assert contact_table(summary).rows[0][2:4] == ("–", "1")
    assert moving_table(summary, "lifting").rows[0][5] == "–"


def test_the_joint_that_is_strained_most_is_named() -> None:
    summary = aggregate(trials_of("IO-WBC", "lifting", {4.0: 5}))
    assert (summary["torque_rms"].iloc[0], summary["torque_rms_joint"].iloc[0]) == (pytest.approx(0.3), "knee")
    assert contact_table(summary).rows[0][-1] == "30 % (knee)"


def test_the_papers_numbers_are_found_by_label_and_left_out_where_it_knows_none() -> None:
    trials = trials_of("full", "pushing", {30.0: 5})
    summary = aggregate(trials, {"full": "IO-WBC"})
    assert "| 0.131 (2.29) |" in markdown(error_table(summary, "pushing"))
    panel = errors_against_mass(summary, "pushing").axes[0]
    assert any(line.get_linestyle() == ":" for line in panel.lines), "the paper's numbers"
    without = error_table(aggregate(trials, {"full": "mine"}), "pushing")
    assert "paper E_" not in markdown(without)
    assert {len(row) for row in without.rows} == {len(without.head)}


def test_the_papers_tables_are_complete() -> None:
    for table in (LIFTING, PUSHING):
        assert all(tuple(row) == VARIANTS for row in table.values())
    assert reported("lifting", 8.0, "IO-WBC") == (0.145, 0.018, 0.053, 0.150)
    assert reported("lifting", 8.0, "WBC") is None
    assert reported("lifting", 5.0, "WBC") == "absent"


def test_variants_come_in_the_papers_order_and_unknown_ones_last() -> None:
    names = ["mine", "w/o RG", "IO-WBC"]
    trials = pd.concat([trials_of(name, "lifting", {0.0: 5}) for name in names])
    assert variants_of(trials) == ["IO-WBC", "w/o RG", "mine"]
    assert list(aggregate(trials)["variant"]) == ["IO-WBC", "w/o RG", "mine"]


def test_no_two_variants_look_alike() -> None:
    variants = [*VARIANTS, "another", "one more"]
    assert len({tuple(style_of(variant, variants).values()) for variant in variants}) == len(variants)
    assert style_of("one more", ["IO-WBC", "one more"]) != style_of("IO-WBC", ["IO-WBC", "one more"])


def test_a_variant_has_its_colour_in_a_panel_without_the_others() -> None:
    swept = [trials_of(name, "lifting", {0.0: 5, 4.0: 5}) for name in ("one", "other")]
    figure = comparison(aggregate(pd.concat([*swept, trials_of("other", "heavy", {18.0: 4}, "tyre")])), 0.8)
    heavy = figure.axes[-1]
    (bar,) = (bar for bar in heavy.patches if np.isfinite(bar.get_height()))
    assert to_hex(bar.get_facecolor()) == style_of("other", ["one", "other"])["color"].lower()


def test_what_was_not_evaluated_is_told_from_what_failed() -> None:
    summary = aggregate(
        pd.concat([trials_of("IO-WBC", "lifting", {4.0: 5}), trials_of("w/o RG", "pushing", {30.0: 0})])
    )
    text = markdown(capacity_table(summary, 0.8))
    assert "| IO-WBC | ≥ 4 kg | – |" in text
    assert "| w/o RG | – | < 30 kg |" in text


def test_load_capacity_stops_at_the_first_mass_that_breaks() -> None:
    summary = aggregate(trials_of("IO-WBC", "lifting", {0.0: 5, 1.0: 4, 2.0: 3, 3.0: 5}))
    found = [load_capacities(summary, rate)["IO-WBC"] for rate in (0.8, 0.6)]
    assert [(one["lifting"].value, one["lifting"].open_ended) for one in found] == [(1.0, False), (3.0, True)]
    assert all("pushing" not in one for one in found)
    assert "| IO-WBC | 1 kg |" in markdown(capacity_table(summary, 0.8))
    assert "| IO-WBC | ≥ 3 kg |" in markdown(capacity_table(summary, 0.6))


def test_heavy_cases_show_rate_interval_and_the_papers_rate() -> None:
    summary = aggregate(trials_of("IO-WBC", "heavy", {18.0: 4}, "tyre"))
    text = markdown(success_table(summary))
    assert "| tyre (18 kg) | IO-WBC | 4/5 | 4/5 | 80 % | 38 to 96 % | 80 % |" in text
    assert "stands still | – | none | 0 %" in text


def test_latex_captions_show_every_sign_of_a_label() -> None:
    caption = r"A&B #1 of $x, 5 % {w/o} a_b ~ ^ \ end"
    text = latex(Table("made_up", caption, heads("one"), [("1",)], grouped=False))
    assert r"A\&B \#1 of \$x, 5 \% \{w/o\} a\_b \textasciitilde{} \textasciicircum{} \textbackslash{} end" in text


def test_latex_groups_rows_and_escapes() -> None:
    trials = pd.concat([trials_of(name, "lifting", {0.0: 5, 4.0: 5}) for name in VARIANTS])
    text = latex(error_table(aggregate(trials), "lifting"))
    assert text.count(r"\multirow[c]{4}{*}") == 2
    assert text.count(r"\cline{1-") == 3
    assert "±" not in text
    assert "95 \\% interval" in text
    assert "$E_{\\alpha}$ & $E_{h}$" in text
    assert text.count("{") == text.count("}")


def test_latex_of_a_table_without_groups_has_one_line_a_variant() -> None:
    text = latex(capacity_table(aggregate(trials_of("w/o Distill.", "lifting", {4.0: 5})), 0.8))
    assert "80 \\% success" in text
    assert "w/o Distill. & $\\geq$ 4 kg \\\\" in text
    assert "multirow" not in text


@pytest.mark.parametrize("variants", [("IO-WBC",), VARIANTS])
def test_report_writes_every_table_and_figure(variants: tuple[str, ...], tmp_path: Path) -> None:
    parts = [trials_of(name, "lifting", {0.0: 5, 4.0: 2, 8.0: 0}) for name in variants]
    parts += [trials_of(name, "pushing", {0.0: 5, 30.0: 5}) for name in variants]
    parts += [trials_of(name, "squeezing", {0.05: 5, 2.0: 5}) for name in variants]
    parts += [trials_of(name, "heavy", {18.0: 1}, "tyre") for name in variants]
    parts += [trials_of(name, "stagnation", {65.0: 5}, "blocked crate") for name in variants]
    parts += [trials_of(name, "pushes", {4.0: 4}, "left", impulse=10.0) for name in variants]
    summary = write_report(pd.concat(parts), tmp_path, 0.8)
    assert len(summary) == 10 * len(variants)
    names = {str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*.*")}
    tables = ["lifting", "lifting_moving", "pushing", "pushing_moving", "heavy", "heavy_errors", "stagnation"]
    tables += ["squeezing", "squeezing_moving", "paper", "capacity", "pushes", "joints", "contact"]
    tables += ["differences", "interquartile"] if len(variants) > 1 else []
    assert names == {
        *(f"tables/{name}.{kind}" for name in tables for kind in ("md", "tex", "csv", "json")),
        "tables/summary.csv",
        *(f"figures/{name}.png" for name in ("comparison", "robustness")),
        *(f"figures/{name}_errors.png" for name in ("lifting", "pushing", "squeezing")),
    }


@pytest.fixture
def standing() -> pd.DataFrame:
    """Trials in which no step is commanded."""
    return trials_of("IO-WBC", "lifting", {4.0: 5}).assign(
        **{name: np.nan for part in ("", "still_") for name in (f"{part}{error}_moving" for error in ERRORS)}
    )


def test_there_is_no_table_of_walking_where_nobody_was_to_walk(standing: pd.DataFrame, tmp_path: Path) -> None:
    write_report(standing, tmp_path, 0.8)
    assert "lifting_moving.md" not in {path.name for path in tmp_path.rglob("*.md")}
    assert "Fails" not in markdown(error_table(aggregate(standing), "lifting"))


def test_standing_is_not_held_against_the_papers_walking(standing: pd.DataFrame) -> None:
    walking = trials_of("IO-WBC", "lifting", {4.0: 5})
    for trials, shown in ((walking, True), (standing, False), (walking.assign(variant="other"), False)):
        summary = aggregate(trials)
        table = error_table(summary, "lifting")
        assert ("paper E_α" in table.head) == shown
        assert ("Table II" in table.caption) == (trials is not standing)
        assert (paper_table(summary) is not None) == shown
        for figure in (errors_against_mass(summary, "lifting"), comparison(summary, 0.8)):
            dotted = [line for line in figure.axes[0].lines if line.get_linestyle() == ":"]
            assert (bool(dotted), "the paper's numbers" in figure.get_suptitle()) == (shown, shown)


def test_every_error_table_says_what_standing_still_scores() -> None:
    trials = pd.concat(
        [
            trials_of("IO-WBC", "lifting", {4.0: 5}),
            trials_of("IO-WBC", "stagnation", {65.0: 5}, "blocked crate"),
            trials_of("IO-WBC", "robustness", {4.0: 5}, "nominal"),
        ]
    )
    summary = aggregate(trials)
    for table in (
        *(error_table(summary, suite) for suite in ("lifting", "stagnation", "robustness")),
        moving_table(summary, "lifting"),
    ):
        (row,) = [row for row in table.rows if row[1] == "stands still"]
        assert row[2:7] == ("0.250",) * 5, table.name
    assert "| any | stands still | 0.250 | 0.250 | 0.250 | 0.250 | 0.250 | – | none | 0.00 |" in markdown(
        error_table(summary, "lifting")
    )


def test_captions_say_partner_friction_height_averaging_and_that_it_is_simulation() -> None:
    trials = pd.concat(
        [trials_of("IO-WBC", "lifting with partner 0.5", {4.0: 5}), trials_of("IO-WBC", "pushing", {30.0: 5})]
    )
    summary = aggregate(trials)
    carried, pushed = (error_table(summary, suite) for suite in ("lifting with partner 0.5", "pushing"))
    assert "In simulation, with a partner (share 0.5)." in carried.caption
    assert "without a partner (share 0), rolling resistance μ 0.06." in pushed.caption
    assert carried.caption.startswith("Command tracking errors under cooperative lifting (paper's Table II): means")
    assert pushed.caption.startswith("Command tracking errors under pushing alone (paper's Table III): means")
    both = pd.concat([trials, trials.assign(variant="WBC")])
    over_suites = [paper_table(summary), difference_table(both), interquartile_table(both)]
    for table in (carried, pushed, *filter(None, over_suites)):
        assert "In simulation" in table.caption
        assert "the pelvis above the ground" in table.caption
        assert "one gait period of 0.80 s" in table.caption
    assert ["μ 0.06" in table.caption for table in over_suites if table] == [True] * 3
    assert "Table II" in carried.caption
    assert "| 0.132 (2.27) |" in markdown(carried), "cooperative lifting, too, has the paper's numbers"


def test_captions_name_the_variants_whose_errors_are_measured_otherwise() -> None:
    own = trials_of("IO-WBC", "pushing", {30.0: 5})
    other = own.assign(variant="WBC", gait_period=0.65, height="com", rolling_resistance=np.nan)
    both = pd.concat([own, other])
    for table in (error_table(aggregate(both), "pushing"), difference_table(both)):
        assert table is not None
        assert "one gait period of 0.80 s (IO-WBC), 0.65 s (WBC)." in table.caption
        assert (
            "the pelvis above the ground (IO-WBC), the robot's centre of mass above the ground (WBC);" in table.caption
        )
        assert "rolling resistance μ 0.06 (IO-WBC), drawn as in training (WBC)." in table.caption


def test_transport_and_weight_in_the_hands_stand_in_the_table() -> None:
    text = markdown(error_table(aggregate(trials_of("IO-WBC", "lifting", {4.0: 5})), "lifting"))
    assert "| 5/5 | 5/5 | 0.90 / 0.80 | 100 % |" in text


def test_errors_differ_in_pairs_of_the_same_trial() -> None:
    trials = pd.concat([trials_of("IO-WBC", "lifting", {4.0: 5}), trials_of("WBC", "lifting", {4.0: 4}, error=0.3)])
    pairs = paired(trials, "WBC", "IO-WBC")
    assert len(pairs) == 5
    assert (pairs["E_v_variant"] - pairs["E_v_reference"]).tolist() == pytest.approx([0.2] * 5)
    table = difference_table(trials)
    assert table is not None
    assert table.rows[0][:4] == ("lifting", "WBC", "4/5", "+0.200")
    assert table.rows[0][-1] == "-20 % (p 1)"
    assert tuple(map(str, table.rows[1][:4])) == ("lifting", "stands still", "5", "-0.050 ± 0.196 (p 0.52)")
    assert difference_table(trials_of("IO-WBC", "lifting", {4.0: 5})) is None


def test_significance_is_that_of_the_textbooks() -> None:
    differences = pd.Series([0.1, 0.2, 0.3, 0.4, 0.5])
    mean, half, p = mean_difference(differences, pd.Series(range(5)))
    assert (mean, half) == pytest.approx((0.3, 0.1963), abs=1e-4)
    assert p == pytest.approx(0.01324, abs=1e-4)
    assert all(map(np.isnan, mean_difference(pd.Series([], dtype=float), pd.Series([], dtype=int))))
    better = pd.DataFrame({"trial": range(6), "succeeded_variant": [True] * 6, "succeeded_reference": [False] * 6})
    assert success_p(better) == pytest.approx(2 * 0.5**6)


def test_ten_masses_in_the_same_five_worlds_are_five_worlds() -> None:
    trials = [trials_of(name, "lifting", {float(mass): 5 for mass in range(1, 11)}) for name in ("IO-WBC", "WBC")]
    trials[1]["E_v"] += 0.1 + 0.02 * trials[1]["trial"]
    trials[1]["succeeded"] = False
    table = difference_table(pd.concat(trials))
    assert table is not None
    row = table.numbers.iloc[0]
    worlds = 0.1 + 0.02 * np.arange(5)
    assert row["E_v"] == pytest.approx(worlds.mean())
    assert row["E_v_p"] == pytest.approx(mean_difference(pd.Series(worlds), pd.Series(range(5)))[2])
    assert row["success_p"] == pytest.approx(2 * 0.5**5), "of fifty pairs it would be 2e-15"


def test_a_comparison_names_what_was_drawn_from_other_ranges() -> None:
    trials = [trials_of(name, "lifting", {4.0: 5}).assign(drawn_kp_scale=1.0) for name in ("IO-WBC", "WBC")]
    for latency, said in ((1.0, False), (1.5, True)):
        trials[1] = trials[1].assign(drawn_action_latency=latency, drawn_object_mass_scale=latency)
        trials[0] = trials[0].assign(drawn_action_latency=1.0, drawn_object_mass_scale=1.0)
        table = difference_table(pd.concat(trials))
        assert table is not None
        assert ("WBC and IO-WBC met different worlds (action latency)." in table.caption) is said


def test_the_largest_push_survived_is_told_by_direction() -> None:
    levels = {10.0: 5, 20.0: 4, 30.0: 1}
    parts = [trials_of("IO-WBC", "pushes", {4.0: n}, "left", impulse=size) for size, n in levels.items()]
    parts += [trials_of("IO-WBC", "pushes", {4.0: 5}, "right", impulse=size) for size in levels]
    parts += [trials_of("WBC", "pushes", {4.0: 0}, "left", impulse=10.0)]
    summary = aggregate(pd.concat(parts))
    found = push_capacities(summary, 0.8)["IO-WBC"]["left"]
    assert (found.value, found.open_ended) == (20.0, False)
    text = markdown(push_table(summary, 0.8))
    assert "| IO-WBC | 20 N·s | ≥ 30 N·s |" in text
    assert "| WBC | < 10 N·s | – |" in text


def test_the_joints_most_at_their_limit_come_first() -> None:
    table = joint_table(aggregate(trials_of("IO-WBC", "lifting", {4.0: 5, 8.0: 1, 9.0: 0})))
    assert table.rows[0] == ("lifting, 8 kg", "IO-WBC", "knee", "40.0", "10.0 %")
    assert len(table.numbers) == 2


def test_the_comparison_has_a_panel_for_each_thing_that_was_evaluated() -> None:
    lifting, heavy = trials_of("IO-WBC", "lifting", {4.0: 5}), trials_of("IO-WBC", "heavy", {18.0: 1}, "tyre")
    for trials, titles in (
        (lifting, ["(a) error norm, lifting", "(b) load capacity at 80 % success", "(c) success rate"]),
        (trials_of("IO-WBC", "lifting", {4.0: 1}), ["(a) error norm, lifting", "(b) success rate"]),
        (heavy, ["(a) success rate"]),
    ):
        figure = comparison(aggregate(trials), 0.8)
        assert [axes.get_title() for axes in figure.axes] == titles


def test_rates_have_their_interval_and_what_was_not_pushed_to_its_limit_says_so() -> None:
    summary = aggregate(pd.concat([trials_of("IO-WBC", "lifting", {4.0: 5}), trials_of("WBC", "lifting", {4.0: 0})]))
    _, capacity, success = comparison(summary, 0.8).axes
    assert [text.get_text() for text in capacity.texts] == ["≥ 4", "< 4"]
    assert [text.get_text() for text in success.texts] == ["5/5", "0/5"], (
        "above an interval a rate would be read as its height"
    )
    whiskers = [each.lines[2][0] for each in success.containers if isinstance(each, ErrorbarContainer)]
    intervals = [each.get_segments()[0][:, 1] for each in whiskers]
    np.testing.assert_allclose(intervals, [[56.6, 100.0], [0.0, 43.4]], atol=0.1)


def test_a_point_says_how_many_survived_where_not_all_did() -> None:
    summary = aggregate(trials_of("IO-WBC", "lifting", {2.0: 5, 4.0: 1, 8.0: 0}))
    figure = errors_against_mass(summary, "lifting")
    for axes in (*figure.axes, comparison(summary, 0.8).axes[0]):
        assert [(text.get_text(), text.get_position()[0]) for text in axes.texts] == [("1/5", 4.0)]
    assert figure.get_suptitle().startswith("Tracking errors against lifting mass, bars: 95 % intervals. In simulation")


def test_every_point_and_bar_is_below_the_upper_edge_and_axes_begin_at_zero() -> None:
    summary = aggregate(trials_of("IO-WBC", "lifting", {4.0: 5, 8.0: 0}))
    nothing_carried = aggregate(trials_of("IO-WBC", "lifting", {4.0: 0}))
    pushes = aggregate(trials_of("IO-WBC", "pushes", {4.0: 5}, "left", impulse=10.0))
    figures = [errors_against_mass(summary, "lifting"), comparison(summary, 0.8), comparison(nothing_carried, 0.8)]
    figures.append(robustness(pushes, 0.8))
    for axes in (axes for figure in figures for axes in figure.axes):
        low, high = axes.get_ylim()
        assert low == 0
        assert high > axes.dataLim.ymax * 1.05 or axes.dataLim.ymax <= 0


def test_equal_trials_give_equal_files(tmp_path: Path) -> None:
    trials = trials_of("IO-WBC", "lifting", {0.0: 5, 8.0: 0})
    for name in ("one", "two"):
        write_report(trials, tmp_path / name, 0.8)
    for path in (tmp_path / "one").rglob("*.*"):
        assert path.read_bytes() == (tmp_path / "two" / path.relative_to(tmp_path / "one")).read_bytes()
