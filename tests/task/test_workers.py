"""Worker processes: quick to start, noticed when they fail, and gone with their parent."""

import functools
import operator
import os
import signal
import subprocess
import sys
import textwrap
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pytest
from faulty import StepBy
from task_worlds import actions

from iowbc.errors import WorkerFailed
from iowbc.task.specification import Specification
from iowbc.task.vector.vector_env import VectorEnv
from iowbc.task.vector.workers import WorkerProcesses

Make = Callable[..., VectorEnv]
SOON = 60.0
"""What "within seconds" means here [s]."""


def processes_of(env: VectorEnv) -> list[int]:
    assert isinstance(env.workers, WorkerProcesses)
    return env.workers.processes


def gone(processes: list[int], patience: float = SOON) -> bool:
    """Whether all processes end in time."""
    deadline = time.monotonic() + patience
    while time.monotonic() < deadline:
        if not any(psutil.pid_exists(pid) and psutil.Process(pid).status() != "zombie" for pid in processes):
            return True
        time.sleep(0.02)
    return False


def test_workers_do_not_import_what_only_the_learner_needs(make: Make) -> None:
    env = make(num_envs=2, workers=1)
    maps = Path(f"/proc/{processes_of(env)[0]}/maps").read_text()
    assert "mujoco" in maps
    assert not [name for name in ("libtorch", "pandas", "pinocchio", "matplotlib") if name in maps]


def test_closing_ends_the_workers_and_may_be_repeated(make: Make) -> None:
    env = make(num_envs=4, workers=2)
    env.reset()
    processes = processes_of(env)
    env.close()
    env.close()
    assert gone(processes)
    with pytest.raises(WorkerFailed, match="have ended"):
        env.step(actions(0, 4))


def test_a_forgotten_environment_takes_its_workers_along(make: Make, folder: Path, recipe: Any) -> None:
    env = VectorEnv(Specification(recipe, folder), num_envs=2, workers=2, seed=0)
    processes = processes_of(env)
    del env
    assert gone(processes)


def test_a_killed_worker_is_noticed_at_once_and_nothing_is_left(make: Make) -> None:
    env = make(num_envs=4, workers=2, patience=3600.0)
    env.reset()
    processes = processes_of(env)
    os.kill(processes[1], signal.SIGKILL)
    with pytest.raises(
        WorkerFailed, match=r"worker 1 .*environments 2 to 3\) died with exit status -9: it was ended from outside"
    ):
        env.step(actions(0, 4))
    assert gone(processes)


def test_a_crashed_worker_leaves_its_traceback(make: Make) -> None:
    env = make(num_envs=2, workers=1)
    env.reset()
    os.kill(processes_of(env)[0], signal.SIGSEGV)
    with pytest.raises(WorkerFailed, match=r"(?s)status -11.*Segmentation fault.*in _serve"):
        env.step(actions(0, 2))


def test_an_exception_in_a_worker_arrives_with_its_traceback(make: Make) -> None:
    env = make(num_envs=2, workers=1)
    env.reset()
    processes = processes_of(env)
    env.workers.call([StepBy(functools.partial(operator.truediv, 1, 0))])
    with pytest.raises(WorkerFailed, match=r"(?s)worker 0 .*Traceback.*ZeroDivisionError"):
        env.step(actions(0, 2))
    assert gone(processes)


def test_an_exception_while_starting_arrives_too(make: Make, tmp_path: Path, recipe: Any, folder: Path) -> None:
    with pytest.raises(WorkerFailed, match=r"(?s)Traceback.*FileNotFoundError"):
        VectorEnv(Specification(recipe, folder, tmp_path / "nothing"), num_envs=2, workers=2, seed=0)


def test_a_hung_worker_is_noticed_and_says_where_it_hangs(make: Make) -> None:
    env = make(num_envs=4, workers=2, patience=1.0)
    env.reset()
    processes = processes_of(env)
    env.workers.call([StepBy(functools.partial(time.sleep, 3600.0))] * 2)
    with pytest.raises(WorkerFailed, match=r"(?s)has not answered for 1 s.*in _serve"):
        env.step(actions(0, 4))
    assert gone(processes)


def test_an_interrupted_step_leaves_a_usable_environment(make: Make) -> None:
    env = make(num_envs=4, workers=2)
    env.reset()
    env.step_async(actions(0, 4))
    state = env.state()
    assert (state["task/steps"] == 1).all()
    assert np.isfinite(env.step(actions(1, 4))[0]).all()


PARENT = """
    import signal, sys, time
    from iowbc.recipe.recipe import Recipe
    from iowbc.robot.description import robot_folder
    from iowbc.task.specification import Specification
    from iowbc.task.vector.vector_env import VectorEnv
    import numpy as np

    signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored in what a shell starts in the background
    env = VectorEnv(Specification(Recipe(name="x"), robot_folder("g1")), num_envs=4, workers=2, seed=0)
    env.reset()
    print(*env.workers.processes, flush=True)
    while True:
        env.step(np.zeros((4, 15), np.float32))
        {then}
"""


def parent(then: str = "") -> tuple[subprocess.Popen[str], list[int]]:
    """A process with a vector environment, and its workers."""
    process = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(PARENT).replace("{then}", then)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    assert process.stdout is not None
    return process, [int(pid) for pid in process.stdout.readline().split()]


def ending(process: subprocess.Popen[str]) -> str:
    """What a process writes to its standard error until it ends; it is killed where it does not."""
    try:
        return process.communicate(timeout=20)[1]
    finally:
        process.kill()


def shared_segments() -> set[str]:
    return {path.name for path in Path("/dev/shm").glob("*")}


@pytest.mark.parametrize("blow", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
def test_workers_go_with_a_parent_that_is_ended(blow: signal.Signals) -> None:
    before = shared_segments()
    process, workers = parent()
    with process:
        assert len(workers) == 2
        if blow == signal.SIGINT:
            os.killpg(process.pid, blow)
        else:
            process.send_signal(blow)
        errors = ending(process)
    assert gone(workers)
    assert shared_segments() <= before
    if blow == signal.SIGINT:
        assert errors.count("Traceback") == 1, "workers leave Ctrl-C to their parent"
        assert "KeyboardInterrupt" in errors


def test_workers_go_with_a_parent_that_raises() -> None:
    process, workers = parent("raise RuntimeError('planned')")
    with process:
        errors = ending(process)
    assert "planned" in errors
    assert gone(workers)


def test_workers_take_little_memory_beyond_their_imports(make: Make) -> None:
    env = make(num_envs=48, workers=1, changes={"task.scenes.free": 0.0})
    env.reset()
    for step in range(3):
        env.step(actions(step, 48))
    code = "import iowbc.task.vector.setup, psutil; print(psutil.Process().memory_info().rss)"
    imports = int(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout)
    used = psutil.Process(processes_of(env)[0]).memory_info().rss
    assert (used - imports) / 1e6 < 150.0
