"""Outcome and recorded signals of one episode."""

from collections.abc import Mapping
from dataclasses import dataclass

from iowbc.arrays import Array


@dataclass(frozen=True)
class Trace:
    """Signals per control step up to the end of the trial, (T,) or (T, k); world frame unless stated otherwise.

    Feet and hands: left, then right. `iowbc.task.record.signals` has the same signals.
    """

    dt: float
    """Control period [s]."""
    system_velocity: Array
    commanded_velocity: Array
    """Velocity of the common centre of mass of robot and object, and clamped command: v_x, v_y [m/s], yaw rate [rad/s],
    heading frame, (T, 3)."""
    heading: Array
    heading_reference: Array
    """Yaw of the base, and integrated commanded yaw rate, (T,) [rad]."""
    torso_pitch: Array
    torso_pitch_command: Array
    """Measured pitch and clamped command, (T,) [rad]."""
    pelvis_height: Array
    height_command: Array
    """Measured height, of the point that the command H refers to, and clamped command, (T,) [m]."""
    saturation: Array
    """Fraction of the joints at their torque limit, (T,)."""
    slipped: Array
    """1 while a hand does not hold the object, or in a push does not touch it, (T,)."""
    partner_force: Array
    external_force: Array
    """Forces on the object: of the partner, and the sum of partner, impulses and pulls, (T, 3) [N]."""
    link_object_force: Array
    """Magnitude of the net force of links other than the hands on the object, (T,) [N]."""
    grip_force: Array
    """Force of the object on each hand, (T, 6) [N]."""
    handle_displacement: Array
    """Displacement of the object's far handle in each period, zero without an object, (T, 3) [m]."""
    partner_velocity: Array
    """Velocity of the handle that the partner intends; zero without one, (T, 3) [m/s]."""
    power: Array
    """Sum over the joints of |torque x speed|, (T,) [W]."""
    base_position: Array
    torso_position: Array
    object_position: Array
    """Position of base, a point in the torso, and object (zero without one), (T, 3) [m]."""
    foot_position: Array
    """Sole centres, (T, 6) [m]."""
    foot_slide: Array
    foot_sink: Array
    """Horizontal speed of each sole at its centre of pressure, downward speed of its lowest corner, (T, 2) [m/s]."""
    foot_margin: Array
    """Distance of each foot's centre of pressure from the edge of its sole, zero in the air, (T, 2) [m]."""
    foot_peak: Array
    foot_load: Array
    foot_shear: Array
    """Ground force on each foot: peak over physics steps of the period, vertical, horizontal magnitude, (T, 2) [N]."""
    foot_contact: Array
    """1 while a foot touches the ground, (T, 2)."""
    action: Array
    """Residual that the action adds to the reference of the support joints, (T, support) [rad]."""
    joint_torque: Array
    joint_saturation: Array
    """Torque [N·m], and 1 while a joint is at its limit, (T, joints)."""

    def __len__(self) -> int:
        return len(self.heading)


@dataclass(frozen=True)
class Outcome:
    """Signals and termination of one episode."""

    trace: Trace
    seconds: float
    """Duration until the end [s]."""
    fallen: bool
    dropped: bool
    finished: bool
    """True if the episode reached its time limit."""
    drawn: Mapping[str, Array]
    """Random draws by name, each of shape (k,)."""

    @property
    def survived(self) -> bool:
        """True if the episode finished without a fall or a drop."""
        return self.finished and not (self.fallen or self.dropped)

    @property
    def ending(self) -> str:
        """Kind of termination; "diverged" if the simulation stopped without a fall or a drop."""
        if self.fallen:
            return "fell"
        if self.dropped:
            return "dropped"
        return "finished" if self.finished else "diverged"
