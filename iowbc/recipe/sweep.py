"""A sweep: variants of a recipe or a study over a grid of values and random draws."""

import contextlib
import hashlib
import itertools
import json
import math
import random
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, JsonValue, ValidationError

from iowbc.errors import Problem, RecipeError, shown
from iowbc.recipe.reading.document import Located, plain, read_document, read_value
from iowbc.recipe.reading.loading import LoadedRecipe, load_recipe, read_text
from iowbc.recipe.reading.study import load_study
from iowbc.recipe.reading.validation import descend, value_head
from iowbc.recipe.recipe import NAME
from iowbc.recipe.section import Interval, Problems, Section

DIGITS = 4
"""Significant digits of a drawn value, so that it is easy to read and type; further digits do not matter."""
MOST_VALUES = 10_000
"""Largest number of values of an axis."""
MOST_POINTS = 1_000
"""Default limit on the points of a sweep: planning each takes some 10 ms and 200 kB."""


class Drawn(Interval):
    """A number drawn at random: x ~ U(low, high), or log x ~ U(log low, log high)."""

    scale: Literal["linear", "log"] = "linear"
    """`log`: all orders of magnitude are equally likely, for rates and weights of unknown scale."""
    whole: bool = False
    """Round to an integer."""

    def problems(self) -> Problems:
        if self.high <= self.low:
            yield "", f"high {self.high} is not greater than low {self.low}"
        if not math.isfinite(self.high - self.low):
            yield "", f"{self.low} to {self.high} is too wide to draw from"
        if self.scale == "log" and self.low <= 0:
            yield "", f"low {self.low}: a logarithmic scale begins above 0"

    def value(self, part: float) -> int | float:
        """The number at a fraction of the way from low to high, 0 to 1."""
        low, high = (self.low, self.high) if self.scale == "linear" else (math.log(self.low), math.log(self.high))
        found = low + part * (high - low)
        found = found if self.scale == "linear" else math.exp(found)
        return round(found) if self.whole else float(f"{found:.{DIGITS}g}")


class RandomDraws(Section):
    """Random points, each with a draw of all values."""

    count: int = Field(ge=1, le=MOST_VALUES)
    """Number of draws."""
    seed: int = Field(default=0, ge=0, lt=2**32)
    """Seed of the draws; increasing `count` or adding paths does not change earlier draws."""
    values: Mapping[str, Drawn] = Field(min_length=1)
    """Distributions of the drawn values, by dotted path of the recipe."""

    def points(self) -> list[dict[str, JsonValue]]:
        """The drawn values of each draw, by dotted path."""
        sources = {path: random.Random(f"{self.seed} {path}") for path in self.values}
        return [
            {path: drawn.value(sources[path].random()) for path, drawn in self.values.items()}
            for _ in range(self.count)
        ]


class SweepFile(Section):
    """The file of a sweep, `iowbc sweep RECIPE --from FILE`: every combination of the grid with every draw."""

    name: str | None = Field(default=None, pattern=f"^{NAME}$", max_length=64)
    """Name of the sweep; empty: the file's name."""
    description: str = ""
    """Purpose of the sweep, in a sentence."""
    grid: Mapping[str, Annotated[list[JsonValue], Field(min_length=1)]] = {}
    """Values by dotted path of the recipe; `0..4` stands for the integers 0 to 4."""
    draws: RandomDraws | None = None
    """Random draws."""


INTEGERS = re.compile(r"(-?[0-9]{1,10})\.\.(-?[0-9]{1,10})")
"""`0..4`: the integers 0 to 4."""
LONGEST_NAME = 64
"""Characters of a recipe's name."""
DIGEST_LENGTH = 6
"""Characters of the digest in the name of a point."""
RECIPE_AXIS = "recipe"
"""Additional axis of a study's sweep: the variant."""


@dataclass(frozen=True)
class Point:
    """One run of a sweep: an ordinary recipe with its own name."""

    loaded: LoadedRecipe
    settings: Mapping[str, JsonValue]
    """Values that the sweep varies, by dotted path."""

    @property
    def name(self) -> str:
        return self.loaded.recipe.name


@dataclass(frozen=True)
class Sweep:
    """A sweep's points, which differ in the varied values."""

    name: str
    points: tuple[Point, ...]

    @property
    def axes(self) -> tuple[str, ...]:
        """Dotted paths of the varied values, the same for all points."""
        return tuple(self.points[0].settings)


def load_sweep(word: str, settings: Sequence[str], file: Path | None = None, most: int = MOST_POINTS) -> Sweep:
    """The points of a sweep, all of them valid recipes; `path=value` in settings holds for all points, `path=a,b` and
    `path=0..4` vary it. Settings override the file, and of several for one path the last counts. Raises
    `RecipeError`."""
    described = SweepFile() if file is None else _read_file(file)
    grid = {path: _expanded(values, f"{file}") for path, values in described.grid.items()}
    if far := [value for value in grid.get("robot", ()) if Path(str(value)).name != value]:
        text = f"key 'grid.robot' = {shown(far[0])}: a sweep names a folder under robots/; a path is for --set"
        raise RecipeError([Problem(f"{file}:1:1", text)])
    fixed: list[str] = []
    for setting in settings:
        place, (path, equals, text) = f"--set {setting}", setting.partition("=")
        listed = plain(read_value(f"[{text}]", place)) if equals else []  # so that brackets and quotes keep commas
        values = _expanded(listed if isinstance(listed, list) else [], place)
        grid.pop(path.strip(), None)
        if len(values) > 1:
            grid[path.strip()] = values
        else:
            fixed.append(setting if values == listed else f"{path}={written(values[0])}")
    set_here = {*grid, *(setting.partition("=")[0].strip() for setting in fixed)}
    drawn = described.draws.points() if described.draws is not None else [{}]
    drawn = _each_once([{path: value for path, value in point.items() if path not in set_here} for point in drawn])
    axes = (*grid, *drawn[0])
    if axes or not load_study(word):
        _require_axes(axes, file)
    count = len(drawn) * math.prod(map(len, grid.values()))
    if count > most:
        text = f"{count:,} points, more than {most:,}; vary less, or allow them: `iowbc sweep --points {count}`"
        raise RecipeError([Problem(str(file or "--set"), text)])
    points = []
    for draw in drawn:
        for combination in itertools.product(*grid.values()):
            points += _points(word, fixed, dict(zip(grid, combination, strict=True)) | draw)
    name = described.name or _slug([file.stem] if file is not None else [Path(word).stem, *map(_leaf, axes)])
    if common := _common(fixed):
        name = f"{name[: LONGEST_NAME - DIGEST_LENGTH - 1]}-{_digest(common)}"
    return Sweep(name[:LONGEST_NAME], tuple(points))


