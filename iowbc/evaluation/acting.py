"""The acting policy in the trials of a recipe: a trained one, or the model-based rival."""

from pathlib import Path

from iowbc.evaluation.trials.rollout import Acting
from iowbc.learning.acting import load_policy
from iowbc.robot.description import load_robot
from iowbc.task.specification import Specification


def evaluated_policy(world: Specification, folder: Path | None) -> Acting:
    """The policy that `eval.policy` names; `folder`: the artifact of the stage that trained it, where one did."""
    if folder is not None:
        return load_policy(folder)
    from iowbc.model_based.policy import ModelPolicy

    return ModelPolicy(load_robot(world.robot), world.recipe)
