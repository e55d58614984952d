"""Third-party controllers as baselines."""

from typing import Literal

from pydantic import Field

from iowbc.recipe.beside import ModuleFile
from iowbc.recipe.section import COSMETIC, Problems, Section


class PublicController(Section):
    """A public controller. The recipe holds its digest, not its content."""

    adapter: Literal["holosoma", "deploy", "own"]
    """Source of its observation, action, gains and frequency: `holosoma`: the walking policies of that project;
    `deploy`: a folder with a network and the `deploy.yaml` of Isaac Lab exports; `own`: a custom `module`."""
    module: ModuleFile | None = None
    """Python file with a function `adapter(policy)`, which takes the controller's path and returns an
    `iowbc.adapters.adapter.Adapter`; for the adapter `own` alone."""
    policy: str = Field(min_length=1, json_schema_extra=COSMETIC)
    """Its file or folder: a path relative to the working folder, or PACKAGE:PATH for a file of an installed package."""
    sha256: str = Field(pattern="^[0-9a-f]{64}$")
    """SHA-256 of the file; for a folder, SHA-256 of its sorted lines `DIGEST  NAME`, as `sha256sum` prints them."""
    arms: Literal["measured", "default", "free", "own"] = "measured"
    """Control and observation of the arms. `measured`, `default`: this project's inverse kinematics holds the grasp;
    the controller observes the arms as measured, or at rest in its default posture (observed grasps may disturb a
    policy that was trained to move its arms; choose on development trials). `own`: the controller moves the arms, with
    its own gains. `free`: it moves them in trials without an object only."""
    heading_gain: float = Field(default=0.5, ge=0.0)
    """Yaw rate commanded per radian of heading error [1/s]. These controllers track rates and therefore drift; learnt
    policies of this project observe the heading error. Velocity tasks of Isaac Lab train with 0.5."""

    @property
    def moves_arms(self) -> bool:
        """True where the arms follow the controller's outputs in some trials."""
        return self.arms in ("free", "own")

    def problems(self) -> Problems:
        if (self.adapter == "own") != (self.module is not None):
            yield "", "module: belongs to the adapter 'own', which needs it"
