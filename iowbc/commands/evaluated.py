"""What an evaluation played: its world, its policy, its trials, to be played again."""

from typing import TYPE_CHECKING

from iowbc.commands.origins import input_of, policy_of, world_of
from iowbc.errors import UsageError
from iowbc.pipeline.store.artifact import Artifact
from iowbc.pipeline.store.store import Store

if TYPE_CHECKING:
    import pandas as pd

    from iowbc.evaluation.side_by_side import Actor

TRIALS, PROBE = "trials.parquet", "probe.parquet"


def evaluated_actor(store: Store, artifact: Artifact, trials: "pd.DataFrame | None" = None) -> "Actor":
    """The actor of an artifact of `eval`; `trials`: its table, if it is read already. Raises `UsageError`."""
    import pandas as pd

    from iowbc.evaluation.acting import evaluated_policy
    from iowbc.evaluation.side_by_side import Actor
    from iowbc.evaluation.trials.protocol import evaluated_world

    if trials is None and not (artifact.folder / TRIALS).is_file():
        raise UsageError(f"{artifact.folder} has none: its recipe asks for a probe alone")
    table = pd.read_parquet(artifact.folder / TRIALS) if trials is None else trials
    world = evaluated_world(world_of(artifact.recipe, input_of(store, artifact, "rg-fit")))
    policy = None if world.recipe.eval.policy == "model" else policy_of(store, artifact).folder
    return Actor(world, evaluated_policy(world, policy), table)