def _common(fixed: Sequence[str]) -> list[str]:
    """The settings of all points that may decide results, and so belong to their names."""
    return sorted(setting.strip() for setting in fixed if not setting.strip().startswith("execution."))


def _points(word: str, fixed: Sequence[str], settings: Mapping[str, JsonValue]) -> list[Point]:
    """The point of a recipe, or the points of a study's variants."""
    overrides = (*fixed, *(f"{path}={written(value)}" for path, value in settings.items()))
    if variants := load_study(word, overrides):
        named = ((one.recipe.name, _named(one, settings, _common(fixed))) for one in variants)
        return [Point(one, {RECIPE_AXIS: name, **settings}) for name, one in named]
    return [Point(_named(load_recipe(word, overrides), settings, _common(fixed)), settings)]


def _named(loaded: LoadedRecipe, settings: Mapping[str, JsonValue], common: Sequence[str]) -> LoadedRecipe:
    """The recipe renamed by its settings; the name is the same in every sweep that contains it. `common`: settings of
    all points."""
    if not settings and not common:
        return loaded
    name = _slug([loaded.recipe.name, *(f"{_leaf(path)}-{written(value)}" for path, value in settings.items())])
    if common or not settings.keys() <= {"seed"} or len(name) > LONGEST_NAME:
        digest = _digest([settings, common] if common else settings)
        name = f"{name[: LONGEST_NAME - DIGEST_LENGTH - 1]}-{digest}"
    recipe = loaded.recipe.model_copy(update={"name": name})
    return replace(loaded, recipe=recipe, overrides=(*loaded.overrides, f"name={name}"))


def _digest(content: Any) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:DIGEST_LENGTH]


def _leaf(path: str) -> str:
    return path.rpartition(".")[2]


def _slug(words: Sequence[str]) -> str:
    return re.sub(r"[^a-z0-9_-]+", "_", "-".join(words).lower())


def written(value: JsonValue) -> str:
    """A value in the syntax of `--set`."""
    if isinstance(value, str):
        with contextlib.suppress(RecipeError):
            if plain(read_value(value, "")) == value:
                return value
    return json.dumps(value)


def _expanded(values: Sequence[JsonValue], place: str) -> list[JsonValue]:
    """The values of an axis with `0..4` expanded, without repetitions. Raises `RecipeError`."""
    found: list[JsonValue] = []
    for value in values:
        ends = INTEGERS.fullmatch(value) if isinstance(value, str) else None
        if ends is None:
            found.append(value)
            continue
        first, last = int(ends[1]), int(ends[2])
        if not 0 <= last - first < MOST_VALUES:
            text = f"{value}: should read SMALLER..LARGER, of {MOST_VALUES:,} integers at most"
            raise RecipeError([Problem(place, text)])
        found += range(first, last + 1)
    return _each_once(found)


def _each_once(values: Sequence[Any]) -> list[Any]:
    return [value for place, value in enumerate(values) if value not in values[:place]]


def _require_axes(axes: Sequence[str], file: Path | None) -> None:
    place = "--set" if file is None else str(file)
    if not axes:
        text = "a sweep varies something: `--set seed=0..4`, `--set task.references.use_rg=true,false`, or --from FILE"
        raise RecipeError([Problem(place, text)])
    for path in axes:
        if part := next((other for other in axes if path.startswith(f"{other}.")), ""):
            raise RecipeError([Problem(f"{place} {path}", f"is a part of {part}, which is varied, too; vary one")])
        if path in ("name", "description") or path.split(".")[0] in ("execution", "extends"):
            raise RecipeError([Problem(f"{place} {path}", "is not varied: it decides no result")])


def _read_file(file: Path) -> SweepFile:
    """Contents of the file of a sweep. Raises `RecipeError` with every problem and its line."""
    if not file.exists():
        raise RecipeError([Problem(f"--from {file}", "no such file")])
    tree = read_document(read_text(str(file), f"{file}:1:1"), str(file))
    if not isinstance(tree.value, dict):
        raise RecipeError([Problem(tree.place, "a sweep is a mapping with `grid`, `draws` or both")])
    try:
        return SweepFile.model_validate(plain(tree))
    except ValidationError as error:
        raise RecipeError([_problem(tree, found["loc"], found["msg"]) for found in error.errors()]) from None


def _problem(tree: Located, location: Sequence[int | str], message: str) -> Problem:
    path, found = descend(tree, location)
    text = message.removeprefix("Value error, ").replace("Input should", "should").replace("Extra inputs", "other keys")
    end = f" lacks '{location[-1]}'" if message == "Field required" else f": {text}"
    return Problem(found.place, f"{value_head(path, found, 'the sweep')}{end}")
