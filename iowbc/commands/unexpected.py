"""The message of an unexpected error: one sentence, where the details are, and the next command."""

import os
import shlex
import tempfile
import traceback
from collections.abc import Sequence
from pathlib import Path

from iowbc.full_disk import nothing_fits, what_is_full


def described(error: Exception, arguments: Sequence[str]) -> str:
    """The sentence. Needs no disk: where the details cannot be written they follow it."""
    again = f"to go on: {shlex.join(['iowbc', *arguments])}"
    if nothing_fits(error):
        full = what_is_full(error, (Path("runs"), Path(os.environ.get("TMPDIR", "/tmp"))))
        return f"no space is left: {full}; make some (`iowbc gc` removes what you name), and then\n{again}"
    summary = " ".join(f"{type(error).__name__}: {error}".split())[:300]
    details = "".join(traceback.format_exception(error))
    try:
        with tempfile.NamedTemporaryFile("w", prefix="iowbc-", suffix=".txt", delete=False, encoding="utf-8") as file:
            file.write(details)
        where = f"the details are in {file.name}"
    except OSError:
        where = f"the details could not be written:\n{details.rstrip()}"
    return f"unexpected error: {summary}; {where}\n{again}"
