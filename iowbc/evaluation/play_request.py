"""The request to show one episode of a policy, in the viewer or as a film. Imports nothing heavy."""

from dataclasses import dataclass
from pathlib import Path

from iowbc.errors import UsageError
from iowbc.recipe.evaluation.evaluation import Video
from iowbc.recipe.evaluation.sequences import Segment
from iowbc.recipe.simulation.holding import FREE

HEAVIEST = 1000.0
"""No object is heavier [kg]."""


@dataclass(frozen=True)
class PlayRequest:
    """One episode. Raises UsageError for a film that is no mp4."""

    scene: str = "lift"
    mass: float = 4.0
    """Of the object [kg]; 0 plays without one, as the scene `free` does."""
    partner_share: float | None = 0.0
    """Part of the weight that the partner bears; None draws it."""
    sequence: tuple[Segment, ...] = ()
    """Commands; empty takes the recipe's `eval.sequence`."""
    seed: int = 0
    disturbances: bool = False
    """With impulses on the object and pushes on the base."""
    video: Path | None = None
    """The mp4 file to write instead of opening the viewer."""
    video_settings: Video | None = None
    """Of the film; None takes `eval.video`, without its limit of length."""

    def __post_init__(self) -> None:
        if not 0.0 <= self.mass <= HEAVIEST:
            raise UsageError(f"--mass {self.mass:g}: should be 0 to {HEAVIEST:g} kg")
        if self.video is not None and self.video.suffix != ".mp4":
            raise UsageError(f"{self.video}: a film is an mp4 file; give a name that ends in .mp4")

    @property
    def object_mass(self) -> float:
        """Mass of the object [kg]; 0 in the scene without one."""
        return 0.0 if self.scene == FREE else self.mass
