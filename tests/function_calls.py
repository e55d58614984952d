"""How much work a command is, in function calls: the same on every machine, however busy."""

import re
import subprocess
import sys
from pathlib import Path


def function_calls(*arguments: str, folder: Path | None = None) -> int:
    """Function calls of Python with these arguments, a script or `-m` and a module, its imports included."""
    profiled = [sys.executable, "-m", "cProfile", *arguments]
    done = subprocess.run(profiled, cwd=folder, capture_output=True, text=True, check=False)
    found = re.search(r"(\d+) function calls", done.stdout)
    assert found, done.stderr
    return int(found[1])
