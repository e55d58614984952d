"""Links by name to what a recipe has: `runs/<recipe>/<stage>` leads to the artifact."""

import os
from pathlib import Path

from iowbc.pipeline.store.runs import Runs


def link(runs: Runs, recipe: str, stage: str, artifact: Path) -> None:
    """Let `runs/<recipe>/<stage>` lead to an artifact's folder; a recipe named like a part of `runs` has no links."""
    folder = runs.root / recipe
    if folder in runs.parts or (folder.exists() and not _only_links(folder)):
        return
    folder.mkdir(exist_ok=True)
    fresh = folder / f".{stage}.{os.getpid()}"
    fresh.unlink(missing_ok=True)
    fresh.symlink_to(os.path.relpath(artifact, folder))
    os.replace(fresh, folder / stage)


def named_folder(runs: Runs, recipe: str, stage: str, artifact: Path) -> Path:
    """`runs/<recipe>/<stage>` where it leads to an artifact's folder, else that folder."""
    short = runs.root / recipe / stage
    return short if short.is_symlink() and short.resolve() == artifact.resolve() else artifact


def remove_dangling(runs: Runs) -> None:
    """Remove the links whose artifacts are gone."""
    for folder in runs.root.iterdir() if runs.root.is_dir() else ():
        if folder.is_dir() and folder not in runs.parts and _only_links(folder):
            for path in folder.iterdir():
                if not path.exists():
                    path.unlink()
            if not any(folder.iterdir()):
                folder.rmdir()


def _only_links(folder: Path) -> bool:
    return folder.is_dir() and all(path.is_symlink() for path in folder.iterdir())
