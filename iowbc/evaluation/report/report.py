"""Tables and figures from the trials of one variant or of several, as `eval` writes them and `compare` joins them."""

from collections.abc import Mapping
from pathlib import Path

import pandas as pd

from iowbc.evaluation.report.aggregate import TRAINING, aggregate, asks_for_steps, suites_of, with_trainings
from iowbc.evaluation.report.beside_paper import paper_table
from iowbc.evaluation.report.compliance import compliance_figure, compliance_table, impedance_table
from iowbc.evaluation.report.differences import difference_table
from iowbc.evaluation.report.error_tables import NO_LABELS, SWEPT, error_table, moving_table, slug
from iowbc.evaluation.report.figures import comparison, errors_against_mass, robustness, write_figure
from iowbc.evaluation.report.interquartile import interquartile_table
from iowbc.evaluation.report.other_tables import (
    capacity_table,
    contact_table,
    heaviest,
    joint_table,
    push_table,
    success_table,
)
from iowbc.evaluation.report.push_map import MAP, map_figure, map_table
from iowbc.evaluation.report.tables import Table, write_table


def write_report(
    trials: pd.DataFrame, folder: Path, capacity_rate: float, labels: Mapping[str, str] = NO_LABELS
) -> pd.DataFrame:
    """Write `tables/` and `figures/` under `folder`; returns the summary, one row for each variant, suite and mass.

    trials: the long table of `trials.parquet`, one or several of them concatenated; `training_seed` tells the trainings
    of a variant apart.
    capacity_rate: success rate that a mass must reach to count as carried.
    labels: `eval.label` of each variant that goes by another name here, to find the paper's numbers for it.
    """
    tables, figures = folder / "tables", folder / "figures"
    tables.mkdir(parents=True, exist_ok=True)
    figures.mkdir(parents=True, exist_ok=True)
    summary = aggregate(trials)
    for table in report_tables(trials, summary, capacity_rate, labels):
        write_table(table, tables)
    for suite in suites_of(summary, *SWEPT):
        write_figure(errors_against_mass(summary, suite), figures / f"{slug(suite)}_errors.png")
    if suites_of(summary, *SWEPT, "heavy"):
        write_figure(comparison(summary, capacity_rate), figures / "comparison.png")
    if suites_of(summary, "robustness", "stagnation", "pushes"):
        write_figure(robustness(summary, capacity_rate), figures / "robustness.png")
    if suites_of(summary, "compliance", "impedance"):
        write_figure(compliance_figure(summary), figures / "compliance.png")
    if suites_of(summary, MAP):
        write_figure(map_figure(summary), figures / "push_map.png")
    summary.to_csv(tables / "summary.csv", index=False)
    return summary


def report_tables(
    trials: pd.DataFrame, summary: pd.DataFrame, capacity_rate: float, labels: Mapping[str, str]
) -> list[Table]:
    """All tables that the trials give; of walking and of joints only where somebody was to walk, or survived."""
    swept, kinds = suites_of(summary, *SWEPT), set(summary["kind"])
    tables = [error_table(summary, suite, labels) for suite in swept]
    beside = paper_table(summary, labels)
    tables += [] if beside is None else [beside]
    tables += [moving_table(summary, suite) for suite in swept if asks_for_steps(summary[summary["suite"] == suite])]
    tables += [error_table(summary, suite) for suite in suites_of(summary, "stagnation", "robustness")]
    if "heavy" in kinds:
        tables += [success_table(summary, labels), error_table(summary, "heavy", name="heavy_errors")]
    if swept:
        tables.append(capacity_table(summary, capacity_rate))
    if "pushes" in kinds:
        tables.append(push_table(summary, capacity_rate))
    special = {"compliance": compliance_table, "impedance": impedance_table, MAP: map_table}
    tables += [table(summary) for kind, table in special.items() if kind in kinds]
    if not heaviest(summary).empty:
        tables += [joint_table(summary), contact_table(summary)]
    several = len(with_trainings(trials)[["variant", TRAINING]].drop_duplicates()) > 1
    together = [difference_table(trials), interquartile_table(trials)] if several else []
    return [*tables, *(table for table in together if table is not None)]
