"""`iowbc play`: shows or films a policy, or serves a page to drive it by hand and to replay its evaluation's trials."""

from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from rich.console import Console
from typer import Argument, Option

from iowbc.commands import completion, options
from iowbc.commands.playable import driven, named_source, planned, playable_skill, skill_to_play
from iowbc.commands.printed import film_progress, stdout_console, tell
from iowbc.commands.process import close_on_termination
from iowbc.errors import Interrupted, UsageError, require_known
from iowbc.evaluation.play_request import PlayRequest
from iowbc.pipeline.store.runs import Runs
from iowbc.pipeline.store.store import Store

if TYPE_CHECKING:
    from iowbc.evaluation.play import Source
    from iowbc.live.session import Played
    from iowbc.skill.single_game import SingleGame


def play(
    word: Annotated[
        str,
        Argument(
            help="Recipe, RECIPE/STAGE, key, or export folder.", metavar="WHAT", autocompletion=completion.artifacts
        ),
    ],
    stage: Annotated[str | None, Option(help="Stage whose policy is played (default: the last one available).")] = None,
    scene: options.SceneName = "lift",
    mass: Annotated[
        float | None,
        Option(help="Object mass [kg]; 0 removes the object (default: 4; drawn in a skill's game).", min=0.0),
    ] = None,
    partner_share: Annotated[
        float | None,
        Option(
            help="Share of the weight that the partner bears (default: 0; drawn in a skill's game).", min=0.0, max=1.0
        ),
    ] = None,
    partner: Annotated[
        str | None,
        Option(help="Human of a skill's game (default: one not met in training).", metavar="BEHAVIOUR"),
    ] = None,
    seed: Annotated[int, Option(min=0, max=2**32 - 1)] = 0,
    disturbances: Annotated[bool, Option("--disturbances", help="Enable random disturbances.")] = False,
    video: Annotated[Path | None, Option(help="Record a film instead of opening a window.", metavar="MP4")] = None,
    web: options.Web = False,
    port: options.Port = None,
    runs: options.RunsFolder = options.RUNS,
) -> None:
    """Play an episode of what a word names, in the viewer, in the browser or as a film. Raises `UsageError`."""
    store, console = Store(Runs(runs)), stdout_console()
    request = PlayRequest(
        scene=scene,
        mass=PlayRequest.mass if mass is None else mass,
        partner_share=partner_share or 0.0,
        seed=seed,
        disturbances=disturbances,
        video=video,
    )
    if request.object_mass == 0.0 and (mass or partner_share):
        raise UsageError("--mass above 0 and --partner-share need an object: choose another --scene, or no --mass 0")
    if web and video is not None:
        raise UsageError("--web and --video exclude each other: open the page, or make a film")
    options.require_extra("train", "iowbc play")
    page = options.page_port(web, port)
    close_on_termination()
    plan = planned(store, word)
    skill = skill_to_play(store, word, stage, plan)
    if skill is not None:
        if mass == 0.0 or disturbances:
            raise UsageError("a game has an object (--mass above 0) and no random --disturbances: its human disturbs")
        if page is not None and partner is not None:
            raise UsageError("--web and --partner exclude each other: on the page you are the human")
        from iowbc.skill.episodes import AGENT, PERSON, Plan
        from iowbc.skill.game import NOMINAL, ROBOT
        from iowbc.skill.single_game import SingleGame

        world, student, robot, task = playable_skill(store, skill, scene)
        recipe, human, partners = skill.manifest.recipe, PERSON, world.recipe.skill.partners
        if page is None:
            humans = [kind for kind in (*partners.held_out, *partners.training) if kind != AGENT]
            human = partner or humans[0]
            require_known(human, "human of the skill", humans)
        first = Plan(task, human, known=False, mass=mass, share=partner_share, seed=seed)
        if page is None:
            with closing(SingleGame(world, student, NOMINAL | {ROBOT: robot}, first)) as game:
                title = f"{recipe}: {task}, {game.mass:.0f} kg, partner {human}, seed {seed}"
                _play_game(console, game, title, video)
            return
        from iowbc.live.game import GamePanel, GameSession

        tell(console, f"skill of {recipe}: you are its partner")
        _serve(console, page, GameSession(world, student, robot, first), panel=GamePanel)
    elif partner is not None:
        raise UsageError(f"{word}: --partner is the human of a skill's game, and this names no skill")
    elif page is not None:
        from iowbc.live.session import Session

        source, actor = driven(store, console, word, stage, plan)
        _serve(console, page, Session(source, request), evaluated=actor)
    else:
        _play_episode(named_source(store, console, word, stage, scene, plan), request, console)


def _play_episode(source: "Source", request: PlayRequest, console: Console) -> None:
    from iowbc.evaluation.play import play

    try:
        episode, outcome, pictures = play(source, request, progress=film_progress(console, request.video))
    except Interrupted as stopped:
        console.print(str(stopped), markup=False, highlight=False)
        return
    made = f"; {request.video} has {pictures} pictures" if request.video else ""
    tell(console, f"{outcome.ending} after {outcome.seconds:.1f} of {episode.duration:.1f} s{made}")


def _serve(console: Console, port: int, session: "Played", **shown: Any) -> None:
    """Serve the page of a session until interrupted; `shown`: further arguments of `Page`."""
    from iowbc.live.page import Page
    from iowbc.live.server import serving

    def ready() -> None:
        console.print("Drive it in the browser; Ctrl-C ends it:", highlight=False)
        tell(console, f"http://{options.HOST}:{port}")
        there = f"ssh -L {port}:{options.HOST}:{port} THIS_MACHINE"
        console.print(f"(from another machine: {there}, and the same address there)", markup=False, highlight=False)

    with closing(session), serving(port) as server:
        Page(server, session, **shown).run(ready)


def _play_game(console: Console, game: "SingleGame", title: str, video: Path | None) -> None:
    from iowbc.skill.single_game import film_game, show_game

    tell(console, title)
    made = ""
    try:
        if video is None:
            show_game(game)
        else:
            pictures = film_game(game, video, title, film_progress(console, video))
            made = f"; {video} has {pictures} pictures"
    except Interrupted as stopped:
        console.print(str(stopped), markup=False, highlight=False)
        return
    tell(console, f"{game.ending.replace('_', ' ')} after {game.seconds:.1f} s{made}")
