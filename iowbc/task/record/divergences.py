"""Keeps simulations that diverged, for replay."""

from collections import deque
from pathlib import Path

from iowbc.sim.divergence import Divergence


def keep_divergences(divergences: deque[Divergence], folder: Path | None) -> None:
    """Moves what diverged into a folder, or nowhere."""
    while divergences:
        divergence = divergences.popleft()
        if folder is not None:
            folder.mkdir(parents=True, exist_ok=True)
            name = f"divergence-{divergence.environment}-{divergence.episode}-{divergence.step}.npz"
            divergence.save(folder / name)
