"""The weighted sum of the terms, with its parts."""

from collections.abc import Callable
from operator import attrgetter

import numpy as np

from iowbc.arrays import Array, Mask
from iowbc.recipe.task.reward import CustomTerm, Reward
from iowbc.task.own_function import load_function
from iowbc.task.rewards.table import ONCE, TERMS, TRACKED, Step, Term

CONTRACT = "it takes a Step (iowbc/task/rewards/table.py) and returns a finite number for each environment, shape (n,)"


def term_names(recipe: Reward) -> tuple[str, ...]:
    """Names of all terms: those of the table by dotted path, then user-defined ones that have a weight."""
    return (*TERMS, *(f"own.{name}" for name in recipe.own_terms))


class RewardFunction:
    """The reward of a recipe. Terms without a weight, now or later, are computed only if they are in `TRACKED`."""

    def __init__(self, recipe: Reward, period: float, *, own: bool = False) -> None:
        """`period`: control period [s]; `own`: execute the user-defined terms, which are zero otherwise. Raises
        StageFailed for one that cannot be used."""
        self._weights, self._change = np.zeros((2, len(TERMS) + len(recipe.own_terms)))
        """Rewards per control step for the value 1, and their later change."""
        self._terms: list[tuple[int, Term, float | None]] = []
        """Columns of the terms to compute, their functions, and widths of the kernels."""
        seconds = dict.fromkeys(ONCE, 1.0) | {path: 0.0 for path in TERMS if path.partition(".")[0] in recipe.without}
        functions = TERMS | (load_terms(recipe) if own else {})
        settings = {path: attrgetter(path)(recipe) for path in TERMS}
        settings |= {f"own.{name}": term for name, term in recipe.own_terms.items()}
        self._later, later = recipe.later, recipe.later.weights if recipe.later else {}
        for column, (path, function) in enumerate(functions.items()):
            setting, given = settings[path], seconds.get(path, period)
            weight, width = (setting, None) if isinstance(setting, float | int) else (setting.weight, setting.width)
            weight *= given
            self._weights[column] = weight
            self._change[column] = later[path] * given - weight if path in later else 0.0
            if weight != 0.0 or path in TRACKED or path in later:
                self._terms.append((column, function, width))
        self._tracked, self._once = ([[*functions].index(path) for path in paths] for paths in (TRACKED, ONCE))

    def __call__(self, step: Step, diverged: Mask, level: Array) -> tuple[Array, Array]:
        """Each term's part of the reward of a step, (n, terms), and scores of the terms `TRACKED`, (n, tracked).
        `level`: of locomotion, (n,). `diverged` environments, (n,), get the penalty of a fall and no other term."""
        terms = np.zeros((len(step.command), len(self._weights)))
        for column, function, width in self._terms:
            value = np.asarray(function(step))
            value = value if width is None else kernel(value, width)
            terms[:, column] = value if value.ndim == 1 else value.sum(axis=1)
        if diverged.any():
            terms[diverged] = 0.0
            terms[diverged, self._once] = 1.0
        tracking = terms[:, self._tracked]
        weights, later = self._weights, self._later
        if later is not None:
            part = ((level - later.begin) / (later.end - later.begin)).clip(0.0, 1.0)
            weights = weights + part[:, None] * self._change
        terms *= weights
        return terms, tracking


def kernel(squared_error: Array, width: float | Array) -> Array:
    """exp(−e²/width²), (n,) or (n, k): 1 without error, 0.37 at an error of `width`, one or (k,)."""
    return np.exp(squared_error / -(width * width))


def load_terms(recipe: Reward) -> dict[str, Callable[[Step], Array]]:
    """User-defined terms with a weight, by path; executes their file. Raises StageFailed if one cannot be used."""
    return {f"own.{name}": _own_term(f"task.reward.own.{name}", term) for name, term in recipe.own_terms.items()}


def _own_term(path: str, term: CustomTerm) -> Callable[[Step], Array]:
    function = load_function(path, term, CONTRACT)

    def value(step: Step) -> Array:
        count = len(step.command)
        kernels = () if term.width is None else ((count, None),)
        return function(step, (count,), *kernels, excused=step.state.diverged)

    return value
