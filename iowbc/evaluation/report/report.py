"""Tables and figures of the trials of one or several variants, for `eval` and `compare`."""

from collections.abc import Mapping
from pathlib import Path

import pandas as pd

from iowbc.evaluation.report import figures, interaction, limits
from iowbc.evaluation.report.aggregate import TRAINING, aggregate, stepping_commanded, suites_of, with_trainings
from iowbc.evaluation.report.differences import difference_table
from iowbc.evaluation.report.error_tables import SWEPT, error_table, moving_table, paper_table, slug
from iowbc.evaluation.report.interquartile import interquartile_table
from iowbc.results.picture import write_figure
from iowbc.results.table import Table, write_table


def write_report(
    trials: pd.DataFrame, folder: Path, capacity_rate: float, labels: Mapping[str, str] | None = None
) -> pd.DataFrame:
    """Write `tables/` and `figures/` under `folder`; returns the summary, see `aggregate`.

    trials: long table of one `trials.parquet`, or several concatenated; `training_seed` identifies the trainings of a
    variant.
    capacity_rate: success rate that a mass must reach to count as carried.
    labels: `eval.label` of each variant with another name here, to find the paper's numbers for it.
    """
    tables, summary = folder / "tables", aggregate(trials, labels)
    for table in report_tables(trials, summary, capacity_rate):
        write_table(table, tables)
    pictures = {
        f"{slug(suite)}_errors": figures.errors_against_mass(summary, suite) for suite in suites_of(summary, *SWEPT)
    }
    if suites_of(summary, *SWEPT, "heavy"):
        pictures["comparison"] = figures.comparison(summary, capacity_rate)
    if suites_of(summary, "robustness", "stagnation", "pushes"):
        pictures["robustness"] = figures.robustness(summary, capacity_rate)
    if suites_of(summary, "compliance", "impedance"):
        pictures["compliance"] = interaction.compliance_figure(summary)
    if suites_of(summary, interaction.MAP):
        pictures["push_map"] = interaction.map_figure(summary)
    for name, figure in pictures.items():
        write_figure(figure, folder / "figures" / f"{name}.png")
    summary.to_csv(tables / "summary.csv", index=False, float_format="%.9g")
    return summary


def report_tables(trials: pd.DataFrame, summary: pd.DataFrame, capacity_rate: float) -> list[Table]:
    """All tables that apply to the trials: walking only if it was commanded, joints only if a trial survived."""
    swept, kinds = suites_of(summary, *SWEPT), set(summary["kind"])
    walked = [suite for suite in swept if stepping_commanded(summary[summary["suite"] == suite])]
    several = len(with_trainings(trials)[["variant", TRAINING]].drop_duplicates()) > 1
    survived = not limits.heaviest(summary).empty
    tables = [
        *(error_table(summary, suite) for suite in swept),
        paper_table(summary),
        *(moving_table(summary, suite) for suite in walked),
        *(error_table(summary, suite) for suite in suites_of(summary, "stagnation", "robustness")),
        limits.success_table(summary) if "heavy" in kinds else None,
        error_table(summary, "heavy", name="heavy_errors") if "heavy" in kinds else None,
        limits.capacity_table(summary, capacity_rate) if swept else None,
        limits.push_table(summary, capacity_rate) if "pushes" in kinds else None,
        interaction.compliance_table(summary) if "compliance" in kinds else None,
        interaction.impedance_table(summary) if "impedance" in kinds else None,
        interaction.map_table(summary) if interaction.MAP in kinds else None,
        limits.joint_table(summary) if survived else None,
        limits.contact_table(summary) if survived else None,
        difference_table(trials) if several else None,
        interquartile_table(trials) if several else None,
    ]
    return [table for table in tables if table is not None]
