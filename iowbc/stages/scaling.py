"""`iowbc bench scale`: labels and trials on one node of Ray and on two, and what its engine costs."""

import pickle
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch

from iowbc.benchmarks.standing_generator import generator_of
from iowbc.evaluation.trials.plan import Trial, planned_sweeps
from iowbc.evaluation.trials.protocol import Batches
from iowbc.learning.networks import TeacherNetwork
from iowbc.learning.storage import save_network
from iowbc.pipeline.cluster.cluster import Cluster, begun_here
from iowbc.pipeline.cluster.folders import files_of
from iowbc.pipeline.stage import Spread
from iowbc.recipe.evaluation.segment import Segment
from iowbc.recipe.recipe import Recipe
from iowbc.reference.labels.labelling import LabelTask
from iowbc.robot.description import load_robot, robot_folder
from iowbc.stages.rg_dataset import CHUNK
from iowbc.stages.spreading import SHARES, label_everywhere, play_everywhere
from iowbc.task.layout import full_layout

NODES = (1, 2)
"""Nodes of one core each, in turn."""
SHARDS = 4
"""Shards of labels for each node."""
TRIALS = 16
"""Trials in a batch; each node plays `SHARES` batches."""
DURATION = 3.0
"""Length of a trial [s]."""
ROUNDS = 30
"""Pieces that do nothing, one after another, by which the engine is timed."""


@dataclass(frozen=True)
class World:
    """What is played and labelled."""

    recipe: Recipe
    folders: dict[str, Path]
    """What a batch of trials reads."""
    trials: Sequence[Trial]

    @property
    def reads(self) -> int:
        """Bytes that a node fetches once."""
        return sum(len(content) for folder in self.folders.values() for content in files_of(folder).values())

    def batches(self, nodes: int) -> Batches:
        """The same ones for each node."""
        return {f"{node}-{number}": self.trials for node in range(nodes) for number in range(SHARES)}


@dataclass(frozen=True)
class Pace:
    """How fast a cluster was."""

    labels: float
    """Labelled samples a second."""
    trials: float
    """Trials a second."""
    piece: float
    """Time of a piece that does nothing [s]."""


def main(recipe: Recipe | None = None, *, turns: int = 3, say: Callable[[str], None] = print) -> dict[str, float]:
    """Measures, prints the table, returns every figure by name (rates a second, times in ms, sizes in bytes).

    Work grows with the nodes. An efficiency is the median over turns of the rate of two nodes against twice that of one
    in the same turn. What a node does once (it starts, imports, fetches inputs) is left out.
    """
    with _world(recipe or Recipe(name="bench")) as world:
        call = (world.recipe, "0-0", world.trials[:1])
        figures: dict[str, float] = {"inputs_bytes": world.reads, "piece_bytes": len(pickle.dumps(call))}
        measured: list[dict[int, Pace]] = []
        for _ in range(turns):
            turn = {}
            for nodes in NODES:
                with begun_here([1] * nodes, copy=True) as cluster:
                    turn[nodes], figures["answer_bytes"] = _pace(cluster, world, nodes)
            measured.append(turn)
    say(f"{world.recipe.name}: nodes of one core, {turns} turns")
    say(f"{'':10}{'1 node':>12}{'2 nodes':>12}{'efficiency':>12}")
    for name in ("labels", "trials"):
        rates = [[getattr(turn[nodes], name) for nodes in NODES] for turn in measured]
        one, two = (max(turn[place] for turn in rates) for place in range(len(NODES)))
        efficiency = statistics.median(turn[1] / (2 * turn[0]) for turn in rates)
        figures |= {f"{name}_1": one, f"{name}_2": two, f"{name}_efficiency": efficiency}
        say(f"{name + '/s':10}{one:>12.2f}{two:>12.2f}{efficiency:>12.2f}")
    figures["piece_ms"] = 1e3 * min(turn[nodes].piece for turn in measured for nodes in NODES)
    figures["trial_ms"] = 1e3 / figures["trials_1"]
    say(f"engine: {figures['piece_ms']:.1f} ms a piece; a trial takes {figures['trial_ms']:.0f} ms of a core")
    inputs, piece, answer = (figures[f"{name}_bytes"] for name in ("inputs", "piece", "answer"))
    say(f"bytes: {inputs:.0f} once to each node, {piece:.0f} to a piece of one trial, {answer:.0f} back from {TRIALS}")
    return figures


@contextmanager
def _world(recipe: Recipe) -> Iterator[World]:
    """Trials of a few seconds by an untrained policy of the recipe's size."""
    folder = robot_folder(recipe.robot)
    asked = recipe.eval.model_copy(update={"trials": TRIALS, "sequence": (Segment(duration=DURATION, ramp=0.0),)})
    recipe = recipe.model_copy(update={"eval": asked})
    sweep = planned_sweeps(recipe)[0]
    with generator_of(None, folder, recipe) as generator, tempfile.TemporaryDirectory() as place:
        robot = load_robot(folder)
        architecture: dict[str, Any] = {
            "inputs": full_layout(recipe, robot).size,
            "actions": len(robot.support),
            "hidden": list(recipe.teacher.hidden),
            "activation": recipe.teacher.activation,
            "clip": 10.0,
        }
        torch.manual_seed(0)
        save_network(TeacherNetwork(**architecture), architecture, Path(place), "teacher", {})
        folders = {"robot": folder, "policy": Path(place), "generator": generator}
        yield World(recipe, folders, sweep.trials(sweep.sweep.masses[-1:]))


def _pace(cluster: Cluster, world: World, nodes: int) -> tuple[Pace, int]:
    """How fast a cluster is, and the bytes that come back from a batch."""
    spread = cluster.spread(world.folders.values())
    _labelled(spread, world, nodes)  # every node starts what it needs
    list(play_everywhere(spread, world.recipe, world.folders, {str(n): world.trials[:1] for n in range(nodes)}))

    began = time.perf_counter()
    for _ in range(ROUNDS):
        list(spread(_nothing, [(world.recipe, world.trials[:1])], world.folders))
    piece = (time.perf_counter() - began) / ROUNDS

    began = time.perf_counter()
    batches = world.batches(nodes)
    answers = list(play_everywhere(spread, world.recipe, world.folders, batches))
    trials = sum(map(len, batches.values())) / (time.perf_counter() - began)

    began = time.perf_counter()
    labelled = _labelled(spread, world, SHARDS * nodes)
    return Pace(labelled / (time.perf_counter() - began), trials, piece), max(len(content) for _, content in answers)


def _labelled(spread: Spread, world: World, shards: int) -> int:
    """Label some shards; the count of samples."""
    rg = world.recipe.rg
    count = shards * CHUNK[rg.method]
    with tempfile.TemporaryDirectory(prefix="iowbc-bench-") as folder:
        label_everywhere(
            LabelTask(world.folders["robot"], rg, world.recipe.seed, rg.method),
            range(count),
            spread=spread,
            folder=Path(folder),
            key="bench",
            chunk_size=CHUNK[rg.method],
            interrupted=lambda: False,
            progress=lambda done, total: None,
        )
    return count


def _nothing(recipe: Recipe, trials: Sequence[Trial], *, robot: Path, policy: Path, generator: Path) -> None:
    """A piece that has all that one of trials has, and does nothing with it."""
