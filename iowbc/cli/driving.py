"""`robot` and `robot-sim`: drive a robot, or a simulated one, with an exported controller."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from iowbc.cli.options import Port, Web, console, page_port
from iowbc.commands import completion

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
    from iowbc.commands.robot import robot as drive

    drive(
        console(),
        what,
        network=network,
        domain=domain,
        scene=scene,
        commands=commands,
        object_pose=object_pose,
        log=log,
        waive=waive,
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
