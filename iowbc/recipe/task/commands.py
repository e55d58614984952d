"""The 11-D skill-level command and how it is drawn in training."""

from pydantic import Field

from iowbc.recipe.section import PositiveRange, Range, Section, Vector


class CommandRates(Section):
    """Rate limits of a command; a new value is approached at this rate."""

    velocity: float = Field(default=1.0, gt=0.0)
    """Change of the planar velocity, per axis [m/s²]."""
    yaw_rate: float = Field(default=1.0, gt=0.0)
    """Change of the yaw rate [rad/s²]."""
    height: float = Field(default=0.15, gt=0.0)
    """Change of the height [m/s]."""
    pitch: float = Field(default=0.5, gt=0.0)
    """Change of the torso pitch [rad/s]."""
    offset: float = Field(default=0.15, gt=0.0)
    """Change of a wrist offset, per axis [m/s]."""


class PushingVelocities(Section):
    """Velocities behind a crate, which is not held: neither backward nor to the side."""

    velocity_x: Range = (0.0, 0.5)
    """Forward velocity, heading frame [m/s]."""
    velocity_y: Range = (0.0, 0.0)
    """Velocity to the left, heading frame [m/s]."""
    yaw_rate: Range = (-0.1, 0.1)
    """Yaw rate [rad/s]; two palms turn a crate slowly."""


class Commands(Section):
    """Ranges, resampling and limits of the 11-D command [v_x, v_y, ω_yaw, H, α_pitch, Δp_left, Δp_right]."""

    velocity_x: Range = (-0.3, 0.6)
    """Forward velocity, heading frame [m/s]; slightly beyond the 0.5 m/s of the trials."""
    velocity_y: Range = (-0.2, 0.2)
    """Velocity to the left, heading frame [m/s]."""
    yaw_rate: Range = (-0.4, 0.4)
    """Yaw rate [rad/s]."""
    height: Range = (0.5, 0.78)
    """Height H [m]; 0.78 m is where the legs are nearly straight. The feasible map clamps further."""
    pitch: Range = (-0.25, 0.75)
    """Torso pitch against gravity, positive leaning forward [rad]. The feasible map clamps further."""
    deep_pitch: Range = (-0.5, 1.5)
    """Torso pitch of the deep leans, the paper's whole range [rad]; while standing, clamped by the feasible map."""
    deep_share: float = Field(default=0.1, ge=0.0, le=1.0)
    """Fraction of the standing commands with a deep lean; few, since trials stay within `pitch`."""
    pushing: PushingVelocities = PushingVelocities()
    common_offset: Vector = (0.05, 0.05, 0.08)
    """Largest common offset of both wrists, per axis of the heading frame [m]."""
    single_offset: Vector = (0.02, 0.0, 0.02)
    """Largest additional offset of a single wrist, per axis [m]; small, because a held object does not stretch."""
    nominal_height: float = Field(default=0.72, gt=0.0)
    """Height of the nominal posture [m], used for commands that leave the posture unspecified."""
    nominal_pitch: float = 0.0
    """Torso pitch of the nominal posture [rad]."""
    standing_episodes: float = Field(default=0.1, ge=0.0, le=1.0)
    """Fraction of the episodes without walking. They train balance, posture and loads before walking is learnt; 1:
    standing only."""
    standing_share: float = Field(default=0.15, ge=0.0, le=1.0)
    """Fraction of standing commands in the other episodes, so that three in four of all commands walk. With two in four
    a robot learnt to step in place and never walked."""
    straight_share: float = Field(default=0.5, ge=0.0, le=1.0)
    """Fraction of the walking commands without yaw rate and lateral velocity."""
    turning_share: float = Field(default=0.1, ge=0.0, le=1.0)
    """Fraction of the commands with a yaw rate that turn on the spot."""
    nominal_share: float = Field(default=0.4, ge=0.0, le=1.0)
    """Fraction of the commands with nominal height, pitch and wrists."""
    holding_start: float = Field(default=0.3, ge=0.0, le=1.0)
    """Initial posture of an episode with a held object, as a fraction of the way from the nominal to the drawn posture;
    at 1 a third of the objects would start inside thighs or torso. The command then approaches the drawn posture."""
    smallest_speed: float = Field(default=0.25, ge=0.0)
    """Smallest planar speed of a walking command [m/s]. Slower ones are raised to it, even out of their range, so that
    stepping is worthwhile."""
    smallest_yaw_rate: float = Field(default=0.2, ge=0.0)
    """Smallest yaw rate of a turn on the spot [rad/s]; slower ones are raised to it, for the same reason."""
    resampling: PositiveRange = (3.0, 7.0)
    """Time from one command to the next [s]."""
    rates: CommandRates = CommandRates()
