"""Aggregation, tables and figures of made-up trials."""

from pathlib import Path

import pandas as pd
import pytest

from iowbc.evaluation.report.aggregate import COSTS, aggregate, load_capacity, variants_of
from iowbc.evaluation.report.figures import comparison, errors_against_mass, style_of
from iowbc.evaluation.report.paper import LIFTING, PUSHING, VARIANTS, reported
from iowbc.evaluation.report.report import write_report
from iowbc.evaluation.report.tables import capacity_table, latex, markdown, success_table, sweep_table
from iowbc.evaluation.trials.metrics import ERRORS


def trials_of(variant: str, suite: str, survivors: dict[float, int], case: str = "") -> pd.DataFrame:
    """Five trials a mass, of which the given number survived, with errors 0.1, 0.2, ... that grow by trial."""
    rows = [
        {
            "variant": variant,
            "suite": suite,
            "case": case or suite,
            "mass": mass,
            "trial": trial,
            "survived": trial < count,
            **dict.fromkeys(ERRORS, 0.1 + 0.1 * trial),
            **dict.fromkeys(COSTS, 1.0),
        }
        for mass, count in survivors.items()
        for trial in range(5)
    ]
    return pd.DataFrame(rows)


def test_errors_are_means_over_the_survivors_alone() -> None:
    summary = aggregate(trials_of("IO-WBC", "lifting", {4.0: 3}))
    row = summary.iloc[0]
    assert (row["trials"], row["survived"]) == (5, 3)
    assert row["E_alpha"] == pytest.approx(0.2)
    assert row["E_alpha_half"] == pytest.approx(4.3027 * 0.1 / 3**0.5, abs=1e-4)
    assert row["norm"] == pytest.approx(0.4)


def test_fails_is_printed_only_where_none_survived() -> None:
    summary = aggregate(trials_of("WBC", "lifting", {0.0: 5, 7.0: 1, 8.0: 0}))
    text = markdown(sweep_table(summary, "lifting"))
    lines = {line.split("|")[1].strip(): line for line in text.splitlines() if " kg " in line}
    assert "Fails" not in lines["0 kg"]
    assert "0.100" in lines["7 kg"]
    assert "1/5" in lines["7 kg"]
    assert "Fails" not in lines["7 kg"]
    assert lines["8 kg"].count("Fails") == 8, "ours and the paper's"


def test_the_papers_numbers_stand_beside_ours() -> None:
    summary = aggregate(trials_of("IO-WBC", "pushing", {30.0: 5}))
    assert "| 0.131 | 0.016 | 0.225 | 0.143 |" in markdown(sweep_table(summary, "pushing"))


def test_the_papers_numbers_are_found_by_label_and_left_out_where_it_knows_none() -> None:
    summary = aggregate(trials_of("full", "pushing", {30.0: 5}))
    assert "| 0.131 | 0.016 | 0.225 | 0.143 |" in markdown(sweep_table(summary, "pushing", {"full": "IO-WBC"}))
    without = sweep_table(summary, "pushing", {"full": "mine"})
    assert "paper E_" not in markdown(without)
    assert {len(row) for row in without.rows} == {len(without.head)} == {len(without.latex_head)}


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
    assert len({style_of(variant, variants) for variant in variants}) == len(variants)
    assert style_of("one more", ["IO-WBC", "one more"]) != style_of("IO-WBC", ["IO-WBC", "one more"])


def test_what_was_not_evaluated_is_told_from_what_failed() -> None:
    summary = aggregate(
        pd.concat([trials_of("IO-WBC", "lifting", {4.0: 5}), trials_of("w/o RG", "pushing", {30.0: 0})])
    )
    text = markdown(capacity_table(summary, 0.8))
    assert "| IO-WBC | 4 kg | – |" in text
    assert "| w/o RG | – | Fails |" in text


def test_load_capacity_stops_at_the_first_mass_that_breaks() -> None:
    summary = aggregate(trials_of("IO-WBC", "lifting", {0.0: 5, 1.0: 4, 2.0: 3, 3.0: 5}))
    assert load_capacity(summary, "lifting", "IO-WBC", 0.8) == 1.0
    assert load_capacity(summary, "lifting", "IO-WBC", 0.6) == 3.0
    assert load_capacity(summary, "pushing", "IO-WBC", 0.6) is None
    assert "| IO-WBC | 1 kg |" in markdown(capacity_table(summary, 0.8))


def test_heavy_cases_show_rate_interval_and_the_papers_rate() -> None:
    summary = aggregate(trials_of("IO-WBC", "heavy", {18.0: 4}, "tyre"))
    text = markdown(success_table(summary))
    assert "| tyre (18 kg) | IO-WBC | 4/5 | 80 % | 38 to 96 % | 80 % |" in text


def test_latex_groups_rows_and_escapes() -> None:
    trials = pd.concat([trials_of(name, "lifting", {0.0: 5, 4.0: 5}) for name in VARIANTS])
    text = latex(sweep_table(aggregate(trials), "lifting"))
    assert text.count(r"\multirow[c]{4}{*}") == 2
    assert text.count(r"\cline{1-11}") == 2
    assert "±" not in text
    assert "95 \\% interval" in text
    assert "$E_{\\alpha}$ & $E_{h}$" in text
    assert text.count("{") == text.count("}")


def test_latex_of_a_table_without_groups_has_one_line_a_variant() -> None:
    text = latex(capacity_table(aggregate(trials_of("w/o Distill.", "lifting", {4.0: 5})), 0.8))
    assert "80 \\% success" in text
    assert "w/o Distill. & 4 kg \\\\" in text
    assert "multirow" not in text


@pytest.mark.parametrize("variants", [("IO-WBC",), VARIANTS])
def test_report_writes_every_table_and_figure(variants: tuple[str, ...], tmp_path: Path) -> None:
    parts = [trials_of(name, "lifting", {0.0: 5, 4.0: 2, 8.0: 0}) for name in variants]
    parts += [trials_of(name, "pushing", {0.0: 5, 30.0: 5}) for name in variants]
    parts += [trials_of(name, "heavy", {18.0: 1}, "tyre") for name in variants]
    summary = write_report(pd.concat(parts), tmp_path, 0.8)
    assert len(summary) == 6 * len(variants)
    names = {str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*.*")}
    assert names == {
        *(
            f"tables/{name}.{kind}"
            for name in ("lifting", "pushing", "heavy", "capacity")
            for kind in ("md", "tex", "csv")
        ),
        "tables/summary.csv",
        "figures/lifting_errors.png",
        "figures/pushing_errors.png",
        "figures/comparison.png",
    }


def test_the_comparison_has_a_panel_for_each_thing_that_was_evaluated() -> None:
    lifting, heavy = trials_of("IO-WBC", "lifting", {4.0: 5}), trials_of("IO-WBC", "heavy", {18.0: 1}, "tyre")
    for trials, titles in (
        (lifting, ["(a) error norm, lifting", "(b) load capacity at 80 % success", "(c) success rate"]),
        (heavy, ["(a) success rate"]),
    ):
        figure = comparison(aggregate(trials), 0.8)
        assert [axes.get_title() for axes in figure.axes] == titles


def test_every_point_and_bar_is_below_the_upper_edge_and_axes_begin_at_zero() -> None:
    summary = aggregate(trials_of("IO-WBC", "lifting", {4.0: 5, 8.0: 0}))
    nothing_carried = aggregate(trials_of("IO-WBC", "lifting", {4.0: 0}))
    figures = [errors_against_mass(summary, "lifting"), comparison(summary, 0.8), comparison(nothing_carried, 0.8)]
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
