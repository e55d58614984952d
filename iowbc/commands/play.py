"""`iowbc play`: shows or films a policy, or serves a page to drive it by hand and to replay its evaluation's trials."""

import contextlib
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from iowbc.commands import completion, options
from iowbc.commands.lookup import (
    in_training,
    input_artifact,
    input_of,
    named,
    policy_of,
    policy_stages,
    world_of,
)
from iowbc.commands.printed import film_progress, stdout_console, tell
from iowbc.commands.process import close_on_termination
from iowbc.commands.request import prepared
from iowbc.commands.results import evaluated_actor
from iowbc.deploy.exported_folder import CONTRACT
from iowbc.errors import Interrupted, UsageError, require_known
from iowbc.evaluation.play_request import PlayRequest
from iowbc.pipeline.stage_plan import Options
from iowbc.pipeline.store.artifact import Artifact
from iowbc.pipeline.store.last_used import recall, require_whole
from iowbc.pipeline.store.runs import Runs
from iowbc.pipeline.store.store import Store
from iowbc.recipe.evaluation.evaluation import Evaluation
from iowbc.recipe.reading.loading import SUFFIXES, load_recipe
from iowbc.recipe.recipe import Recipe
from iowbc.stages.inputs import policy_stage

if TYPE_CHECKING:
    from iowbc.evaluation.play import Source
    from iowbc.evaluation.side_by_side import Actor
    from iowbc.learning.networks import TeacherNetwork
    from iowbc.skill.lower_layer import Student
    from iowbc.task.specification import Specification

SKILL = "skill"
MASS = 4.0
"""Mass of the object by default [kg]."""


@dataclass(frozen=True)
class Held:
    """Fixed quantities of a skill's game; drawn if empty."""

    mass: float | None = None
    """Mass of the object [kg]."""
    share: float | None = None
    """Share of the weight that the human bears."""
    partner: str | None = None
    """Behaviour of the human; empty: the first that the skill has not met in training."""

    def require_playable(self, request: PlayRequest) -> None:
        """Raises UsageError for a game without an object or with random disturbances."""
        if self.mass == 0.0 or request.disturbances:
            raise UsageError("a game has an object (--mass above 0) and no random --disturbances: its human disturbs")


@dataclass(frozen=True)
class Planned:
    """Recipe and cached artifacts of a recipe file that is played; empty for a key, a name or a folder."""

    recipe: Recipe | None = None
    artifacts: Mapping[str, Artifact] = field(default_factory=dict)
    """Stored artifacts that its plan uses, by stage."""


def play(
    word: Annotated[
        str,
        typer.Argument(
            help="Recipe, RECIPE/STAGE, key, or export folder.",
            metavar="WHAT",
            autocompletion=completion.artifacts,
        ),
    ],
    stage: Annotated[
        str | None, typer.Option(help="Stage whose policy is played (default: the last one available).")
    ] = None,
    scene: options.SceneName = "lift",
    mass: Annotated[
        float | None,
        typer.Option(help="Object mass [kg]; 0 removes the object (default: 4; drawn in a skill's game).", min=0.0),
    ] = None,
    partner_share: Annotated[
        float | None,
        typer.Option(
            help="Share of the weight that the partner bears (default: 0; drawn in a skill's game).", min=0.0, max=1.0
        ),
    ] = None,
    partner: Annotated[
        str | None,
        typer.Option(help="Human of a skill's game (default: one not met in training).", metavar="BEHAVIOUR"),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, max=2**32 - 1)] = 0,
    disturbances: Annotated[bool, typer.Option("--disturbances", help="Enable random disturbances.")] = False,
    video: Annotated[
        Path | None, typer.Option(help="Record a film instead of opening a window.", metavar="MP4")
    ] = None,
    web: options.Web = False,
    port: options.Port = None,
    runs: options.RunsFolder = options.RUNS,
) -> None:
    """Play an episode of what a word names, in the viewer, in the browser or as a film. Raises `UsageError`."""
    page, store, console = options.page_port(web, port), Store(Runs(runs)), stdout_console()
    request = PlayRequest(
        scene=scene,
        mass=MASS if mass is None else mass,
        partner_share=partner_share or 0.0,
        seed=seed,
        disturbances=disturbances,
        video=video,
    )
    held = Held(mass, partner_share, partner)
    if page is not None:
        play_on_web(store, console, word, stage, request, held, page)
        return
    options.require_extra("train", "iowbc play")
    close_on_termination()
    plan = planned(store, word)
    skill = skill_to_play(store, word, stage, plan)
    if skill is not None:
        play_game(store, console, skill, request, held)
        return
    if partner is not None:
        raise UsageError(f"{word}: --partner is the human of a skill's game, and this names no skill")
    source = named_source(store, console, word, stage, request.scene, plan)

    from iowbc.evaluation.play import play as play_episode

    try:
        progress = film_progress(console, request.video)
        episode, outcome, pictures = play_episode(source, request, progress=progress)
    except Interrupted as stopped:
        console.print(str(stopped), markup=False, highlight=False)
        return
    made = f"; {request.video} has {pictures} pictures" if request.video else ""
    tell(console, f"{outcome.ending} after {outcome.seconds:.1f} of {episode.duration:.1f} s{made}")


