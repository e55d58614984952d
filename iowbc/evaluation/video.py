"""Writes a film frame by frame, with lines of text in a corner."""

from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

import imageio.v2
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

Frame = NDArray[np.uint8]

QUALITY = 7
"""Of imageio-ffmpeg, 0 to 10; 20 s of 640 x 480 take about 2 MB."""
LINES_PER_FRAME = 26
"""Height of the text: this many lines would fill the frame."""


def with_text(frame: Frame, lines: Sequence[str]) -> Frame:
    """The frame (H, W, 3) with lines of text at the upper left, white on a darkened strip."""
    image = Image.fromarray(frame)
    size = max(10, frame.shape[0] // LINES_PER_FRAME)
    font = ImageFont.load_default(size)
    draw = ImageDraw.Draw(image, "RGBA")
    width = max(draw.textlength(line, font=font) for line in lines)
    draw.rectangle((0, 0, width + size, (len(lines) + 0.5) * size * 1.15), fill=(0, 0, 0, 130))
    for row, line in enumerate(lines):
        draw.text((size / 2, size * (0.2 + 1.15 * row)), line, font=font, fill="white")
    return np.asarray(image)


class Film:
    """An mp4 file that is written frame by frame; it appears under its name when the block ends without an error."""

    def __init__(self, path: Path, fps: int) -> None:
        self.path = path
        path.parent.mkdir(parents=True, exist_ok=True)
        self._unfinished = path.with_suffix(".part.mp4")
        self._writer = imageio.v2.get_writer(
            self._unfinished, format="FFMPEG", fps=fps, codec="libx264", quality=QUALITY, pixelformat="yuv420p"
        )

    def add(self, frame: Frame) -> None:
        """Append a frame (H, W, 3)."""
        self._writer.append_data(frame)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._writer.close()
        if kind is None:
            self._unfinished.replace(self.path)
        else:
            self._unfinished.unlink(missing_ok=True)
