"""Measures an exported controller on the bus: `python tests/onboard/measure.py EXPORT [--trials 5] [--seconds 60]`.

Two processes, a simulated robot and the one that drives it, exchange messages alone: in lock step, so that nothing
depends on the machine, or with `--realtime` by the clock. `--memory` samples the resources of both in
a walk.
"""

import argparse
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scripted import SETTLED, Script, simulated

from iowbc.control.sensors import quantities
from iowbc.deploy.controller import Controller
from iowbc.deploy.exported_folder import exported_folder
from iowbc.onboard.dds import DdsBus
from iowbc.onboard.log import LogWriter
from iowbc.onboard.machine import Machine, OperatorRequest, State
from iowbc.onboard.messages import Record
from iowbc.onboard.operators import Operator, OperatorWithPoses, Udp
from iowbc.onboard.process import Clock, LockStep, MonotonicClock, drive, enable_realtime, listen
from iowbc.onboard.ranges import Ranges

TASKS = {
    "stand": ("free", (), (0.0, 0.0, 0.0)),
    "walk": ("free", (), (0.4, 0.0, 0.0)),
    "carry 4 kg": ("lift", ("--mass", "4"), (0.3, 0.0, 0.0)),
    "push 30 kg": ("push", ("--mass", "30"), (0.3, 0.0, 0.0)),
}
"""Scene, options of the simulated robot, velocity [m/s, m/s, rad/s]."""
INTERVAL = 60.0
"""Between two samples of the resources [s]."""
WARM = 120.0
"""Time from which on the slope of memory is fitted [s]."""


@dataclass(frozen=True)
class Resources:
    """Resources of a process."""

    memory: float
    """Resident [MB]."""
    descriptors: int
    threads: int

    @classmethod
    def of(cls, pid: int) -> "Resources":
        """Those of a running process, by Linux's /proc."""
        process = Path(f"/proc/{pid}")
        status = dict(line.split(":", 1) for line in (process / "status").read_text().splitlines())
        memory = float(status["VmRSS"].split()[0]) / 1024.0
        return cls(memory, len(os.listdir(process / "fd")), int(status["Threads"]))

    def __str__(self) -> str:
        return f"{self.memory:.1f} | {self.descriptors} | {self.threads}"


@dataclass
class Sampled:
    """An operator that calls a function at first and every `INTERVAL`."""

    operator: Operator
    sample: Callable[[float], None]
    last: float = -np.inf

    def wanted(self, now: float, state: Record | None) -> OperatorRequest:
        if now >= self.last + INTERVAL:
            self.last = now
            self.sample(now)
        return self.operator.wanted(now, state)


def trial(
    folder: Path,
    task: str,
    seed: int,
    seconds: float,
    domain: int,
    realtime: bool = False,
    log: LogWriter | None = None,
    sample: Callable[[float, int], None] = lambda *_: None,
) -> tuple[float, str]:
    """When a robot left Run [s], and why, with the verdict of its simulation; it ends there.

    `sample` receives the robot's time [s] and its process.
    """
    scene, options, velocity = TASKS[task]
    controller = Controller.load(folder)
    machine = Machine(controller, scene)
    ends: list[str] = []
    ranges = Ranges(controller.contract)
    poses = Udp(ranges, 0)
    settings = ("--scene", scene, *options, "--seed", str(seed), "--support", "fixture", "--release", "1")
    settings += () if realtime else ("--lockstep",)
    if any(port.name in quantities(of_object=True) for port in controller.contract.inputs):
        settings += ("--object-pose", f"udp:{poses.port}")
    with simulated(folder, *settings, domain=domain) as robot:

        def tell(event: str) -> None:
            ends.append(event)
            if len(ends) > 1 and f"{State.DAMPING}:" in event:
                robot.terminate()

        def stopped() -> bool:
            return script.ended or robot.poll() is not None

        bus = DdsBus("lo", domain)
        assert listen(bus, 1.0).states
        script = Script(ranges.standing, velocity, SETTLED + seconds, robot.terminate)
        operator = OperatorWithPoses(Sampled(script, lambda now: sample(now, robot.pid)), poses)
        clock: Clock = MonotonicClock() if realtime else LockStep()
        times = drive(bus, machine, operator, clock, log=log, tell=tell, stopped=stopped)
        said, _ = robot.communicate(timeout=60)
        bus.close()
    poses.close()
    damped = next(line for line in ends[1:] if f"{State.DAMPING}:" in line)
    return float(damped.split()[0]), f"{said.strip().splitlines()[-1]}; {damped.strip()}; {times}"


def measure_memory(folder: Path, seconds: float, domain: int) -> None:
    """Prints the resources of both processes while the robot walks for so long [s], anew after each fall."""
    rows: list[tuple[float, float, float]] = []
    walked, walks = 0.0, 0
    print("| walked [s] | program [MB] | descriptors | threads | robot [MB] | descriptors | threads | log [MB] |")
    print("|---:" * 8 + "|")
    with TemporaryDirectory() as place, LogWriter(path := Path(place) / "walk.mcap", {}) as log:

        def sample(now: float, robot: int) -> None:
            time, own, other = walked + now, Resources.of(os.getpid()), Resources.of(robot)
            rows.append((time, own.memory, other.memory))
            print(f"| {time:.0f} | {own} | {other} | {path.stat().st_size / 1e6:.0f} |", flush=True)

        while walked < seconds:
            lasted, text = trial(folder, "walk", walks, seconds - walked, domain, log=log, sample=sample)
            walked, walks = walked + lasted, walks + 1
            print(text, flush=True)
    table = np.array(rows)
    warm = table[table[:, 0] >= min(WARM, table[-1, 0] / 2.0)]
    for name, memory in (("program", warm[:, 1]), ("robot", warm[:, 2])):
        print(f"{name}: {np.polyfit(warm[:, 0] / 3600.0, memory, 1)[0]:+.1f} MB an hour from {warm[0, 0]:.0f} s on")
    print(f"{walks - 1} falls in {walked:.0f} s")


def main() -> None:
    """Print a line for each trial, or a table of resources."""
    parser = argparse.ArgumentParser()
    parser.add_argument("export")
    parser.add_argument("--trials", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--domain", type=int, default=40)
    parser.add_argument("--task", action="append", choices=TASKS)
    parser.add_argument("--realtime", action="store_true")
    parser.add_argument(
        "--memory", action="store_true", help="sample resources while walking in lock step, again after each fall"
    )
    given = parser.parse_args()
    folder = exported_folder(given.export)
    if given.memory:
        measure_memory(folder, given.seconds, given.domain)
        return
    if given.realtime:
        print(enable_realtime())  # as `iowbc robot`; the simulated robot inherits the priority
    passed = dict.fromkeys(given.task or TASKS, 0)
    for seed in range(given.trials):
        for task in passed:
            lasted, text = trial(folder, task, seed, given.seconds, given.domain, given.realtime)
            ran = lasted >= SETTLED + given.seconds
            passed[task] += ran
            print(f"{task}, seed {seed}: {'passed' if ran else 'FAILED'}: {text}", flush=True)
    print("; ".join(f"{task}: {count} of {given.trials}" for task, count in passed.items()))


if __name__ == "__main__":
    main()
