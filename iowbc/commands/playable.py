"""Lookup of what is played: a policy with its world, a skill with its controller, and the inputs of their artifacts."""

import contextlib
import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console

from iowbc.commands.lookup import name_in, named, policy_stages
from iowbc.commands.printed import tell
from iowbc.commands.request import prepared
from iowbc.commands.results import TRIALS
from iowbc.deploy.exported_folder import CONTRACT
from iowbc.errors import UsageError, require_known
from iowbc.pipeline.console.wording import ago
from iowbc.pipeline.stage_plan import Options
from iowbc.pipeline.store.artifact import INGREDIENTS, RECIPE, Artifact
from iowbc.pipeline.store.last_used import recall, require_results, require_whole
from iowbc.pipeline.store.locks import holder
from iowbc.pipeline.store.runs import read_json, read_yaml
from iowbc.pipeline.store.store import Store
from iowbc.pipeline.store.workspace import unfinished
from iowbc.recipe.evaluation.evaluation import Evaluation
from iowbc.recipe.reading.loading import SUFFIXES, load_recipe
from iowbc.recipe.recipe import Recipe
from iowbc.report.runs import Run
from iowbc.robot.description import robot_folder
from iowbc.stages.eval import acting_stage
from iowbc.stages.inputs import policy_stage
from iowbc.stages.registry import STAGES
from iowbc.task.specification import Specification

if TYPE_CHECKING:
    import pandas as pd

    from iowbc.evaluation.films import Actor
    from iowbc.evaluation.play import Source
    from iowbc.learning.networks import TeacherNetwork
    from iowbc.skill.lower_layer import Student

SKILL = "skill"
CHECKPOINT = Path("scratch", "training.checkpoint")
UNPLANNED = Run("", {})
"""Plan of a key, a name or a folder: no recipe and no artifacts."""


def planned(store: Store, word: str) -> Run:
    """The recipe of a file with the artifacts that its plan uses, or `UNPLANNED`. Raises `RecipeError`."""
    if Path(word).suffix not in SUFFIXES or not os.path.isfile(word):
        return UNPLANNED
    loaded = load_recipe(word)
    steps = prepared(loaded, store.runs, Options()).plan()
    cached = {step.stage.name: step.artifact for step in steps if step.cached and step.artifact}
    return Run(word, cached, loaded.recipe.model_dump(mode="json"))


def skill_to_play(store: Store, word: str, stage: str | None, plan: Run = UNPLANNED) -> Artifact | None:
    """The skill that a word and `--stage` name; None where they name no skill, or another stage."""
    if stage not in (None, SKILL):
        return None
    return plan.artifacts.get(SKILL) if plan.recipe else _finished(store, word).usable.get(SKILL)


def _finished(store: Store, word: str) -> Run:
    """The run that a word names; an empty one for a folder, and while no stage has finished."""
    if not os.path.isdir(word):
        with contextlib.suppress(UsageError):
            return named(store, word)
    return UNPLANNED


def playable_skill(store: Store, skill: Artifact, scene: str) -> "tuple[Specification, Student, TeacherNetwork, str]":
    """World of a skill, its controller and its network, and the first task of a scene. Raises `UsageError`."""
    from iowbc.learning.storage import load_teacher
    from iowbc.skill.lower_layer import load_student

    recipe = Recipe.model_validate(skill.recipe)
    generator, student = (input_of(store, skill, name) for name in ("rg-fit", policy_stage(recipe)))
    if student is None:
        raise UsageError(f"{skill.folder}: this skill read no controller; run its recipe again")
    require_whole(store.runs, [skill, student, *([generator] if generator else [])])
    for artifact in (skill, student):
        require_results(store.runs, artifact)
    first = {getattr(recipe.skill.tasks, name).scene: name for name in reversed(recipe.skill.tasks.names)}
    require_known(scene, "scene with a transport task", first)
    world = world_of(skill.recipe, generator).deployed
    robot = load_teacher(skill.folder, "robot")[0]
    return world, load_student(student.folder, world), robot, first[scene]


