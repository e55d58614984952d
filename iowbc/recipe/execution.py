"""Execution of a recipe on a machine; not part of any key."""

from typing import Literal

from pydantic import Field

from iowbc.recipe.section import Section


class Execution(Section):
    """Execution of a recipe on this machine; never changes a result, and is not part of any key."""

    workers: int | None = Field(default=None, ge=1, le=1024)
    """Worker processes of the parallel stages; empty: all available cores. `--workers` overrides it."""
    engine: Literal["local", "ray"] = "local"
    """Engine of the stages: local processes or a Ray cluster, with the same results. `--engine` overrides it."""
    address: str = Field(default="local", min_length=1, max_length=200)
    """The Ray cluster: `local` (on this machine only, for the duration of the run), `auto` (started here by `ray
    start`), `HOST:PORT`, or `ray://HOST:PORT`. `--address` overrides it."""
    rollout_actors: int | None = Field(default=None, ge=1, le=1024)
    """On Ray: number of rollout actors of a training, on any nodes, with one core each; at most the cluster's cores.
    Empty: a training stays on one node with its worker processes, which is better for many parallel trainings."""
    device: str = Field(default="cpu", pattern=r"^(cpu|cuda(:[0-9]+)?)$")
    """Device of PPO's networks: `cpu`, or `cuda` for a GPU (`cuda:1` for the second), which needs a torch build for it.
    Rounding differs from the CPU's: a training is then reproduced closely, not bit for bit."""
    copy_files: bool = False
    """Let nodes copy inputs and outputs to local disks even if they can access `runs/`, for slow shared file systems.
    Nodes without access always copy."""
    track: bool = True
    """Record runs in MLflow."""
    experiment: str = Field(default="iowbc", min_length=1, max_length=200)
    """MLflow experiment of the runs."""
    line_interval: float = Field(default=10.0, gt=0)
    """Seconds between two progress lines of a stage if the output is not a terminal."""
    tracking_patience: float = Field(default=15.0, ge=0)
    """Seconds that a finished run waits for pending uploads to MLflow; the next run sends the rest."""
