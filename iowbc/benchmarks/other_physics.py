"""Physics with more or less in it than a recipe's: what it costs, and how far trajectories go apart."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iowbc.arrays import Array
from iowbc.benchmarks.bare_loop import wander
from iowbc.benchmarks.breakdown import Stopwatch, watch_physics
from iowbc.task.vector.setup import Setup
from iowbc.task.vector.shared import private_buffers


@dataclass(frozen=True)
class Variant:
    """Other physics than a recipe's."""

    name: str
    """Of its figures."""
    label: str
    physics: dict[str, Any]
    """What differs from the recipe's physics."""


VARIANTS = (
    Variant("iterations", "100 solver iterations", {"iterations": 100, "line_search_iterations": 50}),
    Variant("cone", "elliptic friction cones", {"cone": "elliptic"}),
    Variant("timestep", "physics steps of 1 ms", {"timestep": 0.001}),
    Variant("explicit", "and explicit joint control", {"timestep": 0.001, "pd": "explicit"}),
    Variant("touch_everything", "links that touch everything", {"body_contact": "everything"}),
    Variant("touch_object", "links that touch the object", {"body_contact": "object"}),
    Variant("touch_nothing", "links that touch nothing", {"body_contact": "nothing"}),
)
LARGER = 1.1
"""Actions by which trajectories go apart, to compare with."""


@dataclass(frozen=True)
class Trajectories:
    """How environments moved from a reset, played with small random actions."""

    joints: Array
    """(periods, n, joints) [rad]."""
    base: Array
    """(periods, n, 3) [m]."""
    up: NDArray[np.bool_]
    """Environments whose episode has not ended, (n,)."""
    time: float
    """Processor time spent in MuJoCo [s]."""


def play(setup: Setup, periods: int, size: float = 1.0) -> Trajectories:
    """Plays the environments of a setup in this process, with actions of a relative size."""
    n = setup.count
    batch = setup.batch(0, n, private_buffers(setup.buffer_fields(), n))
    watch = Stopwatch()
    watch_physics(batch, watch)
    batch.reset(np.arange(n, dtype=np.uint64) + np.uint64(setup.seed))
    watch.spent["physics"] = 0.0
    joints, base, up = [], [], np.ones(n, np.bool_)
    for period in range(periods):
        batch.buffers["action"][:] = size * wander(period, n, batch.buffers["action"].shape[1])
        batch.step()
        up &= ~batch.buffers["done"]
        joints.append(batch.simulation.state.joint_position.copy())
        base.append(batch.simulation.state.base_position.copy())
    return Trajectories(np.array(joints), np.array(base), up, watch.spent["physics"])


def apart(one: Trajectories, other: Trajectories) -> tuple[float, float]:
    """Largest distance in any joint [rad] and of the base [m]: medians over the environments that stay up in both."""
    both = one.up & other.up
    if not both.any():
        return np.nan, np.nan
    joint = np.abs(one.joints - other.joints)[:, both].max(axis=(0, 2))
    base = np.linalg.norm(one.base - other.base, axis=2)[:, both].max(axis=0)
    return float(np.median(joint)), float(np.median(base))


def compare(setup: Setup, periods: int, turns: int, say: Callable[[str], None]) -> dict[str, float]:
    """Prints and returns for each variant its cost and how far its trajectories are from the recipe's."""
    physics = setup.specification.recipe.simulation.physics
    others = [v for v in VARIANTS if any(getattr(physics, name) != value for name, value in v.physics.items())]
    setups = [setup, *(_with_physics(setup, variant.physics) for variant in others)]
    played = [[play(one, periods) for one in setups] for _ in range(turns)]
    fastest = [min(turn.time for turn in of_one) for of_one in zip(*played, strict=True)]
    plain = played[0][0]
    seconds = periods / setup.specification.recipe.task.control_frequency
    say(f"{f'other physics, trajectories of {seconds:g} s':34}{'cost':>10}{'joint [rad]':>14}{'base [mm]':>12}")
    figures: dict[str, float] = {}
    for one, trajectories, time in zip(others, played[0][1:], fastest[1:], strict=True):
        joint, base = apart(plain, trajectories)
        cost = time / fastest[0]
        say(f"  {one.label:32}{cost:10.2f}{joint:14.4f}{1e3 * base:12.1f}")
        figures |= {f"{one.name}_cost": cost, f"{one.name}_joint": joint, f"{one.name}_base": base}
    joint, base = apart(plain, play(setup, periods, LARGER))
    say(f"  {'for scale: actions 10 % larger':32}{'':10}{joint:14.4f}{1e3 * base:12.1f}")
    return figures | {"scale_joint": joint, "scale_base": base}


def _with_physics(setup: Setup, changes: dict[str, Any]) -> Setup:
    simulation = setup.specification.recipe.simulation
    physics = simulation.physics.model_copy(update=changes)
    recipe = setup.specification.recipe.model_copy(
        update={"simulation": simulation.model_copy(update={"physics": physics})}
    )
    return replace(setup, specification=replace(setup.specification, recipe=recipe))
