"""Reasons to damp a robot that moves."""

import numpy as np

from iowbc.deploy.contract import Contract
from iowbc.onboard.limits import Limits
from iowbc.onboard.sensors import Posture, Sensors


def stale(sensors: Sensors, now: float, limits: Limits) -> str | None:
    """The reason where the newest state is old, or arrives late by the robot's own clock."""
    age = now - sensors.at
    if age > limits.state_age:
        return f"stale state: nothing new for {1e3 * age:.0f} ms"
    if sensors.late > limits.state_age:
        return f"stale state: it arrives {1e3 * sensors.late:.0f} ms late"
    return None


def beyond(now: Posture, contract: Contract, limits: Limits) -> str | None:
    """The reason where a measurement is no number or beyond a limit."""
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


def exhausted(now: Posture, charge: float | None, joints: tuple[str, ...], least: float, most: float) -> dict[str, str]:
    """Complaints about a battery below `least` and a motor above `most` [°C]; `charge`: None where unknown [%]."""
    found = {}
    if charge is not None and charge < least:
        found["battery"] = f"battery at {charge:.0f} %, less than {least:g}"
    if now.temperature[hottest := int(np.argmax(now.temperature))] > most:
        found["temperature"] = f"temperature: {joints[hottest]} at {now.temperature[hottest]:.0f} °C, above {most:g}"
    return found
