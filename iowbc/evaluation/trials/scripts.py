"""Random command scripts from a seed."""

from collections.abc import Iterator

import numpy as np

from iowbc import counter_random as random
from iowbc.arrays import Array
from iowbc.control.command import nominal_command, rate_limits
from iowbc.recipe.evaluation.sequences import DrawnScripts
from iowbc.recipe.section import Range
from iowbc.recipe.task.commands import Commands
from iowbc.task.episodes import CommandScript, CommandSegment

WORDS = 256
"""Random numbers per script; more than any script uses."""
WHOLE = 0.02
"""Durations are whole multiples of this [s]; a control period at 50 Hz."""
LONGER = 2.0
"""Factor of the hold time of straight walking or pushing."""


def drawn_script(
    scripts: DrawnScripts, commands: Commands, *, pushing: bool, seed: int, part: int = 0
) -> CommandScript:
    """The script of a seed. `pushing`: behind a crate; `part`: index of the script in a trial with several."""
    key = random.absorb(random.environment_key(seed, np.zeros(1)), part)
    numbers = iter(random.uniform(key, "script", WORDS)[0].tolist())
    motions = _Motions(scripts, commands, pushing, numbers)
    targets = [motions.straight(), *(motions.behind_a_crate() if pushing else motions.in_the_open())]
    longer = np.array([LONGER, *[1.0] * (len(targets) - 1)])
    order = np.argsort([next(numbers) for _ in targets])
    goals = np.stack(targets)[order]
    weights = longer[order] * (0.7 + 0.6 * np.array([next(numbers) for _ in targets]))
    before = np.vstack([nominal_command(commands), goals[:-1]])
    ramps = np.max(np.abs(goals - before) / rate_limits(commands.rates), axis=1)
    ramps = np.ceil(ramps / WHOLE + 1e-6) * WHOLE
    held = max(scripts.duration - scripts.start - ramps.sum() - len(goals) * scripts.shortest_hold, 0.0)
    holds = scripts.shortest_hold + np.floor(held * weights / weights.sum() / WHOLE) * WHOLE
    holds[-1] += max(scripts.duration - scripts.start - ramps.sum() - holds.sum(), 0.0)
    first = CommandSegment(scripts.start, tuple(nominal_command(commands).tolist()))
    parts = zip(goals.tolist(), ramps.tolist(), holds.tolist(), strict=True)
    return CommandScript((first, *(CommandSegment(ramp + hold, tuple(goal), ramp) for goal, ramp, hold in parts)))


class _Motions:
    """Generator of motions, each a command (11,) with random sizes."""

    def __init__(self, scripts: DrawnScripts, commands: Commands, pushing: bool, numbers: Iterator[float]) -> None:
        self.scripts, self.commands, self.numbers = scripts, commands, numbers
        self.ranges = commands.pushing if pushing else commands

    def in_the_open(self) -> list[Array]:
        """Motions with or without an object in the hands."""
        scripts = self.scripts
        raised = self.straight()
        raised[[7, 10]] = min(self._between(scripts.raised), self.commands.common_offset[2])
        back = self._walk(-self._between(scripts.backward), 0.0, 0.0)
        side = self._walk(0.0, self._between(scripts.sideways) * (1.0 if next(self.numbers) < 0.5 else -1.0), 0.0)
        turns = []
        for sign in (1.0, -1.0):
            forward = self._between(scripts.walking) * (next(self.numbers) < 0.5)  # on the spot in half of the turns
            turns.append(self._walk(forward, 0.0, sign * self._between(scripts.turning)))
        crouch = self._stand(self._between(scripts.crouch), self._between((0.0, scripts.pitch[1])))
        return [raised, *turns, back, side, crouch, self._bow(), self._posture()]

    def behind_a_crate(self) -> list[Array]:
        """Motions behind a crate; neither backward nor sideways, since the hands do not hold it."""
        scripts = self.scripts
        turns = [
            self._walk(self._between(scripts.walking), 0.0, sign * self._between(scripts.crate_turning))
            for sign in (1.0, -1.0)
        ]
        low = self.straight()
        low[3:5] = self._between(scripts.crouch), self._between((0.2, 0.5))
        bowed = self._stand(self._between(scripts.bow_height), self._between(scripts.bow))
        return [*turns, low, self.straight(), bowed, self._posture()]

    def straight(self) -> Array:
        return self._walk(self._between(self.scripts.walking), 0.0, 0.0)

    def _walk(self, forward: float, left: float, turn: float) -> Array:
        ranges = self.ranges
        command = self._posture()
        lowest, highest = zip(ranges.velocity_x, ranges.velocity_y, ranges.yaw_rate, strict=True)
        command[:3] = np.clip((forward, left, turn), lowest, highest)
        return command

    def _posture(self) -> Array:
        """Standing, in a random posture with probability `posture_share`."""
        height, pitch = self._between(self.scripts.height), self._between(self.scripts.pitch)
        if next(self.numbers) >= self.scripts.posture_share:
            height, pitch = self.commands.nominal_height, self.commands.nominal_pitch
        return self._stand(height, pitch)

    def _bow(self) -> Array:
        """A bow. Deep bows have a pitch between the upper ends of `commands.pitch` and `commands.deep_pitch`."""
        scripts, commands = self.scripts, self.commands
        pitch = min(self._between(scripts.bow), commands.pitch[1])
        deep = self._between((commands.pitch[1], max(commands.deep_pitch[1], commands.pitch[1])))
        command = self._stand(self._between(scripts.bow_height), pitch)
        if next(self.numbers) < scripts.deep_share * (commands.deep_share > 0.0):
            command[4] = deep
        return command

    def _stand(self, height: float, pitch: float) -> Array:
        """Standing in a posture within the commanded ranges."""
        command = nominal_command(self.commands)
        command[3] = np.clip(height, *self.commands.height)
        command[4] = np.clip(pitch, *self.commands.pitch)
        return command

    def _between(self, ends: Range) -> float:
        low, high = ends
        return low + (high - low) * next(self.numbers)
