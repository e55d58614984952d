"""Safety limits, checks before the robot moves, and reasons to damp it while it moves."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pydantic import Field

from iowbc.arrays import Array
from iowbc.control.sensors import quantities
from iowbc.deploy.contract import Contract
from iowbc.deploy.controller import Controller
from iowbc.onboard.messages import Record
from iowbc.onboard.sensors import MeasuredState, Sensors
from iowbc.recipe.section import Section
from iowbc.robot.g1_motors import MOTORS


class SafetyLimits(Section):
    """Limits of checks and watchdogs."""

    state_age: float = Field(default=0.015, gt=0.0)
    """Age of the newest state at which it is stale [s]: seven lost messages at 500 Hz; with the loop's period, damping
    begins within 20 ms of the last state."""
    frozen: float = Field(default=0.05, gt=0.0)
    """Time for which the inertial unit, or all motors, may repeat their values [s]: sensors have noise, and 25 states
    allow for a board that updates them more slowly."""
    command_age: float = Field(default=0.5, gt=0.0)
    """Age of the newest command at which it is stale [s]; the robot covers 0.3 m in it at full speed."""
    object_age: float = Field(default=0.1, gt=0.0)
    """Age of the newest object pose at which it is stale [s]: five control periods."""
    overrun: float = Field(default=0.01, gt=0.0)
    """Longest time between two cycles of the loop [s]: five periods, half a control period."""
    tilt: float = Field(default=1.0, gt=0.0)
    """Largest angle between pelvis and vertical [rad]; deep bows lean by 0.6, and beyond 1 it falls."""
    position_margin: float = Field(default=0.1, ge=0.0)
    """Largest measured distance of a joint beyond its limits [rad]: encoder bias and elastic stops."""
    speed: float = Field(default=1.0, gt=0.0)
    """Highest joint speed as a multiple of the motor's no-load speed."""
    torque: float = Field(default=1.2, gt=0.0)
    """Highest estimated torque as a multiple of the motor's limit: saturation is allowed, the estimate has errors."""
    battery: float = Field(default=20.0, ge=0.0, le=100.0)
    """Least charge at the start; below it, a moving robot warns [%]."""
    battery_empty: float = Field(default=10.0, ge=0.0, le=100.0)
    """Least charge of a moving robot [%]; an assumption, since the charge at which it turns off is not public."""
    battery_age: float = Field(default=10.0, gt=0.0)
    """Age of the newest battery message at which a moving robot warns [s]; one or two a second are expected."""
    temperature: float = Field(default=80.0, gt=0.0)
    """Highest motor temperature at the start; above it, a moving robot warns [°C]."""
    temperature_hot: float = Field(default=100.0, gt=0.0)
    """Highest motor temperature of a moving robot [°C]; an assumption, since the drives' own limit is not public."""
    standing_tilt: float = Field(default=0.35, gt=0.0)
    """Largest angle between pelvis and vertical at which Stand and Run begin [rad]."""
    standing_speed: float = Field(default=3.0, gt=0.0)
    """Highest joint speed at which Stand begins [rad/s]; noise alone reaches 1.7 in training."""
    standing_error: float = Field(default=0.3, gt=0.0)
    """Largest distance of a joint from the standing posture at which Run begins [rad]; arms sag under a load."""
    ramp: float = Field(default=3.0, gt=0.0)
    """Time over which Stand raises the gains and moves to the standing posture [s]."""
    damping: float = Field(default=1.0, gt=0.0)
    """Velocity gains while damping, as a multiple of the contract's."""


LIMITS = SafetyLimits()


CHECKS = ("states", "model", "ankles", "mode", "publishers", "joints", "battery", "temperature", "policy")
MODEL = 5
"""`mode_machine` of the G1 with 29 joints, revision 1.0, whose masses and gears the MJCF has."""
PITCH_ROLL = 0
"""`mode_pr` in which ankles and waist are commanded by pitch and roll, not by their motors' angles."""
STATES = (400.0, 700.0)
"""Fewest and most state messages a second: a robot sends 500; of more, some are of a second one."""
MIXED = "states of two robots, or of one that has just restarted: time stamps go back"
DRY_STEPS = 5
"""Policy steps of the dry run on the measured posture; their targets are not sent."""
FURTHEST = 1.0
"""Largest plausible distance of a dry-run target from the default posture [rad]."""


@dataclass(frozen=True)
class CheckResult:
    """One check and its result."""

    name: str
    passed: bool
    text: str
    waivable: bool = True
    """False if the robot must not be driven while the check fails."""


@dataclass(frozen=True)
class BusSnapshot:
    """Messages received while listening to the bus before the robot moves."""

    states: Sequence[Record]
    seconds: float
    battery: Record | None
    others: int
    """Number of low-level commands from other programs."""
    mode: str | None
    """The robot's active built-in controller: "" for none, None without an answer."""


