"""The Markov game of a robot and a human who transport an object: n games at once, over worker processes."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from iowbc.arrays import Array, Keys, Mask
from iowbc.errors import Interrupted
from iowbc.learning.networks import TeacherNetwork
from iowbc.skill.batch import GameBatch
from iowbc.skill.episodes import KINDS, Plan
from iowbc.skill.lower_layer import Student
from iowbc.skill.observation import sizes
from iowbc.skill.outcomes import FIGURES
from iowbc.skill.setup import GameSetup
from iowbc.skill.trained import mean_actions
from iowbc.task.specification import Specification
from iowbc.task.vector.worker import Message
from iowbc.task.vector.workers import InProcess, WorkerProcesses, Workers

PATIENCE = 60.0
"""Time for a decision of all games before a worker counts as hung [s]."""
ROBOT, HUMAN = "robot", "human"
COUNTED = ("success", "fallen", "dropped", "strayed", "diverged", "time_out", "known")

NOMINAL = {ROBOT: None, HUMAN: None}
"""Policies for `play_once` with zero actions: nominal command of the robot, scripted intention of the human agent."""


@dataclass(frozen=True)
class Observed:
    """Observations of agents and critic in n games."""

    observations: Mapping[str, Array]
    """By agent, "robot" and "human", (n, k) float32."""
    state: Array
    """Input of the centralised critic, (n, state_size) float32."""


@dataclass(frozen=True)
class GameOutcome:
    """Result of one decision in n games."""

    observed: Observed
    """After ended episodes have restarted."""
    reward: Array
    """Shared by both agents, (n,) float32."""
    terminated: Mask
    truncated: Mask
    """Ended by success, failure or divergence; by the time limit, (n,)."""
    final: Observed
    """Before ended episodes have restarted."""
    figures: Mapping[str, Array]
    """Metrics `FIGURES` of the k episodes that ended, in the order of the games, (k,); task and partner are names."""


class TransportGame:
    """n games. Results depend on the seed and the game's number, not on the number of workers."""

    agents = (ROBOT, HUMAN)

    def __init__(
        self,
        specification: Specification,
        student: Student,
        *,
        n: int,
        workers: int = 0,
        seed: int = 0,
        partners: Sequence[str] | None = None,
        plans: Sequence[Plan] | None = None,
    ) -> None:
        """`workers`: processes; 0 runs the games here. `partners`: humans to sample, those of training by default.
        `plans`: one per game instead. Raises UsageError for an unknown name, WorkerFailed if a worker dies or hangs."""
        skill = specification.recipe.skill
        drawn = skill.partners.training if partners is None else partners
        planned = None if plans is None else tuple(plans)
        self.setup = GameSetup(specification, student, n, seed, tuple(drawn), planned)
        self.n, self.decision_rate = n, skill.frequency
        self.observation_sizes = dict(sizes(skill))
        self.state_size = self.observation_sizes.pop("state")
        self._workers: Workers = WorkerProcesses(self.setup, workers, PATIENCE) if workers else InProcess(self.setup)
        self._buffers = self._workers.buffers
        self.action_sizes = {agent: self._buffers[f"action/{agent}"].shape[1] for agent in self.agents}

    @property
    def batch(self) -> GameBatch:
        """The games, if they run in this process (`workers` 0)."""
        if not isinstance(self._workers, InProcess):
            raise AttributeError("the games live in worker processes; make the game with workers=0")
        return self._workers.batch

    @property
    def human_acts(self) -> Mask:
        """Games in whose current episode the human agent acts, (n,)."""
        return self._buffers["human_acts"].copy()

    @property
    def privileged_actions(self) -> Array:
        """Actions that reproduce the command of a robot that knows the path, (n, 11); zero unless the robot follows."""
        return self._buffers["privileged_action"].copy()

    def reset(self, seeds: Keys | None = None, agent_share: float = 0.0) -> Observed:
        """Starts the first episode of every game, the same each time, or that of the seeds (n,) uint64. `agent_share`:
        fraction of the sampled episodes from now on in which the human agent acts."""
        own = [None if seeds is None else seeds[first:last] for first, last in self._workers.groups]
        self._workers.call([Message(GameBatch.reset, (part, agent_share)) for part in own])
        return self._observed("now")

    def step(self, actions: Mapping[str, Array]) -> GameOutcome:
        """One decision; actions by agent, (n, k) in [-1, 1]. Raises ValueError if not finite or of another shape."""
        self.act(actions)
        self._workers.call([Message(GameBatch.step)] * len(self._workers.groups))
        return self.outcome()

    def act(self, actions: Mapping[str, Array]) -> None:
        """Sets the actions of the next decision; see `step`."""
        for agent in self.agents:
            buffer, given = self._buffers[f"action/{agent}"], np.asarray(actions[agent], np.float32)
            if given.shape != buffer.shape or not np.isfinite(given).all():
                text = f"shape {given.shape}" if given.shape != buffer.shape else "values that are not finite"
                raise ValueError(f"actions of {agent} have {text}; expected finite ones of shape {buffer.shape}")
            buffer[:] = given

    def outcome(self) -> GameOutcome:
        reward, terminated, truncated = (self._buffers[name].copy() for name in ("reward", "terminated", "truncated"))
        figures = self._figures(np.flatnonzero(terminated | truncated))
        return GameOutcome(self._observed("now"), reward, terminated, truncated, self._observed("final"), figures)

    def close(self) -> None:
        self._workers.close()

    def _observed(self, time: str) -> Observed:
        rows = {name: self._buffers[f"{time}/{name}"].copy() for name in (*self.agents, "state")}
        return Observed({agent: rows[agent] for agent in self.agents}, rows["state"])

    def _figures(self, which: Array) -> dict[str, Array]:
        values: dict[str, Array] = dict(zip(FIGURES, self._buffers["figures"][which].T, strict=True))
        values |= {name: values[name] > 0.0 for name in COUNTED}
        names = {"task": list(self.setup.tasks), "partner": list(KINDS)}
        values |= {name: np.array(known, object)[values[name].astype(np.int64)] for name, known in names.items()}
        return values | {name: values[name].astype(np.int64) for name in ("environment", "episode")}


def play_once(
    game: TransportGame, networks: Mapping[str, TeacherNetwork | None], interrupted: Callable[[], bool] = lambda: False
) -> dict[str, Array]:
    """Metrics of every game's first episode, (n,) by name, with `mean_actions`. Raises Interrupted if asked to."""
    observed, decision = game.reset(), 0
    rows: dict[int, dict[str, Array]] = {}
    while len(rows) < game.n:
        if interrupted():
            raise Interrupted(f"stopped after {decision / game.decision_rate:.0f} s of {game.n} games")
        outcome = game.step(mean_actions(networks, observed.observations, game.action_sizes))
        observed, decision = outcome.observed, decision + 1
        for place, row in enumerate(outcome.figures["environment"].tolist()):
            rows.setdefault(row, {name: values[place] for name, values in outcome.figures.items()})
    return {name: np.array([rows[row][name] for row in range(game.n)]) for name in rows[0]}
