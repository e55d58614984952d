"""The environments of one process, stepped as arrays: simulation, guidance, judgement, observation."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from iowbc.arrays import Array, Indices, Keys
from iowbc.control import gait
from iowbc.control.action import action_scale, applied_action
from iowbc.control.command import HEIGHT, OFFSET, VELOCITY, YAW_RATE
from iowbc.control.layout import EVERY
from iowbc.control.observation import PolicyInputs
from iowbc.recipe.simulation.holding import FREE
from iowbc.robot.description import load_robot
from iowbc.sim.simulation import Simulation
from iowbc.task.episode_state import PER_ENVIRONMENT_FIELDS, EpisodeState
from iowbc.task.episodes import PlannedPulls, PlannedPushes
from iowbc.task.guidance import Guidance
from iowbc.task.judge import Ending, Judge, Judgement
from iowbc.task.layout import full_layout
from iowbc.task.motion import Motion
from iowbc.task.privileged import Truth
from iowbc.task.record import statistics
from iowbc.task.record.signals import Recorded, write_signals
from iowbc.task.schedule import Schedule
from iowbc.task.vector.shared import Buffers

if TYPE_CHECKING:
    from iowbc.task.vector.setup import Setup


class Batch:
    """n environments. `step` reads the actions from the buffers; `reset` and `step` write all results there."""

    def __init__(self, setup: "Setup", first: int, last: int, buffers: Buffers) -> None:
        """The environments of a setup from `first` to `last`, the latter excluded; `buffers` hold their rows alone."""
        specification, scenes = setup.specification, setup.scenes[first:last]
        episodes = None if setup.episodes is None else setup.episodes[first:last]
        recipe, task = specification.recipe, specification.recipe.task
        self.robot, self.buffers = load_robot(specification.robot), buffers
        self.layout = full_layout(recipe, self.robot)
        self.n = n = last - first
        self.period = period = 1.0 / task.control_frequency
        self.scenes = np.array(scenes)
        """Name of each environment's scene, (n,)."""
        self.memory = EpisodeState(n, len(self.robot.interaction), len(self.robot.support))
        self._schedule = schedule = Schedule(
            task, self.memory, environments=np.arange(first, last), seed=setup.seed, trials=episodes
        )
        self.simulation = Simulation(
            self.robot,
            recipe.simulation,
            envs=schedule.streams,
            seed=schedule.seeds,
            scenes=scenes,
            fixed=schedule.fixed,
            control_frequency=task.control_frequency,
            drake=specification.drake,
        )
        kinds = np.array([getattr(recipe.simulation.scenes, name).kind for name in scenes])
        self._holding, self._pushing = kinds == "lift", kinds == "push"
        scripts = schedule.planned("script")
        self.guidance = Guidance(specification, self.robot, scenes, self._holding, self._pushing, scripts)
        self.judge = Judge(recipe, self.robot, self._holding, training=episodes is None)
        self._pushes = PlannedPushes(schedule.planned("push"), period)
        self._pulls = PlannedPulls(schedule.planned("pull"), period)
        self._action, self._scale = task.action, action_scale(self.robot, task.action)
        arms = None if specification.public is None else specification.public.arms
        self._own_arms = np.flatnonzero([arms == "own" or (arms == "free" and name == FREE) for name in scenes])
        """Environments in which a public controller moves its arms, (k,)."""

    def targets(self, action: Array) -> Array:
        """Joint targets of an action (n, 15) in the next step, (n, joints) [rad]."""
        return self.guidance.targets(self.memory, self._applied(self._clipped(action)))

    def _clipped(self, action: Array) -> Array:
        return action.clip(-self._action.bound, self._action.bound)

    def _applied(self, action: Array) -> Array:
        return applied_action(action, self.memory.action, self._action)

    def reset(self, seeds: Keys | None = None) -> None:
        """Starts an episode in every environment; `seeds` (n,) reseed all random number streams."""
        if seeds is not None:
            self.reseed(seeds)
        if self._schedule.repeats:
            self.memory.episode[:] = 0
            self.simulation.episode[:] = 0
        moved = self.begin(np.arange(self.n))
        for name in ("reward", "done", "truncated", "terminal_observation"):
            self.buffers[name][:] = 0
        self._observe(moved)
        nothing, ending = np.zeros((self.n, len(self.robot.support))), Ending(*np.zeros((5, self.n), np.bool_))
        step = Recorded(self.simulation, moved, self.memory, ending, nothing, self.period)
        write_signals(self.buffers, step, planned=False)

    def reseed(self, seeds: Keys) -> None:
        """Reseeds all random number streams from seeds (n,)."""
        self._schedule.reseed(seeds)
        self.simulation.reseed(self._schedule.key)
        self.memory.episode[:], self.memory.failed[:] = 0, False

    def step(self) -> None:
        """One control step of every environment; those that end start a new episode."""
        memory, simulation = self.memory, self.simulation
        given, support = self.buffers["action"].astype(np.float64), len(self.robot.support)
        action = self._clipped(given[:, :support])
        applied = self._applied(action)
        simulation.target[:] = self.guidance.targets(memory, applied)
        if len(self._own_arms):
            simulation.target[np.ix_(self._own_arms, self.robot.interaction)] = given[self._own_arms, support:]
        self.feed_partner(simulation.feed)
        if self._pushes.any:
            simulation.planned_push[:] = self._pushes.force(memory.steps, memory.heading_reference)
        if self._pulls.any:
            simulation.planned_impulse[:] = self._pulls.force(memory.steps, memory.heading_reference)
        simulation.step()
        memory.steps += 1
        memory.heading_reference += memory.command[:, YAW_RATE] * self.period
        judgement = self.judge.judge(
            simulation.state,
            memory,
            action,
            place=self.guidance.object_place(memory),
            disturbed=simulation.disturbed,
            resistance=simulation.drawn["rolling_resistance"],
        )
        self.record(judgement, applied)
        self.guidance.advance(memory, self._schedule.episode_key, self.simulation.measured)
        self.finish(judgement)

    def record(self, judgement: Judgement, applied: Array) -> None:
        """Writes signals and counters of the step just made, in which the motors followed an action (n, 15)."""
        statistics.count_step(self.buffers, judgement, self.memory)
        motion, ending, correction = judgement.motion, judgement.ending, applied * self._scale
        step = Recorded(self.simulation, motion, self.memory, ending, correction, self.period)
        write_signals(self.buffers, step, planned=self._schedule.repeats)

    def feed_partner(self, feed: Array) -> None:
        """Writes the entries of the command that the partner receives, (n, 4)."""
        feed[:, :3] = self.memory.command[:, VELOCITY]
        left, right = self.memory.command[:, OFFSET][:, 2::3].T
        feed[:, 3] = self.memory.command[:, HEIGHT] + 0.5 * (left + right)

    def finish(self, judgement: Judgement) -> None:
        """Writes the results of the step, and starts a new episode where one has ended."""
        memory, buffers, ending, reward = self.memory, self.buffers, judgement.ending, judgement.terms.sum(axis=1)
        memory.total += reward
        memory.tracking += judgement.tracking
        done = ending.done
        buffers["reward"][:] = reward
        buffers["done"][:] = done
        buffers["truncated"][:] = ending.truncated
        self._observe(judgement.motion)
        if not done.any():
            return
        which = np.flatnonzero(done)
        buffers["terminal_observation"][which] = buffers["observation"][which]
        buffers["episode_return"][which] = memory.total[which]
        buffers["episode_length"][which] = memory.steps[which]
        statistics.count_endings(buffers, ending, self._schedule.causes(ending), which)
        self._schedule.promote(ending, which)
        self._observe(self.begin(which), which)

    def begin(self, which: Indices) -> Motion:
        """Starts new episodes in some environments, (k,). Returns the motion of all."""
        memory = self.memory
        key = self._schedule.start(which)
        joints, pitch = self.guidance.start(which, memory, key)
        memory.clear(which)
        self.simulation.hold(self._schedule.scales(which, key), which)
        self.simulation.reset(which, joints, base_pitch=pitch, key=key)
        memory.infeasible[which] = self.simulation.infeasible[which]
        statistics.count_pushes(self.buffers, self._pushing, memory, which)
        moved = self.judge.motion(self.simulation.state)
        memory.heading_reference[which] = moved.heading[which]
        memory.heading_offset[which] = (self.simulation.measured.heading[:, 0] - moved.heading)[which]
        memory.object_place[which] = 0.0
        away = moved.object_offset - self.guidance.object_place(memory)
        memory.object_place[which] = away[which] * self._holding[which, None]
        return moved

    def _observe(self, moved: Motion, which: Indices | slice = EVERY) -> None:
        """Writes s_t and s_priv of some environments."""
        memory, simulation, layout = self.memory, self.simulation, self.layout
        sensed = PolicyInputs(
            measured=simulation.measured,
            command=memory.command,
            heading_reference=(memory.heading_reference + memory.heading_offset)[:, None],
            joint_reference=self.guidance.joints(memory.support, memory.arms),
            phase=gait.phase_signal(memory.phase, memory.stepping),
            last_action=memory.action,
            support_reference=memory.support,
            arm_reference=memory.arms,
        )
        truth = Truth(moved, simulation.state, simulation.drawn, simulation.motor_effort)
        seen = np.empty((len(moved.heading[which]), layout.size), np.float32)
        layout.state.gather(sensed, seen[:, layout.observation], which)
        layout.extra.gather(truth, seen[:, layout.privileged], which)
        self.buffers["observation"][which] = seen

    def drawn(self) -> dict[str, Array]:
        """Everything that was drawn for the current episodes, by name, (n,) or (n, k)."""
        return {name: values.copy() for name, values in self.simulation.drawn.items()}

    def levels(self) -> Array:
        """Curriculum levels, (n, axes)."""
        return self.memory.level.copy()

    def set_levels(self, levels: Array) -> None:
        """Sets the curriculum levels (n, axes), from the next episodes on."""
        self.memory.level[:] = levels

    def copy(self, source: Indices) -> None:
        """Each environment continues from the state of environment `source`, (n,), of the same scene, with the same
        random quantities until its episode ends. It keeps its levels and its own random sequence of episodes."""
        to = np.flatnonzero(source != np.arange(self.n))
        chosen = source[to]
        for name, values in vars(self.memory).items():
            if name not in PER_ENVIRONMENT_FIELDS:
                values[to] = values[chosen]
        for values in (self._schedule.episode_key, self.buffers["observation"]):
            values[to] = values[chosen]
        self.simulation.copy(chosen, to)

    def _arrays(self) -> dict[str, Array]:
        """State arrays by their names in a snapshot, one row per environment, without those of the simulation."""
        own = vars(self.memory) | {"key": self._schedule.key, "episode_key": self._schedule.episode_key}
        saved = {f"task/{name}": values for name, values in own.items()}
        return saved | {f"buffer/{name}": values for name, values in self.buffers.items()}

    def snapshot(self) -> dict[str, Array]:
        """Complete state, one row per environment."""
        return {name: values.copy() for name, values in self._arrays().items()} | self.simulation.snapshot()

    def restore(self, saved: Mapping[str, Array]) -> None:
        """Inverse of `snapshot`: the environments then continue bit for bit."""
        for name, values in self._arrays().items():
            values[...] = saved[name]
        self.simulation.reseed(self._schedule.key)
        self.simulation.restore(saved)
