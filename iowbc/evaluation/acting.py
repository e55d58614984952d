"""The acting policy in the trials of a recipe: a trained one, the model-based rival, or a public controller."""

from pathlib import Path

from iowbc.evaluation.trials.rollout import Acting
from iowbc.learning.acting import load_policy
from iowbc.robot.description import load_robot
from iowbc.task.specification import Specification


def evaluated_policy(world: Specification, folder: Path | None) -> Acting:
    """The policy that `eval.policy` names; `folder`: the artifact of the stage that trained it, where one did."""
    if folder is not None:
        return load_policy(folder)
    robot, recipe = load_robot(world.robot), world.recipe
    if recipe.eval.public is not None:
        from iowbc.adapters.policy import AdaptedPolicy
        from iowbc.adapters.source import load_adapter

        return AdaptedPolicy(recipe.eval.public, load_adapter(recipe.eval.public), robot, recipe.task)
    from iowbc.model_based.policy import ModelPolicy

    return ModelPolicy(robot, recipe)
