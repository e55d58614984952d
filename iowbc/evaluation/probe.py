"""Linear probe of the load: trials with masses spread over a range, and a ridge regression of the mass on features."""

import math
from collections.abc import Callable, Sequence

import numpy as np
import pandas as pd
import torch
from numpy.typing import NDArray
from sklearn.linear_model import Ridge
from sklearn.model_selection import GridSearchCV, GroupKFold
from sklearn.pipeline import Pipeline
from sklearn.preprocessing import StandardScaler

from iowbc.errors import StageFailed
from iowbc.evaluation.trials.plan import command_script, held_fixed, planned_episode
from iowbc.evaluation.trials.rollout import play_episodes
from iowbc.learning.acting import Policy, StudentPolicy
from iowbc.rollouts.policies import History
from iowbc.task.specification import Specification

Features = NDArray[np.float32]
EXACT = 1e-6
"""Tolerance for equal times [s]."""

PENALTIES = tuple(10.0**power for power in range(6))
"""Ridge penalties on standardised features; selected by cross-validation over the training trials."""
FOLDS = 4

COLUMNS = ["source", "trial", "seconds", "settled", "mass", "size", "inferred"]
"""Columns of `probe.parquet`; see `inferred_masses`."""
LATENT, HISTORY, NEWEST, PRIVILEGED = "latent", "history H_t", "newest s_t", "s_priv"
"""Sources from which the mass is inferred."""


class RecordingPolicy:
    """Wrapper of a policy that records its inputs every `every` control steps."""

    def __init__(self, policy: Policy, environments: int, every: int, length: int) -> None:
        """`length`: of the recorded history if the policy has none."""
        self.policy, self.every = policy, every
        self.student = policy.network if isinstance(policy, StudentPolicy) else None
        self.length = policy.network.history if isinstance(policy, StudentPolicy) else length
        self.kept: list[dict[str, Features]] = []
        self._starts = np.ones(environments, np.bool_)
        self._history: History | None = None
        self._steps = 0

    def reset(self, which: NDArray[np.bool_]) -> None:
        self.policy.reset(which)
        self._starts |= which

    def act(self, observation: Features, privileged: Features) -> Features:
        size = observation.shape[1] if self.student is None else self.student.observation
        if self._history is None:
            self._history = History(len(observation), self.length, size)
        frames = self._history.push(observation[:, :size], self._starts)
        self._starts[:] = False
        if self._steps % self.every == 0:
            seen: dict[str, Features] = {}
            if self.student is not None:
                with torch.inference_mode():
                    seen[LATENT] = self.student.read(torch.from_numpy(frames))[1].numpy()
            seen[HISTORY] = frames.reshape(len(frames), -1).copy()
            seen |= {NEWEST: frames[:, -1].copy(), PRIVILEGED: np.array(privileged)}
            self.kept.append(seen)
        self._steps += 1
        return self.policy.act(observation, privileged)


def read(
    world: Specification,
    policy: Policy,
    *,
    workers: int,
    interrupted: Callable[[], bool] = lambda: False,
    progress: Callable[[float], None] = lambda seconds: None,
) -> tuple[dict[str, Features], pd.DataFrame]:
    """Play the trials of `eval.probe`, lightest first; returns the readings of `gathered`. Raises Interrupted."""
    recipe, probe = world.recipe, world.recipe.eval.probe
    assert probe is not None
    held = held_fixed(None, disturbed=recipe.eval.disturbances) | probe.fixed
    held |= held_fixed(probe.partner_share, disturbed=True)
    script, masses = command_script(probe.sequence, recipe.task.commands), np.linspace(*probe.masses, probe.trials)
    episodes = [
        planned_episode(probe.scene, script, mass, probe.seed + number, held)
        for number, mass in enumerate(masses.tolist())
    ]
    frequency = recipe.task.control_frequency
    listener = RecordingPolicy(policy, len(episodes), math.ceil(probe.interval * frequency), recipe.distill.history)
    outcomes = play_episodes(world, episodes, listener, workers=workers, interrupted=interrupted, progress=progress)
    times = np.arange(len(listener.kept)) * listener.every / frequency
    going = times[:, None] < np.array([outcome.seconds for outcome in outcomes])
    return gathered(listener.kept, going, times, masses, listener.length / frequency)


def gathered(
    kept: Sequence[dict[str, Features]],
    going: NDArray[np.bool_],
    times: NDArray[np.float64],
    masses: NDArray[np.float64],
    span: float,
) -> tuple[dict[str, Features], pd.DataFrame]:
    """Readings of all trials without those after a trial's end: features by source, (readings, k), and a table with the
    number of the `trial`, `seconds` since its start with the object in the hands, `settled` (the history no longer
    holds the initial copies of the first observation), and `mass` of the object [kg].

    kept: features at each time, one row per trial; going: True before a trial's end, (times, trials); times: (times,)
    [s]; masses: (trials,) [kg]; span: duration of a history [s].
    """
    moment, trial = np.nonzero(going)
    features = {name: np.stack([seen[name] for seen in kept])[moment, trial] for name in kept[0]}
    seconds = times[moment]
    moments = {"trial": trial, "seconds": seconds, "settled": seconds >= span - EXACT, "mass": masses[trial]}
    return features, pd.DataFrame(moments)


def inferred_masses(features: dict[str, Features], moments: pd.DataFrame) -> pd.DataFrame:
    """Inferred masses in the test trials, one row per reading and source, from readings of `gathered`: `source` and its
    `size`, `trial`, `seconds`, `settled` (True if the history was full), `mass` and `inferred` [kg]. The regression is
    fitted to settled readings of even trials and tested on odd ones. Raises StageFailed if too few last long enough."""
    tested = moments["trial"] % 2 == 1
    fitted = moments[~tested & moments["settled"]]
    lasted = fitted["trial"].nunique()
    if lasted < FOLDS or not (tested & moments["settled"]).any():
        raise StageFailed(
            f"probe: only {lasted} of the trials to be fitted last as long as a history, {FOLDS} must; train longer, "
            "or give lighter masses (eval.probe.masses) or a longer sequence (eval.probe.sequence)"
        )
    tables = []
    for source, given in features.items():
        values = given.astype(np.float64)  # a history's columns are nearly alike: single precision is not enough
        search = GridSearchCV(
            Pipeline([("scale", StandardScaler()), ("ridge", Ridge())]),
            {"ridge__alpha": PENALTIES},
            cv=GroupKFold(FOLDS),
            scoring="neg_mean_squared_error",
        )
        search.fit(values[fitted.index], fitted["mass"].to_numpy(), groups=fitted["trial"].to_numpy())
        found = {"size": values.shape[1], "inferred": search.predict(values[tested])}
        tables.append(moments[tested].assign(**found, source=source)[COLUMNS])
    return pd.concat(tables, ignore_index=True)
