"""Draws the random quantities of an episode."""

from collections.abc import Mapping

import numpy as np

from iowbc import counter_random as random
from iowbc.arrays import Array, Indices, Keys, places
from iowbc.recipe.simulation.holding import BY_AXIS, SWITCHES
from iowbc.recipe.simulation.partner import PartnerSettings
from iowbc.recipe.simulation.randomization import Distribution
from iowbc.recipe.simulation.scene import Scene
from iowbc.recipe.simulation.simulation import SimulationSettings as Recipe
from iowbc.robot.description import GRAVITY, Robot
from iowbc.robot.rotations import TINY
from iowbc.sim.objects import measured

PUSH_SHARE = "partner_share/push"
"""Column of the partner's share in a push scene; there it takes the place of `partner_share`."""

WITH_OBJECT = (
    *("object_mass_scale", "inertia_scale", "object_com_offset", "surface_friction", "object_latency"),
    *("partner_share", "partner_stiffness", "partner_damping", "partner_delay", "partner_pace", "partner_noise"),
    "partner_share_drift",
)
"""Quantities that are zero in a scene without an object."""


class DrawTable:
    """Distributions side by side, one column per number; drawn at once, which is faster than many small draws."""

    def __init__(self, entries: Mapping[str, tuple[Distribution, int]]) -> None:
        """`entries`: distribution and width of each quantity by name."""
        widths = [width for _, width in entries.values()]
        self.width, self.columns = sum(widths), places(dict(zip(entries, widths, strict=True)))
        kinds = [distribution for distribution, _ in entries.values()]
        off = np.array([not kind.enabled for kind in kinds])
        nominal = np.array([kind.nominal for kind in kinds])
        low = np.where(off, nominal, [kind.low for kind in kinds])
        high = np.where(off, nominal, [kind.high for kind in kinds])
        self._owner = np.repeat(np.arange(len(kinds)), widths)
        self.nominal, self._low = nominal[self._owner], low[self._owner]
        self._span = (high - low)[self._owner]
        logarithmic = np.array([kind.shape == "log-uniform" and kind.enabled for kind in kinds])
        self._logarithmic = np.flatnonzero(logarithmic[self._owner])
        self._ratio = 1.0 + self._span[self._logarithmic] / self._low[self._logarithmic]
        self._probability = np.array([kind.probability for kind in kinds])

    def draw(self, key: Keys, stream: str) -> Array:
        """A row for each key from a stream of random numbers, (k, width)."""
        chances = random.uniform(key, stream, self.width + len(self._probability))
        row = self._low + self._span * chances[:, : self.width]
        logarithmic = self._logarithmic
        row[:, logarithmic] = self._low[logarithmic] * self._ratio ** chances[:, logarithmic]
        undrawn = chances[:, self.width :] >= self._probability
        return np.where(undrawn[:, self._owner], self.nominal, row)

    def views(self, rows: Array) -> dict[str, Array]:
        """The quantities in rows (n, width), by name, (n,) or (n, k)."""
        columns = self.columns.items()
        return {name: rows[:, at.start] if at.stop - at.start == 1 else rows[:, at] for name, at in columns}