def named_source(
    store: Store, console: Console, word: str, stage: str | None, scene: str | None, plan: Run
) -> "Source":
    """The source that a word, with its plan, and `--stage` denote, as the section `eval` of the recipe file, or of the
    recipe's last run, plays it; prints a line if it is still in training. Raises `UsageError`, also for a `scene` that
    the recipe lacks."""
    from iowbc.evaluation.play import exported_source, with_evaluation

    if os.path.isfile(Path(word, CONTRACT)):
        if stage is not None:
            raise UsageError(f"{word} is an export folder and names one policy; leave --stage out")
        return exported_source(Path(word))
    training, checkpoint = in_training(store, word, stage, plan)
    if checkpoint is not None:
        tell(console, training)
        return checkpoint
    try:
        artifact = playable(store, word, stage, plan)
    except UsageError:
        if not training:
            raise
        text = "there is neither a checkpoint that can be played nor a finished one; `iowbc status` tells how far it is"
        raise UsageError(f"{training}; {text}") from None
    if training:
        tell(console, f"{training}; this is another, which has finished")
    known = plan.recipe or recall(store.runs, word.partition("/")[0]).recipe
    asked = Evaluation.model_validate(known["eval"]) if "eval" in known else None
    require_whole(store.runs, [artifact])
    if artifact.published:
        tell(console, f"{artifact.manifest.stage} of {artifact.manifest.recipe}, as it came with the repository")
    scenes = artifact.recipe.get("simulation", {}).get("scenes", {})
    if scene is not None and scenes:
        require_known(scene, "scene", [*scenes, *(asked.scenes if asked else ())])
    source = whole_source(store, artifact)
    return source if asked is None else with_evaluation(source, asked)


def in_training(store: Store, word: str, stage: str | None, plan: Run = UNPLANNED) -> "tuple[str, Source | None]":
    """Message about the newest unfinished training that `RECIPE/STAGE`, or a recipe and `--stage`, names, empty without
    one, and where the plan uses a finished one; and its checkpoint, if that can be played: that of an interrupted
    training only where none has finished. Raises `UsageError` if its reference generator is gone."""
    from iowbc.evaluation.play import Source

    name, slash, last = word.rpartition("/")
    name, wanted = (name, last) if slash and Path(word).suffix not in SUFFIXES else (word, stage)
    if slash and last in STAGES and stage not in (None, last):
        raise UsageError(f"{word} --stage {stage}: two stages; name one of them")
    if wanted not in STAGES or not STAGES[wanted].trained_by or wanted in plan.artifacts:
        return "", None
    own = [one for one in unfinished(store.runs) if (one[1].stage, one[1].recipe) == (wanted, name_in(name))]
    if not own:
        return "", None
    folder, record = own[0]
    checkpoint, ingredients, recipe = folder / CHECKPOINT, read_json(folder / INGREDIENTS), read_yaml(folder / RECIPE)
    held = holder(store.runs, folder.name)
    state = "is being trained" if held else "was interrupted"
    text = f"{wanted} of {record.recipe} {state}{f', {record.share} done' if record.share else ''}"
    finished = not held and not plan.recipe and wanted in _finished(store, name).usable
    if finished or wanted != "teacher" or not (checkpoint.is_file() and recipe and ingredients):
        return text, None
    generator = input_artifact(store, ingredients, "rg-fit", f"{wanted} {folder.name[:12]}")
    text += f"; this is its checkpoint of {ago(checkpoint.stat().st_mtime)}"
    return text, Source(world_of(recipe, generator), checkpoint, folder.name)


def whole_source(store: Store, artifact: Artifact) -> "Source":
    """A policy with the world of its recipe. Raises `UsageError` if its reference generator is missing or damaged."""
    from iowbc.evaluation.play import Source, exported_source

    if artifact.manifest.stage == "export":
        return exported_source(artifact.folder)
    generator = input_of(store, artifact, "rg-fit")
    if generator is not None:
        require_whole(store.runs, [generator])
    world = world_of(artifact.recipe, generator)
    student = artifact.manifest.stage == "distill" or world.recipe.teacher.history is not None
    return Source(world.deployed if student else world, artifact.folder)


