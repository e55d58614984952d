"""The 11-D skill-level command C: names, places of its parts, and its rate limits."""

import numpy as np

from iowbc.arrays import Array
from iowbc.recipe.task.commands import CommandRates, Commands
from iowbc.robot.description import Robot
from iowbc.robot.mirror import VECTOR_SIGN, MirrorMap

WRISTS = tuple(f"{side}_{axis}" for side in ("left", "right") for axis in "xyz")
COMMAND = ("v_x", "v_y", "yaw_rate", "height", "pitch", *WRISTS)
"""Names of the command's entries: m/s, m/s, rad/s, m, rad, and six wrist offsets in m; heading frame."""
VELOCITY = slice(0, 3)
YAW_RATE = 2
HEIGHT = 3
PITCH = 4
OFFSET = slice(5, 11)


def nominal_command(commands: Commands) -> Array:
    """Standing still in the nominal posture, (11,)."""
    command = np.zeros(len(COMMAND))
    command[HEIGHT], command[PITCH] = commands.nominal_height, commands.nominal_pitch
    return command


def command_mirror(robot: Robot) -> MirrorMap:
    """Mirror of the command, (11,): v_y, yaw rate and the y offsets change sign, the wrists change sides."""
    permutation = np.array([0, 1, 2, 3, 4, 8, 9, 10, 5, 6, 7])
    return MirrorMap(permutation, np.array([1.0, -1.0, -1.0, 1.0, 1.0, *VECTOR_SIGN, *VECTOR_SIGN]))


def rate_limits(rates: CommandRates) -> Array:
    """Largest change a second of each entry, (11,)."""
    return np.array([rates.velocity, rates.velocity, rates.yaw_rate, rates.height, rates.pitch, *[rates.offset] * 6])


def approach(command: Array, goal: Array, largest_step: Array) -> Array:
    """The command moved towards its goal by at most `largest_step` (11,); commands (n, 11)."""
    return command + (goal - command).clip(-largest_step, largest_step)
