"""The plan of a recipe: stages that would run, and why."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from iowbc.errors import Damaged, Problem, RecipeError, shown
from iowbc.files import data_digest, folder_digest
from iowbc.pipeline.code import changed_code, stage_code
from iowbc.pipeline.nested import MISSING, differences, nested
from iowbc.pipeline.stage import ExternalInput, Stage, slice_value
from iowbc.pipeline.stage_plan import Options, StagePlan, estimated
from iowbc.pipeline.store.artifact import Artifact
from iowbc.pipeline.store.runs import read_record
from iowbc.pipeline.store.store import Store
from iowbc.pipeline.store.workspace import PROGRESS, Progress
from iowbc.recipe.reading.loading import SUFFIXES, LoadedRecipe, file_meant_in, load_recipe
from iowbc.recipe.section import deciding

NOT_WHOLE = "its published artifact leaves out large files"


@dataclass(eq=False)
class Planner:
    """Planner of one recipe on one store."""

    loaded: LoadedRecipe
    stages: Sequence[Stage]
    store: Store
    robot: Path
    options: Options
    origins: Mapping[tuple[str, str], "Planner"]
    """Planners of the recipes that make borrowed artifacts, by stage and input; see `planner_for`."""
    whole: bool = False
    """A stage that runs reads the last artifact: a published one does not do that leaves out large files."""

    def __post_init__(self) -> None:
        self.robot_digest = folder_digest(self.robot)
        self.deciding = deciding(self.loaded.recipe)

    def plan(self, known: "Plans | None" = None) -> list[StagePlan]:
        """The plan of each stage for the current store, which is not changed. `known`: plans that were just made."""
        known, steps = {} if known is None else known, dict[str, StagePlan]()
        if self in known:
            return known[self]
        borrowed = {stage.name: self.borrowed(stage, known) for stage in self.stages}
        for stage in self.stages:
            inputs = {
                name: steps[name].artifact if steps[name].cached else None for name in stage.reads(self.loaded.recipe)
            }
            step = self.decide(stage, {**inputs, **borrowed[stage.name]})
            unknown = [name for name in inputs if not steps[name].cached and steps[name].expected is None]
            steps[stage.name] = replace(step, expected=None, roughly=step.guess) if unknown else step
        for stage in reversed(self.stages):
            for name in stage.reads(self.loaded.recipe):
                step, made = steps[name], steps[name].artifact
                if not steps[stage.name].cached and step.cached and made is not None and not made.whole:
                    timed = estimated(step, self.store.artifacts(name), made)
                    steps[name] = replace(timed, reasons=(f"{NOT_WHOLE}; {stage.name} reads it",))
        running = [stage for stage in self.stages if not steps[stage.name].cached]
        if any(self._want_whole(stage, borrowed[stage.name]) for stage in running):
            known.clear()
            return self.plan(known)
        known[self] = list(steps.values())
        return known[self]

    def chain(self) -> "list[Planner]":
        """This planner and those of all recipes that it begins from, each once."""
        return list(dict.fromkeys([self, *(one for origin in self.origins.values() for one in origin.chain())]))

    def _want_whole(self, stage: Stage, borrowed: Mapping[str, Artifact | None]) -> bool:
        """True if a stage that runs borrows artifacts that are not whole; from now on their recipes make them. Raises
        `RecipeError` for one that the recipe names by its key."""
        lacking = [name for name, one in borrowed.items() if one is not None and not one.whole]
        for name in lacking:
            origin = self.origins.get((stage.name, name))
            if origin is None:
                raise wrong_origin(self.loaded, stage.borrows(self.loaded.recipe)[name], NOT_WHOLE)
            origin.whole = True
        return bool(lacking)

    def borrowed(self, stage: Stage, known: "Plans | None" = None) -> dict[str, Artifact | None]:
        """The artifacts of other recipes that a stage reads, by their names among the inputs; None for one that is not
        made yet. Raises `RecipeError` for one that is not stored, or damaged."""
        known, found = {} if known is None else known, dict[str, Artifact | None]()
        for name, one in stage.borrows(self.loaded.recipe).items():
            if (stage.name, name) in self.origins:
                step = self.origins[stage.name, name].plan(known)[-1]
                found[name] = step.artifact if step.cached else None
            else:
                found[name] = self.named(one)
        return found

    def named(self, borrowed: ExternalInput) -> Artifact:
        """The stored artifact whose key the recipe names. Raises `RecipeError` unless exactly one fits, undamaged."""
        found = [one for one in self.store.artifacts(borrowed.stage) if one.manifest.key.startswith(borrowed.named)]
        if len(found) != 1:
            keys = ", ".join(one.manifest.key[:12] for one in found) or "none"
            text = f"should begin one key of {borrowed.stage}, begins {keys}; `iowbc ls` has them"
            raise wrong_origin(self.loaded, borrowed, text)
        try:
            found[0].verify()
        except Damaged as error:
            raise wrong_origin(self.loaded, borrowed, f"is damaged: {error}") from None
        return found[0]

    def decide(self, stage: Stage, inputs: Mapping[str, Artifact | None], *, whole: bool = False) -> StagePlan:
        """The plan for a stage with these inputs; None is an input that would be made anew. whole: require
        all results, as the last stage with `self.whole` does; a published artifact may lack large ones."""
        unknown = [name for name, artifact in inputs.items() if artifact is None]
        ingredients = {
            "stage": stage.name,
            "version": stage.version,
            "recipe": stage.key_values(self.loaded.recipe, self.deciding),
            "inputs": {name: artifact.manifest.digest if artifact else None for name, artifact in inputs.items()},
            "robot": self.robot_digest,
        }
        there = {name: artifact for name, artifact in inputs.items() if artifact is not None}
        step = StagePlan(stage, ingredients=ingredients, inputs=there, code=stage_code(stage))
        if not unknown:
            keyed = replace(step, key=data_digest(ingredients))
            step = self._with_cached_artifact(keyed, whole or (self.whole and stage is self.stages[-1]))
            if step.artifact is not None and step.cached:
                return step
        former = self._closest(stage.name, ingredients)
        if former is not None:
            step = estimated(step, self.store.artifacts(stage.name), former)
        if step.artifact is None:
            why = [f"damaged: {step.damage}"] if step.damage else self._reasons(ingredients, former, unknown)
            step = replace(step, reasons=(*step.reasons, *why))
        return step if unknown else self._with_resume_point(step)

    def _with_cached_artifact(self, step: StagePlan, whole: bool) -> StagePlan:
        """The plan with the stored, undamaged artifact of its key, the reasons not to use it, and notes."""
        stage, notes = step.stage, list[str]()
        reasons = ["forced by --force"] if stage.name in self.options.force else []
        artifact, damage = self.store.checked(stage.name, step.key)
        if artifact is None:
            artifact, published_damage = self.store.checked(stage.name, step.key, published=True)
            if published_damage:
                notes.append(f"the published artifact is ignored, it is damaged: {published_damage}")
        if artifact is not None:
            if damage:
                notes.append(f"the published artifact is used; the one made here is damaged: {damage}")
            changed = changed_code(artifact.manifest.code, step.code)
            text = f"code changed since it was made: {', '.join(changed)}"
            if whole and not artifact.whole:
                reasons.append(NOT_WHOLE)
            elif changed and self.options.same_code:
                reasons.append(text)
            if changed and not self.options.same_code:
                notes.append(text)
            notes.extend(self._cosmetic_notes(stage, artifact))
        return replace(step, artifact=artifact, damage=damage, reasons=tuple(reasons), notes=tuple(notes))

    def _with_resume_point(self, step: StagePlan) -> StagePlan:
        """The plan of a stage that runs, with the earlier attempt or the artifact of a shorter run to resume."""
        stage, notes, expected, predecessor = step.stage, list(step.notes), step.expected, None
        record = read_record(Progress, self.store.runs.work / step.key / PROGRESS)
        forced = stage.name in self.options.force
        if record and record.continues(forced, step.code if self.options.same_code else None):
            notes.append(", ".join(filter(None, [f"goes on from attempt {record.attempts or 1}", record.share])))
            if record.done and record.total and record.seconds:  # the remaining part at the attempt's rate
                expected = record.seconds * max(0.0, record.total / record.done - 1.0)
        if not forced:
            predecessor = self._predecessor(step)
        if predecessor is not None:
            changed = changed_code(predecessor.manifest.code, step.code)
            code = f"; code changed since it was made: {', '.join(changed)}" if changed else ""
            notes.append(f"extends {predecessor.manifest.key[:8]}, which ends earlier{code}")
            expected = None if expected is None else max(0.0, expected - predecessor.manifest.seconds)
        return replace(step, notes=tuple(notes), expected=expected, predecessor=predecessor)

    def _predecessor(self, step: StagePlan) -> Artifact | None:
        """The undamaged artifact that differs only in a smaller `stage.extends`; of several the longest. None with
        other code where that is to run again."""
        stage, ingredients, same_code = step.stage, step.ingredients, self.options.same_code
        if stage.extends is None:
            return None
        aim = slice_value(self.deciding, stage.extends, stage)
        ends: dict[float, Artifact] = {}
        for artifact in self.store.artifacts(stage.name):
            old = artifact.ingredients
            changes = list(differences(nested(old.get("recipe", {})), nested(ingredients["recipe"])))
            alike = all(old.get(name) == ingredients[name] for name in ("version", "inputs", "robot"))
            there = not set(stage.extends_from) & set(artifact.manifest.omitted)
            there = there and not (same_code and changed_code(artifact.manifest.code, step.code))
            if alike and there and [path for path, _, _ in changes] == [stage.extends] and changes[0][1] < aim:
                ends[changes[0][1]] = artifact
        for end in sorted(ends, reverse=True):
            with suppress(Damaged):
                ends[end].verify()
                return ends[end]
        return None

    def _cosmetic_notes(self, stage: Stage, artifact: Artifact) -> Iterator[str]:
        """Notes on cosmetic values that differ from those an artifact was made with; it is used unchanged."""
        if stage.name in self.options.force:
            return
        borrowed = {one.path for one in stage.borrows(self.loaded.recipe).values()}
        for path, old, new in differences(artifact.recipe, self.loaded.recipe.model_dump(mode="json")):
            of_stage = any(path == part or path.startswith(f"{part}.") for part in stage.slice)
            if of_stage and path not in borrowed and MISSING not in (old, new):
                yield f"{path} is {shown(old)} in it; `--force {stage.name}` makes it with {shown(new)}"

    def _closest(self, stage: str, ingredients: Mapping[str, Any]) -> Artifact | None:
        """The stored artifact of a stage that differs least; of several this recipe's own, then the newest."""

        def distance(artifact: Artifact) -> tuple[int, bool, float]:
            count = len(list(self._differences(ingredients, artifact.ingredients)))
            return count, artifact.manifest.recipe != self.loaded.recipe.name, -artifact.manifest.made

        return min(self.store.artifacts(stage), key=distance, default=None)

    def _reasons(self, ingredients: Mapping[str, Any], former: Artifact | None, unknown: Sequence[str]) -> list[str]:
        """Reasons to run a stage: the recipe compared with, inputs that are re-made, then all differences."""
        if former is None:
            return ["nothing stored yet"]
        found = list(self._differences(ingredients, former.ingredients))
        texts = [f"{name} is made anew" for name in unknown] + found
        if found and former.manifest.recipe != self.loaded.recipe.name:
            texts.insert(0, f"compared with recipe {former.manifest.recipe}")
        return texts or ["nothing stored yet"]

    def _differences(self, ingredients: Mapping[str, Any], old: Mapping[str, Any]) -> Iterator[str]:
        """Differences of a key's ingredients from earlier ones, each with its place in the recipe."""
        for path, before, after in differences(nested(old.get("recipe", {})), nested(ingredients["recipe"])):
            yield f"{path} ({self.loaded.place(path)}): {shown(before)} -> {shown(after)}"
        if old.get("version") != ingredients["version"]:
            yield f"stage version {old.get('version')} -> {ingredients['version']}"
        if old.get("robot") != ingredients["robot"]:
            yield "the robot's files changed"
        old_inputs = old.get("inputs", {})
        for name, digest in ingredients["inputs"].items():
            if digest is not None and old_inputs.get(name) != digest:
                yield f"{name} changed" if name in old_inputs else f"{name} is read now"
        yield from (f"{name} is not read any more" for name in old_inputs if name not in ingredients["inputs"])


