"""Films of trials: plays a trial again from its row of the table and draws it."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from iowbc.evaluation.protocol import replayed
from iowbc.evaluation.rollout import Acting, Played, play_in
from iowbc.evaluation.video import Film, with_text
from iowbc.recipe.evaluation import Video
from iowbc.recipe.recipe import Recipe
from iowbc.sim.rendering import SceneRenderer
from iowbc.task.episode import Episode
from iowbc.task.vector_env import VectorEnv

NOT_WORD = str.maketrans({" ": "_", "/": "_"})


def filmed(trials: pd.DataFrame, count: int) -> list[tuple[str, "pd.Series[Any]"]]:
    """The trials to film, with names: the first trial of up to `count` masses, spread over all of them."""
    first = trials[trials["trial"] == 0]
    places = np.unique(np.linspace(0, len(first) - 1, min(count, len(first))).round().astype(int)) if count else []
    rows = [first.iloc[place] for place in places]
    return [(f"{row['case']}_{row['mass']:g}kg".translate(NOT_WORD), row) for row in rows]


def film_episode(
    recipe: Recipe,
    robot: Path,
    rg: Path | None,
    policy: Acting,
    row: "pd.Series[Any]",
    path: Path,
    interrupted: Callable[[], bool] = lambda: False,
) -> Played:
    """Play the trial of a row again and film it. Raises Stopped when interrupted."""
    episode = replayed(row)
    environment = VectorEnv(recipe, robot, rg=rg, num_envs=1, workers=0, seed=0, episodes=(episode,))
    try:
        with FilmedEnvironment(environment, path, recipe.eval.video, title(row, recipe)) as film:
            return play_in(environment, recipe, policy, interrupted, look=film.look)
    finally:
        environment.close()
