"""Commands of trials: segments of a sequence, scripts drawn per trial, and fixed sequences.

All fixed sequences command steps, so that a robot that stands still fails each of them. They respect
`task.commands.rates` and stay within the feasible postures. Where a trial repeats a script, it starts again at once.
"""

from typing import Annotated

from pydantic import Field

from iowbc.recipe.section import Problems, Range, Section, Vector

Offset = Annotated[float, Field(ge=-0.5, le=0.5)]
"""Wrist offset along an axis [m]; arms of this size cannot reach farther from the grasp."""


class Segment(Section):
    """Segment of a command sequence; the command moves linearly to these values over `ramp` and then holds."""

    duration: float = Field(gt=0, le=600)
    """Length of the segment, its ramp included [s]."""
    ramp: float = Field(default=0.5, ge=0)
    """Time over which the command moves linearly from the previous segment's values [s]."""
    velocity: Vector = (0.0, 0.0, 0.0)
    """Commanded v_x, v_y [m/s] and yaw rate [rad/s] in the heading frame."""
    height: float | None = Field(default=None, ge=0.3, le=1.0)
    """Commanded pelvis height [m]; no humanoid of this size exceeds 1. Empty: the task's default height."""
    pitch: float = Field(default=0.0, ge=-1.6, le=1.6)
    """Commanded torso pitch [rad], positive leans forward."""
    wrists: tuple[Offset, Offset, Offset, Offset, Offset, Offset] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    """Wrist offsets Δp, left then right, heading frame [m]."""

    def problems(self) -> Problems:
        if self.ramp > self.duration:
            yield "", f"ramp {self.ramp} s is longer than the segment's duration {self.duration} s"


class DrawnScripts(Section):
    """Random command scripts: every script has the same kinds of motion, in random order, with random values and times.

    With an object in the hands, or without one: walk, walk with raised hands, turn left and right, walk back and
    sideways, crouch, bow, stop. Behind a crate: push straight, in a left and a right turn, from a crouch, stop bowed,
    stop upright. Values are clipped to the ranges of `task.commands`, and commands change as fast as its rates allow.
    """

    duration: float = Field(default=24.0, ge=12.0, le=600.0)
    """Duration of a script [s]: nine kinds of motion, each held for a second or two. A script is longer if its ramps
    would leave less than `shortest_hold` for each."""
    start: float = Field(default=1.0, ge=0.0)
    """Initial standing time [s], in which the hands take up the object's weight."""
    shortest_hold: float = Field(default=0.5, gt=0.0)
    """Shortest time for which a command is held after its ramp [s]."""
    walking: Range = (0.3, 0.5)
    """Forward speed [m/s]; the upper end is that of the fixed sequences."""
    backward: Range = (0.2, 0.3)
    """Backward speed [m/s]; training draws up to 0.3."""
    sideways: Range = (0.15, 0.2)
    """Speed to either side [m/s]; training draws up to 0.2."""
    turning: Range = (0.2, 0.4)
    """Yaw rate of a turn [rad/s], on the spot in every other one; training draws up to 0.4."""
    crate_turning: Range = (0.05, 0.1)
    """Yaw rate of a turn behind a crate [rad/s]; two palms turn it slowly."""
    height: Range = (0.62, 0.76)
    """Pelvis height while walking in another posture than the nominal one [m]."""
    pitch: Range = (-0.2, 0.4)
    """Torso pitch in such a posture [rad]."""
    posture_share: float = Field(default=0.5, ge=0.0, le=1.0)
    """Fraction of the walks and stops in another posture than the nominal one."""
    raised: Range = (0.02, 0.05)
    """Height of raised hands above their grasp [m]."""
    crouch: Range = (0.5, 0.6)
    """Pelvis height of a crouch [m]; the paper's lowest is 0.5."""
    bow: Range = (0.4, 0.75)
    """Torso pitch of a bow while standing [rad]; as far as `task.commands.pitch` goes."""
    deep_share: float = Field(default=0.1, ge=0.0, le=1.0)
    """Fraction of deep bows, over the paper's range up to `task.commands.deep_pitch`; by default as in training."""
    bow_height: Range = (0.64, 0.72)
    """Pelvis height of a bow [m]; at 1.5 rad 0.62 to 0.72 m are feasible."""


