"""What `iowbc play` plays: a recipe's policy, one artifact, or an exported folder."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console

from iowbc.commands.filming import Filming
from iowbc.commands.in_training import InTraining, in_training
from iowbc.commands.interrupt import close_on_termination
from iowbc.commands.named import named
from iowbc.commands.origins import generator_of, made_from, world_of
from iowbc.commands.results import POLICIES
from iowbc.commands.training import require_training
from iowbc.deploy.exported_folder import CONTRACT
from iowbc.errors import Interrupted, UsageError, require_known
from iowbc.evaluation.play_request import PlayRequest as PlayRequest
from iowbc.pipeline.store.artifact import Artifact
from iowbc.pipeline.store.last_used import require_whole
from iowbc.pipeline.store.store import Store

if TYPE_CHECKING:
    from iowbc.evaluation.play import Source


def play_word(store: Store, console: Console, word: str, stage: str | None, request: PlayRequest) -> int:
    """Play an episode of what a word names. Returns the exit code."""
    require_training("play")
    close_on_termination()
    source = named_source(store, console, word, stage, request.scene)

    from iowbc.evaluation.play import play

    try:
        with Filming(console, request.video) as filming:
            shown = play(source, request, progress=filming)
    except Interrupted as stopped:
        console.print(str(stopped), markup=False, highlight=False)
        return 0
    made = f"; {request.video} has {shown.frames} pictures" if request.video else ""
    text = f"{shown.outcome.ending} after {shown.outcome.seconds:.1f} of {shown.duration:.1f} s{made}"
    console.print(text, markup=False, highlight=False, soft_wrap=True)
    return 0


def named_source(store: Store, console: Console, word: str, stage: str | None, scene: str | None = None) -> "Source":
    """What a word and `--stage` name, told on the console while it is trained. Raises `UsageError`, also for a `scene`
    that its recipe has not."""
    from iowbc.evaluation.play import exported_source

    if os.path.isfile(Path(word, CONTRACT)):
        return exported_source(Path(word))
    training = in_training(store, word, stage)
    if training is not None and training.recipe is not None:
        console.print(training.text, markup=False, highlight=False, soft_wrap=True)
        return _training_source(store, training, training.recipe)
    try:
        artifact = playable(store, word, stage)
    except UsageError:
        if training is None:
            raise
        text = "there is neither a checkpoint that can be played nor a finished one; `iowbc status` tells how far it is"
        raise UsageError(f"{training.text}; {text}") from None
    if training is not None:
        console.print(f"{training.text}; this is a finished one", markup=False, highlight=False, soft_wrap=True)
    require_whole(store.runs, [artifact])
    if artifact.published:
        text = f"{artifact.manifest.stage} of {artifact.manifest.recipe}, as it came with the repository"
        console.print(text, markup=False, highlight=False, soft_wrap=True)
    scenes = artifact.recipe.get("simulation", {}).get("scenes", {})
    if scene is not None and scenes:
        require_known(scene, "scene", scenes)
    return _whole_source(store, artifact)


def artifact_source(store: Store, artifact: Artifact) -> "Source":
    """A stored policy with its world. Raises `UsageError` where its files are damaged."""
    require_whole(store.runs, [artifact])
    return _whole_source(store, artifact)


def _whole_source(store: Store, artifact: Artifact) -> "Source":
    """The same of a policy that is known to be whole."""
    from iowbc.evaluation.play import exported_source

    generator = generator_of(store, artifact)
    if generator is not None:
        require_whole(store.runs, [generator])
    return exported_source(artifact.folder) if artifact.manifest.stage == "export" else _source(artifact, generator)


def playable(store: Store, word: str, stage: str | None) -> Artifact:
    """The policy that a word and `--stage` name. Raises `UsageError`."""
    found = named(store, word).usable
    ready = [name for name in POLICIES if name in found]
    if not ready or (stage is not None and stage not in ready):
        raise UsageError(
            f"{word}: no policy {f'of stage {stage} ' if stage else ''}to play; "
            f"stages that leave one: {', '.join(POLICIES)}; finished: {', '.join(found) or 'none'}"
        )
    return found[stage or ready[0]]


def _source(artifact: Artifact, generator: Artifact | None) -> "Source":
    """A policy with the world that its own recipe describes and the reference generator that it was trained on."""
    from iowbc.evaluation.play import Source

    world = world_of(artifact.recipe, generator)
    student = artifact.manifest.stage == "distill" or world.recipe.teacher.history is not None
    return Source(world.deployed if student else world, artifact.folder)


def _training_source(store: Store, training: InTraining, recipe: Mapping[str, Any]) -> "Source":
    """The newest checkpoint of a training, with the world of its recipe."""
    from iowbc.evaluation.play import Source

    generator = made_from(store, training.ingredients, "rg-fit", f"{training.stage} {training.key[:12]}")
    return Source(world_of(recipe, generator), training.checkpoint, training.key)
