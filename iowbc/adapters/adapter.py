"""Description of a third-party controller: joints, gains, observation, action and network."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from numbers import Real
from typing import Any

import numpy as np

from iowbc.arrays import Array, Mask
from iowbc.errors import StageFailed
from iowbc.robot.description import Robot

PLACE = "eval.public"
"""Place of a public controller in the recipe, for messages."""
VELOCITIES = ("v_x", "v_y", "yaw_rate")


@dataclass(frozen=True)
class Seen:
    """Command and measurements of n robots, one row each. Joints are in the adapter's order."""

    velocity: Array
    """Commanded v_x, v_y [m/s] and yaw rate [rad/s], heading frame, clipped to the adapter's ranges, (n, 3)."""
    height: Array
    """Commanded height of the pelvis, (n, 1) [m]."""
    pitch: Array
    """Commanded torso pitch, (n, 1) [rad]."""
    walking: Mask
    """True if the commanded velocity requires stepping, (n,)."""
    walked: Array
    """Time since walking began, (n, 1) [s]; 0 in standing."""
    gravity: Array
    """Direction of gravity in the base frame, (n, 3)."""
    angular_velocity: Array
    """Of the base, base frame, (n, 3) [rad/s]."""
    joint_position: Array
    """(n, joints) [rad]."""
    joint_deviation: Array
    """From the adapter's default posture, (n, joints) [rad]."""
    joint_velocity: Array
    """(n, joints) [rad/s]."""
    action: Array
    """Network output of the previous step, initially zero, (n, acted)."""


Term = Callable[[Seen], Array]
"""A part of the observation, (n, size)."""


def scaled(name: str, factor: float | Array = 1.0) -> Term:
    """Observation term: a field of `Seen` times a factor."""
    return lambda seen: getattr(seen, name) * factor


@dataclass(frozen=True)
class Adapter:
    """Description of a controller, from its own configuration."""

    joints: tuple[str, ...]
    """Observed joints, in the controller's order."""
    default: Array
    """Reference posture of observation and action, (joints,) [rad]."""
    kp: Array
    """Position gains, (joints,) [N·m/rad]."""
    kd: Array
    """Velocity gains, (joints,) [N·m·s/rad]."""
    acted: tuple[str, ...]
    """Joints of the action, in the controller's order: at least legs and waist. Its arm targets are used if
    `eval.public.arms` is `own` or `free`, which require all arm joints; otherwise the arms hold the grasp by this
    project's inverse kinematics."""
    scale: Array
    """Change of joint target per unit of action, (acted,) [rad]."""
    frequency: float
    """Control rate [Hz]."""
    terms: tuple[Term, ...]
    """Terms of the observation, in order."""
    network: Callable[[Array], Array]
    """Action (1, acted) from an observation (1, size), float32."""
    history: int = 1
    """Number of observations in the input, including the newest. The first of an episode fills the history."""
    by_term: bool = True
    """True: all past values of a term are adjacent, oldest first. False: all terms of a past observation are."""
    ranges: Mapping[str, tuple[float, float]] | None = None
    """Ranges of the commanded v_x, v_y [m/s] and yaw_rate [rad/s]; a missing entry is unbounded."""
    standing: float = 0.01
    """Commanded planar speed [m/s] and yaw rate [rad/s] up to which the robot stands."""

    def observed(self, past: tuple[Array, ...]) -> Array:
        """Network input, (n, size), from the last values of each term, (n, history, size of the term) each."""
        rows = len(past[0])
        if self.by_term:
            return np.concatenate([values.reshape(rows, -1) for values in past], axis=1)
        return np.concatenate(past, axis=2).reshape(rows, -1)


