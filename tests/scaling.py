"""`make scale`: labels, trials and rollouts on one node of Ray and on two, and the cost of its engine."""

import argparse
import pickle
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import psutil
import torch
from local_nodes import connected_nodes, spread_over

from iowbc.benchmarks.standing_generator import generator_of
from iowbc.evaluation.trials.plan import Trial, planned_sweeps
from iowbc.evaluation.trials.protocol import Batches
from iowbc.files import folder_files
from iowbc.learning.as_numpy import numpy_policy
from iowbc.learning.networks import TeacherNetwork
from iowbc.learning.storage import load_teacher, save_network
from iowbc.recipe.evaluation.sequences import Segment
from iowbc.recipe.reading.loading import load_recipe
from iowbc.recipe.recipe import Recipe
from iowbc.reference.labels.pool import LabelTask, label_all
from iowbc.robot.description import load_robot, robot_folder
from iowbc.rollouts.blocks import block_size
from iowbc.rollouts.rollout import ExploringPolicy
from iowbc.stages.environments import RemoteWorkers
from iowbc.stages.eval import play_everywhere
from iowbc.stages.rg_dataset import CHUNK, SHARES, label_everywhere
from iowbc.task.layout import full_layout
from iowbc.task.specification import Specification
from iowbc.task.vector.vector_env import VectorEnv

if TYPE_CHECKING:
    from iowbc.pipeline.cluster.cluster import Cluster
    from iowbc.pipeline.cluster.spread import NodeSpread

NODES = (1, 2)
"""Nodes of one core each, in turn."""
SHARDS = 4
"""Shards of labels for each node."""
TRIALS = 16
"""Trials in a batch; each node plays `SHARES` batches."""
DURATION = 3.0
"""Length of a trial [s]."""
ENVIRONMENTS = 48
"""Environments of a training for each node."""
ROLLOUTS = 3
"""Rollouts that are timed."""
ROUNDS = 30
"""Pieces that do nothing, one after another, by which the engine is timed."""


@dataclass(frozen=True)
class Workload:
    """What is played and labelled."""

    recipe: Recipe
    folders: dict[str, Path]
    """What a batch of trials reads."""
    trials: Sequence[Trial]

    @property
    def reads(self) -> int:
        """Bytes that a node fetches once."""
        return sum(path.stat().st_size for folder in self.folders.values() for path in folder_files(folder))

    def batches(self, nodes: int) -> Batches:
        """The same ones for each node."""
        return {f"{node}-{number}": self.trials for node in range(nodes) for number in range(SHARES)}


@dataclass(frozen=True)
class Throughput:
    """How fast a cluster made some number of things."""

    count: int
    seconds: float
    used: float
    """Processor time of everything that took part [s]."""

    @property
    def rate(self) -> float:
        """Things a second."""
        return self.count / self.seconds

    @property
    def a_core(self) -> float:
        """Things a second of processor time: what a core gives that is not shared with other programs."""
        return self.count / self.used


KINDS = ("labels", "trials", "rollouts")
Turn = dict[int, dict[str, Throughput]]
"""Paces of `KINDS` (rollouts in environment steps) and `pieces` (that do nothing) by the number of nodes."""


def main(recipe: Recipe | None = None, *, turns: int = 3, say: Callable[[str], None] = print) -> dict[str, float]:
    """Measures, prints the table, returns every figure by name (rates a second, times in ms, sizes in bytes).

    Work grows with the nodes. An efficiency is the median over turns of the rate of two nodes against twice that of one
    in the same turn. What a node does once (it starts, imports, fetches inputs) is left out.
    """
    with _world(recipe or Recipe(name="bench")) as world:
        call = (world.recipe, "0-0", world.trials[:1])
        figures: dict[str, float] = {"inputs_bytes": world.reads, "piece_bytes": len(pickle.dumps(call))}
        measured: list[Turn] = []
        for _ in range(turns):
            turn: Turn = {}
            for nodes in NODES:
                with connected_nodes([1] * nodes) as cluster:
                    turn[nodes], sizes = _paces(cluster, world, nodes)
                    figures |= sizes
            measured.append(turn)
    say(f"{world.recipe.name}: nodes of one core, {turns} turns; a second, and a second of a core's time")
    say(f"{'':10}{'1 node':>10}{'2 nodes':>10}{'efficiency':>12}{'a core, 1':>12}{'a core, 2':>12}")
    for name in KINDS:
        rates = [max(turn[nodes][name].rate for turn in measured) for nodes in NODES]
        cores = [max(turn[nodes][name].a_core for turn in measured) for nodes in NODES]
        efficiency = statistics.median(turn[2][name].rate / (2 * turn[1][name].rate) for turn in measured)
        figures |= {f"{name}_{nodes}": rate for nodes, rate in zip(NODES, rates, strict=True)}
        figures |= {f"{name}_a_core_{nodes}": rate for nodes, rate in zip(NODES, cores, strict=True)}
        figures[f"{name}_efficiency"] = efficiency
        say(f"{name:10}{rates[0]:>10.2f}{rates[1]:>10.2f}{efficiency:>12.2f}{cores[0]:>12.2f}{cores[1]:>12.2f}")
    figures["piece_ms"] = 1e3 / max(turn[nodes]["pieces"].rate for turn in measured for nodes in NODES)
    figures["trial_ms"] = 1e3 / figures["trials_1"]
    say(f"engine: {figures['piece_ms']:.1f} ms a piece; a trial takes {figures['trial_ms']:.0f} ms of a core")
    inputs, piece, answer = (figures[f"{name}_bytes"] for name in ("inputs", "piece", "answer"))
    say(f"bytes: {inputs:.0f} once to each node, {piece:.0f} to a piece of one trial, {answer:.0f} back from {TRIALS}")
    down, up = figures["policy_bytes"], figures["rollout_bytes"]
    say(f"bytes an update: {down:.0f} to an actor of {ENVIRONMENTS} environments, {up:.0f} back")
    return figures


