"""`play`, `export`, `robot` and `robot-sim`: watch, drive, share and deploy a policy."""

from pathlib import Path
from typing import Annotated, Literal

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


What = Annotated[
    str,
    typer.Argument(help="Export folder, or the recipe that made it.", metavar="EXPORT", autocompletion=completion.ran),
]
Network = Annotated[str, typer.Option(help="Network interface: lo for this machine, eth0 or another for a robot.")]
Domain = Annotated[int, typer.Option(help="DDS domain; the G1's is 0.", min=0, max=230)]
Scene = Annotated[str, typer.Option(help="Scene, which sets grasp and expected load.", metavar="SCENE")]
InStep = Annotated[
    bool, typer.Option("--lockstep", help="Synchronise with the other process step by step, on a busy machine.")
]
Seconds = Annotated[float, typer.Option(help="End after this time [s].", min=0.0)]


def robot(
    what: What,
    network: Network = "lo",
    domain: Domain = 0,
    scene: Scene = "free",
    commands: Annotated[
        str, typer.Option(help="Source of commands: remote, keyboard or udp:PORT.", metavar="SOURCE")
    ] = "keyboard",
    object_pose: Annotated[
        str | None, typer.Option(help="Source of the object's pose: udp:PORT (default: with the commands).")
    ] = None,
    log: Annotated[Path | None, typer.Option(help="Log every message to this new file.", metavar="MCAP")] = None,
    waive: Annotated[list[str] | None, typer.Option(help="Ignore a failure of this check (repeatable).")] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Check the robot and send nothing.")] = False,
    lockstep: InStep = False,
    seconds: Seconds = float("inf"),
) -> None:
    """Drive a robot on its bus with an exported controller; never tried on hardware, see docs/deployment.md."""
    from iowbc.commands.robot import robot

    robot(
        console(),
        what,
        network=network,
        domain=domain,
        scene=scene,
        commands=commands,
        object_pose=object_pose,
        log=log,
        waived=waive or (),
        dry_run=dry_run,
        lockstep=lockstep,
        seconds=seconds,
    )


def robot_sim(
    what: What,
    network: Network = "lo",
    domain: Domain = 0,
    scene: Scene = "free",
    mass: Annotated[float | None, typer.Option(help="Object mass [kg] (default: random).", min=0.0)] = None,
    seed: Annotated[int, typer.Option(min=0, max=2**32 - 1)] = 0,
    support: Annotated[
        Literal["band", "fixture", "none"] | None,
        typer.Option(help="Initial support of the robot (default: band; with an object: fixture)."),
    ] = None,
    release: Annotated[float, typer.Option(help="Time at full gains before the support releases [s].", min=0.0)] = 3.0,
    object_pose: Annotated[
        str | None, typer.Option(help="Send the object's pose to udp:PORT of this machine, as motion capture would.")
    ] = None,
    lockstep: InStep = False,
    seconds: Seconds = float("inf"),
    web: Web = False,
    port: Port = None,
) -> None:
    """Simulate a robot on the bus, which `iowbc robot` can drive."""
    from iowbc.commands.robot import simulated_robot

    simulated_robot(
        console(),
        what,
        network=network,
        domain=domain,
        scene=scene,
        mass=mass,
        seed=seed,
        support=support,
        release=release,
        object_pose=object_pose,
        lockstep=lockstep,
        seconds=seconds,
        port=page_port(web, port),
    )
