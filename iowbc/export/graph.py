"""The controller as one torch module: reference generator, gait prior, observation, history, student, action scaling.

It does in one graph what `iowbc.task` does in NumPy, from measured values to joint targets of the support branch.
"""

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor, nn

from iowbc.control.command import HEIGHT, PITCH
from iowbc.control.gait import LEFT_LEG_PITCH, RIGHT_LEG_PITCH
from iowbc.control.generator import ReferenceNetwork
from iowbc.control.observation import ObservationLayout
from iowbc.learning.networks import ACTIVATIONS, StudentNetwork
from iowbc.recipe.task.joint_references import GaitPrior
from iowbc.robot.description import Robot

HALF_STRIDE = 0.5


@dataclass(frozen=True)
class Port:
    """An input or output of the graph, without the leading axis of robots."""

    name: str
    shape: tuple[int, ...]
    unit: str
    frame: str
    meaning: str


class ReferenceModule(nn.Module):
    """φ_RG in torch: (n, inputs) to the support reference (n, 15) [rad], or a constant posture without a generator."""

    default: Tensor
    input_mean: Tensor
    input_std: Tensor
    output_mean: Tensor
    output_std: Tensor
    lower: Tensor
    upper: Tensor

    def __init__(self, network: ReferenceNetwork | None, default: np.ndarray, arms: int) -> None:
        super().__init__()
        self.constant = network is None
        self.register_buffer("default", _tensor(default))
        if network is None:
            return
        self.extra = len(network.inputs) - arms - 2
        for name in ("input_mean", "input_std", "output_mean", "output_std", "lower", "upper"):
            self.register_buffer(name, _tensor(getattr(network, name)))
        layers: list[nn.Module] = []
        for weight, bias in network.layers:
            linear = nn.Linear(*reversed(weight.shape))
            linear.weight.data, linear.bias.data = _tensor(weight), _tensor(bias)
            layers += [linear, ACTIVATIONS[network.activation]()]
        self.body = nn.Sequential(*layers[:-1])

    def forward(self, arm_reference: Tensor, base_command: Tensor) -> Tensor:
        if self.constant:
            return torch.zeros_like(arm_reference[:, :1]) + self.default
        rows = torch.cat([arm_reference, base_command, torch.zeros_like(arm_reference[:, : self.extra])], dim=1)
        normal = (rows - self.input_mean) / self.input_std
        return torch.clamp(self.body(normal) * self.output_std + self.output_mean, self.lower, self.upper)


class GaitModule(nn.Module):
    """The swing that the gait prior adds to θ_S_ref, and the phase signal of the observation."""

    amplitude: Tensor

    def __init__(self, gait: GaitPrior, support_joints: int) -> None:
        super().__init__()
        self.stance = gait.stance
        amplitude = np.zeros((2, support_joints))
        if gait.enabled:
            for foot, joints in enumerate((LEFT_LEG_PITCH, RIGHT_LEG_PITCH)):
                amplitude[foot, list(joints)] = gait.hip_pitch, gait.knee, gait.ankle_pitch
        self.register_buffer("amplitude", _tensor(amplitude))

    def forward(self, gait: Tensor) -> tuple[Tensor, Tensor]:
        """gait: φ in [0, 1), and 1 while the clock runs, (n, 2). Returns swing (n, 15) [rad] and signal (n, 2)."""
        phase, stepping = gait[:, :1], gait[:, 1:]
        shifted = phase + HALF_STRIDE
        feet = torch.cat([phase, shifted - torch.floor(shifted)], dim=1)
        progress = torch.clamp((feet - self.stance) / (1.0 - self.stance), 0.0, 1.0)
        swing = (torch.sin(torch.pi * progress) * stepping) @ self.amplitude
        angle = 2.0 * torch.pi * phase
        return swing, torch.cat([torch.sin(angle), torch.cos(angle)], dim=1) * stepping


