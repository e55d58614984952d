"""The trials of an evaluation, played again exactly as they were to be looked through."""

from collections.abc import Callable
from typing import Any

import pandas as pd

from iowbc.evaluation.side_by_side import Actor
from iowbc.evaluation.trials.batch_policy import in_batch
from iowbc.evaluation.trials.rollout import play_in
from iowbc.evaluation.trials.table import replayed
from iowbc.live.moment import Moment, Witness
from iowbc.live.track import Track
from iowbc.task.vector.vector_env import VectorEnv


def trial_titles(trials: pd.DataFrame) -> list[str]:
    """A name for each row of `trials.parquet`: what was tried, and how it ended."""
    return [_title(row) for _, row in trials.iterrows()]


def _title(row: "pd.Series[Any]") -> str:
    push = f", push {row['impulse']:g} N·s" if row["impulse"] else ""
    case = row["suite"] if row["suite"] == row["case"] else f"{row['suite']}: {row['case']}"
    return f"{case}, {row['mass']:g} kg{push}, trial {row['trial']}: {row['end']} after {row['seconds']:.1f} s"


def played_again(
    actor: Actor,
    row: "pd.Series[Any]",
    interrupted: Callable[[], bool] = lambda: False,
    progress: Callable[[float], None] = lambda seconds: None,
) -> Track:
    """The trial of a row of the actor's table, taken down step by step.

    progress: told the time reached within the trial [s]. Raises Interrupted once `interrupted()` is true.
    """
    environment = VectorEnv(actor.world, num_envs=1, workers=0, seed=0, episodes=(replayed(row),))
    seen: list[Moment] = []
    witness: list[Witness] = []

    def look(seconds: float) -> None:
        if not witness:
            witness.append(Witness(environment))
        seen.append(witness[0].look(seconds))

    try:
        outcome = play_in(environment, in_batch(actor.policy, row), interrupted, progress, look)[0]
        track = Track(
            title=_title(row),
            model=witness[0].model,
            period=environment.period,
            gait_period=1.0 / actor.world.recipe.task.references.gait.frequency,
            held_weight=witness[0].held_weight,
            joints=environment.batch.robot.joints,
            ending=outcome.ending,
        )
    finally:
        environment.close()
    track.moments.extend(seen)
    return track
