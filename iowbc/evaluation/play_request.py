"""Options for playback of one episode of a policy, in the viewer or as a video. Imports only light modules."""

from dataclasses import dataclass
from pathlib import Path

from iowbc.errors import UsageError
from iowbc.recipe.evaluation.sequences import Segment
from iowbc.recipe.simulation.holding import FREE

HEAVIEST = 1000.0
"""Maximum mass of an object [kg]."""


@dataclass(frozen=True)
class PlayRequest:
    """Options for playback of one episode. Raises UsageError for an invalid mass or a video file other than mp4."""

    scene: str = "lift"
    mass: float = 4.0
    """Mass of the object [kg]; 0: no object, as in the scene `free`."""
    partner_share: float = 0.0
    """Fraction of the weight carried by the partner."""
    sequence: tuple[Segment, ...] = ()
    """Commands; empty: the recipe's `eval.sequence`."""
    seed: int = 0
    disturbances: bool = False
    """Enable random impulses on the object and pushes on the base."""
    video: Path | None = None
    """The mp4 file to write instead of opening the viewer, by `eval.video` without its duration limit."""

    def __post_init__(self) -> None:
        if not 0.0 <= self.mass <= HEAVIEST:
            raise UsageError(f"--mass {self.mass:g}: should be 0 to {HEAVIEST:g} kg")
        if self.video is not None and self.video.suffix != ".mp4":
            raise UsageError(f"{self.video}: a film is an mp4 file; give a name that ends in .mp4")

    @property
    def object_mass(self) -> float:
        """Mass of the object [kg]; 0 in the scene without one."""
        return 0.0 if self.scene == FREE else self.mass
