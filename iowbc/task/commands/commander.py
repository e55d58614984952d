"""Commands: random goals in training, scripts in trials, or user input; rate-limited, clamped to the feasible map."""

from collections.abc import Sequence

import numpy as np

from iowbc import counter_random as random
from iowbc.arrays import Array, Indices, Keys, Mask
from iowbc.control.command import COMMAND, VELOCITY, approach, nominal_command, rate_limits
from iowbc.control.references import ReferenceLayer
from iowbc.recipe.task.task import Task
from iowbc.task.commands.drawing import draw_goals, draw_holding_time, interpolate
from iowbc.task.commands.script import CommandScript
from iowbc.task.curriculum import difficulty
from iowbc.task.episode_state import EpisodeState


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
