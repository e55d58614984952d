"""Fixed command sequences of trials. All ask for steps: a robot that stands still fails every one.

Each changes no faster than `task.commands.rates` allow and asks for no posture outside of the feasible map.
"""

from iowbc.recipe.evaluation.segment import Segment

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
Neither back nor sideways, for the hands do not hold the crate, and turns as slow as two palms can make it turn."""

STAGNATION = (
    Segment(duration=1.0, ramp=0.0),
    Segment(duration=7.0, velocity=(0.5, 0.0, 0.0), pitch=0.2),
    Segment(duration=2.0, pitch=0.2),
)
"""Push against what does not give way, and stop: 10 s."""

WALKING_ON = (Segment(duration=3.0, velocity=(0.4, 0.0, 0.0)),)
"""Walk: 3 s."""

STANDING = (Segment(duration=5.0, ramp=0.0), *WALKING_ON)
"""Stand, which is when the robot is pushed, and walk on: 8 s."""

WALKING = (Segment(duration=1.0, ramp=0.0), Segment(duration=7.0, velocity=(0.4, 0.0, 0.0)))
"""Walk, which is when the robot is pushed: 8 s."""

BOWING = (Segment(duration=2.0, ramp=0.0), Segment(duration=7.0, height=0.68, pitch=1.4, ramp=3.0))
"""Bow while standing, to where the paper's range nearly ends, and hold it."""

PROBED = (
    Segment(duration=2.0, ramp=0.0),
    Segment(duration=4.0, velocity=(0.4, 0.0, 0.0)),
    Segment(duration=2.0, velocity=(0.3, 0.0, 0.3)),
    Segment(duration=2.0, height=0.68, pitch=0.15, ramp=0.8),
    Segment(duration=2.0, ramp=0.8),
)
"""Stand, walk, turn, crouch and lean a little, stand: 12 s."""
