"""The second carrier: a spring, a damper and a preload at the object's far handle, on a path of its own.

The path is that of the command, integrated from the start of the episode, and changed by the partner's behaviour; a
follower moves with the handle. A steered partner has a velocity of its own instead, and turns the object. All
arithmetic is real: the rounding of NumPy's complex products depends on the number of environments.
"""

import numpy as np

from iowbc.arrays import Array, Indices
from iowbc.recipe.simulation.partner import BEHAVIOURS
from iowbc.recipe.simulation.partner import PartnerSettings as Recipe
from iowbc.recipe.simulation.scene import Scene
from iowbc.robot import rotations
from iowbc.robot.description import GRAVITY
from iowbc.robot.rotations import TINY
from iowbc.sim.objects import measured
from iowbc.sim.state import SimulationState
from iowbc.sim.timing import DelayLine

NOISE_WIDTH = 3
"""Noise columns that the partner uses per step: two for its unsteady force, one for its share."""
FEED = 4
"""Entries of the command that the partner receives: v_x, v_y, yaw rate, height."""
SLOW = 0.1
"""Speed of a crate below which a follower's push fades out [m/s]."""
FOLLOWER_FADE_SPEED = 0.03
"""Speed set for a crate below which a steered partner's push fades out [m/s]."""
PATH, FOLLOWER, LEADER, STOPPING, TUGGING, LAGGING = range(len(BEHAVIOURS))
STATE_FIELDS = (
    *("stiffness", "damping", "weight", "resistance", "bound", "pace", "gust", "drift", "share", "wandering"),
    *("present", "height", "heading", "offset", "aim", "unsteady", "centre", "at", "speed", "arm", "force"),
    *("behaviour", "steps", "turning", "sideways", "rise", "stop", "halted", "followed", "attention", "slow"),
)