def validate_adapter(adapter: Adapter, robot: Robot, frequency: float, *, moves_arms: bool = False) -> None:
    """Check an adapter against a robot and a control rate [Hz], and its network against its observation. `moves_arms`:
    the controller acts on all arm joints, too. Raises StageFailed with the field, its value and the valid values."""
    problems = [*_joint_name_problems(adapter, robot, moves_arms), *_value_problems(adapter, robot, frequency)]
    if problems:
        raise StageFailed(f"{PLACE}: does not fit the robot {robot.name}: {'; '.join(problems)}")
    try:  # a step of a robot that stands in the default posture
        parts = [np.asarray(term(standing(adapter)), np.float64) for term in adapter.terms]
        for number, values in enumerate(parts):
            if values.ndim != 2 or len(values) != 1 or not np.isfinite(values).all():
                text = f"terms: number {number} (from 0) gives {_described(values)} for one robot"
                raise StageFailed(f"{PLACE}: {text}, expected (1, size) of finite numbers")
        past = tuple(np.repeat(values[:, None], adapter.history, 1) for values in parts)
        observation = adapter.observed(past).astype(np.float32)
        answer = np.asarray(adapter.network(observation))
    except StageFailed:
        raise
    except Exception as error:
        raise StageFailed(f"{PLACE}: cannot make a step: {type(error).__name__}: {error}") from error
    if answer.shape != (1, len(adapter.acted)) or not np.isfinite(answer).all():
        text = f"its network gives {_described(answer)} for an observation of {observation.shape[1]} numbers"
        raise StageFailed(f"{PLACE}: {text}; expected {(1, len(adapter.acted))} finite numbers, one a joint of `acted`")


def _joint_name_problems(adapter: Adapter, robot: Robot, moves_arms: bool) -> list[str]:
    found = []
    for field, names, known in (("joints", adapter.joints, robot.joints), ("acted", adapter.acted, adapter.joints)):
        if wrong := sorted({name for name in names if name not in known or names.count(name) > 1}):
            found.append(f"{field}: unknown or repeated {wrong}; valid, once each: {', '.join(known)}")
    needed = [robot.joints[index] for index in (*robot.support, *(robot.interaction if moves_arms else ()))]
    missing = ", ".join(name for name in needed if name not in adapter.acted)
    remedy = "; a controller without arms of its own needs arms: measured or default" if moves_arms else ""
    return [*found, f"acted: lacks {missing}{remedy}"] if missing else found


def _value_problems(adapter: Adapter, robot: Robot, frequency: float) -> Iterator[str]:
    for name in ("default", "kp", "kd", "scale"):
        values, size = np.asarray(getattr(adapter, name)), len(adapter.acted if name == "scale" else adapter.joints)
        if values.shape != (size,) or values.dtype.kind not in "fiu" or not np.isfinite(values).all():
            yield f"{name}: has {_described(values)}, expected {(size,)} finite numbers"
        elif name in ("kp", "kd") and values.min() < 0.0:
            yield f"{name}: has the negative gain {values.min():g}, which would drive its joint away"
        elif name == "default":
            for index in robot.support:
                joint, low, high = robot.joints[index], robot.lower[index], robot.upper[index]
                angle = values[adapter.joints.index(joint)] if joint in adapter.joints else low
                if not low <= angle <= high:
                    yield f"default: {joint} is {angle:g} rad, its range {low:.3g} to {high:.3g} rad"
    own: Any = adapter.frequency
    if not isinstance(own, Real):
        yield f"frequency: is {own!r}, expected a number [Hz]"
    elif own != frequency:
        text = f"frequency: is {own:g} Hz, the trials run at {frequency:g} Hz"
        yield f"{text}; set task.control_frequency to it"
    if not isinstance(adapter.history, int) or adapter.history < 1:
        yield f"history: is {adapter.history!r}, expected a number of observations, the present one included"
    for name, bounds in (adapter.ranges or {}).items():
        if name not in VELOCITIES:
            yield f"ranges: {name}: no such velocity; valid: {', '.join(VELOCITIES)}"
        elif np.shape(bounds) != (2,) or not all(isinstance(end, Real) for end in bounds) or not bounds[0] <= bounds[1]:
            yield f"ranges: {name}: is {bounds}, expected its smallest and its largest value"


def _described(values: Array) -> str:
    finite = values.dtype.kind in "fiu" and np.isfinite(values).all()
    return f"shape {values.shape}{'' if finite else ', not all of it finite numbers'}"


def standing(adapter: Adapter) -> Seen:
    """Measurements of a robot that stands upright in the adapter's default posture."""
    zero, still = np.zeros((1, 1)), np.zeros((1, len(adapter.joints)))
    return Seen(
        velocity=np.zeros((1, 3)),
        height=zero,
        pitch=zero,
        walking=np.zeros(1, np.bool_),
        walked=zero,
        gravity=np.array([[0.0, 0.0, -1.0]]),
        angular_velocity=np.zeros((1, 3)),
        joint_position=still + adapter.default,
        joint_deviation=still,
        joint_velocity=still,
        action=np.zeros((1, len(adapter.acted))),
    )
