"""The gait prior: a stride of the commanded velocity, added to the support posture.

In stance a foot travels backward under the pelvis with the commanded velocity and turns against the commanded yaw rate;
in swing it returns, lifted by the swing clearance; the pelvis sways over the standing foot. Displacements of the soles
become joint angles by the leg's own geometry: hip pitch and knee exactly, as two links in the sagittal plane, hip roll
and yaw and ankle roll to first order; the ankles keep the soles parallel to the posture's, and joints in their range.
"""

import numpy as np

from iowbc.arrays import Array, Constants, namespace
from iowbc.control.command import YAW_RATE
from iowbc.control.gait import foot_phase, swing_height, swing_progress
from iowbc.control.legs import Legs, direction, leg_geometry, leg_joints, pitched
from iowbc.recipe.task.joint_references import GaitPrior
from iowbc.robot.description import Robot

HIP_PITCH, HIP_ROLL, HIP_YAW, KNEE, ANKLE_PITCH, ANKLE_ROLL = range(6)


class Stride(Constants):
    """The gait prior of a robot. Holds constants only."""

    def __init__(self, robot: Robot, settings: GaitPrior, held: bool = False) -> None:
        """`held`: the height feedback also acts while the robot stands. Raises ValueError for legs of another kind."""
        self._joints = [list(pair) for pair in zip(*leg_joints(robot), strict=True)]
        """Places of each joint of the legs, left and right, among the support joints."""
        self._settings, self.legs, self._held = settings, leg_geometry(robot), float(held)
        self._thigh_squared, self._shank_squared = (x * x + z * z for x, z in (self.legs.thigh, self.legs.shank))
        self._twice_product = 2.0 * np.sqrt(self._thigh_squared * self._shank_squared)
        self._crooked = _forward(*self.legs.shank) - _forward(*self.legs.thigh)
        """κ, positive bent back [rad]."""
        self._spread = settings.spread * np.sign(self.legs.side)
        """Lateral offset of each sole from its place in the posture, positive to the left, (2,) [m]."""
        moved = [joint for pair in self._joints for joint in pair]
        others = [joint for joint in range(len(robot.support)) if joint not in moved]
        self._order = np.argsort([*moved, *others]).tolist()
        """For each support joint its place among those of the legs, or among the zeros after them."""
        self._lower, self._upper = robot.lower[robot.support], robot.upper[robot.support]

    def __call__(
        self,
        posture: Array,
        pelvis_pitch: Array,
        command: Array,
        phase: Array,
        stepping: Array,
        feedback: Array | None = None,
    ) -> Array:
        """θ_S_ref with the stride, (n, support joints) [rad].

        `posture` (n, support joints): the reference at rest; `pelvis_pitch` (n,) [rad] in it; `command` C (n, 11);
        `phase` (n,) of the gait, in [0, 1); `stepping` (n,) one while the clock runs, else zero; `feedback` (n, 4 or
        more): forward offset of left foot, right foot and both, stretch of both legs [m].
        """
        xp, legs, pitch = namespace(posture), self.legs, pelvis_pitch[:, None]
        hip, knee = posture[:, self._joints[HIP_PITCH]], posture[:, self._joints[KNEE]]
        thigh = pitch + hip
        x, z = pitched(direction(thigh), *_ankle(legs, knee))
        ahead, left, up, turn = self._soles(pitch, x, command, phase, stepping)
        if feedback is not None:
            ahead, up = ahead + feedback[:, :2] + feedback[:, 2:3], up - feedback[:, 3:4]
        bent, angle = self._bent(x + ahead, z + up)
        moved = stepping[:, None] + self._held * (1.0 - stepping[:, None])
        change, bend = (angle - thigh) * moved, (bent - knee) * moved
        hip_roll, hip_yaw, ankle_roll = _sideways(legs, thigh + change, knee + bend, left, turn)
        joints = [change, hip_roll, hip_yaw, bend, -change - bend, ankle_roll]
        others = 0.0 * posture[:, : len(self._order) - 2 * len(joints)]
        changes = xp.concatenate([*joints, others], -1)[:, self._order]
        return (posture + changes).clip(self._lower, self._upper)

    def _soles(
        self, pitch: Array, ankle_x: Array, command: Array, phase: Array, stepping: Array
    ) -> tuple[Array, Array, Array, Array]:
        """Displacements of the soles from the posture, (n, 2) each: ahead, to the left, up [m], turned [rad]."""
        xp, gait, legs = namespace(phase), self._settings, self.legs
        foot = foot_phase(phase)
        swing = swing_progress(foot, gait.stance)
        time = gait.stance / gait.frequency * gait.stride
        part = travel(foot, swing, gait.stance) * time * stepping[:, None]
        rate = command[:, YAW_RATE : YAW_RATE + 1]
        place_x = xp.cos(pitch) * legs.hip[0] + xp.sin(pitch) * legs.hip[1] + ankle_x + legs.sole[0]
        sway = gait.sway * (xp.sin(2.0 * np.pi * phase) * stepping)[:, None]
        return (
            part * (command[:, 0:1] - rate * (legs.side + self._spread)),
            part * (command[:, 1:2] + rate * place_x) - sway + self._spread,
            swing_height(swing, gait) * stepping[:, None],
            part * rate,
        )

    def _bent(self, x: Array, z: Array) -> tuple[Array, Array]:
        """Knee and thigh's angle that put the ankle ahead of and above the hip pitch axis, (n, 2) [m] to [rad].

        d² = l₁² + l₂² + 2 l₁l₂ cos(knee + κ) for links that make the angle κ with the knee at zero.
        """
        cosine = (x * x + z * z - self._thigh_squared - self._shank_squared) / self._twice_product
        knee = namespace(x).arccos(cosine.clip(-1.0, float(np.cos(self._settings.straightest_knee)))) - self._crooked
        return knee, _forward(x, z) - _forward(*_ankle(self.legs, knee))