RAISED = (0.0, 0.0, 0.05, 0.0, 0.0, 0.05)
"""Both wrists 5 cm above their grasp [m]."""

LIFTING = (
    Segment(duration=1.0, ramp=0.0),
    Segment(duration=4.0, velocity=(0.5, 0.0, 0.0)),
    Segment(duration=2.0, velocity=(0.4, 0.0, 0.4)),
    Segment(duration=3.0, velocity=(0.4, 0.0, 0.0), height=0.66, pitch=0.4, wrists=RAISED, ramp=0.8),
    Segment(duration=2.0, velocity=(-0.3, 0.0, 0.0), height=0.66, pitch=0.3, wrists=RAISED, ramp=0.7),
    Segment(duration=2.0, velocity=(0.0, 0.2, 0.0), height=0.76, pitch=-0.2, ramp=1.0),
    Segment(duration=2.0, velocity=(0.0, 0.0, -0.4), height=0.65, pitch=0.2, ramp=0.8),
    Segment(duration=2.0, height=0.5, pitch=0.4, ramp=1.0),
    Segment(duration=2.0, height=0.62, pitch=0.7, ramp=0.8),
)
"""Stand, walk, turn left, walk on low and leaning with raised hands, back, sideways upright, turn right on the spot,
crouch, bow: 20 s."""

PUSHING = (
    Segment(duration=1.0, ramp=0.0),
    Segment(duration=4.5, velocity=(0.5, 0.0, 0.1), pitch=0.2),
    Segment(duration=4.5, velocity=(0.5, 0.0, 0.0), height=0.65, pitch=0.35),
    Segment(duration=2.5, velocity=(0.4, 0.0, 0.0), height=0.5, pitch=0.5, ramp=1.0),
    Segment(duration=4.0, velocity=(0.4, 0.0, -0.1), height=0.65, pitch=0.35, ramp=1.0),
    Segment(duration=1.5, height=0.6, pitch=0.7, ramp=0.7),
    Segment(duration=2.0, height=0.76, pitch=-0.2, ramp=1.8),
)
"""Stand, push in a left turn, push lower and leaning, push from a crouch, push in a right turn, stop bowed, rise: 20 s.
No backward or sideways motion, because the hands do not hold the crate; turns are as slow as two palms can turn it."""

STAGNATION = (
    Segment(duration=1.0, ramp=0.0),
    Segment(duration=7.0, velocity=(0.5, 0.0, 0.0), pitch=0.2),
    Segment(duration=2.0, pitch=0.2),
)
"""Push against an immovable crate, and stop: 10 s."""

WALKING_ON = (Segment(duration=3.0, velocity=(0.4, 0.0, 0.0)),)
"""Walk: 3 s."""

STANDING = (Segment(duration=5.0, ramp=0.0), *WALKING_ON)
"""Stand (when the robot is pushed), then walk: 8 s."""

WALKING = (Segment(duration=1.0, ramp=0.0), Segment(duration=7.0, velocity=(0.4, 0.0, 0.0)))
"""Walk (when the robot is pushed): 8 s."""

BOWING = (Segment(duration=2.0, ramp=0.0), Segment(duration=7.0, height=0.68, pitch=1.4, ramp=3.0))
"""Bow while standing, to nearly the end of the paper's range, and hold."""

PROBED = (
    Segment(duration=2.0, ramp=0.0),
    Segment(duration=4.0, velocity=(0.4, 0.0, 0.0)),
    Segment(duration=2.0, velocity=(0.3, 0.0, 0.3)),
    Segment(duration=2.0, height=0.68, pitch=0.15, ramp=0.8),
    Segment(duration=2.0, ramp=0.8),
)
"""Stand, walk, turn, crouch and lean a little, stand: 12 s."""
