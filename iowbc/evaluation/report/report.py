"""Tables and figures from the trials of one variant or of several, as `eval` writes them and `compare` joins them."""

from collections.abc import Mapping
from pathlib import Path

import pandas as pd

from iowbc.evaluation.report.aggregate import aggregate
from iowbc.evaluation.report.figures import comparison, errors_against_mass, write_figure
from iowbc.evaluation.report.tables import NO_LABELS, capacity_table, success_table, sweep_table, write_table


def write_report(
    trials: pd.DataFrame, folder: Path, capacity_rate: float, labels: Mapping[str, str] = NO_LABELS
) -> pd.DataFrame:
    """Write `tables/` and `figures/` under `folder`; returns the summary, one row for each variant, suite and mass.

    trials: the long table of `trials.parquet`, one or several of them concatenated.
    capacity_rate: success rate that a mass must reach to count as carried.
    labels: `eval.label` of each variant that goes by another name here, to find the paper's numbers for it.
    """
    tables, figures = folder / "tables", folder / "figures"
    tables.mkdir(parents=True, exist_ok=True)
    figures.mkdir(parents=True, exist_ok=True)
    summary = aggregate(trials)
    swept = [suite for suite in ("lifting", "pushing") if (summary["suite"] == suite).any()]
    for suite in swept:
        write_table(sweep_table(summary, suite, labels), tables)
        write_figure(errors_against_mass(summary, suite), figures / f"{suite}_errors.png")
    if (summary["suite"] == "heavy").any():
        write_table(success_table(summary, labels), tables)
    if swept:
        write_table(capacity_table(summary, capacity_rate), tables)
    write_figure(comparison(summary, capacity_rate), figures / "comparison.png")
    summary.to_csv(tables / "summary.csv", index=False)
    return summary
