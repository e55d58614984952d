"""`iowbc robot` and `iowbc robot-sim`: an exported controller on the robot's bus, and a simulated robot there."""

import signal
import threading
from collections.abc import Collection
from contextlib import ExitStack, closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from rich.console import Console
from typer import Option

from iowbc.commands import options
from iowbc.commands.printed import plain_table, stdout_console, tell
from iowbc.deploy.controller import Controller
from iowbc.deploy.exported_folder import exported_folder
from iowbc.errors import Interrupted, UsageError, require_known
from iowbc.evaluation.play_request import HEAVIEST
from iowbc.onboard.checks import CHECKS, LIMITS, CheckResult, checks
from iowbc.onboard.machine import Machine
from iowbc.onboard.operators import Keyboard, OperatorWithPoses, Udp, operator, single_keys, udp_port
from iowbc.onboard.ranges import Ranges

if TYPE_CHECKING:
    from iowbc.live.remote_view import RemoteView
    from iowbc.onboard.process import Clock
    from iowbc.twin.robot import Twin

LISTENING = 3.0
"""Time of listening to the bus before the checks [s]; the battery's state should arrive once or twice per second."""
POLLING = 5
"""Periods of the bus between two looks for a request of the page."""
Network = Annotated[str, Option(help="Network interface: lo for this machine, eth0 or another for a robot.")]
Domain = Annotated[int, Option(help="DDS domain; the G1's is 0.", min=0, max=230)]
Scene = Annotated[str, Option(help="Scene, which sets grasp and expected load.", metavar="SCENE")]
InStep = Annotated[
    bool, Option("--lockstep", help="Synchronise with the other process step by step, on a busy machine.")
]
Seconds = Annotated[float, Option(help="End after this time [s].", min=0.0)]


def robot(
    what: options.Exported,
    network: Network = "lo",
    domain: Domain = 0,
    scene: Scene = "free",
    commands: Annotated[
        str, Option(help="Source of commands: remote, keyboard or udp:PORT.", metavar="SOURCE")
    ] = "keyboard",
    object_pose: Annotated[
        str | None, Option(help="Source of the object's pose: udp:PORT (default: with the commands).")
    ] = None,
    log: Annotated[Path | None, Option(help="Log every message to this new file.", metavar="MCAP")] = None,
    waive: Annotated[list[str] | None, Option(help="Ignore a failure of this check (repeatable).")] = None,
    dry_run: Annotated[bool, Option("--dry-run", help="Check the robot and send no motor command.")] = False,
    lockstep: InStep = False,
    seconds: Seconds = float("inf"),
) -> None:
    """Check the robot and drive it. Raises UsageError where a check fails."""
    options.require_extra("robot", "iowbc robot")
    from iowbc.onboard.dds import DdsBus
    from iowbc.onboard.log import LogWriter, export_digest
    from iowbc.onboard.process import LockStep, MonotonicClock, drive, enable_realtime, listen

    console = stdout_console()
    for name in waive or ():
        require_known(name, "check", CHECKS)
    if lockstep and network != "lo":
        raise UsageError("--lockstep is for a simulated robot on this machine (--network lo); a robot does not wait")
    if dry_run and log is not None:
        raise UsageError(f"--log {log}: --dry-run logs nothing")
    controller = Controller.load(exported_folder(what))
    require_known(scene, "scene", [name for name, _ in controller.contract.references.grasps])
    source = operator(commands, controller.contract)
    ranges = Ranges(controller.contract)
    if object_pose is not None and not ranges.seen:
        raise UsageError(f"--object-pose {object_pose}: {controller.contract.recipe} does not observe the object")
    poses = None if object_pose is None else Udp(ranges, udp_port(object_pose, "--object-pose"))
    stop = _stop_request()
    bus = DdsBus(network, domain)
    with ExitStack() as stack:
        stack.callback(bus.close)
        tell(console, f"{controller.contract.recipe}: listening on {network} for {LISTENING:g} s")
        heard = listen(bus, LISTENING, stop.is_set)
        if stop.is_set():
            raise Interrupted("stopped before the checks; no motor command was sent")
        found = checks(controller, heard, scene, ranges.standing, LIMITS)
        own_pace = ("states",) if lockstep and heard.states else ()
        report_checks(console, found, (*(waive or ()), *own_pace))
        if dry_run:
            return
        about = {
            "recipe": controller.contract.recipe,
            "export": export_digest(controller),
            "scene": scene,
            "limits": LIMITS.model_dump_json(),
        }
        if isinstance(source, Keyboard):
            stack.enter_context(single_keys())
        writer = None if log is None else stack.enter_context(LogWriter(log, about))
        for port in (source, poses):
            if isinstance(port, Udp):
                stack.callback(port.close)
                port.discard()
        source.wanted(0.0, None)  # discard keys from before the robot was ready
        pace = "in step with the simulated robot" if lockstep else enable_realtime()
        origin = f"udp:{source.port}" if isinstance(source, Udp) else commands
        origin += "" if poses is None else f"; object pose from udp:{poses.port}"
        tell(console, f"{pace}; zero torque; commands from {origin}; Ctrl+C damps and ends")
        clock: Clock = LockStep() if lockstep else MonotonicClock()
        times = drive(
            bus,
            Machine(controller, scene),
            source if poses is None else OperatorWithPoses(source, poses),
            clock,
            charge=None if heard.battery is None else float(heard.battery["soc"]),
            seconds=seconds,
            log=writer,
            tell=lambda text: tell(console, text),
            stopped=stop.is_set,
        )
        tell(console, str(times))
        told = "" if writer is None else writer.failure
    if writer is not None and writer.failure != told:
        tell(console, f"--log {log}: {writer.failure}; its last messages are missing")


