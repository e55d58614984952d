"""n environments stepped in one process: worlds, partner, disturbances, randomisation and sensors."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import mujoco
import numpy as np

from iowbc import counter_random as random
from iowbc.arrays import Array, Indices, Keys, Mask
from iowbc.control.layout import EVERY
from iowbc.recipe.evaluation.evaluation import Drake
from iowbc.recipe.simulation.simulation import SimulationSettings as Recipe
from iowbc.robot import rotations
from iowbc.robot.description import GRAVITY, Robot
from iowbc.robot.rotations import TINY
from iowbc.sim import partner
from iowbc.sim.disturbance import Disturbance
from iowbc.sim.drives import Drives
from iowbc.sim.episode_draws import Draws
from iowbc.sim.sensing import Sensing
from iowbc.sim.state import Period, SimulationState
from iowbc.sim.timing import Timing
from iowbc.sim.world import World, make_world

STARTS_AT_ZERO = (
    *("joint_acceleration", "slipped", "partner_force", "partner_velocity", "partner_share"),
    *("external_force", "push_force"),
)
"""Fields of the state that are zero at the start of an episode."""
DELAY_LINES = ("sensing/robot/values", "sensing/object/values", "partner/line/values")
"""Values of delay lines, (periods, n, width); the names in a snapshot begin with `ring/` after their first form."""


class Simulation:
    """The environments of one process. Set `target` and `feed`, call `step`, read `state` and `measured`."""

    def __init__(
        self,
        robot: Robot,
        recipe: Recipe,
        *,
        envs: Array,
        seed: int | Array,
        scenes: Sequence[str],
        fixed: Mapping[str, Array] | None = None,
        control_frequency: float = 50.0,
        drake: Drake | None = None,
    ) -> None:
        """`envs`: global indices of the environments, (n,); with `seed` (one, or one each) they key all random draws.

        `scenes`: name of each environment's scene. `fixed`: quantities held at a value, not drawn, (n,); NaN draws.
        `drake`: settings of Drake as the physics engine; raises UsageError if it is not installed.
        """
        mujoco.set_mju_user_warning(lambda message: None)  # no printing: warnings are read from their counters
        self.robot, self.recipe = robot, recipe
        self.envs = np.asarray(envs, np.int64)
        self.n = n = len(self.envs)
        self.period = 1.0 / control_frequency
        self.fixed: dict[str, Array] = {}
        for name in dict.fromkeys(scenes):
            if name not in recipe.scenes.names:
                raise KeyError(f"no scene {name!r}; there are: {', '.join(recipe.scenes.names)}")
        models = [getattr(recipe.scenes, name) for name in scenes]
        if len(models) != n:
            raise ValueError(f"{n} environments but {len(models)} scenes")
        timing = Timing(self.period, recipe.physics.timestep, recipe.randomization.longest_latency)
        by_name = dict(zip(scenes, models, strict=True))
        self._scenes = tuple(by_name)
        self.worlds = tuple(
            make_world(robot, recipe.physics, model, np.flatnonzero(np.array(scenes) == name), timing, drake)
            for name, model in by_name.items()
        )
        self._owner, self._index = np.empty(n, np.int64), np.empty(n, np.int64)
        """World of each environment, and its place there, (n,)."""
        for number, world in enumerate(self.worlds):
            self._owner[world.rows], self._index[world.rows] = number, np.arange(len(world.rows))
        self._draws = Draws(recipe, models, robot)
        self.drawn = self._draws.values
        """Random quantities of the current episodes, by name, (n,) or (n, k)."""
        self.hold(fixed or {})
        self._key = random.environment_key(seed, self.envs)
        self._episode_key = self._key.copy()
        self.episode = np.zeros(n, np.int64)
        self.clock = np.zeros(n, np.int64)
        self.state = SimulationState(n, len(robot.joints))
        self.state.has_object[:] = [model.object is not None for model in models]
        self.target = np.tile(robot.default_position, (n, 1))
        self.feed = np.zeros((n, partner.FEED))
        self.planned_push = np.zeros((n, 3))
        """Force on the base in the next period in addition to the drawn pushes, world frame, (n, 3) [N]."""
        self.planned_impulse = np.zeros((n, 3))
        """The same on the object's centre of mass, in addition to the drawn impulses, (n, 3) [N]."""
        self.partner = partner.Partner(recipe.partner, models, self.period)
        self._sensing = Sensing(
            recipe.sensing, len(robot.joints), self.state.has_object, recipe.randomization.longest_latency, self.period
        )
        self.measured = self._sensing.measured
        """Sensor readings, refreshed by `reset` and `step`."""
        self._drives = Drives(robot, recipe.physics, n)
        self.motor_effort = self._drives.effort
        """Torque limit of each motor or linkage in these episodes at low speed, (n, joints) [N·m]."""
        self._impulses = Disturbance("impulse", recipe.impulses, n, self.period)
        self._pushes = Disturbance("push", recipe.pushes, n, self.period)
        self._robot_mass = np.zeros(n)
        held = [model.kind == "lift" for model in models]
        by_contact = np.array([model.grasp.kind == "contact" for model in models]) & held
        self._pressed = by_contact * np.array([model.grasp.squeeze for model in models])
        self._by_friction = (held & ~by_contact) * np.array([model.grasp.by_friction for model in models])
        self._borne = np.zeros(n)
        self._strength = np.array([model.grasp.strength for model in models])
        handover = np.array([model.grasp.handover if model.kind == "lift" else 0.0 for model in models])
        self._handover = handover / self.period
        width = self._sensing.noise_width + partner.NOISE_WIDTH
        self._noise = np.zeros((n, width + width % 2))

    @property
    def infeasible(self) -> Mask:
        """True where a crate's rolling resistance exceeds the friction between feet and ground, (n,)."""
        hold = self.drawn["ground_friction"] * self._robot_mass * GRAVITY
        return self.drawn["rolling_resistance"] > hold

    @property
    def disturbed(self) -> Mask:
        """True where an impulse or a push acts in this control period, (n,)."""
        return np.logical_or(self._impulses.force.any(axis=1), self._pushes.force.any(axis=1))

    @property
    def soles(self) -> dict[str, Array]:
        """Motion and contact of the left and right sole, by name, (n, 2) each; see `iowbc.sim.soles.Soles`."""
        parts = [(world.place, world.soles.arrays()) for world in self.worlds]
        gathered = {name: np.empty((self.n, 2)) for name in parts[0][1]}
        for place, arrays in parts:
            for name, values in arrays.items():
                gathered[name][place] = values
        return gathered

    def hold(self, fixed: Mapping[str, Array], which: Indices | slice = EVERY) -> None:
        """Holds quantities of some environments at values (k,) from the next reset on, others as before; NaN draws."""
        unknown = [name for name in fixed if name not in self.drawn]
        if unknown:
            raise KeyError(f"no randomised quantities {unknown}; there are: {', '.join(sorted(self.drawn))}")
        for name, values in fixed.items():
            self.fixed.setdefault(name, np.full(self.n, np.nan))[which] = values

    def reseed(self, key: Keys) -> None:
        """Restarts all random sequences, from the next reset on; `key` (n,) as from `random.environment_key`."""
        self._key[:] = key
        self.episode[:] = 0

    def reset(
        self, which: Indices, joint_position: Array, base_pitch: Array | None = None, key: Keys | None = None
    ) -> None:
        """Starts new episodes: draws what is random, puts the robot on its soles and the object into its hands.

        `which` (k,); `joint_position` (k, joints) [rad]; `base_pitch` (k,) [rad], zero by default; `key` (k,):
        random keys of the episodes, by default the next of each environment. The height of the base follows from
        kinematics: the lowest corner of the soles touches the ground.
        """
        which = np.asarray(which, np.int64)
        if len(which) == 0:
            return
        pitch = np.zeros(len(which)) if base_pitch is None else np.asarray(base_pitch)
        self.episode[which] += 1
        self.clock[which] = 0
        if key is None:
            key = random.absorb(self._key[which], self.episode[which])
        self._episode_key[which] = key
        self._draws.draw(which, key, self.fixed)
        self.target[which] = joint_position
        state = self.state
        state.diverged[which] = False
        for world, ids, chosen in self._parts(which):
            rows = which[chosen]
            drawn = {name: values[rows] for name, values in self.drawn.items()}
            world.reset(ids, joint_position[chosen], pitch[chosen], drawn)
            world.gather(state)
            self._robot_mass[world.place] = world.robot_mass
        for name in STARTS_AT_ZERO:
            getattr(state, name)[which] = 0
        state.grasped[which] = state.has_object[which, None]
        self._borne[which] = 0.0
        self._drives.reset(which, self.drawn)
        self._impulses.reset(which, key)
        self._pushes.reset(which, key)
        self.partner.reset(which, self.drawn, state)
        self._sensing.reset(which, self.drawn, state)
        self._deliver()

    def step(self) -> None:
        state, drawn = self.state, self.drawn
        wrench, diverged = state.external_force, state.diverged
        self.partner.wrench(self.feed, self._noise[:, self._sensing.noise_width :], state, wrench)
        wrench[:, :3] += self._impulses.advance(self.clock, self._episode_key, drawn["impulse_scale"])
        if self.planned_impulse.any():
            wrench[:, :3] += self.planned_impulse
        self._handover_force(wrench)
        push = self._pushes.advance(self.clock, self._episode_key, drawn["push_scale"])
        np.multiply(push, self._robot_mass[:, None], out=state.push_force)
        np.add(state.push_force, self.planned_push, out=state.push_force)
        target = self.target - drawn["encoder_bias"]
        given = Period(
            target=target,
            effort=self._drives.ranges(target, state),
            wrench=wrench,
            push=state.push_force,
            resistance=drawn["rolling_resistance"],
            squeeze=self._squeeze(),
            slip_force=drawn["slip_force"],
        )
        self.clock += 1
        diverged[:] = np.isnan(target.sum(axis=1))
        speed = state.joint_velocity.copy()
        for world in self.worlds:
            place = world.place
            failed = diverged[place]
            world.step(given.rows(place), failed)
            diverged[place] = failed
            world.gather(state)
            world.release(state, drawn["slip_force"])
        state.joint_acceleration[:] = (state.joint_velocity - speed) / self.period
        self._borne[:] = 0.5 * np.sqrt(np.vecdot(state.grip_force, state.grip_force)).sum(axis=1)
        self.partner.observe(state)
        self._sensing.advance(state)
        self._deliver()

    def pause(self) -> None:
        """A control period in which nothing moves; refreshes the sensor readings."""
        self.clock += 1
        self._deliver()

    def _handover_force(self, wrench: Array) -> None:
        """Bears the robot's share of a held object between the hands, fading out: f = (1 - share) m g (1 - t / T)."""
        if (self.clock < self._handover).any():
            left = np.maximum(self._handover - self.clock, 0.0) / np.maximum(self._handover, 1.0)
            drawn, lifted = self.drawn, np.zeros((self.n, 3))
            lifted[:, 2] = GRAVITY * left * (1.0 - drawn["partner_share"]) * drawn["object_mass"]
            between = -drawn["object_com_offset"]
            between[:, 0] -= drawn["grip_shift"]
            wrench[:, :3] += lifted
            wrench[:, 3:] += rotations.cross(rotations.rotate(self.state.object_quaternion, between), lifted)

    def _deliver(self) -> None:
        self._noise = random.noise(self._episode_key, self.clock.view(np.uint64), self._noise.shape[1])
        self._sensing.deliver(self._noise[:, : self._sensing.noise_width])

    def _parts(self, which: Indices) -> Iterator[tuple[World, Indices, Indices]]:
        """Worlds that some environments belong to, with their indices in the world, ascending, and in `which`."""
        order = np.argsort(which)
        owner = self._owner[which[order]]
        for number, world in enumerate(self.worlds):
            chosen = order[owner == number]
            if len(chosen):
                yield world, self._index[which[chosen]], chosen

    def _squeeze(self) -> Array:
        """Force with which the arms press each hand against a held object, (n,) [N]: constant where friction alone
        holds it, else what friction needs for the palms' part of their last load."""
        needed = self._by_friction * self._borne / np.maximum(self.drawn["surface_friction"], TINY)
        return self._pressed + np.minimum(needed, self._strength)

    def _memory(self) -> dict[str, Array]:
        """State arrays by their names in a snapshot, one row per environment, without those of the worlds."""
        own: dict[str, Array] = {"episode": self.episode, "clock": self.clock, "episode_key": self._episode_key}
        own |= {"target": self.target, "feed": self.feed, "robot_mass": self._robot_mass, "borne": self._borne}
        own["noise"] = self._noise
        parts: dict[str, dict[str, Array]] = {
            "state": vars(self.state),
            "drawn": self.drawn,
            "partner": self.partner.arrays(),
            "sensing": self._sensing.arrays(),
            "drives": {"effort": self.motor_effort},
            "impulses": self._impulses.arrays(),
            "pushes": self._pushes.arrays(),
            "fixed": self.fixed,
        }
        own |= {f"{part}/{name}": values for part, arrays in parts.items() for name, values in arrays.items()}
        delayed = {f"ring/{name}": own.pop(name).swapaxes(0, 1) for name in DELAY_LINES}
        return delayed | {f"simulation/{name}": values for name, values in own.items()}

    def snapshot(self) -> dict[str, Array]:
        """Copies of the complete state, one row per environment; `restore` continues bit for bit."""
        saved = {name: values.copy() for name, values in self._memory().items()}
        for scene, world in zip(self._scenes, self.worlds, strict=True):
            saved |= {f"scene/{scene}/{name}": values for name, values in world.snapshot().items()}
        return saved

    def restore(self, saved: Mapping[str, Array]) -> None:
        """Inverse of `snapshot`, for the same robot, recipe, environments and scenes; other entries are ignored."""
        self.hold(_under("simulation/fixed/", saved))
        for name, values in self._memory().items():
            if name not in saved or saved[name].shape != values.shape:
                found = saved[name].shape if name in saved else "nothing"
                raise ValueError(f"snapshot of another simulation: {name} is {found}, expected {values.shape}")
            values[...] = saved[name]
        for scene, world in zip(self._scenes, self.worlds, strict=True):
            world.restore(_under(f"scene/{scene}/", saved))
        self.partner.derive()

    def copy(self, source: Indices, to: Indices) -> None:
        """Environments `to`, (k,), continue from the states of environments `source`, (k,), of the same scenes, with
        the same random quantities until their episodes end. They keep their own random sequences of episodes."""
        for name, values in self._memory().items():
            if name != "simulation/episode":
                values[to] = values[source]
        for world, ids, chosen in self._parts(to):
            world.copy(self._index[source[chosen]], ids)
        self.partner.derive()

    def world_of(self, env: int) -> tuple[World, int]:
        """The world of an environment, and its index there."""
        if not 0 <= env < self.n:
            raise IndexError(f"no environment {env}; there are {self.n}")
        return self.worlds[self._owner[env]], int(self._index[env])

    def physics_model(self, env: int) -> tuple[Any, Any]:
        """A copy of the MuJoCo model with which an environment is stepped, and data of its state."""
        world, index = self.world_of(env)
        model, data = world.batch.get_model(index), world.batch.get_data(index)
        mujoco.mj_forward(model, data)
        return model, data

    def impulse_force(self, env: int) -> Array:
        """The impulse that acts on the object in this control period, world frame, (3,) [N]."""
        return self._impulses.force[env] + self.planned_impulse[env]

    def hand_position(self, env: int) -> Array:
        """Positions of the grips, (2, 3) [m]."""
        world, index = self.world_of(env)
        return world.grips[index].copy()


def _under(beginning: str, arrays: Mapping[str, Array]) -> dict[str, Array]:
    """The arrays whose names begin so, without that."""
    return {name.removeprefix(beginning): values for name, values in arrays.items() if name.startswith(beginning)}
