"""Requirements that a command checks before it begins: optional packages and a free port."""

import socket
from importlib.util import find_spec

from iowbc.errors import UsageError

MODULES = (
    *("crocoddyl", "imageio", "matplotlib", "mlflow", "mujoco", "pandas", "pinocchio", "stable_baselines3"),
    "torch",
)
"""Modules of the larger packages that `iowbc[train]` brings; they come together."""
HOST = "127.0.0.1"
PORT = 8080
"""Port of a page where no other is asked for."""
LAST_PORT = 65_535


def require_training(command: str) -> None:
    """Raises `UsageError` with the command that installs them where one is missing."""
    missing = [name for name in MODULES if find_spec(name) is None]
    if missing:
        raise UsageError(
            f"`iowbc {command}` needs {', '.join(missing)}, which this installation leaves out: "
            "`pip install 'iowbc[train]'` brings what simulates and trains"
        )


def require_viewer() -> None:
    """Raises `UsageError` with the command that installs what the viewer in the browser needs."""
    if find_spec("viser") is None:
        raise UsageError(
            "`--web` needs viser, which this installation leaves out: `pip install 'iowbc[web]'` brings it; "
            "--video out.mp4 makes a film without it"
        )


def require_free(port: int) -> None:
    """Raises `UsageError` with the next port of this machine that is free where this one is taken."""
    free = next((other for other in range(port, LAST_PORT + 1) if _free(other)), None)
    if free != port:
        raise UsageError(f"port {port} is taken; try --port {free or 'with another number'}")


def _free(port: int) -> bool:
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((HOST, port))
        except OSError:
            return False
    return True
