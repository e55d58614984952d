"""The file of a recipe that is named on the command line."""

import os
from collections.abc import Iterator
from pathlib import Path

SUFFIXES = (".yaml", ".yml")
PACKAGE = Path(__file__).resolve().parents[2]


def recipe_file(word: str | Path) -> Path:
    """The file that a word means: the file itself, or, for a bare name with or without ending, the first of that name.

    Looked through are `./recipes`, the recipes of this checkout, and those of the installed package. A word that means
    nothing comes back as it is, for the reader to complain about.
    """
    path = Path(word)
    if os.path.isfile(path) or path.name != str(word):
        return path
    return next((found for found in known_files() if path.name in (found.stem, found.name)), path)


def file_meant_in(folder: Path, word: str) -> Path:
    """The file that `extends`, `teacher.start` or one of `variants` means in a recipe of a folder: one beside it, with
    or without ending, else what the word means anywhere."""
    beside = [Path(os.path.normpath(folder / f"{word}{ending}")) for ending in ("", *SUFFIXES)]
    return next((found for found in (*beside, recipe_file(word)) if os.path.isfile(found)), beside[0])


def known_files() -> Iterator[Path]:
    """The recipes that can be named without their folder, nearest first."""
    for folder in (Path("recipes"), PACKAGE.parent / "recipes", PACKAGE / "recipes"):
        for suffix in SUFFIXES:
            yield from sorted(folder.glob(f"*{suffix}"))
