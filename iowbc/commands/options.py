"""Arguments, options and requirements that several commands share."""

import socket
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Literal

from typer import Argument, Option

from iowbc.commands import completion
from iowbc.errors import UsageError

EXTRAS = {
    "train": (
        *("crocoddyl", "imageio", "matplotlib", "mlflow", "mujoco", "pandas", "pinocchio", "stable_baselines3"),
        "torch",
    ),
    "web": ("viser",),
    "robot": ("cyclonedds", "mcap"),
    "cluster": ("ray",),
    "drake": ("pydrake",),
}
"""Modules of the larger packages that each extra of iowbc brings; they come together."""
HOST = "127.0.0.1"
PORT = 8080
"""Default port of a page."""


def require_extra(extra: str, what: str) -> None:
    """Raises `UsageError` with the command that installs them where packages are missing that `what` needs."""
    missing = [name for name in EXTRAS[extra] if find_spec(name) is None]
    if missing:
        raise UsageError(
            f"`{what}` needs {', '.join(missing)}, which this installation leaves out: "
            f"`pip install '.[{extra}]'` in a checkout brings {'it' if len(missing) == 1 else 'them'}"
        )


def require_free(port: int) -> None:
    """Raises `UsageError` with another port of this machine that is free where this one is taken."""
    try:
        socket.create_server((HOST, port)).close()
    except OSError:
        with socket.create_server((HOST, 0)) as other:
            raise UsageError(f"port {port} is taken; try --port {other.getsockname()[1]}") from None


RUNS = Path("runs")
"""Folder of artifacts and tracking data where no other is given."""
RunsFolder = Annotated[
    Path,
    Option(
        "--runs",
        help="Folder of artifacts and tracking data (default: $IOWBC_RUNS or ./runs).",
        envvar="IOWBC_RUNS",
        show_default=False,
    ),
]
RecipeFile = Annotated[
    str, Argument(help="Recipe: a YAML file or its name.", metavar="RECIPE", autocompletion=completion.recipes)
]
Overrides = Annotated[
    list[str] | None,
    Option(
        "--set", help="Override a recipe value (repeatable).", metavar="A.B.C=VALUE", autocompletion=completion.paths
    ),
]
Until = Annotated[str | None, Option(help="Stop after this stage.", metavar="STAGE", autocompletion=completion.stages)]
Force = Annotated[
    list[str] | None,
    Option(
        help="Re-run this stage even if it is cached (repeatable).", metavar="STAGE", autocompletion=completion.stages
    ),
]
Workers = Annotated[int | None, Option(help="Worker processes (default: all available cores).", min=1)]
Engine = Annotated[Literal["local", "ray"] | None, Option(help="Execution engine: local processes or a Ray cluster.")]
Address = Annotated[str | None, Option(help="Ray cluster: local, auto, HOST:PORT, ray://HOST:PORT.", metavar="ADDRESS")]
Quiet = Annotated[bool, Option("--quiet", "-q", help="Print errors only.")]
OnCodeChange = Annotated[Literal["report", "rerun"], Option(help="Policy for cached stages whose code has changed.")]
Web = Annotated[bool, Option("--web", help="Interactive viewer in the browser (no display needed).")]
Port = Annotated[int | None, Option(help="Port of --web (default: 8080).", min=1, max=65535)]
SceneName = Annotated[str, Option("--scene", help="Scene of the recipe.", metavar="SCENE")]
AsJson = Annotated[bool, Option("--json", help="Print JSON.")]
Exported = Annotated[
    str,
    Argument(help="Export folder, or the recipe that made it.", metavar="EXPORT", autocompletion=completion.ran),
]
Named = Annotated[
    str,
    Argument(
        help="Recipe (name or file), RECIPE/STAGE, or the first characters of a key.",
        metavar="WHAT",
        autocompletion=completion.artifacts,
    ),
]


def page_port(web: bool, port: int | None) -> int | None:
    """The free port of a page; None without one. Raises UsageError for a port alone, or if no page can be served."""
    if not web:
        if port is not None:
            raise UsageError("--port is that of the page that --web serves; give both")
        return None
    require_extra("web", "--web")
    require_free(port or PORT)
    return port or PORT
