"""`iowbc report EXPORT --log MCAP`: events, errors and a figure of a robot's log."""

import json
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Console

from iowbc.commands import options
from iowbc.commands.printed import plain_table, shown_path, tell
from iowbc.deploy.controller import Controller
from iowbc.deploy.exported_folder import RECIPE, exported_folder
from iowbc.errors import UsageError

if TYPE_CHECKING:
    from iowbc.onboard.errors_of_run import LoggedRun


def report_log(console: Console, what: str, log: Path, output: Path) -> None:
    """Replay the log, print its events and errors, and plot it. Raises UsageError."""
    options.require_extra("robot", "iowbc report --log")
    options.require_extra("train", "iowbc report --log")
    if output.suffix != ".png":
        raise UsageError(f"--output {output}: the figure of a log is a PNG file; give a name that ends in .png")
    from iowbc.onboard.errors_of_run import UNITS, read_run
    from iowbc.onboard.log import is_cut, read_messages, replay

    folder = exported_folder(what)
    controller = Controller.load(folder)
    turns, different = replay(log, folder)
    tell(console, f"{turns} commands replayed, {f'{different} differ' if different else 'all bit for bit the same'}")
    if is_cut(log):
        tell(console, f"{log} has no end: what came after these commands is missing")
    for topic, _, data in read_messages(log):
        if topic in ("event", "timing"):
            tell(console, f"  {json.loads(data)['text']}")
    contract = controller.contract
    run = read_run(log, controller.robot, contract.control_frequency, contract.references.gait.frequency)
    table = plain_table("error", "mean", "95th percentile", "unit")
    for name, values in run.deviations().items():
        table.add_row(name, f"{np.mean(values):.3f}", f"{np.quantile(values, 0.95):.3f}", UNITS[name])
    console.print(table)
    if json.loads((folder / RECIPE).read_text(encoding="utf-8"))["rg"]["height"] == "com":
        tell(console, "E_h compares the pelvis with the commanded height of the centre of mass, which no log has")
    _draw(run, output)
    tell(console, f"{shown_path(output)}: command and robot over time")


def _draw(run: "LoggedRun", path: Path) -> None:
    """Plot command and measured motion over time as PNG."""
    from matplotlib.figure import Figure

    from iowbc.control.command import HEIGHT, PITCH
    from iowbc.results.picture import COLOURS, write_figure

    rows = (
        ("forward velocity [m/s]", run.command[:, 0], run.velocity[:, 0]),
        ("sideways velocity [m/s]", run.command[:, 1], run.velocity[:, 1]),
        ("heading [rad]", run.wanted_heading, run.heading),
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
