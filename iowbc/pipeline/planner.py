"""What would run, and why."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from operator import attrgetter
from pathlib import Path
from typing import Any, Literal

from iowbc.errors import Damaged, Problem, RecipeError, shown
from iowbc.pipeline.code import changed_code, stage_code
from iowbc.pipeline.ingredients import key_values, slice_value
from iowbc.pipeline.nested import MISSING, differences, nested
from iowbc.pipeline.stage import START, Stage
from iowbc.pipeline.store.artifact import Artifact
from iowbc.pipeline.store.digests import data_digest, folder_digest
from iowbc.pipeline.store.store import Store
from iowbc.pipeline.store.workspace import Workspace
from iowbc.recipe.reading.finding import SUFFIXES, file_meant_in
from iowbc.recipe.reading.loading import LoadedRecipe, load_recipe
from iowbc.recipe.recipe import SEEDS
from iowbc.recipe.section import deciding

NOT_WHOLE = "its published artifact leaves out large files"
OnCodeChange = Literal["report", "rerun"]


@dataclass(frozen=True)
class Options:
    """How a run was asked for."""

    until: str | None = None
    force: frozenset[str] = frozenset()
    on_code_change: OnCodeChange = "report"
    workers: int | None = None
    engine: Literal["local", "ray"] | None = None
    address: str | None = None


@dataclass(frozen=True)
class Step:
    """A stage of a recipe: its key, whether its artifact can be used, and why not."""

    stage: Stage
    key: str | None
    """None while an input's content is not known."""
    ingredients: Mapping[str, Any] | None
    artifact: Artifact | None
    """The stored artifact with this key, whole; also where it would be replaced."""
    reasons: tuple[str, ...]
    """Why it would run; empty where it is cached."""
    notes: tuple[str, ...] = ()
    damage: str = ""
    """What is wrong with the stored artifact with this key."""
    expected: float | None = None
    """Time that it takes at the rate of a stored artifact or of its last attempt [s]; None where no rate is known."""
    roughly: float | None = None
    """Where no rate is known: time at the rate of the stored artifact that differs least, though it differs in more
    than seed and counts [s]."""
    rate_of: str = ""
    """Recipe whose artifact that rate is of."""
    code: Mapping[str, str] = field(default_factory=dict)
    predecessor: Artifact | None = None
    """The stored artifact that it would go on from."""

    @property
    def cached(self) -> bool:
        """True where the stored artifact is used as it is."""
        return not self.reasons

    @property
    def guess(self) -> float | None:
        """The expected time, or what comes nearest to one [s]."""
        return self.roughly if self.expected is None else self.expected


