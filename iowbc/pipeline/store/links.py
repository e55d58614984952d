"""Links by name: `runs/<recipe>/<stage>` to what a recipe has, `<stage>-<key>` to what a run with overrides made."""

import os
from pathlib import Path

from iowbc.pipeline.console.wording import KEY_LENGTH
from iowbc.pipeline.store.runs import Runs


def link(runs: Runs, recipe: str, stage: str, artifact: Path, *, with_overrides: bool = False) -> None:
    """Let `runs/<recipe>/<stage>` lead to an artifact's folder; a recipe named like a part of `runs` has no links.

    with_overrides: only a run with overrides made it; the name stands for something else.
    """
    folder = runs.root / recipe
    if folder in runs.parts or (folder.exists() and not _only_links(folder)):
        return
    folder.mkdir(exist_ok=True)
    fresh = folder / f".{stage}.{os.getpid()}"
    fresh.unlink(missing_ok=True)
    fresh.symlink_to(os.path.relpath(artifact, folder))
    os.replace(fresh, folder / (_with_key(stage, artifact) if with_overrides else stage))


def named_folder(runs: Runs, recipe: str, stage: str, artifact: Path) -> Path:
    """The link below `runs/<recipe>` that leads to an artifact's folder, else that folder."""
    links = (runs.root / recipe / name for name in (stage, _with_key(stage, artifact)))
    return next((one for one in links if one.is_symlink() and one.resolve() == artifact.resolve()), artifact)


def remove_dangling(runs: Runs) -> None:
    """Remove the links whose artifacts are gone."""
    for folder in runs.root.iterdir() if runs.root.is_dir() else ():
        if folder.is_dir() and folder not in runs.parts and _only_links(folder):
            for path in folder.iterdir():
                if not path.exists():
                    path.unlink()
            if not any(folder.iterdir()):
                folder.rmdir()


def _with_key(stage: str, artifact: Path) -> str:
    return f"{stage}-{artifact.name[:KEY_LENGTH]}"


def _only_links(folder: Path) -> bool:
    return folder.is_dir() and all(path.is_symlink() for path in folder.iterdir())
