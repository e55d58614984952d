"""Integration of trials by Drake."""

from typing import Literal

from pydantic import Field

from iowbc.recipe.section import Section


class Drake(Section):
    """Integration by Drake; masses, gains, friction and all that is drawn are those of `simulation`."""

    timestep: float = Field(default=0.004, gt=0.0, le=0.02)
    """Physics step [s]; a whole number of them makes a control period. Trials at 2 ms end alike."""
    contact: Literal["sap", "lagged", "similar"] = "lagged"
    """Contact approximation of the SAP solver: linear damping (`sap`) or that of Hunt and Crossley (`lagged`,
    `similar`). All but `lagged` let a contact that slides push apart as well."""
    ground_stiffness: float = Field(default=2e5, gt=0.0)
    """Stiffness of a contact point of the soles [N/m]: on eight a robot sinks 0.2 mm into the ground, as in MuJoCo."""
    body_stiffness: float = Field(default=1e4, gt=0.0)
    """Stiffness of contacts of the object with palms and links, and of links with each other [N/m]: a box of 8 kg that
    hits a thigh is stopped with the force of MuJoCo's contact, whose time constant is 20 ms. Ten times as stiff, the
    same hit tears it out of the hands."""
    relaxation: float = Field(default=0.02, ge=0.0)
    """Time constant of the linear damping of a contact [s], that of MuJoCo's."""
    dissipation: float = Field(default=2.0, ge=0.0)
    """Damping of Hunt and Crossley, over stiffness and force [s/m]."""
    stiction: float = Field(default=1e-3, gt=0.0)
    """Speed below which friction is regularised: of sliding contacts and crates [m/s], and of joints [rad/s]. At its
    limit of friction a crate at rest creeps at this speed, as in MuJoCo."""