Plans = dict[Planner, list[StagePlan]]
"""Plans by planner, so that a recipe that several others start from is planned once."""


def planner_for(
    loaded: LoadedRecipe,
    registry: Mapping[str, Stage],
    store: Store,
    robot: Path,
    options: Options,
    above: Sequence[Path] = (),
    ready: "dict[tuple[Path, str], Planner] | None" = None,
) -> Planner:
    """The planner of a recipe and of those whose artifacts it borrows. `above`: files of the recipes that borrow from
    it; `ready`: shared planners by file and last stage.

    Raises `RecipeError` for stages that are missing or cannot run, and for missing borrowed artifacts.
    """
    stages = _selected(loaded, registry, options)
    itself = () if loaded.overrides else (loaded.file.resolve(),)
    origins, ready = dict[tuple[str, str], Planner](), {} if ready is None else ready
    planner = Planner(loaded, stages, store, robot, options, origins)
    for stage in stages:
        for name, borrowed in stage.borrows(loaded.recipe).items():
            origin = _origin(loaded, borrowed, (*above, *itself))
            if origin is None:
                planner.named(borrowed)
                continue
            place = origin.file.resolve(), borrowed.stage
            if place not in ready:
                until = replace(options, until=borrowed.stage, force=frozenset())
                ready[place] = planner_for(origin, registry, store, robot, until, (*above, *itself), ready)
            origins[stage.name, name] = ready[place]
    return planner


