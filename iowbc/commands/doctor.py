"""`iowbc doctor`: fitness of this machine to run a recipe, and the remedy where it is not fit."""

import importlib.metadata
import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import typer
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
from rich.table import Table
from rich.text import Text

from iowbc.commands import options
from iowbc.commands.printed import stdout_console
from iowbc.pipeline.console.wording import duration
from iowbc.pipeline.store.runs import Runs, obstacle
from iowbc.processes import available_cores

Verdict = Literal["good", "doubtful", "bad"]
STYLES = {"good": "green", "doubtful": "yellow", "bad": "bold red"}
LEAST_MEMORY = 4e9
"""Memory that the quickstart recipe needs for its worker processes [bytes]."""
LEAST_DISK = 5e9
"""Disk that a full run and its tracking take [bytes]."""
PATIENCE = 120.0
"""Time limit of a check that runs in a separate process [s]."""

CONTACT_MODEL = """
import crocoddyl, numpy, pinocchio
model = pinocchio.Model()
joint = model.addJoint(0, pinocchio.JointModelFreeFlyer(), pinocchio.SE3.Identity(), "root_joint")
model.appendBodyToJoint(joint, pinocchio.Inertia.Random(), pinocchio.SE3.Identity())
frame = model.addFrame(pinocchio.Frame("foot", joint, 0, pinocchio.SE3.Identity(), pinocchio.FrameType.OP_FRAME))
state = crocoddyl.StateMultibody(model)
contact = crocoddyl.ContactModel6D(
    state, frame, pinocchio.SE3.Identity(), pinocchio.LOCAL, state.nv, numpy.zeros(2))
x = state.zero()
data = pinocchio.Data(model)
pinocchio.forwardKinematics(model, data, x[:7], x[7:], numpy.zeros(6))
pinocchio.computeJointJacobians(model, data)
pinocchio.updateFramePlacements(model, data)
made = contact.createData(data)
contact.calc(made, x)
assert numpy.isfinite(made.Jc).all() and abs(made.Jc).sum() > 0
"""
"""Computes a contact of a free body; mismatched binaries of crocoddyl and pinocchio crash here."""

PICTURE = """
from iowbc.sim.rendering import backend as headless
chosen = headless.backend()
context = headless.context(64, 64)
import mujoco
model = mujoco.MjModel.from_xml_string("<mujoco><worldbody><light pos='0 0 3'/><geom size='1'/></worldbody></mujoco>")
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
renderer = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
context.free()
print(chosen)
"""
"""Sets up off-screen rendering."""


@dataclass(frozen=True)
class Finding:
    """Result of one check."""

    name: str
    verdict: Verdict
    text: str


def doctor(runs: options.RunsFolder = options.RUNS) -> None:
    """Print all findings; exits with 1 where something essential fails, else 0."""
    console = stdout_console()
    table = Table(box=None, padding=(0, 1), show_header=False)
    table.add_column(no_wrap=True)
    table.add_column(no_wrap=True)
    table.add_column(overflow="fold")
    found = list(findings(Runs(runs)))
    for one in found:
        table.add_row(one.name, Text(one.verdict, style=STYLES[one.verdict]), Text(one.text))
    console.print(table)
    fit = all(one.verdict != "bad" for one in found)
    console.print("fit to run recipes" if fit else "not fit to run recipes: see the lines marked bad", highlight=False)
    raise typer.Exit(0 if fit else 1)


def findings(runs: Runs) -> Iterator[Finding]:
    """All findings, essential ones first."""
    yield _python()
    yield from _packages()
    yield from _robots()
    yield _process(
        "crocoddyl and pin",
        CONTACT_MODEL,
        "a contact model computes",
        "bad",
        "a contact model does not compute: {}; the binaries must match: "
        "`pip install crocoddyl==3.2.1 pin==4.0.0 libpinocchio==4.0.0`",
    )
    yield _process("pictures", PICTURE, "drawn without a screen by ", "doubtful", "none, and no films: {}")
    cores = available_cores()
    yield Finding("cores", "good" if cores > 1 else "doubtful", f"{cores} of {os.cpu_count()}")
    yield _memory()
    yield _disk(runs)
    yield _tracking(runs)


