"""Measures an exported controller on the bus: `python tests/onboard/measure.py EXPORT [--trials 5] [--seconds 60]`.

Two processes, a simulated robot and the one that drives it, exchange messages alone: in lock step, so that nothing
depends on the machine, or with `--realtime` by the clock.
"""

import argparse
from pathlib import Path

from scripted import SETTLED, Script, simulated

from iowbc.deploy.controller import Controller
from iowbc.deploy.exported_folder import exported_folder
from iowbc.onboard.dds import DdsBus
from iowbc.onboard.machine import Machine, State
from iowbc.onboard.operators import Ranges
from iowbc.onboard.process import Clock, LockStep, MonotonicClock, drive, listen

TASKS = {
    "stand": ("free", (), (0.0, 0.0, 0.0)),
    "walk": ("free", (), (0.4, 0.0, 0.0)),
    "carry 4 kg": ("lift", ("--mass", "4"), (0.3, 0.0, 0.0)),
    "push 30 kg": ("push", ("--mass", "30"), (0.3, 0.0, 0.0)),
}
"""Scene, options of the simulated robot, velocity [m/s, m/s, rad/s]."""


def trial(folder: Path, task: str, seed: int, seconds: float, domain: int, realtime: bool) -> tuple[bool, str]:
    """Whether a robot was in Run until the end, what its simulation says of that moment, and what damped it."""
    scene, options, velocity = TASKS[task]
    controller = Controller.load(folder)
    machine = Machine(controller, scene)
    ends: list[str] = []
    settings = ("--scene", scene, *options, "--seed", str(seed), "--support", "fixture", "--release", "1")
    settings += () if realtime else ("--lockstep",)
    with simulated(folder, *settings, domain=domain) as robot:
        bus = DdsBus("lo", domain)
        assert listen(bus, 1.0).states
        script = Script(Ranges(controller.contract).standing, velocity, SETTLED + seconds, robot.terminate)
        clock: Clock = MonotonicClock() if realtime else LockStep()
        times = drive(bus, machine, script, clock, tell=ends.append, stopped=lambda: robot.poll() is not None)
        said, _ = robot.communicate(timeout=60)
        bus.close()
    damped = next(line for line in ends[1:] if f"{State.DAMPING}:" in line)
    return float(damped.split()[0]) >= SETTLED + seconds, f"{said.strip().splitlines()[-1]}; {damped.strip()}; {times}"


def main() -> None:
    """Print a line for each trial."""
    parser = argparse.ArgumentParser()
    parser.add_argument("export")
    parser.add_argument("--trials", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--domain", type=int, default=40)
    parser.add_argument("--task", action="append", choices=TASKS)
    parser.add_argument("--realtime", action="store_true")
    given = parser.parse_args()
    folder = exported_folder(given.export)
    passed = dict.fromkeys(given.task or TASKS, 0)
    for seed in range(given.trials):
        for task in passed:
            ran, text = trial(folder, task, seed, given.seconds, given.domain, given.realtime)
            passed[task] += ran
            print(f"{task}, seed {seed}: {'passed' if ran else 'FAILED'}: {text}", flush=True)
    print("; ".join(f"{task}: {count} of {given.trials}" for task, count in passed.items()))


if __name__ == "__main__":
    main()