def _selected(loaded: LoadedRecipe, registry: Mapping[str, Stage], options: Options) -> list[Stage]:
    """The recipe's stages up to `--until`. Raises `RecipeError` for unknown stages and their problems."""
    names = [str(name) for name in loaded.recipe.stages]
    for option, asked in (("--until", [options.until or names[-1]]), ("--force", sorted(options.force))):
        for name in asked:
            if name not in names:
                text = f"'{name}' is not a stage of this recipe; valid: {', '.join(names)}"
                raise RecipeError([Problem(f"{option} {name}", text)])
    stages = [registry[name] for name in names]
    for stage in stages:
        for wanted in stage.reads(loaded.recipe):
            if wanted not in names:
                text = f"key 'stages': {stage.name} reads {wanted}, which is not among them: {', '.join(names)}"
                raise RecipeError([Problem(loaded.place("stages"), text)])
    last = names.index(options.until) if options.until else len(names) - 1
    late = [name for name in names[last + 1 :] if name in options.force]
    if late:
        text = f"{', '.join(late)} comes after {options.until}, where --until ends the run; leave one out"
        raise RecipeError([Problem(f"--force {late[0]}", text)])
    chosen = stages[: last + 1]
    problems = [(path, text) for stage in chosen for path, text in stage.problems(loaded.recipe)]
    if problems:
        raise RecipeError([Problem(loaded.place(path), f"key '{path}': {text}") for path, text in problems])
    return chosen


def wrong_origin(loaded: LoadedRecipe, borrowed: ExternalInput, text: str) -> RecipeError:
    """The error that the recipe names an artifact which a stage cannot read."""
    path = borrowed.path
    return RecipeError([Problem(loaded.place(path), f"key '{path}' = {shown(borrowed.named)}: {text}")])


def _origin(loaded: LoadedRecipe, borrowed: ExternalInput, above: Sequence[Path]) -> LoadedRecipe | None:
    """The recipe of a borrowed artifact, if named by file. Raises `RecipeError` if that recipe does not fit."""
    if Path(borrowed.named).suffix not in SUFFIXES:
        return None
    place = loaded.place(borrowed.path)
    said_in = loaded.file if place.startswith("--set ") else Path(place.rsplit(":", 2)[0])
    try:
        origin = load_recipe(file_meant_in(said_in.parent, borrowed.named))
    except RecipeError as error:
        raise wrong_origin(loaded, borrowed, f"{error}") from None
    if origin.file.resolve() in above:
        raise wrong_origin(loaded, borrowed, "begins from itself in the end")
    if origin.recipe.robot != loaded.recipe.robot:
        raise wrong_origin(loaded, borrowed, f"is about another robot, {origin.recipe.robot}")
    return origin