def play_on_web(
    store: Store, console: Console, word: str, stage: str | None, request: PlayRequest, held: Held, port: int
) -> None:
    """Serve the viewer in the browser until interrupted. Raises `UsageError` where it cannot begin."""
    if request.video is not None:
        raise UsageError("--web and --video exclude each other: open the page, or make a film")
    options.require_extra("train", "iowbc play")
    options.require_extra("web", "--web")
    options.require_free(port)
    close_on_termination()

    from iowbc.live.page import Page
    from iowbc.live.server import serving

    def ready() -> None:
        console.print("Drive it in the browser; Ctrl-C ends it:", highlight=False)
        tell(console, f"http://{options.HOST}:{port}")
        there = f"ssh -L {port}:{options.HOST}:{port} THIS_MACHINE"
        console.print(f"(from another machine: {there}, and the same address there)", markup=False, highlight=False)

    plan = planned(store, word)
    skill = skill_to_play(store, word, stage, plan)
    if skill is not None:
        from iowbc.live.game import GamePanel, GameRequest, GameSession

        held.require_playable(request)
        if held.partner is not None:
            raise UsageError("--web and --partner exclude each other: on the page you are the human")
        found = _playable_skill(store, skill, request.scene)
        tell(console, f"skill of {skill.manifest.recipe}: you are its partner")
        first = GameRequest(found.task, request.seed, mass=held.mass, share=held.share)
        with GameSession(found.world, found.student, found.robot, first) as game, serving(port) as server:
            Page(server, game, panel=GamePanel).run(ready)
        return
    source, actor = _driven(store, console, word, stage, plan)

    from iowbc.live.session import Session

    with Session(source, request) as session, serving(port) as server:
        Page(server, session, actor).run(ready)


def planned(store: Store, word: str) -> Planned:
    """The plan of a recipe's file. Raises `RecipeError` for one that is wrong."""
    if Path(word).suffix not in SUFFIXES or not os.path.isfile(word):
        return Planned()
    loaded = load_recipe(word)
    steps = prepared(loaded, store.runs, Options()).plan()
    return Planned(loaded.recipe, {step.stage.name: step.artifact for step in steps if step.cached and step.artifact})


def skill_to_play(store: Store, word: str, stage: str | None, plan: Planned = Planned()) -> Artifact | None:
    """The skill that a word and `--stage` name; None where they name no skill, or another stage."""
    if stage not in (None, SKILL) or os.path.isdir(word):
        return None
    if plan.recipe is not None:
        return plan.artifacts.get(SKILL)
    with contextlib.suppress(UsageError):  # a first training has nothing finished yet
        return named(store, word).usable.get(SKILL)
    return None


def play_game(store: Store, console: Console, skill: Artifact, request: PlayRequest, held: Held) -> None:
    """Play a game of a skill in the viewer or as a film; its human alone knows the path. Raises `UsageError`."""
    held.require_playable(request)

    from iowbc.skill.game import NOMINAL, ROBOT
    from iowbc.skill.plan import AGENT, Plan
    from iowbc.skill.playing import film_game, show_game
    from iowbc.skill.single_game import SingleGame

    found = _playable_skill(store, skill, request.scene)
    partners = found.world.recipe.skill.partners
    humans = [kind for kind in (*partners.held_out, *partners.training) if kind != AGENT]
    human = held.partner or humans[0]
    require_known(human, "human of the skill", humans)
    plan = Plan(found.task, human, known=False, mass=held.mass, share=held.share, seed=request.seed)
    with contextlib.closing(SingleGame(found.world, found.student, NOMINAL | {ROBOT: found.robot}, plan)) as game:
        title = f"{skill.manifest.recipe}: {plan.task}, {game.mass:.0f} kg, partner {human}, seed {request.seed}"
        tell(console, title)
        made = ""
        try:
            if request.video is None:
                show_game(game)
            else:
                pictures = film_game(game, request.video, title, film_progress(console, request.video))
                made = f"; {request.video} has {pictures} pictures"
        except Interrupted as stopped:
            console.print(str(stopped), markup=False, highlight=False)
            return
        tell(console, f"{game.ending.replace('_', ' ')} after {game.seconds:.1f} s{made}")


@dataclass(frozen=True)
class PlayableSkill:
    """A trained skill, with what it commands, and the task that is played first."""

    world: "Specification"
    student: "Student"
    robot: "TeacherNetwork"
    task: str