class ControllerGraph(nn.Module):
    """One control step of the support branch; inputs and outputs as `input_ports` and `output_ports` list them."""

    scale: Tensor
    joint_order: Tensor

    def __init__(
        self,
        student: StudentNetwork,
        rg: ReferenceNetwork | None,
        robot: Robot,
        layout: ObservationLayout,
        gait: GaitPrior,
        *,
        history: int,
        action_scale: np.ndarray,
        action_bound: float,
    ) -> None:
        super().__init__()
        self.layout, self.history, self.bound = layout, history, action_bound
        self.observes_object = "object_position" in layout.names
        self.robot = robot
        self.student = student
        self.reference = ReferenceModule(rg, robot.default_position[robot.support], len(robot.interaction))
        self.gait = GaitModule(gait, len(robot.support))
        self.register_buffer("scale", _tensor(action_scale))
        order = np.argsort(np.concatenate([robot.support, robot.interaction]))
        self.register_buffer("joint_order", torch.from_numpy(order))
        self.eval().requires_grad_(False)

    def input_ports(self) -> tuple[Port, ...]:
        """Inputs, in order."""
        joints, support, arms = len(self.robot.joints), len(self.robot.support), len(self.robot.interaction)
        return (
            Port("command", (11,), "m/s, m/s, rad/s, m, rad, m x 6", "heading", "the skill-level command C, clamped"),
            Port("projected_gravity", (3,), "1", "base", "direction of gravity; (0, 0, -1) when upright"),
            Port("base_angular_velocity", (3,), "rad/s", "base", "gyroscope"),
            Port("joint_position", (joints,), "rad", "joint", "all joints, in the order of `joints`"),
            Port("joint_velocity", (joints,), "rad/s", "joint", "all joints, in the order of `joints`"),
            Port("arm_reference", (arms,), "rad", "joint", "θ_I_ref from differential IK, interaction order"),
            Port("gait", (2,), "1, 1", "-", "gait phase in [0, 1), and 1 while the gait clock runs, else 0"),
            Port("last_action", (support,), "action", "joint", "`action` of the step before, 0 at the start"),
            Port("restart", (1,), "1", "-", "1 at the first step of an episode: the history is filled with it"),
            Port("history", (self.history, self.layout.size), "SI", "-", "`history_next` of the step before"),
            *self.object_ports(),
        )

    def object_ports(self) -> tuple[Port, ...]:
        """The last inputs, where the policy observes the object."""
        if not self.observes_object:
            return ()
        return (
            Port("object_position", (3,), "m", "base", "object's origin from the base"),
            Port("object_quaternion", (4,), "1", "base", "object's orientation, wxyz"),
            Port("object_linear_velocity", (3,), "m/s", "base", "object's velocity relative to the base"),
            Port("object_angular_velocity", (3,), "rad/s", "base", "object's angular velocity relative to the base"),
        )

    def output_ports(self) -> tuple[Port, ...]:
        """Outputs, in order."""
        support = len(self.robot.support)
        return (
            Port("support_target", (support,), "rad", "joint", "position targets of the PD loop, support order"),
            Port("action", (support,), "action", "joint", "residual action, clipped; the next step's `last_action`"),
            Port("support_reference", (support,), "rad", "joint", "θ_S_ref with the gait prior"),
            Port("history_next", (self.history, self.layout.size), "SI", "-", "the next step's `history`"),
        )

    def forward(
        self,
        command: Tensor,
        projected_gravity: Tensor,
        base_angular_velocity: Tensor,
        joint_position: Tensor,
        joint_velocity: Tensor,
        arm_reference: Tensor,
        gait: Tensor,
        last_action: Tensor,
        restart: Tensor,
        history: Tensor,
        object_position: Tensor | None = None,
        object_quaternion: Tensor | None = None,
        object_linear_velocity: Tensor | None = None,
        object_angular_velocity: Tensor | None = None,
    ) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        swing, signal = self.gait(gait)
        support_reference = self.reference(arm_reference, command[:, HEIGHT : PITCH + 1]) + swing
        joint_reference = torch.cat([support_reference, arm_reference], dim=1).index_select(1, self.joint_order)
        parts = {
            "command": command,
            "projected_gravity": projected_gravity,
            "base_angular_velocity": base_angular_velocity,
            "joint_position": joint_position - joint_reference,
            "joint_velocity": joint_velocity,
            "phase": signal,
            "last_action": last_action,
            "support_reference": support_reference,
        }
        if object_quaternion is not None:
            sign = 1.0 - 2.0 * (object_quaternion[:, :1] < 0.0).to(object_quaternion.dtype)
            parts["object_orientation"] = object_quaternion[:, 1:] * sign
        seen = {
            "object_position": object_position,
            "object_linear_velocity": object_linear_velocity,
            "object_angular_velocity": object_angular_velocity,
        }
        parts |= {name: value for name, value in seen.items() if value is not None}
        frame = torch.cat([parts[name] for name in self.layout.names], dim=1)[:, None]
        shifted = torch.cat([history[:, 1:], frame], dim=1)
        history_next = torch.where(restart[:, :, None] > 0.5, frame.expand(-1, self.history, -1), shifted)
        action = torch.clamp(self.student(history_next), -self.bound, self.bound)
        target = support_reference + self.scale * action
        return target, action, support_reference, history_next


def _tensor(values: np.ndarray) -> Tensor:
    return torch.from_numpy(np.ascontiguousarray(values, np.float32))
