"""What `iowbc play` plays: a recipe's policy, one artifact, or an exported folder."""

from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from iowbc.commands.named import named
from iowbc.commands.training import require_training
from iowbc.errors import Damaged, Interrupted, UsageError
from iowbc.evaluation.play_request import PlayRequest as PlayRequest
from iowbc.pipeline.store.artifact import Artifact
from iowbc.pipeline.store.last_used import remaking
from iowbc.pipeline.store.store import Store

if TYPE_CHECKING:
    from iowbc.evaluation.play import Source

POLICIES = ("export", "distill", "teacher")
"""Stages that leave a policy, the one to prefer first."""
CONTRACT = "contract.json"
"""Every exported folder has one."""


def play_word(store: Store, console: Console, word: str, stage: str | None, request: PlayRequest) -> int:
    """Play an episode of what a word names. Returns the exit code."""
    require_training("play")
    artifact = None if (Path(word) / CONTRACT).is_file() else playable(store, word, stage)
    generator = None
    if artifact is not None:
        generator = generator_of(store, artifact)
        for read in filter(None, (artifact, generator)):
            _check_whole(store, read)

    from iowbc.evaluation.play import exported_source, play

    try:
        if artifact is None or artifact.manifest.stage == "export":
            source = exported_source(artifact.folder if artifact is not None else Path(word))
        else:
            source = _source(artifact, generator)
        shown = play(source, request)
    except Interrupted as stopped:
        console.print(str(stopped), markup=False, highlight=False)
        return 0
    made = f"; {request.video} has {shown.frames} pictures" if request.video else ""
    text = f"{shown.outcome.ending} after {shown.outcome.seconds:.1f} of {shown.duration:.1f} s{made}"
    console.print(text, markup=False, highlight=False, soft_wrap=True)
    return 0


def playable(store: Store, word: str, stage: str | None) -> Artifact:
    """The policy that a word and `--stage` name. Raises `UsageError`."""
    found = named(store, word)
    ready = [name for name in POLICIES if name in found.artifacts]
    if not ready or (stage is not None and stage not in ready):
        raise UsageError(
            f"{word}: no policy {f'of stage {stage} ' if stage else ''}to play; "
            f"stages that leave one: {', '.join(POLICIES)}; finished: {', '.join(found.artifacts) or 'none'}"
        )
    return found.artifacts[stage or ready[0]]


def _check_whole(store: Store, artifact: Artifact) -> None:
    """Raises `UsageError` where a file of an artifact is not what was published."""
    try:
        artifact.verify()
    except Damaged as error:
        raise UsageError(
            f"{artifact.folder} is damaged: {error}; to make it anew: {remaking(store.runs, artifact)}"
        ) from None


def generator_of(store: Store, artifact: Artifact) -> Artifact | None:
    """The reference generator that a policy was trained on; None for an export, which holds its own, or without one."""
    return None if artifact.manifest.stage == "export" else input_of(store, artifact, "rg-fit")


def input_of(store: Store, artifact: Artifact, stage: str) -> Artifact | None:
    """What an artifact was made from; None where it read nothing of that stage. Raises `UsageError` if it is gone."""
    digest = artifact.ingredients.get("inputs", {}).get(stage)
    if digest is None:
        return None
    found = next((one for one in store.artifacts(stage) if one.manifest.digest == digest), None)
    if found is None:
        raise UsageError(
            f"the {stage} (content {digest[:12]}) that {artifact.manifest.stage} "
            f"{artifact.manifest.key[:12]} was made from is no longer stored; run its recipe again"
        )
    return found


def _source(artifact: Artifact, generator: Artifact | None) -> "Source":
    """A policy with the world that its own recipe describes and the reference generator that it was trained on."""
    from iowbc.evaluation.play import Source
    from iowbc.recipe.recipe import Recipe
    from iowbc.robot.description import robot_folder
    from iowbc.task.specification import Specification

    recipe = Recipe.model_validate(artifact.recipe)
    folder = robot_folder(recipe.robot)
    world = Specification(recipe, folder, generator.folder if generator is not None else None)
    return Source(world, artifact.folder)
