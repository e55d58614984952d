"""Specification of environments."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

from iowbc.recipe.evaluation.baselines import PublicController
from iowbc.recipe.evaluation.evaluation import Drake
from iowbc.recipe.recipe import Recipe


@dataclass(frozen=True)
class Specification:
    """Recipe, robot and reference generator of an environment."""

    recipe: Recipe
    robot: Path
    rg: Path | None = None
    """Folder of the fitted reference generator; without one θ_S_ref is the default posture."""
    drake: Drake | None = None
    """Settings of Drake as the physics engine; None selects MuJoCo."""
    public: PublicController | None = None
    """The public controller of trials, which may move the arms; None for any other policy."""

    @property
    def deployed(self) -> Self:
        """The same for a policy that does not see s_priv: the file of its user-defined parts is not executed."""
        return replace(self, recipe=self.recipe.deployed)
