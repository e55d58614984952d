"""How much of a processor a command takes, in a unit that a slow or busy machine stretches as much as the command."""

import os
import statistics
import subprocess
import sys
from pathlib import Path

YARDSTICK = ("-c", "import pydantic, yaml; pydantic.create_model('Model', number=(int, 1))(number=2)")
"""Python that reads YAML and validates one model: the least that any of our commands needs."""


def processor_seconds(*arguments: str, folder: Path | None = None) -> float:
    """Processor time of Python with these arguments [s]; what waits, or runs beside it, is not counted."""
    before = os.times()
    subprocess.run([sys.executable, *arguments], cwd=folder, capture_output=True, check=False)
    after = os.times()
    return after.children_user + after.children_system - before.children_user - before.children_system


def yardsticks(*arguments: str, folder: Path | None = None, pairs: int = 3) -> float:
    """The processor time of Python with these arguments over that of the yardstick: the median of pairs run in turn."""
    return statistics.median(
        processor_seconds(*arguments, folder=folder) / processor_seconds(*YARDSTICK) for _ in range(pairs)
    )
