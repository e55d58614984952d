"""A randomised quantity: how it is drawn, and its value when it is not."""

from typing import Literal, Self

from pydantic import Field, model_validator

from iowbc.recipe.section import Section


class Distribution(Section):
    """x ~ U(low, high), or its logarithm uniform; or else the nominal value."""

    low: float
    """Lower end of the range."""
    high: float
    """Upper end of the range."""
    nominal: float
    """Value where the entry is disabled or not drawn."""
    shape: Literal["uniform", "log-uniform"] = "uniform"
    """Uniform between the ends, or uniform in the logarithm."""
    probability: float = Field(default=1.0, ge=0.0, le=1.0)
    """Chance that a value is drawn; otherwise it is the nominal one."""
    enabled: bool = True
    """Off always gives the nominal value."""

    @model_validator(mode="after")
    def _range_is_valid(self) -> Self:
        if self.low > self.high:
            raise ValueError(f"low {self.low} is above high {self.high}")
        if self.shape == "log-uniform" and self.low <= 0.0:
            raise ValueError(f"a log-uniform range must be positive, got low {self.low}")
        return self
