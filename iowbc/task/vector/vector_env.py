"""The vector environment: a stable-baselines3 `VecEnv` over worker processes with many environments each."""

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv

from iowbc.arrays import Array
from iowbc.robot.description import load_robot
from iowbc.rollouts.rollout import RolloutPolicy, Trajectories, roll, side_by_side
from iowbc.task.batch import Batch
from iowbc.task.curriculum import AXES
from iowbc.task.episodes import Episode
from iowbc.task.layout import full_layout, load_parts
from iowbc.task.record.signals import SIGNALS
from iowbc.task.record.statistics import REASONS, Statistics
from iowbc.task.rewards.reward import load_terms, term_names
from iowbc.task.specification import Specification
from iowbc.task.vector.setup import Setup
from iowbc.task.vector.shared import join, split
from iowbc.task.vector.worker import Message
from iowbc.task.vector.workers import InProcess, WorkerProcesses, Workers

Indices = None | int | Iterable[int]

PATIENCE = 15.0
"""Timeout of a step, after which a worker counts as hung [s]; a step takes milliseconds."""


class VectorEnv(VecEnv):  # type: ignore[misc]
    """Environments of a recipe. Rows of observations are [s_t | s_priv], see `layout`; actions are residuals a."""

    def __init__(
        self,
        specification: Specification,
        *,
        num_envs: int,
        workers: int | Callable[[Setup], Workers],
        seed: int,
        episodes: Sequence[Episode] | None = None,
        group: int = 1,
        patience: float = PATIENCE,
    ) -> None:
        """`workers`: number of processes, 0 to step in this one, or a factory of `Workers`. `episodes`: one per
        environment, restarted by every reset. `group`: size of the groups within which `copy` may copy states.

        The rollout does not depend on `workers`. Raises WorkerFailed when a worker dies, hangs for `patience` [s] or
        raises, and StageFailed where a function in a user's file cannot be used: a part of s_priv, or a term of the
        reward where episodes are drawn.
        """
        trials = None if episodes is None else tuple(episodes)
        self.setup = Setup(specification, num_envs, seed, trials, group)
        recipe = specification.recipe
        self.layout = full_layout(recipe, load_robot(specification.robot))
        load_parts(recipe.task.observation)  # errors in them are raised here, before processes start
        if trials is None:
            load_terms(recipe.task.reward)
        self._scenes = self.setup.scenes
        if callable(workers):
            self.workers = workers(self.setup)
        else:
            self.workers = WorkerProcesses(self.setup, workers, patience) if workers else InProcess(self.setup)
        self._buffers = self.workers.buffers
        self.signals: dict[str, Array] = {
            name.removeprefix("signal/"): values for name, values in self._buffers.items() if name.startswith("signal/")
        }
        """Values of the last step, before an automatic reset, (num_envs, k); see `iowbc.task.record.signals`."""
        self.period = 1.0 / recipe.task.control_frequency
        """Time of a control step [s]."""
        self._statistics = Statistics(self.period, self._scenes, term_names(recipe.task.reward))
        self._began = time.monotonic()
        bound, actions = recipe.task.action.bound, self._buffers["action"].shape[1]
        super().__init__(
            num_envs,
            spaces.Box(-np.inf, np.inf, (self.layout.size,), np.float32),
            spaces.Box(-bound, bound, (actions,), np.float32),
        )

    @property
    def batch(self) -> Batch:
        """The environments themselves, where they are stepped in this process."""
        if not isinstance(self.workers, InProcess):
            raise AttributeError(
                "the environments live in worker processes; make the vector environment with workers=0"
            )
        return self.workers.batch

    def reset(self) -> NDArray[np.float32]:
        """Starts an episode in every environment; after a call of `seed`, with those seeds."""
        seeds = None if self._seeds[0] is None else np.array(self._seeds, np.uint64)
        parts = [None if seeds is None else seeds[first:last] for first, last in self.workers.groups]
        self.workers.call([Message(Batch.reset, (part,)) for part in parts])
        self._reset_seeds()
        self._reset_options()
        return self._buffers["observation"].copy()

    def step_async(self, actions: NDArray[Any]) -> None:
        """Begins a step; actions (num_envs, actions). Raises ValueError where one is not finite."""
        given = np.asarray(actions, np.float32)
        if given.shape != self._buffers["action"].shape:
            raise ValueError(f"actions have shape {given.shape}, expected {self._buffers['action'].shape}")
        if not np.isfinite(given).all():
            rows = np.flatnonzero(~np.isfinite(given).all(axis=1))
            raise ValueError(f"actions of environments {rows.tolist()} are not finite, the first is {given[rows[0]]}")
        self._buffers["action"][:] = given
        self.workers.ask([Message(Batch.step) for _ in self.workers.groups])

    def step_wait(self) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_], list[dict[str, Any]]]:
        """Results of the step: observations, rewards, dones, infos; ended environments have been reset."""
        self.workers.answers()
        buffers = self._buffers
        done = buffers["done"].copy()
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for index in np.flatnonzero(done).tolist():
            infos[index] = self._ending(index)
        return buffers["observation"].copy(), buffers["reward"].copy(), done, infos

    def roll(self, rollout_policy: RolloutPolicy, steps: int) -> Trajectories:
        """Runs a rollout of some control steps, with one message to each worker; the same whatever their number."""
        messages = [Message(roll, (rollout_policy.part(*group), steps)) for group in self.workers.groups]
        return side_by_side(self.workers.call(messages))

    def _ending(self, index: int) -> dict[str, Any]:
        """Info of an episode's end for stable-baselines3, with the reason."""
        buffers, truncated = self._buffers, bool(self._buffers["truncated"][index])
        reason = "time_limit" if truncated else next(r for r in REASONS if r in SIGNALS and self.signals[r][index, 0])
        return {
            "terminal_observation": buffers["terminal_observation"][index].copy(),
            "TimeLimit.truncated": truncated,
            "end": reason,
            "episode": {
                "r": float(buffers["episode_return"][index]),
                "l": int(buffers["episode_length"][index]),
                "t": round(time.monotonic() - self._began, 6),
            },
        }

    def statistics(self) -> dict[str, float]:
        """Statistics since the last call; see `Statistics`."""
        return self._statistics.read(self._buffers["counters"], self._buffers["terms"], self._levels())

    def drawn(self) -> dict[str, Array]:
        """Everything that was drawn for the current episodes, by name, (num_envs,) or (num_envs, k)."""
        return join(self._read(Batch.drawn))

    def curriculum(self) -> dict[str, Any]:
        """State of the curriculum for JSON: the levels of each axis in each scene, ascending."""
        levels, scenes = self._levels(), np.array(self._scenes)
        return {
            "levels": {
                name: {axis: sorted(levels[scenes == name, place].tolist()) for place, axis in enumerate(AXES)}
                for name in dict.fromkeys(self._scenes)
            }
        }

    def set_curriculum(self, curriculum: Mapping[str, Any]) -> None:
        """Spreads the levels of another vector environment's `curriculum` over the environments of each scene, unless
        the recipe does not inherit them."""
        if not self.setup.specification.recipe.task.curriculum.inherit:
            return
        known: Mapping[str, Mapping[str, Sequence[float]]] = curriculum["levels"]
        every = {axis: [level for levels in known.values() for level in levels[axis]] for axis in AXES}
        scenes, levels = np.array(self._scenes), np.empty((self.num_envs, len(AXES)))
        for name in dict.fromkeys(self._scenes):
            rows = np.flatnonzero(scenes == name)
            for place, axis in enumerate(AXES):
                quantiles = (np.arange(len(rows)) + 0.5) / len(rows)
                levels[rows, place] = np.quantile(known.get(name, every)[axis], quantiles)
        self._set_levels(levels)

    def state(self) -> dict[str, Array]:
        """Complete state; independent of the number of workers."""
        return join(self._read(Batch.snapshot)) | {"statistics": self._statistics.carried.copy()}

    def restore(self, state: Mapping[str, Array]) -> None:
        """Inverse of `state`: the environments then continue bit for bit. Raises ValueError if it is of others."""
        own = dict(state)
        carried = own.pop("statistics")
        parts = split(own, [self._scenes[first:last] for first, last in self.workers.groups])
        for name, values in self.state().items():
            if name not in state or state[name].shape != values.shape:
                raise ValueError(f"environments have another '{name}'")
        self._statistics.carried[:] = carried
        self.workers.call([Message(Batch.restore, (part,)) for part in parts])
        self._reset_seeds()

    def copy(self, source: NDArray[np.int64]) -> NDArray[np.float32]:
        """Each environment continues from the state of environment `source`, (num_envs,), of its own group, see
        `Batch.copy`. Returns observations."""
        parts = [source[first:last] - first for first, last in self.workers.groups]
        self.workers.call([Message(Batch.copy, (part,)) for part in parts])
        return self._buffers["observation"].copy()

    def close(self) -> None:
        self.workers.close()

    def get_attr(self, attr_name: str, indices: Indices = None) -> list[Any]:
        """`render_mode`, `scene`, `level`, or an attribute of this vector environment, for each environment."""
        rows = self._get_indices(indices)
        if attr_name == "render_mode":
            return [None for _ in rows]
        if attr_name == "scene":
            return [self._scenes[row] for row in rows]
        if attr_name == "level":
            return [dict(zip(AXES, level, strict=True)) for level in self._levels()[list(rows)].tolist()]
        if attr_name in ("observation_space", "action_space", "layout"):
            return [getattr(self, attr_name) for _ in rows]
        names = "scene, level, layout, observation_space, action_space, render_mode"
        raise AttributeError(f"environments have no attribute {attr_name!r}; there are {names}")

    def set_attr(self, attr_name: str, value: Any, indices: Indices = None) -> None:
        """Sets the curriculum `level`, from the next episodes on: a number for all axes, or numbers of some by name."""
        if attr_name != "level":
            raise AttributeError(f"{attr_name!r} of an environment cannot be set; `level` can")
        levels = self._levels()
        rows = list(self._get_indices(indices))
        axes = value if isinstance(value, Mapping) else dict.fromkeys(AXES, value)
        for axis, level in axes.items():
            if axis not in AXES:
                raise ValueError(f"the curriculum has no axis {axis!r}; there are {', '.join(AXES)}")
            levels[rows, AXES.index(axis)] = level
        self._set_levels(levels)

    def env_method(
        self, method_name: str, *method_args: Any, indices: Indices = None, **method_kwargs: Any
    ) -> list[Any]:
        """`drawn()`: what was drawn for the episode of each environment, by name."""
        if method_name != "drawn" or method_args or method_kwargs:
            raise AttributeError(f"environments have no method {method_name!r} with these arguments; there is drawn()")
        drawn = self.drawn()
        return [{name: values[row] for name, values in drawn.items()} for row in self._get_indices(indices)]

    def env_is_wrapped(
        self, wrapper_class: type[gymnasium.Wrapper[Any, Any, Any, Any]], indices: Indices = None
    ) -> list[bool]:
        """Never: the environments are arrays."""
        return [False for _ in self._get_indices(indices)]

    def _set_levels(self, levels: Array) -> None:
        levels = np.clip(levels, 0.0, self.setup.specification.recipe.task.curriculum.limit)
        parts = [levels[first:last] for first, last in self.workers.groups]
        self.workers.call([Message(Batch.set_levels, (part,)) for part in parts])

    def _levels(self) -> Array:
        return np.concatenate(self._read(Batch.levels))

    def _read(self, method: Callable[[Batch], Any]) -> list[Any]:
        """Results of a read-only method of each group of environments."""
        return self.workers.call([Message(method, changes=False) for _ in self.workers.groups])
