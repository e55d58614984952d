"""Commands that somebody gives in the viewer."""

from iowbc.task.commands.steered import SteeredCommander
from iowbc.task.specification import Specification
from iowbc.task.vector.vector_env import VectorEnv


class Helm:
    """Steers the one environment of a vector environment."""

    def __init__(self, world: Specification, environment: VectorEnv) -> None:
        """Takes over from the environment's own commander."""
        batch = environment.batch
        self.wanted = SteeredCommander(world.recipe, batch.guidance, batch.scenes, environment.period).wanted[0]
        """The command to approach, (11,)."""
