"""The command `iowbc`, and `python -m iowbc`. Ctrl-C counts while the rest of the program is still being read."""

import os
import signal


def main() -> None:
    """Run a command and exit; see `iowbc.cli.main`."""
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, lambda *_: os._exit(130))
    from iowbc.cli import main as command

    command()


if __name__ == "__main__":
    main()
