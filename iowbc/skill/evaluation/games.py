"""The games of `skill-eval`: every skill and rival plays the same episodes."""

import itertools
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd
import torch

from iowbc.arrays import Array
from iowbc.errors import StageFailed
from iowbc.learning.networks import TeacherNetwork
from iowbc.recipe.skill.skill import Skill
from iowbc.skill.game import Observed, TransportGame, play_once
from iowbc.skill.plan import AGENT, Plan, Rule


@dataclass(frozen=True)
class Competitor:
    """A skill, or a rival without one."""

    label: str
    training: str
    """What tells trainings under one label apart."""
    rule: Rule | None
    robot: TeacherNetwork | None
    """The trained policy; None acts as the rule says."""
    controller: str = ""
    """Label of the controller that it commands; empty for that of the recipe."""


@dataclass(frozen=True)
class Case:
    """An episode that every competitor plays."""

    plan: Plan
    episode: int


def cases(skill: Skill, learnt_human: bool) -> list[Case]:
    """All episodes of an evaluation. `learnt_human`: whether there is one to play with."""
    asked, kinds = skill.eval, skill.partners
    partners = asked.partners or (*kinds.training, *kinds.held_out, *([AGENT] if learnt_human else []))
    tasks = {name: getattr(skill.tasks, name) for name in asked.tasks or skill.tasks.names}
    found = []
    for (name, task), known, partner in itertools.product(tasks.items(), asked.known, partners):
        if partner == "follower" and not known:
            continue  # who follows tells nobody where to go
        low, high = task.mass
        masses = asked.masses.get(task.scene) or [low + load * (high - low) for load in asked.loads]
        for mass, episode in itertools.product(masses, range(asked.episodes)):
            found.append(Case(Plan(name, partner, known, mass=mass, seed=asked.seed + episode), episode))
    return found


class Evaluation:
    """Plays competitors in batches of games; a batch that is finished is kept in `work`."""

    def __init__(
        self,
        make: Callable[[str, Sequence[Plan]], TransportGame],
        human: TeacherNetwork | None,
        games: int,
        work: Path,
        interrupted: Callable[[], bool],
    ) -> None:
        """`make`: games of plans on the controller with a label; `human`: the learnt one, the same for every
        competitor; `games`: in a batch."""
        self._make, self._human, self._games, self._work, self._interrupted = make, human, games, work, interrupted

    def batches(self, competitor: Competitor, planned: Sequence[Case]) -> Iterator[pd.DataFrame]:
        """Rows of the episodes, batch by batch, those of one length together.

        Raises Interrupted where the job is asked to stop; finished batches are kept.
        """
        for begin in range(0, len(planned), self._games):
            batch = planned[begin : begin + self._games]
            place = f"{competitor.label} {competitor.training} {begin} {len(batch)}"
            path = self._work / f"{place.replace('/', '-').replace(' ', '_')}.parquet"
            if not path.is_file():
                rows = self._played(competitor, batch)
                partial = path.with_suffix(".part")
                rows.to_parquet(partial, index=False)
                partial.rename(path)
            yield pd.read_parquet(path)

    def _played(self, competitor: Competitor, planned: Sequence[Case]) -> pd.DataFrame:
        """The first episode of a game of each case."""
        plans = [replace(case.plan, rule=competitor.rule) for case in planned]
        with closing(self._make(competitor.controller, plans)) as game:
            _require_fitting(competitor, game.observation_sizes["robot"])
            networks = {"robot": competitor.robot, "human": self._human}

            def act(observed: Observed) -> dict[str, Array]:
                return {
                    agent: acted(network, observed.observations[agent], game.action_sizes[agent])
                    for agent, network in networks.items()
                }

            figures = play_once(game, act, self._interrupted)
        return pd.DataFrame(figures).assign(
            label=competitor.label,
            training=competitor.training,
            episode=[case.episode for case in planned],
            partner=[case.plan.partner for case in planned],
            known=[case.plan.known for case in planned],
        )


def _require_fitting(competitor: Competitor, size: int) -> None:
    if competitor.robot is not None and (own := len(competitor.robot.normalizer.mean)) != size:
        raise StageFailed(
            f"skill.eval.others.{competitor.label}: that skill observes {own} numbers, this game shows {size}; "
            "train it with the same `skill` section and code"
        )


def acted(network: TeacherNetwork | None, observation: Array, size: int) -> Array:
    """The mean action of a policy, (n, size), within its bounds; zero without one."""
    if network is None:
        return np.zeros((len(observation), size), np.float32)
    with torch.inference_mode():
        return np.asarray(network(torch.from_numpy(observation)).clamp(-1.0, 1.0).numpy())
