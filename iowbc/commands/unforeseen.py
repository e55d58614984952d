"""What is said when a command meets what nobody foresaw: one sentence, where the details are, and what to type next."""

import errno
import shlex
import sys
import tempfile
import traceback
from collections.abc import Sequence


def told(error: Exception, arguments: Sequence[str]) -> str:
    """The sentence. Needs no disk: where the details cannot be written they follow it."""
    again = f"to go on: {shlex.join(['iowbc', *arguments])}"
    if isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT):
        place = f" at {error.filename}" if error.filename else ""
        return f"no space is left on the disk{place}; make some (`iowbc gc` removes what you name), and then\n{again}"
    summary = " ".join(f"{type(error).__name__}: {error}".split())[:300]
    details = "".join(traceback.format_exception(error))
    try:
        with tempfile.NamedTemporaryFile("w", prefix="iowbc-", suffix=".txt", delete=False, encoding="utf-8") as file:
            file.write(details)
        where = f"the details are in {file.name}"
    except OSError:
        where = f"the details could not be written:\n{details.rstrip()}"
    return f"iowbc met something that nobody foresaw: {summary}; {where}\n{again}"


def prepare_streams() -> None:
    """Let every text be written somehow: characters that the terminal does not know, and streams that are closed."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open("/dev/null", "w", encoding="utf-8"))  # noqa: SIM115 (for the whole process)
        elif hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")