@contextmanager
def _world(recipe: Recipe) -> Iterator[Workload]:
    """Trials of a few seconds by an untrained policy of the recipe's size."""
    folder = robot_folder(recipe.robot)
    asked = recipe.eval.model_copy(update={"trials": TRIALS, "sequence": (Segment(duration=DURATION, ramp=0.0),)})
    recipe = recipe.model_copy(update={"eval": asked})
    sweep = planned_sweeps(recipe)[0]
    with generator_of(folder, recipe) as generator, tempfile.TemporaryDirectory() as place:
        robot = load_robot(folder)
        layout = full_layout(recipe, robot)
        architecture: dict[str, Any] = {
            "inputs": layout.size,
            "actions": len(robot.support),
            "hidden": list(recipe.teacher.hidden),
            "activation": recipe.teacher.activation,
            "clip": 10.0,
        }
        torch.manual_seed(0)
        save_network(
            TeacherNetwork(**architecture), architecture, Path(place), "teacher", {"layout": layout.describe()}
        )
        folders = {"robot": folder, "policy": Path(place), "generator": generator}
        yield Workload(recipe, folders, sweep.trials(sweep.sweep.masses[-1:]))


def _paces(cluster: "Cluster", world: Workload, nodes: int) -> tuple[dict[str, Throughput], dict[str, float]]:
    """How fast a cluster is, and the bytes of what passes between its nodes."""
    spread = spread_over(cluster, world.folders.values())

    def played(batches: Batches) -> list[tuple[str, bytes]]:
        return list(play_everywhere(spread, world.recipe, world.folders, batches))

    def nothing() -> None:
        for _ in range(ROUNDS):
            list(spread(_nothing, [(world.recipe, world.trials[:1])], world.folders))

    _label(spread, world, nodes)  # every node starts what it needs
    played({str(node): world.trials[:1] for node in range(nodes)})
    batches, answers = world.batches(nodes), list[tuple[str, bytes]]()
    paces = {
        "pieces": _timed(ROUNDS, nothing),
        "trials": _timed(sum(map(len, batches.values())), lambda: answers.extend(played(batches))),
        "labels": _timed(SHARDS * nodes * CHUNK[world.recipe.rg.method], lambda: _label(spread, world, SHARDS * nodes)),
    }
    paces["rollouts"], sizes = _rolled(spread, world, nodes)
    return paces, sizes | {"answer_bytes": max(len(content) for _, content in answers)}


def _rolled(spread: "NodeSpread", world: Workload, nodes: int) -> tuple[Throughput, dict[str, float]]:
    """How fast a training's rollouts are made, one actor on each node; and the bytes of an update, of one actor."""
    recipe, count = world.recipe, ENVIRONMENTS * nodes
    specification = Specification(recipe, world.folders["robot"], world.folders["generator"])
    policy = numpy_policy(load_teacher(world.folders["policy"])[0])
    environments = VectorEnv(specification, num_envs=count, workers=partial(RemoteWorkers, spread, nodes), seed=0)
    with closing(environments):
        environments.reset()
        steps, actions = recipe.teacher.rollout, environments.action_space.shape[0]
        noise = np.random.default_rng(0).normal(0.0, recipe.teacher.initial_std, (steps, count, actions))
        rollout_policy = ExploringPolicy(policy, noise.astype(np.float32), block_size(count))
        found = environments.roll(rollout_policy, steps)
        sizes = {
            "policy_bytes": len(pickle.dumps(rollout_policy.part(*environments.workers.groups[0]))),
            "rollout_bytes": len(pickle.dumps((found, environments.state()))) / nodes,
        }
        return _timed(ROLLOUTS * steps * count, lambda: _repeat(environments, rollout_policy, steps)), sizes


def _repeat(environments: VectorEnv, rollout_policy: ExploringPolicy, steps: int) -> None:
    for _ in range(ROLLOUTS):
        environments.roll(rollout_policy, steps)


def _timed(count: int, work: Callable[[], None]) -> Throughput:
    began, used = time.perf_counter(), _processor_time()
    work()
    return Throughput(count, time.perf_counter() - began, _processor_time() - used)


def _processor_time() -> float:
    """Processor time so far of this process, of Ray's, and of those that they have seen end [s]."""
    total = 0.0
    for process in (psutil.Process(), *psutil.Process().children(recursive=True)):
        with suppress(psutil.NoSuchProcess):
            total += sum(process.cpu_times()[:4])  # user, system, and both of its children
    return total


def _label(spread: "NodeSpread", world: Workload, shards: int) -> None:
    """Label some shards."""
    rg = world.recipe.rg
    with tempfile.TemporaryDirectory(prefix="iowbc-bench-") as folder:
        task, size = LabelTask(world.folders["robot"], rg, world.recipe.seed, rg.method), CHUNK[rg.method]
        elsewhere = partial(label_everywhere, spread, task, "bench", size)
        numbers = range(shards * size)
        label_all(task, numbers, folder=Path(folder), key="bench", chunk_size=size, elsewhere=elsewhere)


def _nothing(recipe: Recipe, trials: Sequence[Trial], *, robot: Path, policy: Path, generator: Path) -> None:
    """A piece that has all that one of trials has, and does nothing with it."""


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--recipe", type=Path, help="The default recipe if empty.")
    parser.add_argument("--turns", type=int, default=3, help="Number of repetitions.")
    asked = parser.parse_args()
    main(None if asked.recipe is None else load_recipe(asked.recipe).recipe, turns=asked.turns)
