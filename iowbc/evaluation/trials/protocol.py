"""Evaluation protocol: trials of all suites in batches over all workers, resumable after each batch."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field, replace
from io import BytesIO
from pathlib import Path

import numpy as np
import pandas as pd

from iowbc.evaluation.trials.metrics import trial_row
from iowbc.evaluation.trials.plan import Trial, case_trials, compliance_trials, map_trials, planned_sweeps, push_trials
from iowbc.evaluation.trials.rollout import PolicyInBatch, play_episodes
from iowbc.files import data_digest, newest_checked, write_checked
from iowbc.learning.acting import Policy, load_policy
from iowbc.recipe.recipe import Recipe, with_scenes
from iowbc.recipe.task.joint_references import Grasps, Loads
from iowbc.robot.description import load_robot
from iowbc.rollouts.blocks import shares_in_blocks
from iowbc.task.layout import full_layout
from iowbc.task.specification import Specification


def evaluated_world(specification: Specification) -> Specification:
    """Specification of a recipe's trials: simulation of `eval.simulation`, default that of training, and engine of
    `eval.engine`. Unless the policy is a teacher, s_priv has no user-defined parts. With a public controller, the robot
    has its gains and default posture. Raises StageFailed if such a controller cannot be used."""
    recipe = specification.recipe
    world = specification if recipe.eval.policy == "teacher" else specification.deployed
    if recipe.eval.simulation is not None:
        world = replace(world, recipe=world.recipe.model_copy(update={"simulation": recipe.eval.simulation}))
    if recipe.eval.public is not None:
        from iowbc.adapters.source import adapted_robot

        robot = adapted_robot(recipe.eval.public, load_robot(world.robot), recipe.task)
        world = replace(world, robot=robot, public=recipe.eval.public)
    if recipe.eval.engine == "drake":
        world = replace(world, drake=recipe.eval.drake)
    return replace(world, recipe=_with_trial_scenes(world.recipe)) if recipe.eval.scenes else world


def _with_trial_scenes(recipe: Recipe) -> Recipe:
    """The recipe with the scenes of `eval.scenes`, their grasps and loads."""
    further, simulation, task = recipe.eval.scenes, recipe.simulation, recipe.task
    references = task.references
    usual, grasps, loads = references.loads.lift, dict(references.grasps), dict(references.loads)
    grasps |= {name: own.wrists for name, own in further.items()}
    loads |= {name: usual if own.load is None else own.load for name, own in further.items()}
    own = {"grasps": Grasps.model_validate(grasps), "loads": Loads.model_validate(loads)}
    scenes = {"scenes": with_scenes(simulation.scenes, further)}
    return recipe.model_copy(
        update={
            "simulation": simulation.model_copy(update=scenes),
            "task": task.model_copy(update={"references": references.model_copy(update=own)}),
        }
    )


def evaluated_policy(world: Specification, folder: Path | None) -> Policy:
    """The policy of `eval.policy`: trained (`folder`: artifact of its stage), model-based, or a public controller."""
    robot, recipe = load_robot(world.robot), world.recipe
    if folder is not None:
        return load_policy(folder, full_layout(recipe, robot).describe())
    if recipe.eval.public is not None:
        from iowbc.adapters.policy import AdaptedPolicy
        from iowbc.adapters.source import load_adapter

        return AdaptedPolicy(recipe.eval.public, load_adapter(recipe.eval.public), robot, recipe.task)
    from iowbc.model_based.policy import ModelPolicy

    return ModelPolicy(robot, recipe)


Batches = Mapping[str, Sequence[Trial]]
"""Trials of each batch, by name of the batch."""


@dataclass(eq=False)
class Protocol:
    """Plays the trials of a recipe's `eval` section; finished batches are cached in `work`.

    First come all trials of the recipe, then, one mass per round, those beyond the end of sweeps that still succeed.
    """

    world: Specification
    policy: Policy
    _: KW_ONLY
    work: Path
    workers: int
    interrupted: Callable[[], bool] = lambda: False
    progress: Callable[[float, float, str], None] = lambda done, total, note: None
    """Receives the trials done, the trials planned so far, and a note."""
    elsewhere: Callable[[Batches], Iterator[tuple[str, bytes]]] | None = None
    """Plays batches on other machines and yields the name and the result of `played` of each."""
    done: int = field(init=False, default=0)
    total: int = field(init=False, default=0)

    def run(self) -> pd.DataFrame:
        """All trials, one row each, by suite, mass and order of play, as in `trials.parquet`. Raises Interrupted."""
        recipe = self.world.recipe
        sweeps = planned_sweeps(recipe)
        named = [trial for sweep in sweeps for trial in sweep.named()]
        for planned in (case_trials, push_trials, compliance_trials, map_trials):
            named += planned(recipe)
        tables = [self._round(0, named)]
        going = [(sweep, sweep.masses[-1]) for sweep in sweeps]
        while going := [
            (sweep, heavier)
            for sweep, last in going
            if _succeeds(tables[-1], sweep.suite, last) and (heavier := sweep.heavier(last)) is not None
        ]:
            further = [trial for sweep, mass in going for trial in sweep.trials([mass])]
            tables.append(self._round(len(tables), further))
        suites = list(dict.fromkeys(trial.suite for trial in named))
        labelled = pd.concat(tables).assign(variant=recipe.eval.label)  # batches may come from before a change of it
        return labelled.sort_values(
            ["suite", "mass"],
            key=lambda values: values.map(suites.index) if values.name == "suite" else values,
            ignore_index=True,
        )

    def _round(self, number: int, trials: Sequence[Trial]) -> pd.DataFrame:
        """Play trials in batches, if possible on other machines; returns their table."""
        self.total += len(trials)
        found = batched_by_duration(trials, self.world.recipe.eval.batch)
        batches = {f"trials-{number}-{place}": batch for place, batch in enumerate(found)}
        if self.elsewhere is not None:
            missing = {name: own for name, own in batches.items() if self._finished(name, own) is None}
            ready = self.done + len(trials) - sum(map(len, missing.values()))
            for name, content in self.elsewhere(missing):
                write_checked(self._file(name), _content(missing[name]), content)
                ready += len(missing[name])
                self.progress(ready, self.total, _suites(missing[name]))
        tables = [self._batch(name, batch) for name, batch in batches.items()]
        return pd.concat(tables, ignore_index=True)

    def _file(self, name: str) -> Path:
        """Cache file of a finished batch."""
        return self.work / f"{name}.batch"

    def _finished(self, name: str, trials: Sequence[Trial]) -> bytes | None:
        """A finished batch of these trials, as `played` returns it."""
        return newest_checked(self._file(name), _content(trials))[0]

    def _batch(self, name: str, trials: Sequence[Trial]) -> pd.DataFrame:
        suites, content = _suites(trials), self._finished(name, trials)
        if content is None:
            longest = max(trial.episode.duration for trial in trials)

            def progress(seconds: float) -> None:
                reached = self.done + len(trials) * min(seconds / longest, 1.0)
                self.progress(reached, self.total, f"{suites}, {seconds:.0f} s")

            content = played(self.world, self.policy, trials, self.workers, self.interrupted, progress)
            write_checked(self._file(name), _content(trials), content)
        self.done += len(trials)
        if self.elsewhere is None:
            self.progress(self.done, self.total, suites)
        return pd.read_parquet(BytesIO(content))


def played(
    world: Specification,
    policy: Policy,
    trials: Sequence[Trial],
    workers: int,
    interrupted: Callable[[], bool] = lambda: False,
    progress: Callable[[float], None] = lambda seconds: None,
) -> bytes:
    """Play one batch; returns its rows of the long table as a Parquet file. See `play_episodes`."""
    recipe, size, places = world.recipe, world.recipe.eval.batch, np.arange(len(trials))
    in_batch, episodes = PolicyInBatch(policy, size, places), [trial.episode for trial in trials]
    outcomes = play_episodes(world, episodes, in_batch, workers=workers, interrupted=interrupted, progress=progress)
    robot = load_robot(world.robot)
    rows = [trial_row(recipe, robot, trial, outcome) for trial, outcome in zip(trials, outcomes, strict=True)]
    return pd.DataFrame(rows).assign(batch_size=size, batch_row=places).to_parquet(index=False)


def batched_by_duration(trials: Sequence[Trial], size: int) -> Iterator[list[Trial]]:
    """Nearly equal batches of at most `size` trials, all of one duration, so that no trial waits for a longer one."""
    durations = [round(trial.episode.duration, 3) for trial in trials]
    for duration in sorted(set(durations)):
        alike = [trial for trial, own in zip(trials, durations, strict=True) if own == duration]
        for first, last in shares_in_blocks(len(alike), math.ceil(len(alike) / size), 1):
            yield alike[first:last]


def _content(trials: Sequence[Trial]) -> str:
    """Digest of a batch's trials, to which its file is bound: a resumed stage may plan others."""
    return data_digest([[one.suite, one.case, one.mass, one.number, one.episode.as_json()] for one in trials])


def _suites(trials: Sequence[Trial]) -> str:
    return ", ".join(dict.fromkeys(trial.suite for trial in trials))


def _succeeds(table: pd.DataFrame, suite: str, mass: float) -> bool:
    return bool(table.loc[(table["suite"] == suite) & (table["mass"] == mass), "succeeded"].any())
