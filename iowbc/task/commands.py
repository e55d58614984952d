"""Commands: random goals in training, scripts in trials, or user input; rate-limited, clamped to the feasible map."""

from collections.abc import Mapping, Sequence

import numpy as np

from iowbc import counter_random as random
from iowbc.arrays import Array, Indices, Keys, Mask
from iowbc.control.command import COMMAND, PITCH, VELOCITY, approach, nominal_command, rate_limits
from iowbc.control.references import ReferenceLayer
from iowbc.recipe.task.commands import Commands
from iowbc.recipe.task.task import Task
from iowbc.task.curriculum import difficulty
from iowbc.task.episode_state import EpisodeState
from iowbc.task.episodes import CommandScript


class Commander:
    """Sets goal and command of n environments, in their `EpisodeState`."""

    def __init__(
        self,
        task: Task,
        references: ReferenceLayer,
        scripts: Sequence[CommandScript | None],
        holding: Mask,
        pushing: Mask,
    ) -> None:
        """`holding`: environments that begin with an object in the hands, `pushing`: with a crate in front, (n,)."""
        commands = task.commands
        self._nominal, self._start = nominal_command(commands), np.where(holding, commands.holding_start, 1.0)[:, None]
        self._commands, self._curriculum, self._references = commands, task.curriculum, references
        self._pushing, self._period = pushing, 1.0 / task.control_frequency
        self._largest_step = rate_limits(commands.rates) * self._period
        self.scripted = np.array([script is not None for script in scripts])
        nothing = np.zeros(2), np.zeros((2, len(COMMAND)))
        knots = [nothing if script is None else script.knots() for script in scripts]
        longest = max(len(times) for times, _ in knots)
        self._times = np.stack([np.pad(t, (0, longest - len(t)), mode="edge") for t, _ in knots])
        self._values = np.stack([np.pad(v, ((0, longest - len(v)), (0, 0)), mode="edge") for _, v in knots])
        """Knots of all scripts, padded with their last one: times (n, k) [s] and commands (n, k, 11)."""
        self._given: Array | None = None

    def steer(self, wanted: Array) -> None:
        """Follow a user's commands, (11,) or (n, 11), in place of drawn and scripted ones; they may be
        changed in place. Episodes begin in their posture, standing."""
        self._given = wanted
        self.scripted[:] = True

    def start(self, which: Indices, memory: EpisodeState, key: Keys) -> None:
        """First goals of new episodes; `key` (k,). Episodes with drawn commands start standing, in the goal's posture
        if startable; with an object in the hands, at a fraction `holding_start` of the way to it."""
        memory.draws[which] = 0
        self._draw(which, memory, key)
        command = self._references.start_command(
            self._nominal + self._start[which] * (memory.goal[which] - self._nominal)
        )
        command[:, VELOCITY] = 0.0
        scripted = self.scripted[which]
        if scripted.any():
            memory.goal[which[scripted]] = self._scripted(memory)[which[scripted]]
            command[scripted] = memory.goal[which[scripted]]
            if self._given is not None:
                command[:, VELOCITY] = 0.0
        memory.command[which] = self._references.clamp(command)

    def advance(self, memory: EpisodeState, key: Keys) -> None:
        """Goals and commands of the next control step; `key` of the episodes, (n,)."""
        due = np.flatnonzero((memory.steps >= memory.goal_until) & ~self.scripted)
        if len(due):
            self._draw(due, memory, key[due])
        if self.scripted.any():
            memory.goal[self.scripted] = self._scripted(memory)[self.scripted]
        memory.command[...] = self._references.clamp(approach(memory.command, memory.goal, self._largest_step))

    def _draw(self, which: Indices, memory: EpisodeState, key: Keys) -> None:
        drawn = random.absorb(key, memory.draws[which])
        hardness = difficulty(self._curriculum, memory.played[which])
        memory.goal[which] = draw_goals(
            self._commands, drawn, hardness, pushing=self._pushing[which], walking=memory.walking[which]
        )
        held = draw_holding_time(self._commands, drawn)
        memory.goal_until[which] = memory.steps[which] + np.ceil(held / self._period).astype(np.int64)
        memory.draws[which] += 1

    def _scripted(self, memory: EpisodeState) -> Array:
        if self._given is not None:
            return np.broadcast_to(self._given, memory.goal.shape)
        return interpolate(self._times, self._values, memory.steps * self._period)


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
