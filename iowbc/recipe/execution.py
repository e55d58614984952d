"""How a machine runs a recipe; not part of any key."""

from pydantic import Field

from iowbc.recipe.section import Section


class Execution(Section):
    """How a machine runs a recipe; not part of any key."""

    workers: int | None = Field(default=None, ge=1, le=1024)
    """Worker processes of the parallel stages; all available cores when empty. `--workers` goes before it."""
    track: bool = True
    """Whether runs are recorded in MLflow."""
    experiment: str = Field(default="iowbc", min_length=1, max_length=200)
    """MLflow experiment in which runs are recorded."""
    line_interval: float = Field(default=10.0, gt=0)
    """Seconds between two progress lines of a stage where the output is not a terminal."""
    tracking_patience: float = Field(default=15.0, ge=0)
    """Seconds that a finished run waits for MLflow to take what is not sent yet; the rest is sent by the next run."""
