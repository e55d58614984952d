"""`iowbc report EXPORT --log MCAP`: the log of a robot, replayed and drawn."""

from pathlib import Path

import numpy as np
from rich.console import Console

from iowbc.commands.needs import require_training
from iowbc.commands.printed import plain_table, shown_path, tell
from iowbc.commands.robot import require_bus
from iowbc.deploy.controller import Controller
from iowbc.deploy.exported_folder import exported_folder
from iowbc.errors import UsageError


def report_log(console: Console, what: str, log: Path, output: Path) -> None:
    """Print what happened, replay the log, and draw it. Raises UsageError."""
    require_bus("report --log")
    require_training("report --log")
    if output.suffix != ".png":
        raise UsageError(f"--output {output}: the figure of a log is a PNG file; give a name that ends in .png")
    import json

    from iowbc.onboard.errors_of_run import UNITS, read_run
    from iowbc.onboard.log import read_messages
    from iowbc.onboard.replay import replay
    from iowbc.report.robot_log import draw

    folder = exported_folder(what)
    controller = Controller.load(folder)
    replayed = replay(log, folder)
    end = "all bit for bit the same" if not replayed.different else f"{replayed.different} differ"
    tell(console, f"{replayed.turns} commands replayed, {end}")
    for topic, _, data in read_messages(log):
        if topic in ("event", "timing"):
            tell(console, f"  {json.loads(data)['text']}")
    contract = controller.contract
    run = read_run(log, controller.robot, contract.control_frequency, contract.references.gait.frequency)
    table = plain_table("error", "mean", "95th percentile", "unit")
    for name, values in run.deviations().items():
        table.add_row(name, f"{np.mean(values):.3f}", f"{np.quantile(values, 0.95):.3f}", UNITS[name])
    console.print(table)
    draw(run, output)
    tell(console, f"{shown_path(output)}: command and robot over time")
