"""Table and figure of the linear probe: true object mass and mass inferred from the policy's observations."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from sklearn.metrics import root_mean_squared_error

from iowbc.evaluation.probe import PRIVILEGED
from iowbc.evaluation.report.aggregate import variants_of
from iowbc.evaluation.report.captions import partner
from iowbc.evaluation.report.figures import finish, style_of
from iowbc.evaluation.report.statistics import determination_interval, r_squared
from iowbc.results.picture import write_figure
from iowbc.results.table import Column, Table, heads, measured, write_table

LINES = ("-", "--", ":")
"""Line styles of the sources, in order, without s_priv, which contains the mass. Several variants show two sources."""
LOWEST = -0.25
"""Lower limit of R² in the figure. R² below 0 is worse than predicting the mean of all masses."""
LEAST_TRIALS = 10
"""Minimum number of ongoing trials for R² at a time."""


def write_probe(inferred: pd.DataFrame, folder: Path) -> pd.DataFrame:
    """Write the table `probe` and its figure under `folder`; returns the table's numbers. inferred: `probe.parquet` of
    one variant, or of several one after another."""
    table = probe_table(inferred)
    write_table(table, folder / "tables")
    write_figure(probe_figure(inferred), folder / "figures" / "probe.png")
    return table.numbers


def probe_table(inferred: pd.DataFrame) -> Table:
    """Accuracy of the inferred mass: of single readings, of means over a second and of means over a trial."""
    settled = inferred[inferred["settled"]]
    variants = variants_of(settled)
    numbers = [
        {"source": source, "variant": variant, **figures_of(own)}
        for source, found in settled.groupby("source", sort=False)
        for variant in variants
        if len(own := found[found["variant"] == variant])
    ]
    rows = [
        (
            f"{one['source']} ({one['size']:.0f})",
            one["variant"],
            f"{one['readings']:.0f}",
            f"{one['R2']:.3f}",
            f"{one['R2_low']:.2f} to {one['R2_high']:.2f}",
            f"{one['RMSE']:.2f}",
            measured(one["R2_second"]),
            measured(one["R2_trial"]),
        )
        for one in numbers
    ]
    head = ("Read from", "Algorithm", "Readings", "R²", "95 % interval", "RMSE [kg]", "R² of 1 s", "R² of a trial")
    columns = [Column(name, latex=name.replace("R²", "$R^2$")) for name in head]
    caption = (
        "Linear probe: a ridge regression of the object's mass, fitted to half of the trials and tested on the others. "
        f"{_circumstances(inferred)} In brackets: number of inputs. Readings begin when the history is full; R² of 1 s "
        "and of a trial: of the means of their readings; the interval is over trials. s_priv contains the mass itself "
        "among all quantities drawn, and thus tests the probe."
    )
    return Table("probe", caption, heads(*columns), rows, pd.DataFrame(numbers))


def figures_of(found: pd.DataFrame) -> dict[str, float]:
    """Statistics of one source and variant, by name; R² also of means over a second and over a trial."""
    mass, read = found["mass"].to_numpy(), found["inferred"].to_numpy()
    low, high = determination_interval(mass, read, found["trial"].to_numpy())
    seconds = found.assign(second=np.floor(found["seconds"])).groupby(["trial", "second"])[["mass", "inferred"]].mean()
    trials = found.groupby("trial")[["mass", "inferred"]].mean()
    return {
        "size": float(found["size"].iloc[0]),
        "trials": float(len(trials)),
        "readings": float(len(found)),
        "R2": r_squared(mass, read),
        "R2_low": low,
        "R2_high": high,
        "RMSE": root_mean_squared_error(mass, read),
        "R2_second": r_squared(*seconds.to_numpy().T),
        "R2_trial": r_squared(*trials.to_numpy().T),
        "RMSE_trial": root_mean_squared_error(*trials.to_numpy().T),
    }


def probe_figure(inferred: pd.DataFrame) -> Figure:
    """Inferred over true mass in the test trials, and R² over the time since the grasp."""
    figure = Figure(figsize=(10.5, 4.9), layout="constrained")
    panels = list(figure.subplots(1, 2))
    source, settled = str(inferred["source"].iloc[0]), inferred[inferred["settled"]]
    _scatter(panels[0], settled[settled["source"] == source], variants_of(inferred), source)
    _growth(panels[1], inferred)
    for axes in panels:
        axes.grid(True, color="0.9")
        axes.spines[["top", "right"]].set_visible(False)
    title = f"Linear probe of the object's mass. {_circumstances(inferred)}\n"
    return finish(figure, panels, f"{title}rings: mean of a trial; dots: single readings; grey: as it is")


def _scatter(axes: Axes, chosen: pd.DataFrame, variants: Sequence[str], source: str) -> None:
    ends = (float(chosen["mass"].min()), float(chosen["mass"].max()))
    axes.plot(ends, ends, color="0.55", linestyle="--", linewidth=1.2, zorder=0)
    for variant in variants_of(chosen):
        found = chosen[chosen["variant"] == variant]
        one, means = figures_of(found), found.groupby("trial")[["mass", "inferred"]].mean()
        colour = style_of(variant, variants)["color"]
        axes.plot(found["mass"], found["inferred"], ".", color=colour, markersize=2, alpha=0.35, zorder=1)
        label = f"{variant}: R² {one['R2']:.2f}, RMSE {one['RMSE']:.2f} kg\n(trial's mean {one['R2_trial']:.2f}, "
        label += f"{one['RMSE_trial']:.2f} kg)"
        axes.plot(means["mass"], means["inferred"], "o", color=colour, markerfacecolor="white", label=label, zorder=2)
    axes.set(title=f"mass read from the {source}", xlabel="true mass [kg]", ylabel="inferred mass [kg]")
    axes.legend(fontsize=8, loc="upper left", frameon=False)


def _growth(axes: Axes, inferred: pd.DataFrame) -> None:
    """R² over time, from the trials ongoing at each time."""
    variants = variants_of(inferred)
    sources = [each for each in dict.fromkeys(inferred["source"]) if each != PRIVILEGED]
    lines = LINES if len(variants) == 1 else LINES[:2]
    for variant in variants:
        for source, line in zip(sources, lines, strict=False):
            found = inferred[(inferred["source"] == source) & (inferred["variant"] == variant)]
            values = {
                seconds: r_squared(at["mass"].to_numpy(), at["inferred"].to_numpy())
                for seconds, at in found.groupby("seconds")
                if len(at) >= LEAST_TRIALS
            }
            if values:
                label = source if len(variants) == 1 else f"{variant}, {source}"
                colour = style_of(variant, variants)["color"]
                axes.plot(list(values), list(values.values()), color=colour, linestyle=line, label=label)
    axes.set(title="how soon it is known", xlabel="time since the grasp [s]", ylabel="R² of a single reading")
    axes.set_ylim(LOWEST, 1.05)
    axes.legend(fontsize=8, loc="lower right", frameon=False)


def _circumstances(inferred: pd.DataFrame) -> str:
    count = inferred.groupby("variant")["trial"].nunique().max()
    low, high = inferred["mass"].min(), inferred["mass"].max()
    scene = inferred["scene"].iloc[0]
    return f"In simulation, {scene}, {low:.1f} to {high:.1f} kg in {count} trials, {partner(inferred)}."
