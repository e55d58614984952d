"""Public controllers as policies in the trials: observation from s_t, joint targets as residual action."""

import numpy as np

from iowbc.adapters.adapter import VELOCITIES, Adapter, Seen
from iowbc.arrays import Array, Mask
from iowbc.control.action import action_scale
from iowbc.control.command import HEIGHT, PITCH, VELOCITY, YAW_RATE
from iowbc.control.observation import observation_layout
from iowbc.errors import StageFailed
from iowbc.recipe.evaluation.baselines import PublicController
from iowbc.recipe.task.task import Task
from iowbc.robot.description import Robot


class AdaptedPolicy:
    """Policy that acts in n environments, evaluated separately: other environments do not affect an action.

    Sensors, with noise and latency, are those of the learnt policies. With q_d the adapter's default posture, the
    target of a joint is q_d + scale · output and the action (target - θ_S_ref) / action scale of the task. If the
    controller moves the arms, their targets follow [rad].
    """

    def __init__(self, controller: PublicController, adapter: Adapter, robot: Robot, task: Task) -> None:
        self.adapter, self._controller, self._robot = adapter, controller, robot
        self._places = observation_layout(robot, task.observation.observe_object).slices
        self._joints = [robot.joints.index(name) for name in adapter.joints]
        support = [robot.joints[index] for index in robot.support]
        moved = [*support, *(robot.joints[index] for index in robot.interaction if controller.moves_arms)]
        self._acted = [adapter.acted.index(name) for name in moved]
        self._arms = [place for place, name in enumerate(adapter.joints) if name not in support]
        self._default = adapter.default[[adapter.joints.index(name) for name in moved]]
        self._own, self._scale = adapter.scale[self._acted], action_scale(robot, task.action)
        self._period = 1.0 / task.control_frequency
        ranges = adapter.ranges or {}
        self._bounds = np.array([ranges.get(name, (-np.inf, np.inf)) for name in VELOCITIES]).T
        self._blank(0)

    def _blank(self, n: int) -> None:
        self._starts, self._walking = np.ones(n, np.bool_), np.zeros(n, np.bool_)
        self._walked, self._output = np.zeros((n, 1)), np.zeros((n, len(self.adapter.acted)))
        self._past: tuple[Array, ...] = ()

    def reset(self, which: Mask) -> None:
        """Clear the history of the marked environments, shape (n,)."""
        if self._starts.shape != which.shape:
            self._blank(len(which))
        self._starts |= which

    def act(self, observation: Array, privileged: Array) -> Array:
        """Residual action, shape (n, A), from s_t, shape (n, S); with arm targets, shape (n, A + arm joints), if the
        controller moves the arms. The action of an unused row (s_t all zeros) is zero.

        Raises StageFailed if the network's output is not finite.
        """
        rows = observation.astype(np.float64)
        seen = self._seen({name: rows[:, place] for name, place in self._places.items()})
        self._remember(seen)
        filled = np.asarray(rows.any(axis=1))
        inputs = self.adapter.observed(self._past).astype(np.float32)
        for index in np.flatnonzero(filled):
            self._output[index] = self.adapter.network(inputs[index : index + 1])[0]
        if not np.isfinite(self._output).all():
            raise StageFailed("eval.public: its network's output is not finite; compare its inputs with training's")
        self._starts[filled] = False
        target = self._default + self._own * self._output[:, self._acted]
        support = target[:, : len(self._scale)]
        support[:] = (support - rows[:, self._places["support_reference"]]) / self._scale
        return np.asarray(target * filled[:, None], np.float32)

    def _seen(self, parts: dict[str, Array]) -> Seen:
        robot, command = self._robot, parts["command"]
        position = parts["joint_position"].copy()
        position[:, robot.support] += parts["support_reference"]
        position[:, robot.interaction] += parts["arm_reference"]
        position, rates = position[:, self._joints], parts["joint_velocity"][:, self._joints]
        if self._controller.arms == "default":
            position[:, self._arms], rates[:, self._arms] = self.adapter.default[self._arms], 0.0
        velocity = command[:, VELOCITY].copy()
        asked = np.abs(velocity).max(axis=1) > self.adapter.standing
        velocity[:, YAW_RATE] -= self._controller.heading_gain * parts["heading_error"][:, 0] * asked
        velocity = velocity.clip(*self._bounds)
        speed = np.maximum(np.hypot(velocity[:, 0], velocity[:, 1]), np.abs(velocity[:, YAW_RATE]))
        walking = speed > self.adapter.standing
        went_on = walking & self._walking & ~self._starts
        self._walked = np.where(went_on[:, None], self._walked + self._period, 0.0)
        self._walking = walking
        self._output[self._starts] = 0.0
        return Seen(
            velocity=velocity,
            height=command[:, HEIGHT, None],
            pitch=command[:, PITCH, None],
            walking=walking,
            walked=self._walked,
            gravity=parts["projected_gravity"],
            angular_velocity=parts["base_angular_velocity"],
            joint_position=position,
            joint_deviation=position - self.adapter.default,
            joint_velocity=rates,
            action=self._output.copy(),
        )

    def _remember(self, seen: Seen) -> None:
        """Append the newest observation to the history; the first of an episode fills it."""
        newest = [np.asarray(term(seen), np.float64)[:, None] for term in self.adapter.terms]
        if not self._past:
            self._past = tuple(np.repeat(values, self.adapter.history, 1) for values in newest)
        self._past = tuple(
            np.where(self._starts[:, None, None], values, np.concatenate([past[:, 1:], values], 1))
            for past, values in zip(self._past, newest, strict=True)
        )