def playable(store: Store, word: str, stage: str | None, plan: Run = UNPLANNED) -> Artifact:
    """The policy that a word and `--stage` name, before all one that its file plans to use. Raises `UsageError`."""
    leave = any(name in plan.artifacts for name in policy_stages())
    found = plan.artifacts if leave else named(store, word).usable
    ready = [name for name in policy_stages() if name in found]
    if not ready or (stage is not None and stage not in ready):
        raise UsageError(
            f"{word}: no policy {f'of stage {stage} ' if stage else ''}to play; "
            f"stages that leave one: {', '.join(policy_stages())}; finished: {', '.join(found) or 'none'}"
        )
    chosen = stage or next((name for name in ready if found[name].whole), ready[0])
    require_results(store.runs, found[chosen])
    return found[chosen]


def driven(store: Store, console: Console, word: str, stage: str | None, plan: Run) -> "tuple[Source, Actor | None]":
    """The policy to drive by hand, and the trials of its evaluation."""
    found = _finished(store, word).artifacts
    evaluation = found.get("eval")
    if evaluation is not None and len(found) == 1:
        played = policy_of(store, evaluation)
        require_whole(store.runs, [played])
        source = whole_source(store, played)
    else:
        source = named_source(store, console, word, stage, None, plan)
    try:
        return source, None if evaluation is None else evaluated_actor(store, evaluation)
    except UsageError as error:
        tell(console, f"no trials to look through: {error}")
        return source, None


def evaluated_actor(store: Store, artifact: Artifact, trials: "pd.DataFrame | None" = None) -> "Actor":
    """The actor of an artifact of `eval`; `trials`: its table, if it is read already. Raises `UsageError`."""
    import pandas as pd

    from iowbc.evaluation.films import Actor
    from iowbc.evaluation.trials.protocol import evaluated_policy, evaluated_world

    if trials is None and not (artifact.folder / TRIALS).is_file():
        raise UsageError(f"{artifact.folder} has none: its recipe asks for a probe alone")
    table = pd.read_parquet(artifact.folder / TRIALS) if trials is None else trials
    world = evaluated_world(world_of(artifact.recipe, input_of(store, artifact, "rg-fit")))
    policy = policy_of(store, artifact).folder if acting_stage(world.recipe) else None
    return Actor(world, evaluated_policy(world, policy), table)


def input_of(store: Store, artifact: Artifact, stage: str) -> Artifact | None:
    """The input of a stage that an artifact was made from, or None. Raises `UsageError` if it is gone."""
    manifest = artifact.manifest
    return input_artifact(store, artifact.ingredients, stage, f"{manifest.stage} {manifest.key[:12]}")


def input_artifact(store: Store, ingredients: Mapping[str, Any], stage: str, what: str) -> Artifact | None:
    """The artifact of a stage among the ingredients of the key of `what`. Raises `UsageError` if it is gone."""
    digest = ingredients.get("inputs", {}).get(stage)
    if digest is None:
        return None
    found = next((one for one in store.artifacts(stage) if one.manifest.digest == digest), None)
    if found is None:
        raise UsageError(
            f"the {stage} (content {digest[:12]}) that {what} was made from is no longer stored; run its recipe again"
        )
    return found


def policy_of(store: Store, evaluation: Artifact) -> Artifact:
    """The policy that an evaluation played. Raises `UsageError`."""
    for name, stage in reversed(STAGES.items()):
        if stage.trained_by and (policy := input_of(store, evaluation, name)) is not None:
            require_results(store.runs, policy)
            return policy
    raise UsageError(f"{evaluation.folder}: this evaluation read no policy; run its recipe again")


def world_of(resolved: Mapping[str, Any], generator: Artifact | None) -> Specification:
    """The world of a resolved recipe; `generator`: the reference generator that its policy was trained on."""
    recipe = Recipe.model_validate(resolved)
    return Specification(recipe, robot_folder(recipe.robot), None if generator is None else generator.folder)