class Draws:
    """The quantities drawn for n environments, by name; arrays (n,) or (n, k)."""

    def __init__(self, recipe: Recipe, scenes: list[Scene], robot: Robot) -> None:
        self.recipe = recipe
        n = len(scenes)
        self._table = DrawTable(_entries(recipe, robot))
        self._pushing = np.array([scene.kind == "push" for scene in scenes])
        self._with_object = np.array([scene.object is not None for scene in scenes])
        self._nominal_mass = np.array([scene.object.mass if scene.object else 0.0 for scene in scenes])
        self._smallest_mass = np.array([scene.object.smallest_mass if scene.object else 0.0 for scene in scenes])
        self._strength = np.array([scene.grasp.strength * (scene.kind == "lift") for scene in scenes])
        self._present = np.ones((n, self._table.width))
        for name, place in self._table.columns.items():
            if name in WITH_OBJECT:
                self._present[~self._with_object, place] = 0.0
            elif name == "object_ground_friction":
                self._present[~self._pushing, place] = 0.0
        self._rows = np.tile(self._table.nominal, (n, 1))
        self._behaviour_distributions = DrawTable(_behaviour_distributions(recipe.partner))
        self._habit_rows = np.tile(self._behaviour_distributions.nominal, (n, 1))
        chances = np.array([share for _, share in recipe.partner.behaviours])
        self._behaviours = np.cumsum(chances)[:-1] / chances.sum()
        self.values: dict[str, Array] = {name: np.ones(n) for name in SWITCHES} | {"partner_behaviour": np.zeros(n)}
        self.values |= self._behaviour_distributions.views(self._habit_rows) | self._table.views(self._rows)
        del self.values[PUSH_SHARE]
        first = self._table.columns["object_com_offset"].start
        self.values |= {name: self._rows[:, first + place] for place, name in enumerate(BY_AXIS)}
        self.values["object_mass"] = self._nominal_mass.copy()
        self.values["slip_force"] = self._strength.copy()
        self.values |= {"rolling_resistance": np.zeros(n), "grip_shift": np.zeros(n)}
        self._far = np.array([measured(scene.object).high[0] if scene.object else 0.0 for scene in scenes])
        self._near = self._far * [scene.grasp.near_end * (scene.kind == "lift") for scene in scenes]
        self._lightest = recipe.randomization.object_mass_scale.low

    def draw(self, which: Indices, key: Keys, fixed: Mapping[str, Array]) -> None:
        """Draws quantities of some environments from their episodes' keys; `fixed` (n,): values to hold, NaN draws."""
        values = self.values
        for name in SWITCHES:
            values[name][which] = 1.0
        if not self.recipe.sensing.enabled:
            values["noise_scale"][which] = 0.0
        self._habit_rows[which] = self._behaviour_distributions.draw(key, "partner")
        chance = random.uniform(key, "partner/behaviour", 1)[:, 0]
        values["partner_behaviour"][which] = np.searchsorted(self._behaviours, chance, side="right")
        row = self._table.draw(key, "episode")
        share, push_share = self._table.columns["partner_share"], self._table.columns[PUSH_SHARE]
        pushing = self._pushing[which]
        row[pushing, share] = row[pushing, push_share]
        self._draw_rare_cases(row, key)
        self._rows[which] = row
        for name, held in fixed.items():
            if name != "object_mass":
                self._hold(name, which, held)
        self._rows[which] *= self._present[which]
        values["impulse_scale"][which] *= self._with_object[which]
        above = values["object_mass_scale"][which] - self._lightest
        mass = self._nominal_mass[which] * (self._lightest + above * values["load_scale"][which])
        values["object_mass"][which] = mass
        if "object_mass" in fixed:
            self._hold("object_mass", which, fixed["object_mass"])
        mass = np.maximum(values["object_mass"][which], self._smallest_mass[which])
        values["object_mass"][which] = mass * self._with_object[which]
        friction = values["object_ground_friction"][which] * values["resistance_scale"][which]
        values["rolling_resistance"][which] = friction * values["object_mass"][which] * GRAVITY
        borne = values["partner_share"][which].clip(0.0, 1.0 - TINY)
        values["grip_shift"][which] = np.minimum(borne / (1.0 - borne) * self._far[which], self._near[which])
        values["slip_force"][which] = values["surface_friction"][which] * self._strength[which]

    def _draw_rare_cases(self, row: Array, key: Keys) -> None:
        """Makes objects light and both latencies long in a share of the episodes; rows (k, width)."""
        settings = self.recipe.randomization
        if not settings.enabled or not (settings.light_share or settings.slow_share):
            return
        chance = random.uniform(key, "uncommon", 5)
        light, slow = chance[:, 0] < settings.light_share, chance[:, 1] < settings.slow_share
        if settings.light_share and settings.object_mass_scale.enabled:
            low = settings.object_mass_scale.low
            scale = low * (max(settings.light_end, low) / low) ** chance[:, 2]
            row[light, self._table.columns["object_mass_scale"].start] = scale[light]
        for place, name in enumerate(("action_latency", "sensor_latency"), 3):
            drawn = getattr(settings, name)
            latency = drawn.high - (drawn.high - drawn.low) / 3.0 * chance[:, place]
            if drawn.enabled:
                row[slow, self._table.columns[name].start] = latency[slow]

    def _hold(self, name: str, which: Indices, values: Array) -> None:
        held = which[~np.isnan(values[which])]
        target = self.values[name]
        target[held] = values[held] if target.ndim == 1 else values[held, None]


def _entries(recipe: Recipe, robot: Robot) -> dict[str, tuple[Distribution, int]]:
    randomization, partner, off = recipe.randomization, recipe.partner, {"enabled": False}
    links = len(robot.tree.bodies)
    widths = {"object_com_offset": 3, "link_mass_scale": links, "link_inertia_scale": links}
    widths |= {"linkage_effort": len(robot.linkages), "imu_tilt": 2, "gyro_bias": 3}
    each = ("joint_friction", "motor_damping", "motor_strength", "kp_scale", "kd_scale", "encoder_bias")
    widths |= dict.fromkeys(each, len(robot.joints))
    entries = {name: (value, widths.get(name, 1)) for name, value in randomization if isinstance(value, Distribution)}
    if not randomization.enabled:
        entries = {name: (value.model_copy(update=off), width) for name, (value, width) in entries.items()}
    shares = {"partner_share": partner.share, PUSH_SHARE: partner.push_share}
    absent = Distribution(low=0.0, high=0.0, nominal=0.0)
    entries |= {name: (value if partner.enabled else absent, 1) for name, value in shares.items()}
    for name in ("share_drift", "stiffness", "damping", "delay", "pace", "noise"):
        entries[f"partner_{name}"] = (getattr(partner, name), 1)
    return entries


def _behaviour_distributions(partner: PartnerSettings) -> dict[str, tuple[Distribution, int]]:
    """Distributions of the partner's behaviours, in a separate table, so that they do not change the other draws."""
    sections = {"leader": partner.leader, "stopping": partner.stopping}
    return {
        f"{section}_{name}": (value, 1)
        for section, habits in sections.items()
        for name, value in habits
        if isinstance(value, Distribution)
    }
