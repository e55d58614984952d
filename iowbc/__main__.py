"""The command `iowbc`, and `python -m iowbc`. Ctrl-C counts while the rest of the program is still being read."""

import os
import signal


def leave_while_reading() -> None:
    """From now on Ctrl-C ends the process at once and without a word, unless it was started to ignore it."""
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, lambda *_: os._exit(130))


def load_no_graphics() -> None:
    """Make mujoco load no graphics library in this process and its children: a missing one would abort commands that
    draw nothing. Code that draws reads `IOWBC_GL` (`iowbc.sim.rendering`)."""
    os.environ.setdefault("IOWBC_GL", os.environ.get("MUJOCO_GL", ""))
    os.environ["MUJOCO_GL"] = "off"


def main() -> None:
    """Run a command and exit; see `iowbc.cli.main`."""
    leave_while_reading()
    load_no_graphics()
    from iowbc.cli import main as command

    command()


if __name__ == "__main__":
    main()
