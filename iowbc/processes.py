"""Child processes that end with their parent and use one thread of linear algebra each; the available cores."""

import ctypes
import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib.util import find_spec
from pathlib import Path

SINGLE_THREADED = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""Environment variables of a process whose linear algebra uses one thread: the processes are the parallelism."""
KEPT = {-3: 1 << 30, -1: 1 << 30}
"""mallopt's M_MMAP_THRESHOLD and M_TRIM_THRESHOLD [bytes]."""
PARENT_DEATH_SIGNAL = 1
"""prctl's option PR_SET_PDEATHSIG: the kernel sends the signal when the thread that started the process ends."""


def available_cores() -> int:
    """Cores that this process may use: its affinity, cut to the container's quota."""
    cores = len(os.sched_getaffinity(0))
    with suppress(OSError, ValueError):
        quota, period = Path("/sys/fs/cgroup/cpu.max").read_text().split()
        if quota != "max":
            cores = min(cores, max(1, round(int(quota) / int(period))))
    return cores


def keep_freed_memory() -> None:
    """Lets the C library keep what is freed for the next arrays. By default it gives each of a megabyte and more back
    to the kernel, which clears it page by page when it is asked for again: a fifth of the time of a gradient step."""
    library = ctypes.CDLL(None)
    if hasattr(library, "mallopt"):
        for option, size in KEPT.items():
            library.mallopt(option, size)


def name_glfw() -> None:
    """Set the library path of glfw, which mujoco imports. Without it glfw starts another Python to read the library's
    version, which prints a traceback if the training is ended meanwhile."""
    found = find_spec("glfw")
    if found is not None and found.origin is not None:
        session = "wayland" if os.environ.get("XDG_SESSION_TYPE") == "wayland" else "x11"
        library = Path(found.origin).with_name(os.environ.get("PYGLFW_LIBRARY_VARIANT") or session) / "libglfw.so"
        if library.is_file():
            os.environ.setdefault("PYGLFW_LIBRARY", str(library))


def die_with_parent(parent: int, *, bound: bool = True, number: int = signal.SIGKILL) -> None:
    """End this process when its parent, process `parent`, ends; at once if it has ended already.

    `bound`: the kernel sends signal `number`. Set it only in a process that the parent's main thread started, because
    the kernel watches the thread that started it.
    """
    if bound:
        ctypes.CDLL(None).prctl(PARENT_DEATH_SIGNAL, number, 0, 0, 0)
    if os.getppid() != parent:
        os._exit(1)


@contextmanager
def single_threaded() -> Iterator[None]:
    """Processes that are started inside have one thread of linear algebra each."""
    before = {name: os.environ[name] for name in SINGLE_THREADED if name in os.environ}
    os.environ.update(SINGLE_THREADED)
    try:
        yield
    finally:
        for name in SINGLE_THREADED:
            del os.environ[name]
        os.environ.update(before)