class Planner:
    """Decides, stage by stage, for one recipe on one store."""

    def __init__(
        self,
        loaded: LoadedRecipe,
        registry: Mapping[str, Stage],
        store: Store,
        robot: Path,
        options: Options,
        above: Sequence[Path] = (),
    ) -> None:
        """`above`: files of the recipes that begin from this one."""
        self.loaded = loaded
        self.store = store
        self.options = options
        self.robot = robot
        self.robot_digest = folder_digest(robot)
        self.deciding = deciding(loaded.recipe)
        self.stages = self._selected(registry)
        itself = () if loaded.overrides else (loaded.file.resolve(),)
        origins = {stage.name: self._origin(stage, registry, (*above, *itself)) for stage in self.stages}
        self.origins = {name: origin for name, origin in origins.items() if origin is not None}
        """By stage: the planner of the recipe whose artifact it begins from."""
        for stage in self.stages:
            if stage.name not in self.origins:
                self.start(stage)

    def _selected(self, registry: Mapping[str, Stage]) -> list[Stage]:
        """The recipe's stages up to `--until`. Raises `RecipeError` for names that are not the recipe's."""
        names = [str(name) for name in self.loaded.recipe.stages]
        for option, asked in (("--until", [self.options.until or names[-1]]), ("--force", sorted(self.options.force))):
            for name in asked:
                if name not in names:
                    text = f"'{name}' is not a stage of this recipe; valid: {', '.join(names)}"
                    raise RecipeError([Problem(f"{option} {name}", text)])
        stages = [registry[name] for name in names]
        for stage in stages:
            for wanted in stage.reads(self.loaded.recipe):
                if wanted not in names:
                    text = f"key 'stages': {stage.name} reads {wanted}, which is not among them: {', '.join(names)}"
                    raise RecipeError([Problem(self.loaded.place("stages"), text)])
        last = names.index(self.options.until) if self.options.until else len(names) - 1
        late = [name for name in names[last + 1 :] if name in self.options.force]
        if late:
            text = f"{', '.join(late)} comes after {self.options.until}, where --until ends the run; leave one out"
            raise RecipeError([Problem(f"--force {late[0]}", text)])
        chosen = stages[: last + 1]
        problems = [(path, text) for stage in chosen for path, text in stage.problems(self.loaded.recipe)]
        if problems:
            raise RecipeError([Problem(self.loaded.place(path), f"key '{path}': {text}") for path, text in problems])
        return chosen

    def plan(self) -> list[Step]:
        """A step for each stage, as things stand; nothing is changed."""
        steps: dict[str, Step] = {}
        for stage in self.stages:
            inputs = {name: steps[name].artifact if steps[name].cached else None for name in self.reads(stage)}
            step = self.decide(stage, {**inputs, **self.start(stage)})
            unknown = [name for name in inputs if not steps[name].cached and steps[name].expected is None]
            steps[stage.name] = replace(step, expected=None, roughly=step.guess) if unknown else step
        for stage in reversed(self.stages):
            for name in self.reads(stage):
                made = steps[name].artifact
                if not steps[stage.name].cached and steps[name].cached and made is not None and not made.whole:
                    steps[name] = replace(steps[name], reasons=(f"{NOT_WHOLE}; {stage.name} reads it",))
        return list(steps.values())

    def start(self, stage: Stage) -> dict[str, Artifact | None]:
        """The artifact that a stage begins from, by its name among the inputs; empty where the recipe names none.

        None for one that another recipe has not made yet. Raises `RecipeError` for one that is not stored, or damaged.
        """
        named = self._named_start(stage)
        if named is None:
            return {}
        if stage.name in self.origins:
            step = self.origins[stage.name].plan()[-1]
            return {START: step.artifact if step.cached else None}
        found = [one for one in self.store.artifacts(stage.name) if one.manifest.key.startswith(named)]
        if len(found) != 1:
            keys = ", ".join(one.manifest.key[:12] for one in found) or "none"
            raise self._wrong_start(stage, f"should begin one key of {stage.name}, begins {keys}; `iowbc ls` has them")
        try:
            found[0].verify()
        except Damaged as error:
            raise self._wrong_start(stage, f"is damaged: {error}") from None
        return {START: found[0]}

    def _named_start(self, stage: Stage) -> str | None:
        """What the recipe calls the artifact that a stage begins from."""
        return None if stage.starts_from is None else attrgetter(stage.starts_from)(self.loaded.recipe)

    def _origin(self, stage: Stage, registry: Mapping[str, Stage], above: Sequence[Path]) -> "Planner | None":
        """The planner of the recipe whose artifact a stage begins from. Raises `RecipeError` where it cannot be it."""
        named = self._named_start(stage)
        if named is None or Path(named).suffix not in SUFFIXES:
            return None
        place = self.loaded.place(stage.starts_from or "")
        said_in = self.loaded.file if place.startswith("--set ") else Path(place.rsplit(":", 2)[0])
        try:
            loaded = load_recipe(file_meant_in(said_in.parent, named))
        except RecipeError as error:
            raise self._wrong_start(stage, f"{error}") from None
        if loaded.file.resolve() in above:
            raise self._wrong_start(stage, "begins from itself in the end")
        if loaded.recipe.robot != self.loaded.recipe.robot:
            raise self._wrong_start(stage, f"is about another robot, {loaded.recipe.robot}")
        options = replace(self.options, until=stage.name, force=frozenset())
        return Planner(loaded, registry, self.store, self.robot, options, above)

    def _wrong_start(self, stage: Stage, text: str) -> RecipeError:
        path = stage.starts_from or ""
        return RecipeError(
            [Problem(self.loaded.place(path), f"key '{path}' = {shown(self._named_start(stage))}: {text}")]
        )

    def reads(self, stage: Stage) -> tuple[str, ...]:
        """Names of the stages whose artifacts a stage reads."""
        return stage.reads(self.loaded.recipe)

    def decide(self, stage: Stage, inputs: Mapping[str, Artifact | None], *, whole: bool = False) -> Step:
        """What is to be done for a stage whose inputs are these; None is an input that would be made anew.

        whole: a published artifact does not do that leaves out large files.
        """
        code = stage_code(stage)
        unknown = [name for name, artifact in inputs.items() if artifact is None]
        ingredients = {
            "stage": stage.name,
            "version": stage.version,
            "recipe": key_values(self.loaded.recipe, self.deciding, stage),
            "inputs": {name: artifact.manifest.digest if artifact else None for name, artifact in inputs.items()},
            "robot": self.robot_digest,
        }
        former = self._closest(stage.name, ingredients)
        expected, roughly = (None, None) if former is None else _reckoned(stage, former, ingredients)
        rate_of = "" if former is None else former.manifest.recipe
        if unknown:
            reasons = self._reasons(ingredients, former, unknown)
            return Step(
                stage,
                None,
                None,
                None,
                tuple(reasons),
                expected=expected,
                roughly=roughly,
                rate_of=rate_of,
                code=code,
            )
        key = data_digest(ingredients)
        artifact, damage = _checked(self.store.find, stage.name, key)
        notes: list[str] = []
        if artifact is None:
            artifact, published_damage = _checked(self.store.find_published, stage.name, key)
            if published_damage:
                notes.append(f"the published artifact is ignored, it is damaged: {published_damage}")
        found: list[str] = []
        if stage.name in self.options.force:
            found.append("forced by --force")
        if artifact is None and damage:
            found.append(f"damaged: {damage}")
        elif artifact is None:
            found.extend(self._reasons(ingredients, former, ()))
        elif whole and not artifact.whole:
            found.append(NOT_WHOLE)
        else:
            if damage:
                notes.append(f"the published artifact is used; the one made here is damaged: {damage}")
            expected = artifact.manifest.seconds
            changed = changed_code(artifact.manifest.code, code)
            if changed:
                text = f"code changed since it was made: {', '.join(changed)}"
                (found if self.options.on_code_change == "rerun" else notes).append(text)
            notes.extend(self._looks(stage, artifact))
        predecessor = None
        if found:
            notes.extend(self._checkpoint(stage, key))
            expected = self._rest(stage, key, expected)
            predecessor = None if stage.name in self.options.force else self._predecessor(stage, ingredients)
            if predecessor is not None:
                notes.append(f"extends {predecessor.manifest.key[:8]}, which ends earlier")
                expected = None if expected is None else max(0.0, expected - predecessor.manifest.seconds)
        return Step(
            stage,
            key,
            ingredients,
            artifact,
            tuple(found),
            tuple(notes),
            damage,
            expected,
            roughly,
            rate_of,
            code,
            predecessor,
        )

    def _predecessor(self, stage: Stage, ingredients: Mapping[str, Any]) -> Artifact | None:
        """The whole artifact of a stage that differs in nothing but an earlier end, the latest of several."""
        if stage.extends is None:
            return None
        aim = slice_value(self.deciding, stage.extends, stage)
        ends: dict[float, Artifact] = {}
        for artifact in self.store.artifacts(stage.name):
            old = artifact.ingredients
            changes = list(differences(nested(old.get("recipe", {})), nested(ingredients["recipe"])))
            alike = all(old.get(name) == ingredients[name] for name in ("version", "inputs", "robot"))
            there = not set(stage.extends_from) & set(artifact.manifest.omitted)
            if alike and there and [path for path, _, _ in changes] == [stage.extends] and changes[0][1] < aim:
                ends[changes[0][1]] = artifact
        for end in sorted(ends, reverse=True):
            try:
                ends[end].verify()
            except Damaged:
                continue
            return ends[end]
        return None

    def _looks(self, stage: Stage, artifact: Artifact) -> Iterator[str]:
        """Cosmetic values of a stage that an artifact was made with otherwise: it is used, and looks as it did."""
        for path, old, new in differences(artifact.recipe, self.loaded.recipe.model_dump(mode="json")):
            of_stage = any(path == part or path.startswith(f"{part}.") for part in stage.slice)
            if (
                of_stage
                and path != stage.starts_from
                and MISSING not in (old, new)
                and stage.name not in self.options.force
            ):
                yield f"{path} is {_shown(old)} in it; `--force {stage.name}` makes it with {_shown(new)}"

    def _attempt(self, stage: Stage, key: str) -> dict[str, Any]:
        """The record of an attempt that this run would go on from; empty where there is none."""
        record = Workspace(self.store.runs, stage.name, key).record
        return record if record.get("forced") or stage.name not in self.options.force else {}

    def _rest(self, stage: Stage, key: str, expected: float | None) -> float | None:
        """The time that is left where an earlier attempt has left something, at its own rate [s]."""
        record = self._attempt(stage, key)
        done, total, seconds = (float(record.get(name, 0.0)) for name in ("done", "total", "seconds"))
        return seconds * max(0.0, total / done - 1.0) if done and total and seconds else expected

    def _checkpoint(self, stage: Stage, key: str) -> Iterator[str]:
        """What an earlier attempt has left."""
        record = self._attempt(stage, key)
        if record:
            share = f", {100 * record['done'] / record['total']:.0f} %" if record["total"] else ""
            yield f"goes on from attempt {int(record['attempts']) or 1}{share}"

    def _closest(self, stage: str, ingredients: Mapping[str, Any]) -> Artifact | None:
        """The stored artifact of a stage that differs least; of several this recipe's own, then the newest."""

        def distance(artifact: Artifact) -> tuple[int, bool, float]:
            count = len(list(self._differences(ingredients, artifact.ingredients)))
            return count, artifact.manifest.recipe != self.loaded.recipe.name, -artifact.manifest.made

        return min(self.store.artifacts(stage), key=distance, default=None)

    def _reasons(self, ingredients: Mapping[str, Any], former: Artifact | None, unknown: Sequence[str]) -> list[str]:
        """Why a stage is made: whose artifact it is compared with, inputs made anew, then all that differs."""
        if former is None:
            return ["nothing stored yet"]
        found = list(self._differences(ingredients, former.ingredients))
        texts = [f"{name} is made anew" for name in unknown] + found
        if found and former.manifest.recipe != self.loaded.recipe.name:
            texts.insert(0, f"compared with recipe {former.manifest.recipe}")
        return texts or ["nothing stored yet"]

    def _differences(self, ingredients: Mapping[str, Any], old: Mapping[str, Any]) -> Iterator[str]:
        """How a key's ingredients differ from earlier ones, each with its place in the recipe."""
        for path, before, after in differences(nested(old.get("recipe", {})), nested(ingredients["recipe"])):
            yield f"{path} ({self.loaded.place(path)}): {_shown(before)} -> {_shown(after)}"
        if old.get("version") != ingredients["version"]:
            yield f"stage version {old.get('version')} -> {ingredients['version']}"
        if old.get("robot") != ingredients["robot"]:
            yield "the robot's files changed"
        old_inputs = old.get("inputs", {})
        for name, digest in ingredients["inputs"].items():
            if digest is not None and old_inputs.get(name) != digest:
                yield f"{name} changed" if name in old_inputs else f"{name} is read now"
        yield from (f"{name} is not read any more" for name in old_inputs if name not in ingredients["inputs"])


def _checked(find: Callable[[str, str], Artifact | None], stage: str, key: str) -> tuple[Artifact | None, str]:
    """The artifact that a store finds and whose files are what was written, or what is wrong with it."""
    try:
        artifact = find(stage, key)
        if artifact is not None:
            artifact.verify()
    except Damaged as error:
        return None, str(error)
    return artifact, ""


def _reckoned(
    stage: Stage, former: Artifact, ingredients: Mapping[str, Any]
) -> tuple[float, None] | tuple[None, float]:
    """The time that a stage takes at the rate of a stored artifact [s]: known, or roughly where more differs than seed
    and counts.

    It is proportional to each of the stage's counts.
    """
    old, seconds = former.ingredients, former.manifest.seconds
    alike = old.get("version") == ingredients["version"]
    for path, before, after in differences(nested(old.get("recipe", {})), nested(ingredients["recipe"])):
        if path in stage.counts and MISSING not in (before, after) and before:
            seconds *= after / before
        elif path not in SEEDS:
            alike = False
    return (seconds, None) if alike else (None, seconds)


def _shown(value: Any) -> str:
    return "(absent)" if value is MISSING else shown(value)
