"""Inputs of the physics for one control period."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Self

from iowbc.arrays import Array, Indices


@dataclass(frozen=True)
class Period:
    """Inputs of n environments, held over a control period."""

    target: Array
    """Targets of the joint controllers, (n, joints) [rad]."""
    effort: Array
    """Least and greatest torque of each motor, (n, joints, 2) [N·m]."""
    wrench: Array
    """Force and torque on the object about its centre of mass, (n, 6) [N, N·m]."""
    push: Array
    """Force on the base's centre of mass, (n, 3) [N]."""
    resistance: Array
    """Rolling resistance of a crate's wheels, (n,) [N]."""
    squeeze: Array
    """Force with which the arms press each hand against the object, (n,) [N]."""
    slip_force: Array
    """Force at which a hand slips in a compliant grasp, (n,) [N]."""

    def rows(self, place: slice | Indices) -> Self:
        """The inputs of some environments."""
        return type(self)(**{name: values[place] for name, values in vars(self).items()})

    def of(self, row: int) -> dict[str, Array]:
        return {name: values[row] for name, values in vars(self).items()}

    @classmethod
    def alone(cls, arrays: Mapping[str, Array]) -> Self:
        """Inverse of `of`, for a simulation of that one environment; other entries are ignored."""
        return cls(**{field.name: arrays[field.name][None] for field in fields(cls)})