def travel(foot: Array, swing: Array, stance: float) -> Array:
    """Place of feet along their stride, 1/2 ahead to -1/2 behind, of their phases and progress in swing (n, 2): at an
    even pace in stance; in swing a cubic that leaves and meets the ground at the ground's own speed."""
    slope = (1.0 - stance) / stance
    forth = swing * swing * (3.0 - 2.0 * swing) - slope * swing * (1.0 - swing) * (1.0 - 2.0 * swing)
    return namespace(foot).where(foot < stance, 0.5 - foot / stance, forth - 0.5)


def _ankle(legs: Legs, knee: Array) -> tuple[Array, Array]:
    """The ankle ahead of and above the hip pitch axis, in the thigh's frame, (n, 2) [m]."""
    x, z = pitched(direction(knee), *legs.shank)
    return legs.thigh[0] + x, legs.thigh[1] + z


def _sideways(legs: Legs, thigh: Array, knee: Array, left: Array, turn: Array) -> tuple[Array, Array, Array]:
    """Hip roll, hip yaw and ankle roll that move soles to the left [m] and turn them [rad] without tilting them.

    With levers of the three axes (the sole's motion to the left per radian) and their directions a:
    Σ lever·δ = left, Σ a_z·δ = turn, Σ a_x·δ = 0.
    """
    leaning = direction(thigh)
    ankle_x, ankle_z = _ankle(legs, knee)
    sole_x, sole_z = legs.sole[0], legs.sole[1] + legs.ankle_roll_z
    roll_x, roll_z = leaning[0], -leaning[1]
    yaw_x, yaw_z = pitched(leaning, *legs.tilt)
    from_roll = pitched(leaning, ankle_x - legs.roll[0], ankle_z - legs.roll[1])
    from_yaw = pitched(leaning, ankle_x - legs.yaw[0], ankle_z - legs.yaw[1])
    roll_lever = roll_z * (from_roll[0] + sole_x) - roll_x * (from_roll[1] + sole_z)
    yaw_lever = yaw_z * (from_yaw[0] + sole_x) - yaw_x * (from_yaw[1] + sole_z)
    whole = roll_lever * yaw_z - yaw_lever * roll_z
    hip_roll = (left * yaw_z - yaw_lever * turn) / whole
    hip_yaw = (roll_lever * turn - left * roll_z) / whole
    return hip_roll, hip_yaw, -(roll_x * hip_roll + yaw_x * hip_yaw)


def _forward(x: Array, z: Array) -> Array:
    """Pitch that turns straight down into a vector of the sagittal plane, [rad]."""
    return namespace(x).arctan2(-x, -z)