class Partner:
    """Partners of n environments. Their forces are held over a control period."""

    def __init__(self, recipe: Recipe, scenes: list[Scene], period: float) -> None:
        n = len(scenes)
        self._recipe, self._period = recipe, period
        things = [scene.object for scene in scenes]
        self._things = any(things)
        self._pushing = np.array([scene.kind == "push" for scene in scenes])
        ahead = np.array([measured(thing).high[0] if thing else 0.0 for thing in things])
        above = np.array([scene.grasp.height if scene.kind == "lift" else 0.0 for scene in scenes])
        self._places = np.zeros((n, 2, 3))
        """The handle and the centre of mass on the object, object frame [m]."""
        self._places[:, 0, 0], self._places[:, 0, 2] = ahead, above
        slowest = np.array([measured(thing).about_axes[1:].min() if thing else 1.0 for thing in things])
        self._least_inertia = np.array([thing.smallest_inertia if thing else 0.0 for thing in things])
        self._felt = 1.0 / (1.0 + (ahead * ahead + above * above) / slowest)
        self._line = DelayLine(n, FEED, recipe.longest_delay / period)
        self._stiffness, self._damping, self._weight = np.zeros(n), np.zeros(n), np.zeros(n)
        self._resistance, self._bound, self._pace, self._gust = np.zeros(n), np.zeros(n), np.ones(n), np.zeros(n)
        self._drift, self._share, self._wandering = np.zeros(n), np.zeros(n), np.zeros(n)
        self.steered = np.zeros(n, np.bool_)
        """Partners with a feed of their own: velocity of the handle in the frame of the heading at the start, yaw rate
        of the object, and height of the handle from any origin; from the next reset on, (n,). Not part of snapshots."""
        self.loose = np.zeros(n, np.bool_)
        """Steered partners without horizontal force: they bear their share and follow the handle, (n,). Not
        in snapshots."""
        self._turning_inertia = np.array([measured(thing).about_axes[2] if thing else 0.0 for thing in things])
        self._yaw_stiffness, self._yaw_damping, self._yaw_lead = np.zeros(n), np.zeros(n), np.zeros(n)
        self._present, self._height = np.zeros(n), np.full(n, np.nan)
        self._heading, self._offset = np.zeros((n, 2)), np.zeros((n, 2))
        self._aim, self._unsteady, self._centre = np.zeros((n, 3)), np.zeros((n, 2)), self._places[:, 1]
        self._at, self._speed, self._arm = np.zeros((n, 3)), np.zeros((n, 3)), np.zeros((n, 3))
        self._force = np.zeros((n, 3))
        self.handle_displacement = np.zeros((n, 3))
        """Displacements of the handles in the last period, (n, 3) [m]; zero without an object. Not in snapshots."""
        self._behaviour, self._steps, self._attention = np.zeros(n), np.zeros(n, np.int64), np.ones(n)
        self._turning, self._sideways, self._rise = np.zeros(n), np.zeros(n), np.zeros(n)
        self._stop, self._halted = np.zeros((n, 2)), np.zeros(n)
        """Begin and end of a stop [s]; fraction of the commanded velocity that remains during it."""
        self._followed, self._slow = np.zeros((n, 2)), np.full(n, TINY)
        self._turn_rate, self._own_way = np.zeros(n), np.zeros((n, 2))
        self._keep = float(np.exp(-period / recipe.noise_time))
        self._keep_share = float(np.exp(-period / recipe.drift_time))
        self.derive()

    def reset(self, which: Indices, drawn: dict[str, Array], state: SimulationState) -> None:
        """New partners for some environments, at rest at the handle."""
        share, mass = drawn["partner_share"][which], drawn["object_mass"][which]
        resistance, pushing = drawn["rolling_resistance"][which], self._pushing[which]
        present = (share != 0.0) & (mass > 0.0)
        inertia = np.maximum(mass, self._least_inertia[which])
        stable = self._recipe.stability * inertia * self._felt[which] / self._period
        self._stiffness[which] = present * np.minimum(drawn["partner_stiffness"][which], stable / self._period)
        self._damping[which] = present * np.minimum(drawn["partner_damping"][which], stable)
        self._weight[which] = (present & ~pushing) * mass * GRAVITY
        self._resistance[which] = (present & pushing) * resistance
        strongest, steered = self._recipe.strongest, self.steered[which]
        self._bound[which] = np.where(
            pushing & ~steered,
            np.minimum(self._recipe.push_yielding * np.abs(share) * resistance, strongest),
            strongest,
        )
        self._behave(which, drawn)
        turning = self._recipe.stability * inertia * self._turning_inertia[which] / self._period
        arm = steered * self._recipe.hand_distance**2
        self._yaw_stiffness[which] = np.minimum(arm * self._stiffness[which], turning / self._period)
        self._yaw_damping[which] = np.minimum(arm * self._damping[which], turning)
        self._yaw_lead[which] = 0.0
        self._present[which], self._share[which] = present, share
        unsteady = np.where(pushing, resistance / self._recipe.noise_resistance, 1.0) * drawn["partner_noise"][which]
        self._gust[which] = present * unsteady * np.sqrt(1.0 - self._keep**2)
        self._drift[which] = present * drawn["partner_share_drift"][which] * np.sqrt(1.0 - self._keep_share**2)
        self._centre[which] = drawn["object_com_offset"][which]
        self._line.fill(which, np.zeros((len(which), FEED)))
        for values in (self._unsteady, self._wandering, self._force, self._followed, self._steps):
            values[which] = 0
        self._height[which] = np.nan
        self._observe(state)
        self._aim[which] = self._at[which]
        forward = state.base_rotation[which][:, :2, 0]
        forward = forward / (_length(forward) + TINY)[:, None]
        self._heading[which] = forward
        away = (self._at - state.base_position)[which]
        away *= ~steered[:, None]
        self._offset[which] = rotations.turned_by(away[:, :2], forward[:, 0], -forward[:, 1])
        self.derive()

    def _behave(self, which: Indices, drawn: dict[str, Array]) -> None:
        behaviour, delay = drawn["partner_behaviour"][which], drawn["partner_delay"][which]
        leads, lags = behaviour == LEADER, behaviour == LAGGING
        self._behaviour[which] = behaviour
        self._pace[which] = np.where(leads, drawn["leader_pace"][which], drawn["partner_pace"][which])
        for name in ("turning", "sideways", "rise"):
            getattr(self, f"_{name}")[which] = leads * drawn[f"leader_{name}"][which]
        begin, duration = drawn["stopping_begin"][which], drawn["stopping_duration"][which]
        self._stop[which] = np.stack([begin, begin + duration], axis=1)
        self._halted[which] = -drawn["stopping_reverse"][which]
        self._slow[which] = np.where(behaviour == FOLLOWER, SLOW, TINY)
        self._attention[which] = 1.0 - np.exp(-self._period / np.maximum(delay, self._period))
        self._damping[which] *= np.where(lags, self._recipe.lagging.damping, 1.0)
        self._line.set_latency(which, np.where(lags, self._recipe.lagging.delay, delay) / self._period)

    def derive(self) -> None:
        """Recomputes values derived from the drawn shares and behaviours, also after `arrays` were overwritten."""
        self._any, self._steers = bool(self._present.any()), bool(self.steered.any())
        there = self._present > 0.0
        self._which = [np.flatnonzero(there & (self._behaviour == kind)) for kind in range(len(BEHAVIOURS))]
        sign = np.sign(self._share)
        self._least, self._most = np.minimum(0.0, sign), np.maximum(0.0, sign)

    def wrench(self, commanded: Array, gust: Array, state: SimulationState, out: Array) -> None:
        """Force and torque about the object's centre of mass, written to `out` (n, 6), for the next period.

        `commanded` (n, 4): v_x, v_y and yaw rate in the heading frame, height of the hands [m]; `gust` (n, 3) standard
        normal. F = k (aim - handle) + c (v_aim - v_handle), bounded, plus the share of the weight upward or of the
        rolling resistance along the path, plus an unsteady force; torque = (handle - centre of mass) × F.
        """
        out[:] = 0.0
        state.partner_share[:] = self._share * self._present
        if not self._any:
            return
        self._wandering *= self._keep_share  # AR(1) noise about the drawn share, within 0..1 (-1..0 if negative)
        self._wandering += self._drift * gust[:, 2]
        state.partner_share[:] = (self._share + self._wandering).clip(self._least, self._most) * self._present
        velocity = self._path(commanded)
        state.partner_velocity[:] = velocity * self._present[:, None]
        along = velocity[:, :2] / (_length(velocity) + self._slow)[:, None]
        if self._steers:
            own = self._own_way / (_length(self._own_way) + FOLLOWER_FADE_SPEED)[:, None]
            along = np.where(self.steered[:, None], own, along)
        lead = self._aim + velocity * self._period - self._at
        lead[:, :2] *= np.minimum(1.0, self._recipe.leash / (_length(lead) + TINY))[:, None]
        lead[:, 2] = lead[:, 2].clip(-self._recipe.leash, self._recipe.leash)
        lead[self.loose, :2] = 0.0
        np.add(self._at, lead, out=self._aim)
        force = self._force
        np.multiply(lead, self._stiffness[:, None], out=force)
        velocity -= self._speed
        velocity *= self._damping[:, None]
        force += velocity
        force[:, :2] *= np.minimum(1.0, self._bound / (_length(force) + TINY))[:, None]
        force[:, 2] = force[:, 2].clip(-self._bound, self._bound)
        self._unsteady *= self._keep
        self._unsteady += self._gust[:, None] * gust[:, :2]
        force[:, :2] += self._unsteady
        force[:, :2] += along * (state.partner_share * self._resistance)[:, None]
        force[:, 2] += state.partner_share * self._weight
        self._tug(force)
        force[self.loose, :2] = 0.0
        force *= self._present[:, None]
        self._steps += 1
        out[:, :3] = force
        out[:, 3:] = rotations.cross(self._arm, force)
        if self._steers:
            out[:, 5] += self._twist(state)

    def _twist(self, state: SimulationState) -> Array:
        """Torque of both hands of steered partners about the vertical, (n,) [N·m]: spring and damper of the arms at
        the distance of the hands, towards the yaw rate that the partner gives the object."""
        rate = self._turn_rate - state.object_angular_velocity[:, 2]
        far = self._recipe.leash / self._recipe.hand_distance
        self._yaw_lead += rate * self._period
        self._yaw_lead.clip(-far, far, out=self._yaw_lead)
        strongest = self._recipe.strongest * self._recipe.hand_distance
        torque: Array = self._yaw_stiffness * self._yaw_lead + self._yaw_damping * rate
        return torque.clip(-strongest, strongest)

    def _path(self, commanded: Array) -> Array:
        """Velocity of the path at the handle, (n, 3) [m/s], after the partner's delay; turns the path's heading."""
        heard = commanded.copy()
        risen = commanded[:, 3] - self._height
        risen[np.isnan(risen)] = 0.0
        np.divide(risen, self._period, out=heard[:, 3])
        self._height[:] = commanded[:, 3]
        self._line.push(heard)
        wanted = self._line.read()
        rate, velocity = wanted[:, 2], np.empty((len(wanted), 3))
        offset = rotations.turned_by(self._offset, *self._heading.T)
        velocity[:, :2] = rotations.turned_by(wanted[:, :2], *self._heading.T)
        velocity[:, 0] -= rate * offset[:, 1]
        velocity[:, 1] += rate * offset[:, 0]
        velocity[:, :2] *= self._pace[:, None]
        velocity[:, 2] = wanted[:, 3]
        if self._steers:
            self._own_way = velocity[:, :2].copy()
            self._turn_rate = np.where(self.steered, rate, 0.0)
            rate = rate - self._turn_rate
        if len(self._which[LEADER]):
            rate = rate + self._lead(self._which[LEADER], wanted, velocity)
        if len(self._which[STOPPING]):
            self._halt(self._which[STOPPING], velocity)
        if len(self._which[FOLLOWER]):
            self._follow(self._which[FOLLOWER], velocity)
        self._turn(rate * self._period)
        return velocity

    def _lead(self, which: Indices, wanted: Array, velocity: Array) -> Array:
        """Adds drift and height profile of leaders (k,) to their velocity; returns yaw rates to add, (n,) [rad/s]."""
        walking = wanted[which, :2].any(axis=1)
        aside = walking * self._sideways[which]
        velocity[which, 0] -= self._heading[which, 1] * aside
        velocity[which, 1] += self._heading[which, 0] * aside
        pulse = 2.0 * np.pi / self._recipe.leader.rise_period
        velocity[which, 2] += self._rise[which] * pulse * np.cos(pulse * self._period * self._steps[which])
        rate = np.zeros(len(velocity))
        rate[which] = walking * self._turning[which]
        return rate

    def _halt(self, which: Indices, velocity: Array) -> None:
        """Stops or reverses partners (k,) during their stop, and brings them back to the handle after it."""
        begin, end = self._stop[which].T
        now = self._steps[which] * self._period
        stopped, resumed = which[(now >= begin) & (now < end)], which[now >= end]
        velocity[stopped, :2] *= self._halted[stopped, None]
        velocity[resumed, :2] += (self._at - self._aim)[resumed, :2] / self._recipe.stopping.catching_up

    def _follow(self, which: Indices, velocity: Array) -> None:
        """Moves the aim of followers (k,) with the handle: at its low-passed velocity, plus the distance to its place a
        period ago over the reaction time, so that a steady motion leaves no error."""
        attention = self._attention[which, None]
        followed = self._followed[which] + attention * (self._speed[which, :2] - self._followed[which])
        away = (self._at - self._aim)[which, :2] - followed * self._period
        self._followed[which] = followed
        velocity[which, :2] = followed + away * attention / self._period

    def _tug(self, force: Array) -> None:
        """Adds the pulls of tugging partners: forward, left, backward, right in turn, in their heading."""
        which, tugging = self._which[TUGGING], self._recipe.tugging
        if not len(which):
            return
        turns, within = np.divmod(self._steps[which] * self._period, tugging.interval)
        pull = tugging.force * (within < tugging.duration)
        direction = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])[turns.astype(np.int64) % 4]
        force[which, :2] += rotations.turned_by(direction * pull[:, None], *self._heading[which].T)

    def _turn(self, angle: Array) -> None:
        """Turns the path's heading by small angles (n,) [rad], by Cayley's form of a rotation."""
        half = 0.5 * angle * (1.0 + angle * angle / 12.0)
        scale = 1.0 / (1.0 + half * half)
        self._heading[:] = rotations.turned_by(self._heading, (1.0 - half * half) * scale, 2.0 * half * scale)

    def observe(self, state: SimulationState) -> None:
        """Follows the handle over a period."""
        if not self._things:
            return
        before = self._at
        self._observe(state)
        self.handle_displacement = self._at - before
        if self._any:
            state.partner_force[:] = self._force

    def _observe(self, state: SimulationState) -> None:
        places = rotations.rotate(state.object_quaternion[:, None], self._places)
        out = places[:, 0]
        self._at = state.object_position + out
        self._speed = state.object_linear_velocity + rotations.cross(state.object_angular_velocity, out)
        state.handle_velocity[:] = self._speed
        self._arm = out - places[:, 1]

    @property
    def at(self) -> Array:
        """The objects' far handles, (n, 3) [m]."""
        return self._at.copy()

    @property
    def aim(self) -> Array:
        """Equilibrium points of the partners' springs, (n, 3) [m]."""
        return self._aim.copy()

    def arrays(self) -> dict[str, Array]:
        own = {name: getattr(self, f"_{name}") for name in STATE_FIELDS}
        return own | {f"line/{name}": values for name, values in self._line.arrays().items()}


def _length(vectors: Array) -> Array:
    """Lengths of the planar parts of vectors, (n, k) to (n,)."""
    return np.sqrt(vectors[:, 0] * vectors[:, 0] + vectors[:, 1] * vectors[:, 1])
