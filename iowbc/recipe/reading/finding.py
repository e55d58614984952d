"""Where a recipe that is named on the command line lies."""

from collections.abc import Iterator
from pathlib import Path

SUFFIXES = (".yaml", ".yml")
PACKAGE = Path(__file__).resolve().parents[2]


def recipe_file(word: str | Path) -> Path:
    """The file that a word means: the file itself, or, for a name without ending, the first recipe of that name.

    Looked through are `./recipes`, the recipes of this checkout, and those of the installed package. A word that means
    nothing comes back as it is, for the reader to complain about.
    """
    path = Path(word)
    if path.suffix in SUFFIXES or path.is_file() or path.name != str(word):
        return path
    return next((found for found in known_files() if found.stem == path.name), path)


def known_files() -> Iterator[Path]:
    """The recipes that can be named without their folder, nearest first."""
    for folder in (Path("recipes"), PACKAGE.parent / "recipes", PACKAGE / "recipes"):
        for suffix in SUFFIXES:
            yield from sorted(folder.glob(f"*{suffix}"))
