"""Checks before a robot moves."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from iowbc.arrays import Array
from iowbc.control.sensors import quantities
from iowbc.deploy.controller import Controller
from iowbc.onboard import watchdogs
from iowbc.onboard.limits import Limits
from iowbc.onboard.messages import Record
from iowbc.onboard.sensors import Sensors

MODEL = 5
"""`mode_machine` of the G1 with 29 joints, revision 1.0, whose masses and gears the MJCF has."""
PITCH_ROLL = 0
"""`mode_pr` in which ankles and waist are commanded by pitch and roll, not by their motors' angles."""
DRY_STEPS = 5
"""Steps of the policy on the measured posture; none is sent."""
FURTHEST = 1.0
"""Largest distance of a dry step's target from the default posture that is believed [rad]."""


@dataclass(frozen=True)
class Check:
    """One check and how it ended."""

    name: str
    passed: bool
    text: str


@dataclass(frozen=True)
class Listened:
    """Messages on the bus while the robot was listened to."""

    states: Sequence[Record]
    seconds: float
    battery: Record | None
    others: int
    """Low-level commands of other programs."""
    mode: str | None
    """Active controller of the robot's own, "" for none, None without an answer."""


def checks(controller: Controller, heard: Listened, wanted: Array, limits: Limits) -> list[Check]:
    """All checks, in the order in which they are worth reading; `wanted`: the command to stand, (11,)."""
    contract = controller.contract
    if not heard.states:
        text = f"no rt/lowstate in {heard.seconds:g} s: is the robot on, is the network right?"
        return [Check("states", False, text)]
    sensors = Sensors(len(contract.joints))
    sensors.take(tuple(heard.states), heard.seconds)
    assert sensors.posture is not None
    state, rate = heard.states[-1], len(heard.states) / heard.seconds
    beyond = watchdogs.beyond(sensors.posture, contract, limits)
    warmest, hottest = sensors.posture.temperature.max(), limits.temperature
    charge = None if heard.battery is None else int(heard.battery["soc"])
    battery = "no rt/lf/bmsstate" if charge is None else f"{charge} %, {limits.battery:g} or more are needed"
    model, order = int(state["mode_machine"]), int(state["mode_pr"])
    mode = f"the robot's own controller {heard.mode!r} is active: release it first" if heard.mode else "released"
    if heard.mode is None:
        mode = "the motion switcher does not answer: it is unknown whether the robot's own controller is released"
    return [
        Check("states", rate > 400.0, f"{rate:.0f} a second, 400 or more are needed"),
        Check("model", model == MODEL, f"mode_machine is {model}, that of the exported robot {MODEL}"),
        Check("ankles", order == PITCH_ROLL, f"mode_pr is {order}, {PITCH_ROLL} (pitch and roll) is needed"),
        Check("mode", heard.mode == "", mode),
        Check("publishers", not heard.others, f"{heard.others} low-level commands of other programs"),
        Check("joints", beyond is None, beyond or "within limits, no motor overloaded, upright enough"),
        Check("battery", charge is not None and charge >= limits.battery, battery),
        Check("temperature", warmest <= hottest, f"warmest motor {warmest:.0f} °C, {hottest:g} allowed"),
        _dry_run(controller, sensors, wanted),
    ]


def _dry_run(controller: Controller, sensors: Sensors, wanted: Array) -> Check:
    """Steps of the policy on the posture as measured, of which no command is sent."""
    if not quantities(of_object=True).keys().isdisjoint(port.name for port in controller.contract.inputs):
        return Check("policy", True, "observes the object: tried when its pose arrives")
    controller.reset()
    default, furthest, joint = np.array(controller.contract.default_position), 0.0, 0
    for step in range(DRY_STEPS):
        targets = controller.step(sensors.measured, wanted, measured_at=float(step))
        if targets.held[0]:
            return Check("policy", False, targets.reasons[0])
        away = np.abs(targets.position[0] - default)
        joint = int(np.argmax(away))
        furthest = max(furthest, float(away[joint]))
    controller.reset()
    name = controller.contract.joints[joint]
    return Check(
        "policy", furthest <= FURTHEST, f"targets at most {furthest:.2f} rad from the default posture ({name})"
    )
