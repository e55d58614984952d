"""Whether what only training needs is installed, asked before a command that needs it begins."""

from importlib.util import find_spec

from iowbc.errors import UsageError

MODULES = (
    "crocoddyl",
    "imageio",
    "matplotlib",
    "mlflow",
    "mujoco",
    "pandas",
    "pinocchio",
    "stable_baselines3",
    "torch",
)
"""Modules of the larger packages that `iowbc[train]` brings; they come together."""


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
