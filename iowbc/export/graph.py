"""The controller as one torch module: reference generator, gait prior, observation, history, student, action scaling.

It does in one graph what `iowbc.task` does in NumPy, from measured values to joint targets of the support branch.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from iowbc.control.command import COMMAND, HEIGHT, PITCH
from iowbc.control.generator import ReferenceNetwork
from iowbc.control.observation import OBJECT, PROPRIOCEPTION, ObservationLayout, Sensed
from iowbc.control.sensors import Measured, quantities
from iowbc.control.stride import Stride
from iowbc.learning.activations import ACTIVATIONS
from iowbc.learning.networks import StudentNetwork
from iowbc.recipe.task.joint_references import GaitPrior
from iowbc.robot.description import Robot


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
        for name in ("input_mean", "input_std", "output_mean", "output_std", "lower", "upper"):
            self.register_buffer(name, _tensor(getattr(network, name)))
        layers: list[nn.Module] = []
        for weight, bias in network.layers:
            linear = nn.Linear(*reversed(weight.shape))
            linear.weight.data, linear.bias.data = _tensor(weight), _tensor(bias)
            layers += [linear, ACTIVATIONS[network.activation].module()]
        self.body = nn.Sequential(*layers[:-1])

    def forward(self, arm_reference: Tensor, base_command: Tensor) -> Tensor:
        if self.constant:
            return torch.zeros_like(arm_reference[:, :1]) + self.default
        rows = torch.cat([arm_reference, base_command], dim=1)
        normal = (rows - self.input_mean) / self.input_std
        return torch.clamp(self.body(normal) * self.output_std + self.output_mean, self.lower, self.upper)


class GaitModule(nn.Module):
    """The stride that the gait prior adds to θ_S_ref, and the phase signal of the observation."""

    def __init__(self, gait: GaitPrior, robot: Robot) -> None:
        super().__init__()
        stride = Stride.of(robot, gait)
        self.stride = None if stride is None else stride.converted(_tensor)

    def forward(self, posture: Tensor, pelvis_pitch: Tensor, command: Tensor, gait: Tensor) -> tuple[Tensor, Tensor]:
        """θ_S_ref (n, support joints) [rad] and phase signal (n, 2); gait: φ in [0, 1), and 1 while the clock runs."""
        phase, stepping = gait[:, 0], gait[:, 1]
        angle = 2.0 * torch.pi * phase
        signal = torch.stack([torch.sin(angle), torch.cos(angle)], dim=1) * gait[:, 1:]
        if self.stride is None:
            return posture, signal
        given: tuple[Any, ...] = (posture, pelvis_pitch, command, phase, stepping)
        with_stride: Any = self.stride(torch, *given)
        return with_stride, signal


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
        self.observes_object = OBJECT[0].name in layout.names
        self._measured = (*quantities(of_object=False), *(quantities(of_object=True) if self.observes_object else ()))
        self.robot = robot
        self.student = student
        self.reference = ReferenceModule(rg, robot.default_position[robot.support], len(robot.interaction))
        self.gait = GaitModule(gait, robot)
        self.register_buffer("scale", _tensor(action_scale))
        order = np.argsort(np.concatenate([robot.support, robot.interaction]))
        self.register_buffer("joint_order", torch.from_numpy(order))
        self.eval().requires_grad_(False)

    def input_ports(self) -> tuple[Port, ...]:
        """Inputs, in order."""
        support, arms = len(self.robot.support), len(self.robot.interaction)
        return (
            Port("command", (len(COMMAND),), PROPRIOCEPTION[0].unit, "heading", "the skill-level command C, clamped"),
            *self._measured_ports(False),
            Port(
                "heading_reference",
                (1,),
                "rad",
                "world",
                "`heading` at the start plus the integrated yaw rate commanded",
            ),
            Port("arm_reference", (arms,), "rad", "joint", "θ_I_ref from differential IK, interaction order"),
            Port("gait", (2,), "1, 1", "-", "gait phase in [0, 1), and 1 while the gait clock runs, else 0"),
            Port("last_action", (support,), "action", "joint", "`action` of the step before, 0 at the start"),
            Port("restart", (1,), "1", "-", "1 at the first step of an episode: the history is filled with it"),
            Port("history", (self.history, self.layout.size), "SI", "-", "`history_next` of the step before"),
            *(self._measured_ports(True) if self.observes_object else ()),
        )

    def _measured_ports(self, of_object: bool) -> tuple[Port, ...]:
        return tuple(
            Port(name, (len(what.kind(self.robot)),), what.unit, what.frame, what.meaning)
            for name, what in quantities(of_object).items()
        )

    def _pelvis_pitch(self, posture: Tensor, command: Tensor) -> Tensor:
        """Pitch of the pelvis in a posture of the generator; zero in the default one, whose feet are flat so."""
        if self.reference.constant:
            return torch.zeros_like(command[:, PITCH])
        return command[:, PITCH] - posture[:, self.robot.waist_pitch.tolist()].sum(dim=1)

    def output_ports(self) -> tuple[Port, ...]:
        """Outputs, in order."""
        support = len(self.robot.support)
        return (
            Port("support_target", (support,), "rad", "joint", "position targets of the PD loop, support order"),
            Port("action", (support,), "action", "joint", "residual action, clipped; the next step's `last_action`"),
            Port("support_reference", (support,), "rad", "joint", "θ_S_ref with the gait prior"),
            Port("history_next", (self.history, self.layout.size), "SI", "-", "the next step's `history`"),
        )

    def forward(self, *inputs: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Values of the output ports for those of the input ports, in their order."""
        given = dict(zip((port.name for port in self.input_ports()), inputs, strict=True))
        command, arm_reference, history = given["command"], given["arm_reference"], given["history"]
        posture = self.reference(arm_reference, command[:, HEIGHT : PITCH + 1])
        support_reference, signal = self.gait(posture, self._pelvis_pitch(posture, command), command, given["gait"])
        measured: dict[str, Any] = {name: given[name] for name in self._measured}
        known: dict[str, Any] = {  # tensors in place of arrays: the observation's parts use operators alone
            "command": command,
            "heading_reference": given["heading_reference"],
            "joint_reference": torch.cat([support_reference, arm_reference], dim=1).index_select(1, self.joint_order),
            "phase": signal,
            "last_action": given["last_action"],
            "support_reference": support_reference,
            "arm_reference": arm_reference,
        }
        sensed = Sensed(measured=Measured(**measured), **known)
        frame = torch.cat([part.value(sensed) for part in self.layout.parts], dim=1)[:, None]
        shifted = torch.cat([history[:, 1:], frame], dim=1)
        history_next = torch.where(given["restart"][:, :, None] > 0.5, frame.expand(-1, self.history, -1), shifted)
        action = torch.clamp(self.student(history_next), -self.bound, self.bound)
        target = support_reference + self.scale * action
        return target, action, support_reference, history_next


def _tensor(values: np.ndarray) -> Tensor:
    return torch.from_numpy(np.ascontiguousarray(values, np.float32))
