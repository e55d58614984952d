"""Origins of an artifact: its inputs, the world of its recipe, and the results of its evaluation."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from iowbc.errors import UsageError
from iowbc.pipeline.store.artifact import Artifact
from iowbc.pipeline.store.store import Store
from iowbc.results.table import Table, read_tables
from iowbc.stages.eval import acting_stage
from iowbc.stages.registry import STAGES

if TYPE_CHECKING:
    import pandas as pd

    from iowbc.evaluation.side_by_side import Actor
    from iowbc.task.specification import Specification

TRIALS, PROBE = "trials.parquet", "probe.parquet"


def generator_of(store: Store, artifact: Artifact) -> Artifact | None:
    """The reference generator that a policy was trained on; None for an export, which holds its own, or without one."""
    return None if artifact.manifest.stage == "export" else input_of(store, artifact, "rg-fit")


def policy_of(store: Store, evaluation: Artifact) -> Artifact:
    """The policy that an evaluation played. Raises `UsageError`."""
    trained = (name for name, stage in reversed(STAGES.items()) if stage.presentation.trained_by)
    found = (input_of(store, evaluation, name) for name in trained)
    policy = next(filter(None, found), None)
    if policy is None:
        raise UsageError(f"{evaluation.folder}: this evaluation read no policy; run its recipe again")
    return policy


def input_of(store: Store, artifact: Artifact, stage: str) -> Artifact | None:
    """What an artifact was made from; None where it read nothing of that stage. Raises `UsageError` if it is gone."""
    manifest = artifact.manifest
    return made_from(store, artifact.ingredients, stage, f"{manifest.stage} {manifest.key[:12]}")


def made_from(store: Store, ingredients: Mapping[str, Any], stage: str, what: str) -> Artifact | None:
    """The artifact of a stage among the ingredients of the key of `what`. Raises `UsageError` if it is gone."""
    digest = ingredients.get("inputs", {}).get(stage)
    if digest is None:
        return None
    found = next((one for one in store.artifacts(stage) if one.manifest.digest == digest), None)
    if found is None:
        raise UsageError(
            f"the {stage} (content {digest[:12]}) that {what} was made from is no longer stored; run its recipe again"
        )
    return found


def world_of(resolved: Mapping[str, Any], generator: Artifact | None) -> "Specification":
    """The world that a resolved recipe describes."""
    from iowbc.recipe.recipe import Recipe
    from iowbc.robot.description import robot_folder
    from iowbc.task.specification import Specification

    recipe = Recipe.model_validate(resolved)
    return Specification(recipe, robot_folder(recipe.robot), None if generator is None else generator.folder)


def tables_of(artifact: Artifact) -> list[Table]:
    """The tables that an artifact holds; an evaluation that has them as text alone is read again."""
    found, file = read_tables(artifact.folder / "tables"), artifact.folder / TRIALS
    if found or not file.is_file():
        return found
    import pandas as pd

    from iowbc.evaluation.report.aggregate import aggregate
    from iowbc.evaluation.report.report import report_tables

    trials = pd.read_parquet(file)
    rate = float(artifact.recipe["eval"]["success"]["capacity_rate"])
    return sorted(report_tables(trials, aggregate(trials), rate), key=lambda table: table.name)


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
    policy = policy_of(store, artifact).folder if acting_stage(world.recipe) else None
    return Actor(world, evaluated_policy(world, policy), table)
