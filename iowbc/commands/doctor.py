"""`iowbc doctor`: fitness of this machine to run a recipe, and the remedy where it is not fit."""

import contextlib
import importlib.metadata
import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Iterator
from typing import Literal, NamedTuple

import psutil
from packaging.requirements import Requirement
from rich.text import Text
from typer import Exit

from iowbc.commands import options
from iowbc.commands.printed import plain_table, stdout_console
from iowbc.pipeline.console.wording import duration
from iowbc.pipeline.store.runs import Runs, obstacle
from iowbc.pipeline.tracking.delivery import tracking_uri
from iowbc.pipeline.tracking.tracker import backlog
from iowbc.processes import available_cores
from iowbc.robot.description import load_robot, robot_folders

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
from iowbc.sim.rendering.offscreen import Offscreen, backend, mujoco
model = mujoco.MjModel.from_xml_string("<mujoco/>")
with Offscreen(model, width=64, height=64, distance=1.0, azimuth=0.0, elevation=0.0) as picture:
    picture.draw(mujoco.MjData(model))
print(backend())
"""


class Finding(NamedTuple):
    """Result of one check."""

    name: str
    verdict: Verdict
    text: str


def doctor(runs: options.RunsFolder = options.RUNS) -> None:
    """Print all findings; exits with 1 where something essential fails, else 0."""
    console = stdout_console()
    table = plain_table("check", "", "found")
    found = list(findings(Runs(runs)))
    for name, verdict, text in found:
        table.add_row(name, Text(verdict, style=STYLES[verdict]), Text(text))
    console.print(table)
    fit = all(one.verdict != "bad" for one in found)
    console.print("fit to run recipes" if fit else "not fit to run recipes: see the lines marked bad", highlight=False)
    raise Exit(0 if fit else 1)


def findings(runs: Runs) -> Iterator[Finding]:
    """All findings, essential ones first."""
    yield Finding("Python", "good", platform.python_version())
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
    memory = psutil.virtual_memory()
    scarce = memory.available < LEAST_MEMORY
    text = f"{memory.available / 1e9:.1f} GB free of {memory.total / 1e9:.1f} GB"
    yield Finding("memory", "doubtful" if scarce else "good", text + "; fewer --workers need less" * scarce)
    if reason := obstacle(runs.root):
        yield Finding("disk", "bad", f"{runs.root} cannot be written: {reason}; give another with --runs")
    else:
        free = shutil.disk_usage(runs.root).free
        text = f"{free / 1e9:.1f} GB free in {runs.root.absolute()}"
        yield Finding("disk", "good" if free > LEAST_DISK else "doubtful", text)
    waiting = len(backlog(runs))
    text = (tracking_uri() or str(runs.database)) + (f"; {waiting} runs are not sent whole yet" if waiting else "")
    yield Finding("tracking", "doubtful" if waiting else "good", text)


def _packages() -> Iterator[Finding]:
    """Installed versions against the requirements of iowbc and its extra `train`."""
    fitting = []
    for requirement in map(Requirement, importlib.metadata.requires("iowbc") or []):
        if requirement.marker is not None and not requirement.marker.evaluate({"extra": "train"}):
            continue
        name, wanted = requirement.name, requirement.specifier
        try:
            version = importlib.metadata.version(name)
            wrong = "" if wanted.contains(version, prereleases=True) else f"{version} is not {wanted}"
        except importlib.metadata.PackageNotFoundError:
            wrong = "not installed"
        if wrong:
            yield Finding(name, "bad", f"{wrong}; `pip install '{name}{wanted}'`")
        else:
            fitting.append(f"{name} {version}")
    yield Finding("packages", "good", ", ".join(fitting))


def _robots() -> Iterator[Finding]:
    if not (folders := robot_folders()):
        yield Finding("robot", "bad", "no description of any robot is there; install iowbc again")
    for folder in folders.values():
        try:
            robot = load_robot(folder)
            with contextlib.suppress(ImportError):
                from mujoco import MjModel

                MjModel.from_xml_path(str(robot.mjcf))
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
        return Finding(name, worst, f"no answer within {duration(PATIENCE)}")
    if done.returncode == 0:
        return Finding(name, "good", good + done.stdout.strip())
    last = (done.stderr.strip().splitlines()[-1:] or [""])[0]
    crash = f"it crashes (signal {-done.returncode})" if done.returncode < 0 else ""
    return Finding(name, worst, trouble.format(crash or last.partition("NoRenderer: ")[2] or last))
