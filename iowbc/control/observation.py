"""The observation s_t (eq. 5) and the privileged observation s_priv, as one row of named parts an environment."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating[Any]]
Observation = NDArray[np.float32]

PROPRIOCEPTION = (
    ("command", 11),
    ("projected_gravity", 3),
    ("base_angular_velocity", 3),
    ("joint_position", 29),
    ("joint_velocity", 29),
    ("phase", 2),
    ("last_action", 15),
    ("support_reference", 15),
)
"""Parts of s_t without the object, in order, with their sizes."""
OBJECT = (
    ("object_position", 3),
    ("object_orientation", 3),
    ("object_linear_velocity", 3),
    ("object_angular_velocity", 3),
)
"""Parts of s_t that describe the object, in the base frame."""
PRIVILEGED = (
    ("object_mass", 1),
    ("object_com_offset", 3),
    ("inertia_scale", 1),
    ("ground_friction", 1),
    ("object_ground_friction", 1),
    ("surface_friction", 1),
    ("base_linear_velocity", 3),
    ("system_velocity", 3),
    ("pelvis_height", 1),
    ("foot_force", 6),
    ("external_force", 3),
    ("external_torque", 3),
    ("partner_share", 1),
    ("action_latency", 1),
)
"""Parts of s_priv, in order, with their sizes."""


@dataclass(frozen=True)
class ObservationLayout:
    """Where each part of a row lies."""

    parts: tuple[tuple[str, int], ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parts, in order."""
        return tuple(name for name, _ in self.parts)

    @cached_property
    def size(self) -> int:
        """Length of a row."""
        return sum(size for _, size in self.parts)

    @cached_property
    def slices(self) -> dict[str, slice]:
        """Place of each part in a row."""
        ends = np.cumsum([size for _, size in self.parts]).tolist()
        return {name: slice(end - size, end) for (name, size), end in zip(self.parts, ends, strict=True)}

    def describe(self) -> list[dict[str, Any]]:
        """Names and sizes of the parts, in order, for JSON."""
        return [{"name": name, "size": size} for name, size in self.parts]

    def gather(self, values: Mapping[str, Array], out: Observation | None = None) -> Observation:
        """One row an environment from named arrays, each (n, size); shape (n, self.size), float32."""
        if out is None:
            out = np.empty((len(values[self.parts[0][0]]), self.size), np.float32)
        for name, place in self.slices.items():
            out[:, place] = values[name]
        return out


def observation_layout(observe_object: bool) -> ObservationLayout:
    """Layout of s_t."""
    return ObservationLayout(PROPRIOCEPTION + OBJECT if observe_object else PROPRIOCEPTION)


def privileged_layout() -> ObservationLayout:
    """Layout of s_priv."""
    return ObservationLayout(PRIVILEGED)


@dataclass(frozen=True)
class FullLayout:
    """The row that the vector environment delivers: s_t, then s_priv."""

    state: ObservationLayout
    extra: ObservationLayout

    @cached_property
    def observation(self) -> slice:
        """Place of s_t."""
        return slice(0, self.state.size)

    @cached_property
    def privileged(self) -> slice:
        """Place of s_priv."""
        return slice(self.state.size, self.size)

    @cached_property
    def size(self) -> int:
        """Length of the row."""
        return self.state.size + self.extra.size

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all parts, in order."""
        return self.state.names + self.extra.names

    def describe(self) -> dict[str, list[dict[str, Any]]]:
        """Both parts, for JSON."""
        return {"observation": self.state.describe(), "privileged": self.extra.describe()}

    @cached_property
    def slices(self) -> dict[str, slice]:
        """Place of each part; a part of s_priv goes by `privileged/<name>`."""
        shift = self.state.size
        privileged = {f"privileged/{k}": slice(s.start + shift, s.stop + shift) for k, s in self.extra.slices.items()}
        return self.state.slices | privileged


@dataclass(frozen=True)
class Sensed:
    """What the sensors and the control loop know of n environments; the input of `observe`."""

    command: Array
    """C, (n, 11), as commanded at this step."""
    projected_gravity: Array
    """Direction of gravity in the base frame, (n, 3); (0, 0, −1) when upright."""
    base_angular_velocity: Array
    """Base frame, (n, 3) [rad/s]."""
    joint_position: Array
    """(n, 29) [rad]."""
    joint_velocity: Array
    """(n, 29) [rad/s]."""
    joint_reference: Array
    """θ_ref of all joints in MJCF order, without the residual, (n, 29) [rad]."""
    phase: Array
    """(sin, cos) of the gait phase, zero when standing, (n, 2)."""
    last_action: Array
    """a_{t−1}, (n, 15)."""
    support_reference: Array
    """θ_S_ref, (n, 15) [rad]."""
    object_position: Array
    """Object's origin from the base, base frame, (n, 3) [m]; zero without an object."""
    object_quaternion: Array
    """Object's orientation in the base frame, wxyz, (n, 4)."""
    object_linear_velocity: Array
    """Object's velocity relative to the base, base frame, (n, 3) [m/s]."""
    object_angular_velocity: Array
    """Object's angular velocity, base frame, (n, 3) [rad/s]."""

    def rows(self, which: NDArray[np.intp] | slice) -> "Sensed":
        """The same of some environments."""
        return Sensed(**{field.name: getattr(self, field.name)[which] for field in fields(self)})


def orientation_vector(quaternion: Array) -> Array:
    """Vector part of a unit quaternion whose scalar part is made positive: axis · sin(angle/2); (n, 4) to (n, 3)."""
    vector: Array = quaternion[:, 1:] * np.where(quaternion[:, :1] < 0.0, -1.0, 1.0)
    return vector


def observe(layout: ObservationLayout, sensed: Sensed, out: Observation | None = None) -> Observation:
    """s_t of n environments, (n, S) float32: joint positions relative to their references, everything else as it is.

    Units are SI; scaling is the business of the learner's normalisation.
    """
    return layout.gather(
        {
            "command": sensed.command,
            "projected_gravity": sensed.projected_gravity,
            "base_angular_velocity": sensed.base_angular_velocity,
            "joint_position": sensed.joint_position - sensed.joint_reference,
            "joint_velocity": sensed.joint_velocity,
            "phase": sensed.phase,
            "last_action": sensed.last_action,
            "support_reference": sensed.support_reference,
            "object_position": sensed.object_position,
            "object_orientation": orientation_vector(sensed.object_quaternion),
            "object_linear_velocity": sensed.object_linear_velocity,
            "object_angular_velocity": sensed.object_angular_velocity,
        },
        out,
    )
