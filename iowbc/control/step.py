"""The control step as one function of arrays: measurements, desired command, scene and state in, targets and state out.

`settle` computes the first state, `step` all later ones. An export traces them into `settle.onnx` and `step.onnx`; the
simulation computes the same equations with its own state (`iowbc.task.guidance`).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, get_type_hints

import numpy as np

from iowbc.arrays import Array, Constants, namespace, places
from iowbc.control import gait
from iowbc.control.action import action_scale, applied_action
from iowbc.control.command import COMMAND, YAW_RATE, approach, rate_limits
from iowbc.control.observation import ObservationLayout, PolicyInputs
from iowbc.control.references import FEEDBACK_SIZE, ReferenceLayer
from iowbc.control.sensors import Measured
from iowbc.recipe.task.task import Task
from iowbc.robot.description import Robot


@dataclass(frozen=True)
class State:
    """State of n control loops between two steps, one row a robot: parts in the order of the packed state, with unit,
    frame and meaning; shapes are in `ControlStep.shapes`."""

    command: Annotated[
        Array, "m/s, m/s, rad/s, m, rad, m x 6", "heading", "command in force: rate-limited, and clamped to the map"
    ]
    arms: Annotated[Array, "rad", "joint", "θ_I_ref from differential IK, interaction order"]
    posture: Annotated[Array, "rad", "joint", "θ_S_ref without the gait prior, support order"]
    heading_reference: Annotated[Array, "rad", "world", "`heading` at the start plus the integrated yaw rate commanded"]
    phase: Annotated[Array, "1", "-", "gait phase in [0, 1)"]
    stepping: Annotated[Array, "1", "-", "1 while the gait clock runs, else 0"]
    feedback: Annotated[
        Array,
        "m, m, m, m, rad",
        "heading",
        "forward offset of left foot, right foot and both; stretch of both legs; turn of both hips",
    ]
    begun: Annotated[Array, "1", "-", "0 in the state that settle.onnx makes, 1 afterwards"]
    action: Annotated[Array, "action", "joint", "residual action of the policy, clipped, support order"]
    history: Annotated[Array, "SI", "-", "the last observations, oldest first"]


STATE: Mapping[str, tuple[str, str, str]] = {
    name: hint.__metadata__ for name, hint in get_type_hints(State, include_extras=True).items()
}
"""Unit, frame and meaning of each part of the state, in its order in the packed one."""


@dataclass(frozen=True)
class StepResult:
    target: Array
    """Position targets of all joints, MJCF order, (n, joints) [rad]."""
    action: Array
    """Residual action of the policy, clipped, (n, support joints)."""
    support_reference: Array
    """θ_S_ref with the gait prior, (n, support joints) [rad]."""
    state: State


class ControlStep(Constants):
    """The control step of n robots. Holds constants only."""

    def __init__(
        self,
        robot: Robot,
        task: Task,
        references: ReferenceLayer,
        layout: ObservationLayout,
        history: int,
        policy: Callable[[Any], Any],
    ) -> None:
        """`policy`: from a history (n, K, size of s_t) to the mean action (n, support joints)."""
        self.references, self.layout, self.policy = references, layout, policy
        self.bound, self.scale, self._action = task.action.bound, action_scale(robot, task.action), task.action
        self._period = 1.0 / task.control_frequency
        self._largest_step = rate_limits(task.commands.rates) * self._period
        self._order = np.argsort(np.concatenate([robot.support, robot.interaction])).tolist()
        self._blank, support, arms = np.zeros((1, history, layout.size)), len(robot.support), len(robot.interaction)
        self.shapes: dict[str, tuple[int, ...]] = {
            "command": (len(COMMAND),),
            "arms": (arms,),
            "posture": (support,),
            **dict.fromkeys(("heading_reference", "phase", "stepping"), (1,)),
            "feedback": (FEEDBACK_SIZE,),
            "begun": (1,),
            "action": (support,),
            "history": (history, layout.size),
        }
        """Shape of each part of the state, without the leading axis, in the order of the packed state."""

    def settle(self, heading: Array, command: Array, grasp: Array) -> State:
        """The first state: standing, references settled at the clamped command, history empty. `heading` (n, 1) [rad];
        `command` C (n, 11); `grasp` (n, 2, 3): base grasp of both wrists, heading frame [m]."""
        command = self.references.clamp(command)
        arms, posture = self.references.start(command, grasp)
        zero = 0.0 * heading
        blank = zero[:, None] + self._blank
        return State(
            command, arms, posture, heading, zero, zero, 0.0 * command[:, :FEEDBACK_SIZE], zero, 0.0 * posture, blank
        )

    def step(self, measured: Measured, command: Array, grasp: Array, load: Array, state: State) -> StepResult:
        """One control period. `load` (n, 1): mass that the arms expect between the hands [kg]; the rest as in `settle`.
        The first step after it leaves command, references and gait clock as they are, and fills the history."""
        xp, begun = namespace(command), state.begun > 0.5
        limited = self.references.clamp(approach(state.command, command, self._largest_step))
        command = xp.where(begun, limited, state.command)
        arms, _ = self.references.advance(state.arms, state.posture, command, grasp, self._period)
        arms = xp.where(begun, arms, state.arms)
        posture = self.references.support(arms, command)
        before, ran = state.phase[:, 0], state.stepping[:, 0] > 0.5
        phase, runs, feedback = self.references.pace(
            before, ran, state.feedback, measured, posture, command, self._period
        )
        phase, feedback = xp.where(begun[:, 0], phase, before), xp.where(begun, feedback, state.feedback)
        stepping = (begun[:, 0] & runs) | (~begun[:, 0] & ran)
        support = self.references.with_stride(posture, command, phase, stepping, feedback)
        sensed = PolicyInputs(
            measured=measured,
            command=command,
            heading_reference=state.heading_reference,
            joint_reference=self._joints(support, arms),
            phase=gait.phase_signal(phase, stepping),
            last_action=state.action,
            support_reference=support,
            arm_reference=arms,
        )
        seen = xp.concatenate([part.value(sensed) for part in self.layout.parts], 1)[:, None]
        shifted = xp.concatenate([state.history[:, 1:], seen], 1)
        history = xp.where(begun[:, :, None], shifted, seen + 0.0 * shifted)
        action = self.policy(history).clip(-self.bound, self.bound)
        held = self.references.arm_target(arms, posture, command, load[:, 0])
        turned = state.heading_reference + command[:, YAW_RATE, None] * self._period
        clock, one = 1.0 * stepping[:, None], 1.0 + 0.0 * state.begun
        after = State(command, arms, posture, turned, phase[:, None], clock, feedback, one, action, history)
        applied = applied_action(action, state.action, self._action)
        return StepResult(self._joints(support + self.scale * applied, held), action, support, after)

    def _joints(self, support: Array, arms: Array) -> Array:
        """Values of both branches in MJCF order, (n, joints)."""
        return namespace(support).concatenate([support, arms], 1)[:, self._order]

    def packed(self, state: State) -> Array:
        """The state as rows, (n, size)."""
        parts = [getattr(state, name).reshape(-1, size) for name, size in self.sizes.items()]
        return namespace(parts[0]).concatenate(parts, 1)

    def unpacked(self, rows: Array) -> State:
        """The state of rows (n, size)."""
        parts = [rows[:, place] for place in places(self.sizes).values()]
        return State(*(part.reshape(-1, *shape) for part, shape in zip(parts, self.shapes.values(), strict=True)))

    @property
    def sizes(self) -> dict[str, int]:
        return {name: int(np.prod(shape)) for name, shape in self.shapes.items()}
