"""Pushes over a grid of rolling resistances and masses."""

from typing import Self

from pydantic import Field, model_validator

from iowbc.recipe.evaluation.segment import Segment
from iowbc.recipe.section import Section
from iowbc.recipe.simulation.holding import ObjectScene


class PushMap(Section):
    """Pushes at every rolling resistance and mass: a mass alone says little of how hard a crate is to push."""

    scene: ObjectScene = "push"
    """Scene of `simulation.scenes` with a crate."""
    rolling_resistances: tuple[float, ...] = Field(default=(0.02, 0.06, 0.1, 0.15), min_length=1)
    """Rolling resistances μ; the ends are those of the paper's Table I."""
    masses: tuple[float, ...] = Field(default=(10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0), min_length=1)
    """Masses [kg]."""
    partner_share: float = Field(default=0.0, ge=-1, le=1)
    """Part of the rolling resistance that the partner overcomes."""
    trials: int | None = Field(default=5, ge=1, le=10_000)
    """Trials of each pair; empty takes `eval.trials`. Few, for neighbours in the map support each other."""
    sequence: tuple[Segment, ...] = ()
    """Commands; empty takes those of the sweeps."""

    @model_validator(mode="after")
    def _grid_ascends(self) -> Self:
        for name in ("rolling_resistances", "masses"):
            values = getattr(self, name)
            if list(values) != sorted(set(values)) or values[0] <= 0:
                raise ValueError(f"{name} must be positive and ascend without repetition, got {list(values)}")
        return self
