"""The reference layer: a command becomes arm references by differential IK (eq. 2, 3) and support references by the RG.

Pure arrays over n environments; the exported graph is traced from the same lines.
"""

from pathlib import Path

import numpy as np

from iowbc.arrays import Array, Constants, Mask, as_slice, namespace
from iowbc.control import gait
from iowbc.control.arms import ArmKinematics
from iowbc.control.chain import Frames
from iowbc.control.command import HEIGHT, OFFSET, PITCH
from iowbc.control.feasible_map import FEASIBLE, FeasibleMap
from iowbc.control.feedback import FootPlacement, HipFeedback, LegStretch
from iowbc.control.sensors import Measured
from iowbc.control.stride import Stride
from iowbc.recipe.task.joint_references import References
from iowbc.robot.description import Robot
from iowbc.robot.mirror import VECTOR_SIGN


def both_wrists(left: tuple[float, float, float]) -> Array:
    """Base grasp of both wrists, (2, 3), from the left one's position in the heading frame [m]."""
    return np.stack([np.array(left), VECTOR_SIGN * np.array(left)])


STRETCH, TURN = 3, 4
"""Places of the stretch of the legs and the turn of the hips in the feedback, after the offsets of the feet."""
FEEDBACK_SIZE = 5


class ReferenceLayer(Constants):
    """Arm and support references of n environments. Holds constants only; the caller keeps the references."""

    def __init__(self, robot: Robot, references: References, rg: Path | None) -> None:
        """`rg`: folder of the generator; without it θ_S_ref is the default posture, and commands are not clamped."""
        self.arms = ArmKinematics(robot, references.arms)
        self.network, self.feasible = None, None
        if rg is not None:
            from iowbc.control.generator import ReferenceNetwork

            self.network = ReferenceNetwork.load(rg) if references.use_rg else None
            self.feasible = FeasibleMap.load(rg / FEASIBLE).up_to(references.largest_pitch)
        if references.upright:
            self.feasible = FeasibleMap.single(robot.default_height)
        self._ahead = references.lean * np.eye(3)[0]
        self._compliance = 1.0 / robot.kp[robot.interaction]
        self.default_arms = robot.default_position[robot.interaction]
        self.default_support = robot.default_position[robot.support]
        self.default_height = robot.default_height
        self.waist, self._waist_pitch = as_slice(robot.waist), as_slice(robot.waist_pitch)
        self._settings = prior = references.gait
        height, torso = references.height, references.torso
        self._stride = Stride(robot, prior, held=height is not None) if prior.enabled else None
        self._placement = None if prior.placement is None else FootPlacement(robot, prior, prior.placement)
        self._legs = None if height is None else LegStretch(robot, height)
        self._hips = None if torso is None else HipFeedback(robot, torso)

    def clamp(self, command: Array) -> Array:
        """The command with height and torso pitch brought into the feasible map; (n, 11)."""
        if self.feasible is None:
            return command
        height, pitch = self.feasible.clamp(command[:, HEIGHT], command[:, PITCH])
        parts = [command[:, :HEIGHT], height[:, None], pitch[:, None], command[:, OFFSET]]
        return namespace(command).concatenate(parts, 1)

    def start_command(self, command: Array) -> Array:
        """The command with the posture in which an episode can start, (n, 11): without a generator the default one."""
        if self.network is not None:
            return command
        changed = command.copy()
        changed[:, HEIGHT], changed[:, PITCH] = self.default_height, 0.0
        return changed

    def start(self, command: Array, grasp: Array) -> tuple[Array, Array]:
        """References at the start of an episode, standing in the commanded posture: arms (n, arm joints), support (n,
        support joints); command (n, 11); grasp (n, 2, 3): base grasp wrist positions, heading frame [m]."""
        arms, settings = self.default_arms + 0.0 * command[:, :1], self.arms.settings
        target = self.wrist_target(self.support(arms, command), command, grasp)
        for _ in range(settings.settling):
            arms = self.arms.solve_step(arms, target, settings.settling_time)
        support = self.support(arms, command)
        for _ in range(settings.refining):
            arms, support = self.advance(arms, support, command, grasp, settings.refining_time)
        rest = 0.0 * command[:, 0]
        return arms, self.with_stride(support, command, rest, rest > 0.0)

    def advance(
        self, arms: Array, support: Array, command: Array, grasp: Array, dt: float, frames: Frames | None = None
    ) -> tuple[Array, Array]:
        """References one control period later; shapes as in `start`. `frames` of `arms`, where they are known."""
        arms = self.arms.solve_step(arms, self.wrist_target(support, command, grasp), dt, frames)
        return arms, self.support(arms, command)

    def support(self, arms: Array, command: Array) -> Array:
        """θ_S_ref = φ_RG(θ_I_ref, σ_base), (n, support joints) [rad], without the gait prior."""
        if self.network is None:
            return self.default_support + 0.0 * command[:, :1]
        return self.network(arms, command[:, HEIGHT : PITCH + 1])

    def with_stride(
        self, support: Array, command: Array, phase: Array, stepping: Mask, feedback: Array | None = None
    ) -> Array:
        """θ_S_ref with the stride of the gait prior and the feedback of `pace`, (n, support joints) [rad]."""
        if self._stride is not None:
            pitch = self.start_pitch(support, command)
            support = self._stride(support, pitch, command, phase, 1.0 * stepping, feedback)
        if self._hips is not None and feedback is not None:
            support = self._hips.turned(support, feedback[:, TURN:])
        return support

    def pace(
        self,
        phase: Array,
        stepping: Mask,
        feedback: Array,
        measured: Measured,
        support: Array,
        command: Array,
        dt: float,
    ) -> tuple[Array, Mask, Array]:
        """Gait phase (n,), whether the clock runs (n,), and feedback (n, 5) one control period later: offset of left
        foot, right foot and both, stretch of both legs [m], turn of both hips [rad].

        The clock runs for a commanded velocity, or to catch a fall."""
        moving, recovery = gait.wants_to_move(command, self._settings), self._settings.recovery
        if recovery is not None:
            moving = moving | gait.is_falling(measured, self.start_pitch(support, command), recovery)
        phase, stepping = gait.advance(phase, stepping, moving, self._settings, dt)
        feet, stretch, turn = feedback[:, :STRETCH], feedback[:, STRETCH:TURN], feedback[:, TURN:]
        if self._placement is not None:
            feet = self._placement(feet, measured, command, phase, 1.0 * stepping, dt)
        if self._legs is not None:
            stretch = self._legs(stretch, measured, command, dt)
        if self._hips is not None:
            turn = self._hips(turn, measured, command, dt)
        return phase, stepping, namespace(feedback).concatenate([feet, stretch, turn], -1)

    def pelvis_pitch(self, support: Array, command: Array) -> Array:
        """Pelvis pitch of the reference posture, (n,) [rad]: the torso's less the waist's."""
        return command[:, PITCH] - support[:, self._waist_pitch].sum(1)

    def start_pitch(self, support: Array, command: Array) -> Array:
        """Pelvis pitch at which the feet of a posture are flat, (n,) [rad]: zero for the default posture."""
        return 0.0 * command[:, PITCH] if self.network is None else self.pelvis_pitch(support, command)

    def wrist_target(self, support: Array, command: Array, grasp: Array) -> Array:
        """x_wrist = x_task_base + Δp (eq. 2), (n, 2, 3) [m], in the torso frame of the references, not as measured,
        so that the arms do not react to swaying."""
        wrists = self.wrists(command, grasp)
        return self.arms.into_torso(support[:, self.waist], self.pelvis_pitch(support, command), wrists)

    def wrists(self, command: Array, grasp: Array) -> Array:
        """x_wrist in the heading frame, ahead of the base grasp where the torso leans forward, (n, 2, 3) [m]."""
        lean = namespace(command).sin(command[:, PITCH]).clip(0.0, None)
        return grasp + command[:, OFFSET].reshape(-1, 2, 3) + lean[:, None, None] * self._ahead

    def arm_target(
        self, arms: Array, support: Array, command: Array, load: Array, frames: Frames | None = None
    ) -> Array:
        """Targets of the arms' joint controllers, (n, arm joints) [rad]: the references plus offsets that balance the
        weight of the arms and of a load (n,) [kg] between the hands, θ + τ / kp, in the posture of the references.
        `frames` of `arms`, where they are known."""
        if not self.arms.settings.gravity:
            return arms
        xp, pitch = namespace(command), self.pelvis_pitch(support, command)
        down = xp.stack([xp.sin(pitch), 0.0 * pitch, -xp.cos(pitch)], 1)
        torque = self.arms.torque(arms, support[:, self.waist], down, 0.5 * load[:, None], frames)
        return arms + torque * self._compliance
