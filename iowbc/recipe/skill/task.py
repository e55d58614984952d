"""Transport tasks: an object, its load, and the path of its centre between walls."""

import math
from typing import Annotated

from pydantic import AfterValidator, Field

from iowbc.recipe.section import NamedEntries, NonNegativeRange, Section, Share, in_order
from iowbc.recipe.simulation.holding import ObjectScene


class Stretch(Section):
    """Segment of a path: an arc of constant curvature, or a straight line."""

    length: float = Field(gt=0.0, le=50.0)
    """Length [m]."""
    turn: float = Field(default=0.0, ge=-math.pi, le=math.pi)
    """Change of the path's heading over the segment, positive to the left [rad]."""
    rise: float = Field(default=0.0, ge=-0.5, le=0.5)
    """Change of the object's height over the segment [m]."""
    width: float | None = Field(default=None, gt=0.0)
    """Distance between the walls on both sides [m]; empty: no walls."""


class TransportTask(Section):
    """An object, its load, and the path on which it is to be transported."""

    scene: ObjectScene
    """Scene of the task, with an object."""
    path: tuple[Stretch, ...] = Field(min_length=1, max_length=64)
    """Segments in order, from the object's centre at the start, along the robot's heading."""
    mass: NonNegativeRange
    """Range of the object's mass [kg]; too heavy for the robot alone."""
    share: Annotated[tuple[Share, Share], AfterValidator(in_order)] = (0.4, 0.6)
    """Range of the human's share of the weight, or in a push of the rolling resistance."""
    rolling_resistance: float | None = Field(default=None, ge=0.0)
    """Rolling resistance as a fraction of the weight, in a push; empty: drawn as in training."""
    duration: float = Field(gt=0.0, le=600.0)
    """Time limit [s]."""
    weight: float = Field(default=1.0, ge=0.0)
    """Frequency of the task among those of the same scene; only the proportions matter."""


STRAIGHT = (Stretch(length=3.0),)
LEFT_ARC = Stretch(length=3.0, turn=math.pi / 2.0, width=1.6)
CORRIDOR = (Stretch(length=1.0, width=1.6), LEFT_ARC, Stretch(length=1.0, width=1.6))
DOORWAY = (
    Stretch(length=0.7),
    Stretch(length=0.8, turn=0.3),
    Stretch(length=0.8, turn=-0.3),
    Stretch(length=0.8, width=1.1),
    Stretch(length=0.7),
)
SLALOM = (
    Stretch(length=0.5, width=1.5),
    Stretch(length=0.8, turn=0.35, width=1.5),
    Stretch(length=1.6, turn=-0.7, width=1.5),
    Stretch(length=1.6, turn=0.7, width=1.5),
    Stretch(length=0.8, turn=-0.35, width=1.5),
)
VERTICAL = (
    Stretch(length=0.5),
    Stretch(length=0.8, rise=0.08),
    Stretch(length=1.0),
    Stretch(length=0.8, rise=-0.16),
    Stretch(length=0.4),
)


def _push(path: tuple[Stretch, ...], duration: float) -> TransportTask:
    """A push of the paper's crate, with a rolling resistance that the robot alone cannot overcome."""
    return TransportTask(
        scene="push", path=path, mass=(60.0, 70.0), share=(0.3, 0.45), rolling_resistance=0.16, duration=duration
    )


def _lift(path: tuple[Stretch, ...], duration: float) -> TransportTask:
    """A box that `compliant_correlated` cannot carry alone for the length of a game."""
    return TransportTask(scene="lift", path=path, mass=(14.0, 17.0), duration=duration)


class Tasks(NamedEntries):
    """Transport tasks by name: those of the paper and custom ones."""

    __pydantic_extra__: dict[str, TransportTask] = Field(init=False)
    push_straight: TransportTask = _push(STRAIGHT, 25.0)
    """Push a crate straight on."""
    push_corridor: TransportTask = _push(CORRIDOR, 40.0)
    """Push a crate round a left bend between walls."""
    push_doorway: TransportTask = _push(DOORWAY, 30.0)
    """Push a crate to the left and through a doorway."""
    push_slalom: TransportTask = _push(SLALOM, 40.0)
    """Push a crate on a winding path between walls."""
    lift_straight: TransportTask = _lift(STRAIGHT, 20.0)
    """Carry a box straight on."""
    lift_corridor: TransportTask = _lift(CORRIDOR, 35.0)
    """Carry a box round a left bend between walls."""
    lift_doorway: TransportTask = _lift(DOORWAY, 25.0)
    """Carry a box to the left and through a doorway."""
    lift_slalom: TransportTask = _lift(SLALOM, 35.0)
    """Carry a box on a winding path between walls."""
    raise_carry_lower: TransportTask = _lift(VERTICAL, 25.0)
    """Raise a box, carry it, and lower it to another height: the paper's adaptive vertical synchronization."""
    tyre_straight: TransportTask = TransportTask(scene="tyre", path=STRAIGHT, mass=(18.0, 18.0), duration=20.0)
    """Carry a tyre of 18 kg (paper IV)."""
