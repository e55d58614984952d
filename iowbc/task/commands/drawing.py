"""Drawing commands in training: 11-D goals, and how long each is held."""

from collections.abc import Mapping

import numpy as np

from iowbc import counter_random as random
from iowbc.arrays import Array, Keys, Mask
from iowbc.control.command import COMMAND, PITCH
from iowbc.recipe.task.commands import Commands


def draw_goals(
    commands: Commands, key: Keys, difficulty: Mapping[str, Array], *, pushing: Mask, walking: Mask
) -> Array:
    """Goals (n, 11), a pure function of the keys (n,); ranges scaled by `iowbc.task.curriculum.difficulty`. pushing:
    environments with a crate in front of them, (n,); walking: those whose episode commands velocities, (n,)."""
    goals = np.empty((len(key), len(COMMAND)))
    goals[:, :3] = _velocities(commands, key, difficulty, pushing) * walking[:, None]
    goals[:, 3:] = _posture(commands, key, difficulty["posture"])
    u, (low, high) = random.uniform(key, "command/deep", 2), commands.deep_pitch
    deep = (low + (high - low) * u[:, 0]) * difficulty["posture"] * (u[:, 1] < commands.deep_share)
    deep *= ~goals[:, :3].any(axis=1)  # a share of the standing commands bows deeply
    goals[:, PITCH] = np.where(deep != 0.0, deep, goals[:, PITCH])
    return goals


def draw_holding_time(commands: Commands, key: Keys) -> Array:
    """Time until the next goal, t ~ U(resampling), (n,) [s]."""
    low, high = commands.resampling
    return low + (high - low) * random.uniform(key, "command/time", 1)[:, 0]


def _velocities(commands: Commands, key: Keys, difficulty: Mapping[str, Array], pushing: Mask) -> Array:
    """v_x, v_y, ω ~ U(range)·scale: a share is zero, straight or turning on the spot; low speeds are raised."""
    u = random.uniform(key, "command/velocity", 6)
    ranges = np.array([commands.velocity_x, commands.velocity_y, commands.yaw_rate])
    behind = np.array([commands.pushing.velocity_x, commands.pushing.velocity_y, commands.pushing.yaw_rate])
    low, high = np.where(pushing[:, None], behind.T[:, None], ranges.T[:, None])
    velocity = low + (high - low) * u[:, :3]
    velocity[:, 0] *= difficulty["velocity"]
    velocity[:, 1:] *= difficulty["turning"][:, None]
    velocity[:, 1:] *= (u[:, 3] >= commands.straight_share)[:, None]
    on_the_spot = (u[:, 4] < commands.turning_share) & (u[:, 3] >= commands.straight_share) & ~pushing
    velocity[on_the_spot, :2] = 0.0
    speed = np.hypot(velocity[:, 0], velocity[:, 1])
    short = (speed > 0.0) & (speed < commands.smallest_speed)
    velocity[:, :2] *= np.where(short, commands.smallest_speed / np.where(short, speed, 1.0), 1.0)[:, None]
    slow = on_the_spot & (np.abs(velocity[:, 2]) < commands.smallest_yaw_rate)
    velocity[slow, 2] = np.copysign(commands.smallest_yaw_rate, velocity[slow, 2])
    return velocity * (u[:, 5] >= commands.standing_share)[:, None]


def _posture(commands: Commands, key: Keys, scale: Array) -> Array:
    """H, α ~ U(range) and Δp = shared + single offsets, shrunk towards the nominal posture by `scale`; (n, 8)."""
    u = random.uniform(key, "command/posture", 2 + 3 + 6 + 1)
    low, high = np.array([commands.height, commands.pitch]).T
    nominal = np.array([commands.nominal_height, commands.nominal_pitch])
    away = np.empty((len(key), 8))
    away[:, :2] = low + (high - low) * u[:, :2] - nominal
    shared = np.array(commands.common_offset) * (2.0 * u[:, 2:5] - 1.0)
    single = np.tile(commands.single_offset, 2) * (2.0 * u[:, 5:11] - 1.0)
    away[:, 2:] = np.tile(shared, 2) + single
    away *= (scale * (u[:, 11] >= commands.nominal_share))[:, None]
    away[:, :2] += nominal
    return away


def interpolate(times: Array, values: Array, now: Array) -> Array:
    """Scripted commands at a time: knots (n, k) [s] and (n, k, 11), now (n,) [s]; held after the last knot. (n, 11)."""
    rows = np.arange(len(now))
    after = np.clip((times <= now[:, None]).sum(axis=1), 1, times.shape[1] - 1)
    start, end = times[rows, after - 1], times[rows, after]
    span = np.where(end > start, end - start, 1.0)
    part = np.clip((now - start) / span, 0.0, 1.0)[:, None]
    return values[rows, after - 1] * (1.0 - part) + values[rows, after] * part
