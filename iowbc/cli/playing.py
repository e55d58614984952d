"""`play` and `export`: a policy to watch, to drive and to show to others."""

from pathlib import Path
from typing import Annotated

import typer

from iowbc.cli.options import RunsFolder, SceneName, console, store_in
from iowbc.commands import completion


def play(
    what: Annotated[
        str,
        typer.Argument(
            help="Recipe, RECIPE/STAGE, key, or the folder of an export.",
            metavar="WHAT",
            autocompletion=completion.artifacts,
        ),
    ],
    stage: Annotated[str | None, typer.Option(help="export, distill or teacher; the last one there is.")] = None,
    scene: SceneName = "lift",
    mass: Annotated[float, typer.Option(help="Mass of the object [kg]; 0 for none.", min=0.0)] = 4.0,
    partner_share: Annotated[
        float, typer.Option(help="Part of the weight that a partner bears.", min=0.0, max=1.0)
    ] = 0.0,
    seed: Annotated[int, typer.Option(min=0, max=2**32 - 1)] = 0,
    disturbances: Annotated[bool, typer.Option("--disturbances", help="With impulses and pushes.")] = False,
    video: Annotated[Path | None, typer.Option(help="Make a film instead of opening a window.", metavar="MP4")] = None,
    web: Annotated[bool, typer.Option("--web", help="Drive it in the browser; needs no display.")] = False,
    port: Annotated[int | None, typer.Option(help="Port of --web; 8080.", min=1, max=65535)] = None,
    runs: RunsFolder = None,
) -> None:
    """Watch a trained policy in the viewer, drive it in the browser, or make a film of it."""
    from iowbc.commands.play import PlayRequest, play_word
    from iowbc.commands.play_web import PORT, play_on_web
    from iowbc.errors import UsageError
    from iowbc.stages.registry import STAGES

    request = PlayRequest(
        scene=scene, mass=mass, partner_share=partner_share, seed=seed, disturbances=disturbances, video=video
    )
    if web:
        play_on_web(store_in(runs), console(), what, stage, request, port or PORT, STAGES)
    elif port is not None:
        raise UsageError("--port is that of the page that --web serves; give both")
    else:
        raise typer.Exit(play_word(store_in(runs), console(), what, stage, request, STAGES))


def export(
    what: Annotated[
        str,
        typer.Argument(
            help="Recipe, RECIPE/export, key, or the folder of an export.",
            metavar="WHAT",
            autocompletion=completion.artifacts,
        ),
    ],
    web: Annotated[Path, typer.Option("--web", help="Folder of the web page to write.", metavar="DIR")],
    runs: RunsFolder = None,
) -> None:
    """Write an exported controller as a web page, in which the robot moves on the visitor's machine (needs npm)."""
    from iowbc.commands.export import export_page

    export_page(store_in(runs), console(), what, web)
