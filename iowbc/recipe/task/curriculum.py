"""The curriculum of training: four axes, each with a level of its own, in the order of the paper's three phases."""

from collections.abc import Iterator

from pydantic import Field

from iowbc.recipe.section import LATER, Section


class Scale(Section):
    """A factor at the levels 0, 1 and 2 of an axis; between two levels it is interpolated."""

    start: float = Field(ge=0.0)
    """At level 0."""
    full: float = Field(ge=0.0)
    """At level 1, the recipe's own ranges."""
    extreme: float = Field(ge=0.0)
    """At level 2, which is partly infeasible."""


class Ceilings(Section):
    """Highest level of each axis during a phase."""

    posture: float = Field(ge=0.0, le=2.0)
    """Heights, torso pitches and wrist offsets."""
    locomotion: float = Field(ge=0.0, le=2.0)
    """Velocities and yaw rates."""
    load: float = Field(ge=0.0, le=2.0)
    """Masses, and what resists a push."""
    disturbance: float = Field(ge=0.0, le=2.0)
    """Impulses on the object and pushes on the base."""


class Curriculum(Section):
    """Static balance under varied loads, then locomotion with impulses, then partly infeasible commands (paper III-D).

    Each environment has a level between 0 and 2 on each of four axes: posture, locomotion, load, disturbance. An axis
    rises after an episode that survived and did well by the axis' own measure, and falls after one that ended early
    while that axis was to blame. With one level for everything, training that could not walk yet met heavier loads and
    harder pushes before it practised a step.
    """

    enabled: bool = True
    """Off trains every environment at `fixed_level`."""
    fixed_level: float = Field(default=1.0, ge=0.0, le=2.0)
    """Level of every axis without a curriculum; also that of evaluation and of single environments. 1 is the recipe's
    own ranges."""
    velocity: Scale = Scale(start=1.0, full=1.0, extreme=1.3)
    """Factor on the range of v_x, by the level of locomotion: the recipe's own range from the start. At 0.6 of it, a
    robot that steps in place follows so closely that it hardly learns to walk."""
    turning: Scale = Scale(start=0.2, full=1.0, extreme=1.3)
    """Factor on the ranges of v_y and yaw rate, by the level of locomotion: walking is learnt straight ahead first."""
    posture: Scale = Scale(start=0.2, full=1.0, extreme=1.0)
    """Part of the range of height, pitch and wrist offsets that is used, around the nominal posture."""
    load: Scale = Scale(start=0.15, full=1.0, extreme=1.3)
    """Upper end of the range of masses, as a part of the scene's own; the lower end stays. At 1.3 the box weighs up to
    13.5 kg, and shoulders hold 12 to 16."""
    resistance: Scale = Scale(start=0.5, full=1.0, extreme=3.0)
    """Factor on a crate's rolling resistance, by the level of load: at 3 it is near what feet can push against."""
    blocked: Scale = Scale(start=0.0, full=0.0, extreme=0.25)
    """Part of the pushes whose crate does not roll at all, by the level of load. Together with `resistance` more than
    30 % of the pushes at level 2 are infeasible: they teach to stay upright against what does not yield."""
    blocking: float = Field(default=50.0, ge=1.0, json_schema_extra=LATER)
    """Factor on the rolling resistance of a crate that is not to roll: at the nominal resistance of 0.06 one of 13 kg
    then resists with the 392 N that feet hold at most, and heavier ones do not move."""
    disturbance: Scale = Scale(start=0.0, full=1.0, extreme=1.5)
    """Factor on impulses and pushes."""
    balance: Ceilings = Ceilings(posture=1.0, locomotion=0.5, load=1.0, disturbance=0.3)
    """Phase 1: static balance under varied loads. Slow walking is practised from the first episode on, for it takes
    longest to learn."""
    locomotion: Ceilings = Ceilings(posture=1.0, locomotion=1.0, load=1.0, disturbance=1.0)
    """Phase 2: locomotion with impulses; an environment enters it when it has reached all ceilings of phase 1."""
    extreme: Ceilings = Ceilings(posture=2.0, locomotion=2.0, load=2.0, disturbance=2.0)
    """Phase 3: commands, loads and resistance to what is infeasible."""
    lead: float = Field(default=0.25, ge=0.0)
    """In an episode with walking, posture, load and disturbance are at most so far above the level of locomotion: new
    steps are practised with what is light, and heavy loads first while standing."""
    rise: float = Field(default=0.08, ge=0.0)
    """Added to an axis' level after a success."""
    fall: float = Field(default=0.1, ge=0.0)
    """Taken from it after an episode that ended before `early` of its time for which the axis is to blame. More than
    `rise`: an axis comes to rest where five of nine of its episodes succeed."""
    early: float = Field(default=0.7, gt=0.0, le=1.0)
    """Part of the time limit before which an end counts as a failure."""
    tracking: float = Field(default=0.65, ge=0.0, le=1.0)
    """Mean scores of height and pitch, by the kernels of their terms of the reward, that a success of posture, load and
    disturbance needs."""
    progress: float = Field(default=0.6, ge=0.0, le=1.0)
    """Part of the commanded displacement that a success of locomotion covers, counted along the command and no faster
    than it; 1 is the command itself. Above level 1, where a command may be infeasible, posture counts in its place."""
    load_progress: float = Field(default=0.0, ge=0.0, le=1.0, json_schema_extra=LATER)
    """Part of the commanded displacement that an episode with walking covers before its load grows; 0 asks for none.
    Crates grow heavier behind statues, too, until nobody has seen one roll."""
    heading: float = Field(default=0.5, gt=0.0)
    """Mean heading error [rad] that a success of locomotion may have; above level 1 it does not count."""
    lagging: float = Field(default=0.2, ge=0.0, le=1.0)
    """Part of the commanded displacement below which an episode with walking lowers the level of locomotion, although
    the robot stood: a stepping statue."""
    least_walk: float = Field(default=2.0, ge=0.0)
    """Time with a commanded velocity from which on an episode says something about locomotion [s]."""
    replay: float = Field(default=0.0, ge=0.0, le=1.0, json_schema_extra=LATER)
    """Chance that an environment whose last new episode failed plays it again, with everything that was drawn: loads,
    partner, latencies, commands, disturbances. It is forgotten when it succeeds. 0 always draws anew."""
    blame: float = Field(default=1.0, ge=0.0)
    """Time after an impulse or a push within which a fall is put down to it [s]."""
    limit: float = Field(default=2.0, ge=0.0, le=2.0)
    """Highest level of any axis."""

    def problems(self) -> Iterator[tuple[str, str]]:
        if self.fixed_level > self.limit:
            yield "", f"fixed_level: {self.fixed_level} is above the limit of {self.limit}"