def _stop_request() -> threading.Event:
    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT, signal.SIGTSTP):
        signal.signal(number, lambda *_: stop.set())
    return stop


def report_checks(console: Console, found: list[CheckResult], waived: Collection[str]) -> None:
    """Print the checks. Raises UsageError for failed ones that are not waived, and for those that cannot be."""
    failed = [check for check in found if not check.passed and not (check.waivable and check.name in waived)]
    table = plain_table("check", "", "found")
    for check in found:
        table.add_row(check.name, "ok" if check.passed else "FAILED" if check in failed else "waived", check.text)
    console.print(table)
    if failed:
        names, (first, *_) = ", ".join(check.name for check in failed), failed
        other = f", or pass --waive {first.name} if you know why" if first.waivable else ""
        raise UsageError(f"{names}: failed, no motor command was sent; put it right{other}")


def robot_sim(
    what: options.Exported,
    network: Network = "lo",
    domain: Domain = 0,
    scene: Scene = "free",
    mass: Annotated[float | None, Option(help="Object mass [kg] (default: random).", min=0.0)] = None,
    seed: Annotated[int, Option(min=0, max=2**32 - 1)] = 0,
    support: Annotated[
        Literal["band", "fixture", "none"] | None,
        Option(help="Initial support of the robot (default: band; with an object: fixture)."),
    ] = None,
    release: Annotated[float, Option(help="Time at full gains before the support releases [s].", min=0.0)] = 3.0,
    object_pose: Annotated[
        str | None, Option(help="Send the object's pose to udp:PORT of this machine, as motion capture would.")
    ] = None,
    lockstep: InStep = False,
    seconds: Seconds = float("inf"),
    web: options.Web = False,
    port: options.Port = None,
) -> None:
    """Simulate a robot on the bus until it is stopped."""
    options.require_extra("robot", "iowbc robot-sim")
    options.require_extra("train", "iowbc robot-sim")
    page = options.page_port(web, port)
    from iowbc.evaluation.exported import exported_world
    from iowbc.onboard.dds import DdsBus
    from iowbc.twin.robot import Twin, object_tracking, serve
    from iowbc.twin.support import Support

    console = stdout_console()
    pose_port = None if object_pose is None else udp_port(object_pose, "--object-pose")
    folder = exported_folder(what)
    world, controller = exported_world(folder), Controller.load(folder)
    simulation = world.recipe.simulation
    require_known(scene, "scene", simulation.scenes.names)
    controller.reset(scene=scene)
    loaded = getattr(simulation.scenes, scene).object is not None
    if mass is not None and not (loaded and 0.0 < mass <= HEAVIEST):
        held = f"should be above 0 and at most {HEAVIEST:g} kg" if loaded else f"scene {scene} has no object"
        raise UsageError(f"--mass {mass:g}: {held}")
    kind = support or ("fixture" if loaded else "band")
    fixed = {"impulse_scale": 0.0, "push_scale": 0.0}
    if loaded:
        fixed |= {"partner_share": 0.0} | ({} if mass is None else {"object_mass": mass})
    posture = controller.settled_posture(Ranges(controller.contract).standing)[0]
    frequency = controller.contract.control_frequency
    twin = Twin(controller.robot, simulation, frequency, scene, seed, posture, Support(kind, release), fixed)
    stop, reported = _stop_request(), False
    with ExitStack() as stack:
        tracking = None if pose_port is None else stack.enter_context(object_tracking(pose_port))
        view = None
        if page is not None:
            from iowbc.live.remote_view import RemoteView

            view = stack.enter_context(closing(RemoteView(twin.simulation, page)))
            tell(console, f"http://{options.HOST}:{page}")
        bus = stack.enter_context(closing(DdsBus(network, domain)))
        tell(console, f"{controller.contract.robot} in scene {scene}, held by {kind}, on {network}; Ctrl+C ends")

        def watch(robot: Twin) -> None:
            nonlocal reported, view
            if tracking is not None:
                tracking(robot)
            if view is not None and robot.periods % POLLING == 0:
                try:
                    _show(robot, view)
                except EOFError:
                    view = None
                    robot.simulation.planned_push[0] = robot.simulation.planned_impulse[0] = 0.0
                    tell(console, "the page has ended; the robot goes on")
            if robot.fallen and not reported:
                reported = True
                tell(console, f"{robot.time:8.3f} s  fallen")

        serve(bus, twin, lambda: not stop.is_set() and twin.time < seconds, watch, lockstep=lockstep)
        tell(console, twin.verdict)


def _show(twin: "Twin", view: "RemoteView") -> None:
    """Answer the page's request for a picture and apply user actions. Raises EOFError after the page's end."""
    if (asked := view.asked()) is None:
        return
    simulation, support = twin.simulation, twin.support
    released, pulls = asked
    if released:
        support.let_go()
    simulation.planned_push[0] = pulls["robot"]
    simulation.planned_impulse[0] = pulls["object"] if simulation.state.has_object[0] else 0.0
    held = f", held by {support.kind}" if support.waits else ""
    view.answer(twin.time, (twin.band,), f"{twin.verdict}{held}", support.waits)
