"""Short films of trials."""

from pydantic import Field

from iowbc.recipe.section import Section


class Video(Section):
    """Short films of trials."""

    count: int = Field(default=2, ge=0, le=1000)
    """Number of films, spread over the sweeps' masses; 0 makes none."""
    width: int = Field(default=640, ge=64, le=3840, multiple_of=16)
    """Width of a frame [pixel]; video codecs want multiples of 16."""
    height: int = Field(default=480, ge=64, le=2160, multiple_of=16)
    """Height of a frame [pixel]."""
    fps: int = Field(default=20, ge=1, le=50)
    """Frames per second; a frame takes 0.1 to 0.2 s to draw without a graphics card."""
    duration: float = Field(default=12.0, gt=0)
    """Longest film [s]."""
    traces: bool = True
    """Draw scene, mass, time and command into the frames."""