def checks(
    controller: Controller, heard: BusSnapshot, scene: str, wanted: Array, limits: SafetyLimits
) -> list[CheckResult]:
    """All checks, most important first; `wanted`: the command to stand, (11,). Without a state, or for a robot with
    other motors, the first alone."""
    contract = controller.contract
    if not heard.states:
        text = f"no rt/lowstate in {heard.seconds:g} s: is the robot on, is the network right?"
        return [CheckResult("states", False, text, waivable=False)]
    if contract.joints != MOTORS:
        text = f"{len(contract.joints)} joints, which are not the {len(MOTORS)} motors of the G1 in their order"
        return [CheckResult("model", False, text, waivable=False)]
    sensors = Sensors(len(contract.joints))
    sensors.take(tuple(heard.states), heard.seconds)
    assert sensors.posture is not None
    state, rate = heard.states[-1], len(heard.states) / heard.seconds
    outside = beyond(sensors.posture, contract, limits)
    warmest, hottest = sensors.posture.temperature.max(), limits.temperature
    charge = None if heard.battery is None else int(heard.battery["soc"])
    battery = "no rt/lf/bmsstate" if charge is None else f"{charge} %, {limits.battery:g} or more are needed"
    model, order = int(state["mode_machine"]), int(state["mode_pr"])
    (fewest, most), mixed = STATES, np.isfinite(sensors.mixed)
    paced = f"{rate:.0f} a second, {fewest:g} to {most:g} are needed"
    mode = f"the robot's own controller {heard.mode!r} is active: release it first" if heard.mode else "released"
    if heard.mode is None:
        mode = "the motion switcher does not answer: it is unknown whether the robot's own controller is released"
    return [
        CheckResult("states", fewest < rate < most and not mixed, MIXED if mixed else paced),
        CheckResult("model", model == MODEL, f"mode_machine is {model}, that of the exported robot {MODEL}"),
        CheckResult("ankles", order == PITCH_ROLL, f"mode_pr is {order}, {PITCH_ROLL} (pitch and roll) is needed"),
        CheckResult("mode", heard.mode == "", mode),
        CheckResult("publishers", not heard.others, f"{heard.others} low-level commands of other programs"),
        CheckResult("joints", outside is None, outside or "within limits, no motor overloaded, upright enough"),
        CheckResult("battery", charge is not None and charge >= limits.battery, battery),
        CheckResult("temperature", warmest <= hottest, f"warmest motor {warmest:.0f} °C, {hottest:g} allowed"),
        _dry_run(controller, sensors, scene, wanted),
    ]


def _dry_run(controller: Controller, sensors: Sensors, scene: str, wanted: Array) -> CheckResult:
    """Dry run: policy steps on the measured posture; no command is sent."""
    if not quantities(of_object=True).keys().isdisjoint(port.name for port in controller.contract.inputs):
        return CheckResult("policy", True, "observes the object: not tried, because its pose is not known yet")
    controller.reset(scene=scene)
    default = np.array(controller.contract.default_position)
    away = np.zeros(len(default))
    for step in range(DRY_STEPS):
        targets = controller.step(sensors.measured, wanted, measured_at=float(step))
        if targets.held[0]:
            return CheckResult("policy", False, targets.reasons[0])
        away = np.maximum(away, np.abs(targets.position[0] - default))
    controller.reset()
    furthest, name = away.max(), controller.contract.joints[int(away.argmax())]
    return CheckResult(
        "policy", bool(furthest <= FURTHEST), f"targets at most {furthest:.2f} rad from the default posture ({name})"
    )


def stale(sensors: Sensors, now: float, limits: SafetyLimits) -> str | None:
    """Reason if the newest state is old, arrives late by the robot's own clock, or may be another robot's."""
    if now - sensors.mixed < limits.command_age:
        return MIXED
    age = now - sensors.at
    if age > limits.state_age:
        return f"stale state: nothing new for {1e3 * age:.0f} ms"
    if sensors.late > limits.state_age:
        return f"stale state: it arrives {1e3 * sensors.late:.0f} ms late"
    for part, changed in sensors.changed.items():
        if now - changed > limits.frozen:
            return f"frozen {part}: equal values for {1e3 * (now - changed):.0f} ms"
    return None


def beyond(now: MeasuredState, contract: Contract, limits: SafetyLimits) -> str | None:
    """Reason if a measurement is not finite or beyond a limit."""
    measured = np.concatenate([now.position, now.velocity, now.torque, now.gravity, now.turning])
    if not np.isfinite(measured).all():
        return "a measurement is not finite"
    if now.tilt > limits.tilt:
        return f"tilt: {now.tilt:.2f} rad"
    lower, upper = np.array(contract.lower), np.array(contract.upper)
    outside = np.maximum(lower - now.position, now.position - upper)
    speed, torque = np.array(contract.velocity_limit), np.array(contract.effort)
    for name, excess, value, unit in (
        ("position", outside - limits.position_margin, now.position, "rad"),
        ("velocity", np.abs(now.velocity) - limits.speed * speed, now.velocity, "rad/s"),
        ("torque", np.abs(now.torque) - limits.torque * torque, now.torque, "N·m"),
    ):
        if excess[joint := int(np.argmax(excess))] > 0.0:
            return f"{name} limit: {contract.joints[joint]} at {value[joint]:.2f} {unit}"
    return None
