"""Terms of the reward in a user's file. Training environments execute it; nothing else does."""

from collections.abc import Callable

from iowbc.arrays import Array
from iowbc.recipe.task.reward import OwnTerm, Reward
from iowbc.task.own_function import load_function
from iowbc.task.rewards.table import Step

CONTRACT = "it takes a Step (iowbc/task/rewards/table.py) and returns a finite number for each environment, shape (n,)"


def load_terms(recipe: Reward) -> dict[str, Callable[[Step], Array]]:
    """The recipe's own terms that have a weight, by name. Raises StageFailed for one that cannot be used."""
    return {name: _term(name, term) for name, term in recipe.own_terms.items()}


def _term(name: str, term: OwnTerm) -> Callable[[Step], Array]:
    function = load_function(f"task.reward.own.{name}", term, CONTRACT)

    def value(step: Step) -> Array:
        count = len(step.command)
        kernels = () if term.width is None else ((count, None),)
        return function(step, (count,), *kernels, excused=step.state.diverged)

    return value
