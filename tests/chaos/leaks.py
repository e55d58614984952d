"""Memory and file descriptors of a training and its workers over time: `make leaks`.

python tests/chaos/leaks.py [--recipe FILE] [--set A.B=VALUE ...] [--minutes 60] [--every 30]

Runs a recipe up to its teacher in a folder of its own, looks at each process every so many seconds, and then stops it.
Memory is what a process has to itself (USS). The first fifth counts as warming up.
"""

import argparse
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

import psutil

LONG = (
    "stages=[teacher]",
    "task.references.use_rg=false",
    "teacher.steps=1000000000",
    "teacher.environments=16",
    "execution.track=false",
)
"""Overrides of a training that is small and does not end by itself."""
TOLERANCE = 0.01
"""Part by which memory may grow."""

Look = tuple[float, int]
"""Memory [MB] and number of file descriptors."""


def looked(process: psutil.Process) -> Look | None:
    try:
        return process.memory_full_info().uss / 1e6, process.num_fds()
    except psutil.Error:
        return None


def watch(run: "subprocess.Popen[bytes]", minutes: float, every: float) -> dict[str, list[Look]]:
    """The looks at a run's processes, by name and number."""
    found: dict[str, list[Look]] = {}
    end = time.monotonic() + 60 * minutes
    while time.monotonic() < end and run.poll() is None:
        parent = psutil.Process(run.pid)
        for process in (parent, *parent.children(recursive=True)):
            look = looked(process)
            if look is not None:
                kind = "parent" if process == parent else "worker"
                found.setdefault(f"{kind} {process.pid}", []).append(look)
        time.sleep(every)
    return found


def table(looks: dict[str, list[Look]]) -> tuple[str, bool]:
    """A row a process that lived from warming up to the end, and whether all are flat."""
    rows = ["| process | looks | MB at first | MB at last | growth | descriptors |", "|---|---|---|---|---|---|"]
    longest, flat = max(map(len, looks.values()), default=0), True
    for name, seen in looks.items():
        warm = seen[longest // 5 :]
        if len(seen) < 0.7 * longest or len(warm) < 4:
            continue
        third = max(1, len(warm) // 3)
        first, last = median(memory for memory, _ in warm[:third]), median(memory for memory, _ in warm[-third:])
        counts = sorted({count for _, count in warm})
        flat &= last <= (1 + TOLERANCE) * first and warm[-1][1] <= warm[0][1]
        described = "/".join(map(str, counts))
        rows.append(f"| {name} | {len(warm)} | {first:.1f} | {last:.1f} | {last / first - 1:+.2%} | {described} |")
    return "\n".join(rows), flat and len(rows) > 2


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--recipe", default="smoke")
    parser.add_argument("--set", action="append", default=list(LONG), dest="overrides", metavar="A.B=VALUE")
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--every", type=float, default=30.0)
    asked = parser.parse_args()
    recipe = str(Path(asked.recipe).absolute()) if Path(asked.recipe).is_file() else asked.recipe
    words = [sys.executable, "-m", "iowbc", "run", recipe, "--until", "teacher"]
    for override in asked.overrides:
        words += ["--set", override]
    place = tempfile.TemporaryDirectory(prefix="iowbc-leaks-", ignore_cleanup_errors=True)
    with place as folder, subprocess.Popen(words, cwd=folder, stdout=subprocess.DEVNULL) as run:
        looks = watch(run, asked.minutes, asked.every)
        run.send_signal(signal.SIGTERM)
    text, flat = table(looks)
    print(text)
    print("flat" if flat else f"grown by more than {TOLERANCE:.0%}, or with more descriptors than at first")
    return 0 if flat else 1


if __name__ == "__main__":
    sys.exit(main())