def _playable_skill(store: Store, skill: Artifact, scene: str) -> PlayableSkill:
    """A skill and the first task of a scene. Raises `UsageError`."""
    from iowbc.learning.storage import load_teacher
    from iowbc.skill.lower_layer import load_student

    recipe = Recipe.model_validate(skill.recipe)
    generator, student = (input_of(store, skill, name) for name in ("rg-fit", policy_stage(recipe)))
    if student is None:
        raise UsageError(f"{skill.folder}: this skill read no controller; run its recipe again")
    require_whole(store.runs, [skill, student, *([generator] if generator else [])])
    first = {getattr(recipe.skill.tasks, name).scene: name for name in reversed(recipe.skill.tasks.names)}
    require_known(scene, "scene with a transport task", first)
    world = world_of(skill.recipe, generator).deployed
    robot = load_teacher(skill.folder, "robot")[0]
    return PlayableSkill(world, load_student(student.folder, world), robot, first[scene])


def _driven(
    store: Store, console: Console, word: str, stage: str | None, plan: Planned
) -> "tuple[Source, Actor | None]":
    """The policy to drive by hand, and the trials of its evaluation."""
    found: Mapping[str, Artifact] = {}
    if not os.path.isdir(word):
        with contextlib.suppress(UsageError):  # a first training has nothing finished yet
            found = named(store, word).artifacts
    evaluation = found.get("eval")
    if evaluation is not None and len(found) == 1:
        played = policy_of(store, evaluation)
        require_whole(store.runs, [played])
        source = _whole_source(store, played)
    else:
        source = named_source(store, console, word, stage, plan=plan)
    try:
        return source, None if evaluation is None else evaluated_actor(store, evaluation)
    except UsageError as error:
        tell(console, f"no trials to look through: {error}")
        return source, None


def named_source(
    store: Store,
    console: Console,
    word: str,
    stage: str | None,
    scene: str | None = None,
    plan: Planned | None = None,
) -> "Source":
    """The source that a word and `--stage` denote; prints a line if it is still in training. Raises `UsageError`, also
    for a `scene` that its recipe lacks. `plan`: the word's plan, if known.

    A recipe file denotes the artifacts that `iowbc plan` reports as cached. The section `eval` of that file, or of the
    recipe's last run for a name, sets how they are played.
    """
    from iowbc.evaluation.play import Source, exported_source, with_evaluation

    if os.path.isfile(Path(word, CONTRACT)):
        return exported_source(Path(word))
    training = in_training(store, word, stage)
    if training is not None and training.recipe is not None:
        tell(console, training.text)
        generator = input_artifact(store, training.ingredients, "rg-fit", f"{training.stage} {training.key[:12]}")
        return Source(world_of(training.recipe, generator), training.checkpoint, training.key)
    plan = plan or planned(store, word)
    try:
        artifact = playable(store, word, stage, plan)
    except UsageError:
        if training is None:
            raise
        text = "there is neither a checkpoint that can be played nor a finished one; `iowbc status` tells how far it is"
        raise UsageError(f"{training.text}; {text}") from None
    if training is not None:
        tell(console, f"{training.text}; this is a finished one")
    known = {} if plan.recipe else recall(store.runs, word.partition("/")[0]).recipe
    asked = plan.recipe.eval if plan.recipe else Evaluation.model_validate(known["eval"]) if "eval" in known else None
    require_whole(store.runs, [artifact])
    if artifact.published:
        tell(console, f"{artifact.manifest.stage} of {artifact.manifest.recipe}, as it came with the repository")
    scenes = artifact.recipe.get("simulation", {}).get("scenes", {})
    if scene is not None and scenes:
        require_known(scene, "scene", [*scenes, *(asked.scenes if asked else ())])
    source = _whole_source(store, artifact)
    return source if asked is None else with_evaluation(source, asked)


def _whole_source(store: Store, artifact: Artifact) -> "Source":
    """A stored, verified policy with the world of its own recipe and the reference generator that it was trained with.
    Raises `UsageError` if the generator is missing or damaged."""
    from iowbc.evaluation.play import Source, exported_source

    if artifact.manifest.stage == "export":
        return exported_source(artifact.folder)
    generator = input_of(store, artifact, "rg-fit")
    if generator is not None:
        require_whole(store.runs, [generator])
    world = world_of(artifact.recipe, generator)
    student = artifact.manifest.stage == "distill" or world.recipe.teacher.history is not None
    return Source(world.deployed if student else world, artifact.folder)


def playable(store: Store, word: str, stage: str | None, plan: Planned = Planned()) -> Artifact:
    """The policy that a word and `--stage` name, before all one that its file plans to use. Raises `UsageError`."""
    leave = any(name in plan.artifacts for name in policy_stages())
    found = plan.artifacts if leave else named(store, word).usable
    ready = [name for name in policy_stages() if name in found]
    if not ready or (stage is not None and stage not in ready):
        raise UsageError(
            f"{word}: no policy {f'of stage {stage} ' if stage else ''}to play; "
            f"stages that leave one: {', '.join(policy_stages())}; finished: {', '.join(found) or 'none'}"
        )
    return found[stage or ready[0]]
