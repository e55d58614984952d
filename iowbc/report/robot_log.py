"""The figure of a robot's log: what was asked for, and what it did."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from iowbc.control.command import HEIGHT, PITCH, YAW_RATE
from iowbc.onboard.errors_of_run import Run
from iowbc.results.picture import COLOURS, write_figure


def draw(run: Run, path: Path) -> None:
    """Write the figure as PNG."""
    period = np.diff(run.time, prepend=run.time[0])
    turned = run.heading[0] + np.cumsum(run.command[:, YAW_RATE] * period)
    rows = (
        ("forward velocity [m/s]", run.command[:, 0], run.velocity[:, 0]),
        ("sideways velocity [m/s]", run.command[:, 1], run.velocity[:, 1]),
        ("heading [rad]", turned, run.heading),
        ("pelvis height [m]", run.command[:, HEIGHT], run.height),
        ("torso pitch [rad]", run.command[:, PITCH], run.pitch),
    )
    figure = Figure(figsize=(9.0, 10.0), layout="constrained")
    axes = figure.subplots(len(rows), 1, sharex=True)
    for ax, (name, wanted, done) in zip(axes, rows, strict=True):
        ax.plot(run.time, done, color=COLOURS[0], linewidth=1.0, label="robot")
        ax.plot(run.time, wanted, color=COLOURS[1], linewidth=1.0, linestyle="--", label="command")
        ax.set_ylabel(name)
    axes[0].legend(loc="upper right")
    axes[-1].set_xlabel("time [s]")
    write_figure(figure, path)
