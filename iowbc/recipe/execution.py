"""Execution of a recipe on a machine; not part of any key."""

from typing import Literal

from pydantic import Field

from iowbc.recipe.section import Section


class Execution(Section):
    """Execution of a recipe on a machine; not part of any key."""

    workers: int | None = Field(default=None, ge=1, le=1024)
    """Worker processes of the parallel stages; all available cores when empty. `--workers` goes before it."""
    engine: Literal["local", "ray"] = "local"
    """Engine of the stages: processes here, or on the nodes of a Ray cluster, with the same results. `--engine` goes
    before it."""
    address: str = Field(default="local", min_length=1, max_length=200)
    """The Ray cluster: `local` (one of this machine alone, which ends with the run), `auto` (the one that `ray start`
    began here), `HOST:PORT`, or `ray://HOST:PORT`. `--address` goes before it."""
    rollout_actors: int | None = Field(default=None, ge=1, le=1024)
    """On Ray: actors of one core each, on whatever nodes, that make the rollouts of a training; at most as many as the
    cluster has cores. When empty a training stays on one node with its worker processes, which is better where many
    trainings run."""
    device: str = Field(default="cpu", pattern=r"^(cpu|cuda(:[0-9]+)?)$")
    """Device of PPO's networks: `cpu`, or `cuda` for a graphics card (`cuda:1` for the second), with a torch built for
    it. Rounding differs from the processor's: a training is then repeated closely, not bit for bit."""
    copy_files: bool = False
    """Lets nodes copy what they read and write to their own disks although they see `runs/`: for shared file systems
    that are slow. Where they do not see it they copy in any case."""
    track: bool = True
    """Records runs in MLflow."""
    experiment: str = Field(default="iowbc", min_length=1, max_length=200)
    """MLflow experiment in which runs are recorded."""
    line_interval: float = Field(default=10.0, gt=0)
    """Seconds between two progress lines of a stage where the output is not a terminal."""
    tracking_patience: float = Field(default=15.0, ge=0)
    """Seconds that a finished run waits for MLflow to take what is not sent yet; the rest is sent by the next run."""
