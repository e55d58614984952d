"""The environments of one process: simulation, references, reward, terminations and curriculum, stepped as arrays."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iowbc import counter_random as random
from iowbc.arrays import Keys, as_slice
from iowbc.control import gait
from iowbc.control.action import action_scale
from iowbc.control.command import HEIGHT, OFFSET, PITCH, VELOCITY, YAW_RATE
from iowbc.control.observation import Sensed
from iowbc.control.references import ReferenceLayer, both_wrists
from iowbc.control.sensors import Measured
from iowbc.recipe.recipe import Recipe
from iowbc.robot.description import load_robot
from iowbc.sim.simulation import Simulation
from iowbc.task.commands.commander import Commander
from iowbc.task.curriculum import Difficulty, difficulty, initial_level, next_level
from iowbc.task.endings import dropped, fallen
from iowbc.task.episodes import Episode
from iowbc.task.layout import full_layout
from iowbc.task.memory import Memory
from iowbc.task.motion import Motion, low_pass, motion
from iowbc.task.privileged import Truth
from iowbc.task.record.recorder import Ending, count_endings, count_step, write_signals
from iowbc.task.rewards.total import RewardFunction, Scored, Step
from iowbc.task.vector.shared import Buffers

Array = NDArray[Any]
Indices = NDArray[np.intp]
Mask = NDArray[np.bool_]

EVERY = slice(None)
"""All environments."""


class Batch:
    """n environments. `reset` and `step` read the actions from the buffers and leave everything else there."""

    def __init__(
        self,
        recipe: Recipe,
        robot: Path,
        rg: Path | None,
        *,
        environments: NDArray[np.int64],
        scenes: Sequence[str],
        seed: int,
        buffers: Buffers,
        episodes: Sequence[Episode] | None = None,
        divergences: Path | None = None,
    ) -> None:
        """`environments`: global indices, (n,); `scenes`: their scenes, by name.

        `episodes`: one an environment, or none to draw them as in training. `divergences`: folder in which diverged
        simulations are kept for replay.
        """
        task = recipe.task
        self.recipe, self.robot, self.buffers = recipe, load_robot(robot), buffers
        self.layout = full_layout(recipe, self.robot)
        self.n = n = len(environments)
        self.period = 1.0 / task.control_frequency
        self.references = ReferenceLayer(self.robot, task.references, rg)
        self.scenes = np.array(scenes)
        """Name of each environment's scene, (n,)."""
        seeds, streams = np.full(n, seed, np.uint64), environments
        if episodes is not None:
            seeds, streams = np.array([episode.seed for episode in episodes], np.uint64), np.zeros(n, np.int64)
        self.simulation = Simulation(
            self.robot,
            recipe.simulation,
            envs=streams,
            seed=seeds,
            scenes=scenes,
            fixed=fixed_values(episodes or ()),
            control_frequency=task.control_frequency,
        )
        self._support, self._arms = as_slice(self.robot.support), as_slice(self.robot.interaction)
        self._key = random.environment_key(seeds, streams)
        self._episode_key = self._key.copy()
        scripts = [episode.script for episode in episodes] if episodes is not None else [None] * n
        self._held = np.array([getattr(recipe.simulation.scenes, name).kind == "lift" for name in scenes])
        self._commander = Commander(task, self.references, scripts, self._held, self.period)
        self.memory = Memory.blank(n, len(self.robot.interaction), len(self.robot.support))
        self.memory.level[:] = initial_level(task.curriculum, n) if episodes is None else task.curriculum.fixed_level
        self._trials, self._divergences = episodes, divergences
        self._reward = RewardFunction(task.reward, self._support, self.period)
        self._grasp = np.stack([both_wrists(getattr(task.references.grasps, name)) for name in scenes])
        self._scale = action_scale(self.robot, task.action)
        self._height_rate, self._velocity = np.zeros(n), np.zeros((n, 3))
        self._joint_reference = np.tile(self.robot.default_position, (n, 1))
        self._scales = {name: np.ones(n) for name in ("load_scale", "impulse_scale", "push_scale")}

    @property
    def command(self) -> Array:
        """C in force in the step to come, (n, 11)."""
        return self.memory.command

    def targets(self, action: Array) -> Array:
        """Joint targets of an action (n, 15) in the step to come, (n, 29) [rad]: θ_S_ref + scale·a, θ_I_ref."""
        bound = self.recipe.task.action.bound
        target = np.empty((self.n, len(self.robot.joints)))
        target[:, self._support] = self.memory.support + self._scale * action.clip(-bound, bound)
        target[:, self._arms] = self.memory.arms
        return target

    def reset(self, seeds: NDArray[np.uint64] | None = None) -> None:
        """Starts an episode in every environment; with `seeds` (n,) all that is random starts anew from them."""
        if seeds is not None:
            self._key[:] = random.environment_key(seeds, np.zeros(self.n, np.int64))
            self.simulation.reseed(self._key)
            self.memory.episode[:] = 0
        if self._trials is not None:
            self.memory.episode[:] = 0
            self.simulation.episode[:] = 0
        self._begin(np.arange(self.n))
        for name in ("reward", "done", "truncated", "terminal_observation"):
            self.buffers[name][:] = 0
        moved, nothing = self._motion(), Ending.none(self.n)
        self._observe(moved)
        write_signals(self.buffers, self.simulation.state, moved, self.memory, nothing, self.period)

    def step(self) -> None:
        """One control step of every environment; those that end begin anew."""
        memory, simulation, termination = self.memory, self.simulation, self.recipe.task.termination
        bound = self.recipe.task.action.bound
        action = self.buffers["action"].astype(np.float64).clip(-bound, bound)
        simulation.target[:] = self.targets(action)
        simulation.feed[:] = memory.command[:, VELOCITY]
        simulation.step()
        memory.steps += 1
        moved = self._motion()
        self._follow(moved)
        place = self._object_place()
        diverged = simulation.state.diverged.copy()
        ending = Ending(
            fallen=fallen(moved, memory.command[:, PITCH], termination) & ~diverged,
            dropped=dropped(moved, place, self._held, simulation.state.grasped, termination) & ~diverged,
            time_limit=memory.steps >= memory.limit,
            diverged=diverged,
        )
        scored = self._score(moved, action, place, ending)
        write_signals(self.buffers, simulation.state, moved, memory, ending, self.period)
        memory.action[:] = action
        self._advance()
        self._finish(moved, scored, ending)

    def _motion(self) -> Motion:
        return motion(self.simulation.state, self.recipe.rg.height)

    def _follow(self, moved: Motion) -> None:
        """Filters what was measured, and turns the heading reference by the commanded yaw rate."""
        memory, time_constant = self.memory, self.recipe.task.reward.sync.filter_time
        memory.heading_reference += memory.command[:, YAW_RATE] * self.period
        self._velocity[:, :YAW_RATE] = moved.system_velocity[:, :YAW_RATE]
        self._velocity[:, YAW_RATE] = moved.yaw_rate
        memory.filtered_velocity[:] = low_pass(memory.filtered_velocity, self._velocity, time_constant, self.period)

    def _object_place(self) -> Array:
        """Where a held object belongs, from the base, heading frame, (n, 3) [m]: it follows the wrist targets."""
        wrists = self._grasp + self.memory.command[:, OFFSET].reshape(-1, 2, 3)
        place: Array = 0.5 * (wrists[:, 0] + wrists[:, 1]) + self.memory.object_place
        return place

    def _score(self, moved: Motion, action: Array, place: Array, ending: Ending) -> Scored:
        memory, stance = self.memory, self.recipe.task.references.gait.stance
        foot_phase = gait.foot_phase(memory.phase)
        step = Step(
            command=memory.command,
            height_rate=self._height_rate,
            support_reference=memory.support,
            filtered_velocity=memory.filtered_velocity,
            action=action,
            previous_action=memory.action,
            swing_progress=gait.swing_progress(foot_phase, stance),
            stance=gait.expected_stance(foot_phase, memory.stepping, stance),
            held=self._held & self.simulation.state.grasped.any(axis=1),
            object_place=place,
            ended=ending.failed,
        )
        return self._reward(self.simulation.state, moved, step).without(ending.diverged)

    def _advance(self) -> None:
        """Command, gait clock and references of the step to come."""
        memory, settings = self.memory, self.recipe.task.references.gait
        height = memory.command[:, HEIGHT].copy()
        self._commander.advance(memory, self._episode_key)
        self._height_rate = (memory.command[:, HEIGHT] - height) / self.period
        moving = gait.wants_to_move(memory.command, settings)
        phase, stepping = gait.advance(memory.phase, memory.stepping, moving, settings, self.period)
        memory.phase[:], memory.stepping[:] = phase, stepping
        arms, posture = self.references.advance(memory.arms, memory.posture, memory.command, self._grasp, self.period)
        memory.arms[:], memory.posture[:] = arms, posture
        memory.support[:] = self.references.with_swing(posture, phase, stepping)

    def _finish(self, moved: Motion, scored: Scored, ending: Ending) -> None:
        """Writes the results of the step, and begins anew where an episode has ended."""
        memory, buffers = self.memory, self.buffers
        memory.total += scored.reward
        memory.tracking += scored.tracking
        done = ending.done
        buffers["reward"][:] = scored.reward
        buffers["done"][:] = done
        buffers["truncated"][:] = ending.truncated
        self._observe(moved)
        count_step(buffers, scored)
        if not done.any():
            return
        which = np.flatnonzero(done)
        buffers["terminal_observation"][which] = buffers["observation"][which]
        buffers["episode_return"][which] = memory.total[which]
        buffers["episode_length"][which] = memory.steps[which]
        count_endings(buffers, ending, which)
        self._promote(ending, which)
        self._keep_divergences()
        self._begin(which)
        self._observe(self._motion(), which)

    def _promote(self, ending: Ending, which: Indices) -> None:
        """Moves the curriculum level of environments whose episode ended by itself; trials keep theirs."""
        if self._trials is not None:
            return
        memory = self.memory
        moved = next_level(
            self.recipe.task.curriculum,
            memory.level,
            survived=ending.truncated,
            progress=memory.steps / memory.limit,
            tracking=memory.tracking.min(axis=1) / np.maximum(memory.steps, 1),
        )
        chosen = which[~ending.diverged[which]]
        memory.level[chosen] = moved[chosen]

    def _begin(self, which: Indices) -> None:
        """Starts new episodes: commands, references, robot and object."""
        memory, simulation, trials = self.memory, self.simulation, self._trials
        memory.episode[which] += 1
        key = random.absorb(self._key[which], memory.episode[which])
        self._episode_key[which] = key
        scales = difficulty(self.recipe.task.curriculum, memory.level[which])
        memory.steps[which] = 0
        memory.limit[which] = self._time_limits(which, key)
        self._commander.start(which, memory, key)
        command, grasp = memory.command[which], self._grasp[which]
        arms, posture = self.references.start(command, grasp)
        memory.arms[which], memory.posture[which], memory.support[which] = arms, posture, posture
        memory.stepping[which] = False
        halves = np.floor(2.0 * random.uniform(key, "gait/phase", 1)[:, 0])
        memory.phase[which] = np.where(self._commander.scripted[which], 0.0, 0.5 * halves)
        for values in (
            memory.action,
            memory.filtered_velocity,
            memory.tracking,
            memory.total,
        ):
            values[which] = 0.0
        self._height_rate[which] = 0.0
        joints = np.empty((len(which), len(self.robot.joints)))
        joints[:, self._support], joints[:, self._arms] = posture, arms
        if trials is None:
            self._hold(which, scales)
        simulation.reset(which, joints, base_pitch=self.references.start_pitch(posture, command))
        moved = self._motion()
        memory.heading_reference[which] = moved.heading[which]
        memory.object_place[which] = 0.0
        memory.object_place[which] = (moved.object_offset - self._object_place())[which] * self._held[which, None]

    def _time_limits(self, which: Indices, key: Keys) -> NDArray[np.int64]:
        """Time limits of new episodes, (k,) [control steps]."""
        low, high = self.recipe.task.episode_duration
        seconds = low + (high - low) * random.uniform(key, "episode/duration", 1)[:, 0]
        if self._trials is not None:
            seconds = np.array([self._trials[index].duration for index in which])
        return np.maximum(np.round(seconds / self.period), 1).astype(np.int64)

    def _hold(self, which: Indices, scales: Difficulty) -> None:
        """Tells the simulation how hard the new episodes are."""
        self._scales["load_scale"][which] = scales.load
        self._scales["impulse_scale"][which] = self._scales["push_scale"][which] = scales.disturbance
        self.simulation.hold(self._scales)

    def _observe(self, moved: Motion, which: Indices | slice = EVERY) -> None:
        """Writes the rows of s_t and s_priv of some environments."""
        memory, layout = self.memory, self.layout
        self._joint_reference[:, self._support] = memory.support
        self._joint_reference[:, self._arms] = memory.arms
        sensed = Sensed(
            measured=Measured.of(self.simulation.measured),
            command=memory.command,
            joint_reference=self._joint_reference,
            phase=gait.phase_signal(memory.phase, memory.stepping),
            last_action=memory.action,
            support_reference=memory.support,
        )
        rows = np.empty((len(moved.heading[which]), layout.size), np.float32)
        layout.state.gather(sensed, rows[:, layout.observation], which)
        layout.extra.gather(Truth(moved, self.simulation.drawn), rows[:, layout.privileged], which)
        self.buffers["observation"][which] = rows

    def _keep_divergences(self) -> None:
        """Writes simulations that diverged to the folder for replay."""
        kept = self.simulation.divergences
        while kept:
            divergence = kept.popleft()
            if self._divergences is not None:
                self._divergences.mkdir(parents=True, exist_ok=True)
                name = f"divergence-{divergence.environment}-{divergence.episode}-{divergence.step}.npz"
                divergence.save(self._divergences / name)

    def __len__(self) -> int:
        return self.n

    def drawn(self) -> dict[str, Array]:
        """Everything that was drawn for the current episodes, by name, (n,) or (n, k)."""
        return {name: values.copy() for name, values in self.simulation.drawn.items()}

    def levels(self) -> Array:
        """Curriculum levels, (n,)."""
        return self.memory.level.copy()

    def set_levels(self, levels: Array) -> None:
        """Sets the curriculum levels (n,), from the next episodes on."""
        self.memory.level[:] = np.clip(levels, 0.0, self.recipe.task.curriculum.limit)

    def snapshot(self) -> dict[str, Array]:
        """Everything that the future depends on, a row an environment."""
        own = self.memory.arrays() | {
            "key": self._key,
            "episode_key": self._episode_key,
            "height_rate": self._height_rate,
        }
        saved = {f"task/{name}": values.copy() for name, values in own.items()}
        saved |= {f"buffer/{name}": values.copy() for name, values in self.buffers.arrays.items()}
        return saved | self.simulation.snapshot()

    def restore(self, saved: Mapping[str, Array]) -> None:
        """Inverse of `snapshot`: the environments then take bit for bit the same course."""
        self.memory.restore({field: saved[f"task/{field}"] for field in self.memory.arrays()})
        self._key[:], self._episode_key[:] = saved["task/key"], saved["task/episode_key"]
        self._height_rate = saved["task/height_rate"].copy()
        for name, values in self.buffers.arrays.items():
            values[:] = saved[f"buffer/{name}"]
        self.simulation.reseed(self._key)
        self.simulation.restore(saved)


def fixed_values(episodes: Sequence[Episode]) -> dict[str, Array]:
    """What each episode holds fixed, by name, (n,); NaN where an episode leaves a quantity to be drawn."""
    names = sorted({name for episode in episodes for name in episode.fixed})
    return {name: np.array([episode.fixed.get(name, np.nan) for episode in episodes]) for name in names}
