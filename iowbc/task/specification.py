"""What an environment is made from: a recipe, a robot and a reference generator."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

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
    """Settings with which Drake takes the physics steps; without, MuJoCo does."""

    @property
    def deployed(self) -> Self:
        """The same for a policy that does not see s_priv: without the parts of it that are in a user's file, which
        nothing then executes."""
        return replace(self, recipe=self.recipe.deployed)
