"""`iowbc play --web`: a policy to be driven by hand in the browser, and the trials of its evaluation."""

from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from iowbc.commands.evaluated import evaluated_actor
from iowbc.commands.interrupt import close_on_termination
from iowbc.commands.named import named
from iowbc.commands.origins import policy_of
from iowbc.commands.play import NO_STAGES, Registry, artifact_source, named_source
from iowbc.commands.ports import HOST, require_free
from iowbc.commands.training import require_training, require_viewer
from iowbc.errors import UsageError
from iowbc.evaluation.play_request import PlayRequest
from iowbc.pipeline.store.artifact import Artifact
from iowbc.pipeline.store.store import Store

if TYPE_CHECKING:
    from iowbc.evaluation.play import Source
    from iowbc.evaluation.side_by_side import Actor

PORT = 8080
"""Where nothing else is asked for."""


def play_on_web(
    store: Store,
    console: Console,
    word: str,
    stage: str | None,
    request: PlayRequest,
    port: int,
    registry: Registry = NO_STAGES,
) -> None:
    """Serve the viewer until interrupted. Raises `UsageError` where it cannot begin."""
    if request.video is not None:
        raise UsageError("--web and --video exclude each other: open the page, or make a film")
    require_training("play")
    require_viewer()
    require_free(port)
    close_on_termination()
    evaluation = _evaluation(store, word)
    source = _source(store, console, word, stage, evaluation, registry)

    from iowbc.live.page import play_on_page
    from iowbc.live.server import serving
    from iowbc.live.session import Session

    def ready() -> None:
        console.print("Drive it in the browser; Ctrl-C ends it:", highlight=False)
        console.print(f"http://{HOST}:{port}", markup=False, highlight=False, soft_wrap=True)
        there = f"ssh -L {port}:{HOST}:{port} THIS_MACHINE"
        console.print(f"(from another machine: {there}, and the same address there)", markup=False, highlight=False)

    evaluated = None if evaluation is None else _actor(store, console, evaluation)
    with Session(source, request) as session, serving(port) as server:
        play_on_page(server, session, evaluated, ready)


def _source(
    store: Store, console: Console, word: str, stage: str | None, evaluation: Artifact | None, registry: Registry
) -> "Source":
    """The policy that is named, or the one that was played in the evaluation that is."""
    if evaluation is not None and [*named(store, word).artifacts] == [evaluation.manifest.stage]:
        return artifact_source(store, policy_of(store, evaluation))
    return named_source(store, console, word, stage, registry=registry)


def _evaluation(store: Store, word: str) -> Artifact | None:
    """The evaluation of what a word names, if it has one."""
    if Path(word).is_dir():
        return None
    try:
        return named(store, word).artifacts.get("eval")
    except UsageError:  # a first training, of which nothing is finished yet
        return None


def _actor(store: Store, console: Console, evaluation: Artifact) -> "Actor | None":
    """What an evaluation played, if that is still stored."""
    try:
        return evaluated_actor(store, evaluation)
    except UsageError as error:
        console.print(f"no trials to look through: {error}", markup=False, highlight=False, soft_wrap=True)
        return None
