"""The training curriculum: four axes with separate levels, in the order of the paper's three phases."""

from pydantic import Field

from iowbc.recipe.section import LATER, Problems, Section


class Scale(Section):
    """Factor at levels 0, 1 and 2 of an axis, interpolated between them."""

    start: float = Field(ge=0.0)
    """Factor at level 0."""
    full: float = Field(ge=0.0)
    """Factor at level 1, the recipe's own ranges."""
    extreme: float = Field(ge=0.0)
    """Factor at level 2, which is partly infeasible."""


class Ceilings(Section):
    """Highest level of each axis during a phase."""

    posture: float = Field(ge=0.0, le=2.0)
    """Heights, torso pitches and wrist offsets."""
    locomotion: float = Field(ge=0.0, le=2.0)
    """Velocities and yaw rates."""
    load: float = Field(ge=0.0, le=2.0)
    """Masses, and resistance to a push."""
    disturbance: float = Field(ge=0.0, le=2.0)
    """Impulses on the object and pushes on the base."""


class Curriculum(Section):
    """Static balance under varied loads, then locomotion with impulses, then partly infeasible commands (paper III-D).

    Each environment has a level between 0 and 2 on each of four axes: posture, locomotion, load, disturbance. A level
    rises after an episode that survives and succeeds by the axis' own criterion, and falls after an early end that is
    attributed to the axis. With a single level for all axes, robots that could not walk yet received heavier loads and
    stronger pushes before they practised a step.
    """

    enabled: bool = True
    """Enable the curriculum; otherwise no level changes."""
    inherit: bool = Field(default=True, json_schema_extra=LATER)
    """A training from a trained policy (`teacher.start`, `teacher.history.student`) and a distillation begin at the
    levels of that one, which without a curriculum stay; otherwise, as a training from random weights does, at 0, or
    without a curriculum at `fixed_level`."""
    fixed_level: float = Field(default=1.0, ge=0.0, le=2.0)
    """Level of all axes without a curriculum and in single environments; trials have level 1, the recipe's own
    ranges."""
    velocity: Scale = Scale(start=1.0, full=1.0, extreme=1.3)
    """Factor on the range of v_x at each level of locomotion; by default the full range from the start. At 0.6, a robot
    that steps in place tracks the command so closely that it hardly learns to walk."""
    turning: Scale = Scale(start=0.2, full=1.0, extreme=1.3)
    """Factor on the ranges of v_y and yaw rate at each level of locomotion: straight walking is learnt first."""
    posture: Scale = Scale(start=0.2, full=1.0, extreme=1.0)
    """Factor on the ranges of height, pitch and wrist offsets, around the nominal posture."""
    load: Scale = Scale(start=0.15, full=1.0, extreme=1.3)
    """Width of the mass range above its lower end, relative to the scene's own. At 1.3 the box weighs up to
    13.5 kg, and shoulders hold 12 to 16."""
    resistance: Scale = Scale(start=0.5, full=1.0, extreme=3.0)
    """Factor on a crate's rolling resistance at each level of load; at 3 it is near the limit of foot friction."""
    blocked: Scale = Scale(start=0.0, full=0.0, extreme=0.25)
    """Fraction of the pushes with a blocked crate at each level of load. Together with `resistance`, more than 30 % of
    the pushes at level 2 are infeasible: they teach the robot to stay upright against an immovable crate."""
    blocking: float = Field(default=50.0, ge=1.0, json_schema_extra=LATER)
    """Factor on the rolling resistance of a blocked crate. At the nominal resistance of 0.06, a 13 kg crate resists
    with 392 N, the most that feet hold, and heavier ones do not move."""
    disturbance: Scale = Scale(start=0.0, full=1.0, extreme=1.5)
    """Factor on impulses and pushes."""
    balance: Ceilings = Ceilings(posture=1.0, locomotion=0.5, load=1.0, disturbance=0.3)
    """Phase 1: static balance under varied loads. Slow walking, which takes longest to learn, is practised from the
    start."""
    locomotion: Ceilings = Ceilings(posture=1.0, locomotion=1.0, load=1.0, disturbance=1.0)
    """Phase 2: locomotion with impulses; an environment enters it when it has reached all ceilings of phase 1."""
    extreme: Ceilings = Ceilings(posture=2.0, locomotion=2.0, load=2.0, disturbance=2.0)
    """Phase 3: commands, loads and resistances up to infeasible ones."""
    lead: float = Field(default=0.25, ge=0.0)
    """Largest amount by which the levels of posture, load and disturbance exceed that of locomotion in an episode with
    walking. New walking commands are thus practised with light loads, and heavy loads first while standing."""
    rise: float = Field(default=0.08, ge=0.0)
    """Increment of an axis' level after a success."""
    fall: float = Field(default=0.1, ge=0.0)
    """Decrement of an axis' level after an episode that ended before `early` and is attributed to the axis. It exceeds
    `rise`: a level settles where five of nine of its episodes succeed."""
    early: float = Field(default=0.7, gt=0.0, le=1.0)
    """Fraction of the time limit before which an end counts as a failure."""
    tracking: float = Field(default=0.65, ge=0.0, le=1.0)
    """Smallest mean score of height and of pitch, by the kernels of their reward terms, for a success of posture, load
    and disturbance."""
    progress: float = Field(default=0.6, ge=0.0, le=1.0)
    """Smallest fraction of the commanded displacement for a success of locomotion, counted along the command and no
    faster than it. Above level 1, where commands may be infeasible, posture counts instead."""
    load_progress: float = Field(default=0.0, ge=0.0, le=1.0, json_schema_extra=LATER)
    """Smallest fraction of the commanded displacement in an episode with walking for its load level to rise; 0: no
    condition. Without it, crates also grow heavier for robots that do not push, until none of them ever rolls."""
    heading: float = Field(default=0.5, gt=0.0)
    """Largest mean heading error [rad] for a success of locomotion; it does not count above level 1."""
    lagging: float = Field(default=0.2, ge=0.0, le=1.0)
    """Fraction of the commanded displacement below which an episode with walking lowers the level of locomotion even
    without a fall: the robot stepped in place."""
    least_walk: float = Field(default=2.0, ge=0.0)
    """Smallest time with a commanded velocity for an episode to affect the level of locomotion [s]."""
    replay: float = Field(default=0.0, ge=0.0, le=1.0, json_schema_extra=LATER)
    """Probability that an environment repeats its last failed episode with all its random quantities (loads, partner,
    latencies, commands, disturbances), scaled by its present levels. A success discards the episode. 0: always a new
    episode."""
    blame: float = Field(default=1.0, ge=0.0)
    """Time after an impulse or a push within which a fall is attributed to it [s]."""
    limit: float = Field(default=2.0, ge=0.0, le=2.0)
    """Highest level of any axis."""

    def problems(self) -> Problems:
        if self.fixed_level > self.limit:
            yield "", f"fixed_level: {self.fixed_level} is above the limit of {self.limit}"
