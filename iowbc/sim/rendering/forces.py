"""The forces on an environment's robot and object, as arrows to draw."""

from dataclasses import dataclass

import numpy as np

from iowbc.arrays import Array
from iowbc.sim.simulation import Simulation

METRES_PER_NEWTON = 0.004
ARROW_RADIUS = 0.016
SMALLEST_FORCE = 5.0
"""Weaker forces are not drawn [N]."""
COLOURS = {
    "partner": (0.1, 0.6, 0.25, 1.0),
    "push": (0.85, 0.1, 0.1, 1.0),
    "grip": (0.95, 0.55, 0.1, 1.0),
    "ground": (0.2, 0.4, 0.85, 1.0),
    "band": (0.55, 0.3, 0.7, 1.0),
}
"""By kind: partner, pushes and impulses, object on the hands, ground on the feet, band from which a robot hangs."""
BESIDE = 0.09
"""Forces on hands and feet are drawn this far outside of them, where the limbs do not hide them [m]."""


@dataclass(frozen=True)
class Force:
    """An arrow, world frame."""

    kind: str
    """One of `COLOURS`."""
    start: Array
    """(3,) [m]."""
    force: Array
    """(3,) [N]."""

    @property
    def end(self) -> Array:
        """Tip of the arrow, (3,) [m]."""
        return self.start + METRES_PER_NEWTON * self.force


def forces(simulation: Simulation, env: int) -> list[Force]:
    """Forces of the last control period, of at least `SMALLEST_FORCE`."""
    state = simulation.state
    outward = BESIDE * state.base_rotation[env, :, 1] * np.array([[1.0], [-1.0]])
    found = []
    if state.has_object[env]:
        found.append(Force("partner", simulation.partner.at[env], state.partner_force[env].copy()))
        found.append(Force("push", state.object_position[env].copy(), simulation.impulse_force(env)))
        places = simulation.hand_position(env) + outward
        found += [Force("grip", places[hand], state.grip_force[env, hand].copy()) for hand in range(2)]
    found.append(Force("push", state.base_position[env].copy(), state.push_force[env].copy()))
    places = state.foot_position[env] + outward
    found += [Force("ground", places[foot], state.foot_force[env, foot].copy()) for foot in range(2)]
    return [force for force in found if np.linalg.norm(force.force) >= SMALLEST_FORCE]
