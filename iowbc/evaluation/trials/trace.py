"""The outcome of one episode, and the signals of its course."""

from collections.abc import Mapping
from dataclasses import dataclass

from iowbc.arrays import Array


@dataclass(frozen=True)
class Trace:
    """One row a control step, up to the trial's end or its fall: (T,) or (T, k) as said, world frame unless said.

    Feet and hands: left, then right. `iowbc.task.record.signals` has the same signals.
    """

    dt: float
    """Control period [s]."""
    system_velocity: Array
    commanded_velocity: Array
    """Common centre of mass of robot and object, and the command as clamped to what is feasible: v_x, v_y [m/s], yaw
    rate [rad/s], heading frame, (T, 3)."""
    heading: Array
    heading_reference: Array
    """Yaw of the base, and integrated commanded yaw rate, (T,) [rad]."""
    torso_pitch: Array
    torso_pitch_command: Array
    """As measured and as clamped, (T,) [rad]."""
    pelvis_height: Array
    height_command: Array
    """The height that H means, as measured and as clamped, (T,) [m]."""
    saturation: Array
    """Fraction of the joints at their torque limit, (T,)."""
    slipped: Array
    """1 while a hand does not hold the object, or in a push does not touch it, (T,)."""
    partner_force: Array
    external_force: Array
    """Forces on the object: the partner's, and that of partner, impulses and pulls, (T, 3) [N]."""
    link_object_force: Array
    """Size of the net force of links other than the hands on the object, (T,) [N]."""
    grip_force: Array
    """Force of the object on each hand, (T, 6) [N]."""
    handle_velocity: Array
    partner_velocity: Array
    """Velocity of the object's far handle, and the one that the partner intends for it, zero without, (T, 3) [m/s]."""
    power: Array
    """Sum over the joints of |torque x speed|, (T,) [W]."""
    base_position: Array
    torso_position: Array
    object_position: Array
    """Base, a point within the torso, and object, zero without one, (T, 3) [m]."""
    foot_position: Array
    """Sole centres, (T, 6) [m]."""
    foot_slide: Array
    foot_sink: Array
    """Of the soles: horizontal speed at the centre of pressure, downward speed of the lowest corner, (T, 2) [m/s]."""
    foot_margin: Array
    """Distance of each foot's centre of pressure from the edge of its sole, zero in the air, (T, 2) [m]."""
    foot_peak: Array
    foot_load: Array
    foot_shear: Array
    """Force of the ground on each foot: largest in any physics step of the period, vertical, and size of the horizontal
    one, (T, 2) [N]."""
    foot_contact: Array
    """1 while a foot touches the ground, (T, 2)."""
    action: Array
    """Correction that the action adds to the reference of the support joints, (T, support) [rad]."""
    joint_torque: Array
    joint_saturation: Array
    """Torque [N·m], and 1 while a joint is at its limit, (T, joints)."""

    def __len__(self) -> int:
        return len(self.heading)


@dataclass(frozen=True)
class Outcome:
    """Signals and end of one episode."""

    trace: Trace
    seconds: float
    """Time until it ended [s]."""
    fallen: bool
    dropped: bool
    finished: bool
    """True where it reached its time limit."""
    drawn: Mapping[str, Array]
    """Everything that was drawn for it, by name, each of shape (k,)."""

    @property
    def survived(self) -> bool:
        """No fall, nothing dropped, for the whole episode."""
        return self.finished and not (self.fallen or self.dropped)

    @property
    def ending(self) -> str:
        """The kind of its end; "diverged" where the simulation broke off without a fall or a drop."""
        if self.fallen:
            return "fell"
        if self.dropped:
            return "dropped"
        return "finished" if self.finished else "diverged"
