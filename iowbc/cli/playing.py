"""`play` and `export`: watch, drive and share a policy."""

from pathlib import Path
from typing import Annotated

import typer

from iowbc.cli.options import Port, RunsFolder, SceneName, Web, console, page_port, store_in
from iowbc.commands import completion


def play(
    what: Annotated[
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
    scene: SceneName = "lift",
    mass: Annotated[float, typer.Option(help="Object mass [kg]; 0 removes the object.", min=0.0)] = 4.0,
    partner_share: Annotated[
        float, typer.Option(help="Share of the weight that the partner bears.", min=0.0, max=1.0)
    ] = 0.0,
    seed: Annotated[int, typer.Option(min=0, max=2**32 - 1)] = 0,
    disturbances: Annotated[bool, typer.Option("--disturbances", help="Enable random disturbances.")] = False,
    video: Annotated[
        Path | None, typer.Option(help="Record a film instead of opening a window.", metavar="MP4")
    ] = None,
    web: Web = False,
    port: Port = None,
    runs: RunsFolder = None,
) -> None:
    """Watch a trained policy in the viewer, drive it in the browser, or record a film."""
    from iowbc.commands.play import PlayRequest, play_on_web, play_word

    page = page_port(web, port)
    request = PlayRequest(
        scene=scene, mass=mass, partner_share=partner_share, seed=seed, disturbances=disturbances, video=video
    )
    if page is not None:
        play_on_web(store_in(runs), console(), what, stage, request, page)
    else:
        raise typer.Exit(play_word(store_in(runs), console(), what, stage, request))


def export(
    what: Annotated[
        str,
        typer.Argument(
            help="Recipe, RECIPE/export, key, or export folder.",
            metavar="WHAT",
            autocompletion=completion.artifacts,
        ),
    ],
    web: Annotated[Path, typer.Option("--web", help="Output folder of the web page.", metavar="DIR")],
    runs: RunsFolder = None,
) -> None:
    """Write a web page that simulates an exported controller in the browser (needs npm)."""
    from iowbc.commands.export import export_page

    export_page(store_in(runs), console(), what, web)
