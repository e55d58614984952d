"""The signals of one trial."""

from dataclasses import dataclass

from iowbc.arrays import Array


@dataclass(frozen=True)
class Trace:
    """One row a control step, up to the trial's end or its fall. Vectors are in the world frame unless said."""

    dt: float
    """Control period [s]."""
    system_velocity: Array
    """Common centre of mass of robot and object, heading frame, shape (T, 3) [m/s]."""
    commanded_velocity: Array
    """v_x, v_y [m/s], yaw rate [rad/s] as clamped to what is feasible, heading frame, shape (T, 3)."""
    heading: Array
    """Yaw of the base, shape (T,) [rad]."""
    heading_reference: Array
    """Integrated commanded yaw rate, shape (T,) [rad]."""
    torso_pitch: Array
    """Shape (T,) [rad]."""
    torso_pitch_command: Array
    """As clamped, shape (T,) [rad]."""
    pelvis_height: Array
    """What H speaks of, shape (T,) [m]."""
    height_command: Array
    """As clamped, shape (T,) [m]."""
    saturation: Array
    """Share of the joints at their torque limit, shape (T,)."""
    slipped: Array
    """1 while a hand does not hold the object, or in a push does not touch it, shape (T,)."""
    partner_force: Array
    """Partner's force on the object, shape (T, 3) [N]."""
    link_object_force: Array
    """Size of the net force of links other than the hands on the object, shape (T,) [N]."""
    grip_force: Array
    """Force of the object on each hand, left then right, shape (T, 6) [N]."""
    external_force: Array
    """Force of partner, impulses and pulls on the object, shape (T, 3) [N]."""
    handle_velocity: Array
    """Velocity of the object's far handle, shape (T, 3) [m/s]."""
    partner_velocity: Array
    """Velocity that the partner intends for that handle, zero without a partner, shape (T, 3) [m/s]."""
    power: Array
    """Sum over the joints of |torque x speed|, shape (T,) [W]."""
    base_position: Array
    """Shape (T, 3) [m]."""
    torso_position: Array
    """A point within the torso, shape (T, 3) [m]."""
    object_position: Array
    """Shape (T, 3) [m]; zero without an object."""
    foot_position: Array
    """Sole centres, left then right, shape (T, 6) [m]."""
    foot_slide: Array
    """Horizontal speed of the soles at their centres of pressure, shape (T, 2) [m/s]."""
    foot_margin: Array
    """Distance of each foot's centre of pressure from the edge of its sole, zero in the air, shape (T, 2) [m]."""
    foot_sink: Array
    """Downward speed of the lowest corner of each sole, shape (T, 2) [m/s]."""
    foot_peak: Array
    """Largest force of the ground on each foot in any physics step of the period, shape (T, 2) [N]."""
    foot_load: Array
    """Vertical force of the ground on each foot, shape (T, 2) [N]."""
    foot_shear: Array
    """Size of its horizontal force, shape (T, 2) [N]."""
    foot_contact: Array
    """1 while a foot touches the ground, shape (T, 2)."""
    action: Array
    """What the action adds to the reference of the support joints, shape (T, support) [rad]."""
    joint_torque: Array
    """Shape (T, joints) [N·m]."""
    joint_saturation: Array
    """1 while a joint is at its torque limit, shape (T, joints)."""

    def __len__(self) -> int:
        return len(self.heading)