def _python() -> Finding:
    version, wanted = platform.python_version(), importlib.metadata.metadata("iowbc")["Requires-Python"]
    fits = SpecifierSet(wanted).contains(version, prereleases=True)
    return Finding("Python", "good" if fits else "bad", version if fits else f"{version}; Python {wanted} is needed")


def _packages() -> Iterator[Finding]:
    """Installed versions against the requirements of iowbc and its extra `train`."""
    fitting = []
    for requirement in map(Requirement, importlib.metadata.requires("iowbc") or []):
        if requirement.marker is not None and not requirement.marker.evaluate({"extra": "train"}):
            continue
        wanted = f"{requirement.name}{requirement.specifier}"
        try:
            version = importlib.metadata.version(requirement.name)
        except importlib.metadata.PackageNotFoundError:
            yield Finding(requirement.name, "bad", f"not installed; `pip install '{wanted}'`")
            continue
        if requirement.specifier.contains(version, prereleases=True):
            fitting.append(f"{requirement.name} {version}")
        else:
            yield Finding(
                requirement.name, "bad", f"{version} is not {requirement.specifier}; `pip install '{wanted}'`"
            )
    yield Finding("packages", "good", ", ".join(fitting))


def _robots() -> Iterator[Finding]:
    from iowbc.robot.description import load_robot, robot_folders

    folders = robot_folders()
    if not folders:
        yield Finding("robot", "bad", "no description of any robot is there; install iowbc again")
    for folder in folders.values():
        try:
            robot = load_robot(folder)
        except (OSError, ValueError) as error:
            yield Finding(f"robot {folder.name}", "bad", str(error))
        else:
            yield Finding(f"robot {robot.name}", "good", f"{len(robot.joints)} joints, {folder}")


def _process(name: str, script: str, good: str, worst: Verdict, trouble: str) -> Finding:
    """Run a check where a crash does no harm; `good` comes before its output, and its reason is put into `trouble`."""
    command = [sys.executable, "-c", script]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    except subprocess.TimeoutExpired:
        return Finding(name, "bad", f"no answer within {duration(PATIENCE)}")
    if done.returncode == 0:
        return Finding(name, "good", good + done.stdout.strip())
    last = (done.stderr.strip().splitlines()[-1:] or [""])[0]
    crash = f"it crashes (signal {-done.returncode})" if done.returncode < 0 else ""
    return Finding(name, worst, trouble.format(crash or last.partition("NoRenderer: ")[2] or last))


def _memory() -> Finding:
    import psutil

    memory = psutil.virtual_memory()
    text = f"{memory.available / 1e9:.1f} GB free of {memory.total / 1e9:.1f} GB"
    scarce = memory.available < LEAST_MEMORY
    return Finding("memory", "doubtful" if scarce else "good", text + "; fewer --workers need less" * scarce)


def _disk(runs: Runs) -> Finding:
    if reason := obstacle(runs.root):
        return Finding("disk", "bad", f"{runs.root} cannot be written: {reason}; give another with --runs")
    free = shutil.disk_usage(runs.root).free
    text = f"{free / 1e9:.1f} GB free in {runs.root.absolute()}"
    return Finding("disk", "good" if free > LEAST_DISK else "doubtful", text)


def _tracking(runs: Runs) -> Finding:
    from iowbc.pipeline.tracking.delivery import tracking_uri
    from iowbc.pipeline.tracking.tracker import backlog

    waiting = len(backlog(runs))
    text = (tracking_uri() or str(runs.database)) + (f"; {waiting} runs are not sent whole yet" if waiting else "")
    return Finding("tracking", "doubtful" if waiting else "good", text)
