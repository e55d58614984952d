"""Plays one episode of every game."""

from collections.abc import Callable, Mapping

import numpy as np

from iowbc.arrays import Array
from iowbc.errors import Interrupted
from iowbc.skill.game import Observed, TransportGame

Actions = Mapping[str, Array]


def nominal(game: TransportGame) -> Callable[[Observed], Actions]:
    """Zero actions: the robot's nominal command, and a human of the actions who stands."""
    still = {agent: np.zeros((game.n, size), np.float32) for agent, size in game.action_sizes.items()}
    return lambda observed: still


def play_once(
    game: TransportGame,
    act: Callable[[Observed], Actions],
    interrupted: Callable[[], bool] = lambda: False,
    look: Callable[[int], None] = lambda decision: None,
) -> dict[str, Array]:
    """Figures of the first episode of every game, (n,) by name, in the order of the games.

    `act` gives the actions for what is observed; `look` is told the number of each decision before it is made. Raises
    Interrupted once `interrupted()` is true.
    """
    observed, decision = game.reset(), 0
    rows: dict[int, dict[str, Array]] = {}
    while len(rows) < game.n:
        if interrupted():
            raise Interrupted(f"stopped after {decision / game.decision_rate:.0f} s of {game.n} games")
        look(decision)
        outcome = game.step(act(observed))
        observed, decision = outcome.observed, decision + 1
        for place, row in enumerate(outcome.figures["environment"].tolist()):
            rows.setdefault(row, {name: values[place] for name, values in outcome.figures.items()})
    return {name: np.array([rows[row][name] for row in range(game.n)]) for name in rows[0]}
