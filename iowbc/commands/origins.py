"""What an artifact was made from, and the world that its recipe describes."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from iowbc.errors import UsageError
from iowbc.pipeline.store.artifact import Artifact
from iowbc.pipeline.store.store import Store
from iowbc.stages.registry import STAGES

if TYPE_CHECKING:
    from iowbc.task.specification import Specification


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
