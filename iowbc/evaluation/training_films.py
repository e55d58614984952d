"""Films of a policy while it trains: the same trial of its check, each time a further part of the training is done."""

from collections.abc import Callable
from contextlib import closing
from pathlib import Path

from iowbc.errors import NoRenderer
from iowbc.evaluation.films import film_episode, written_film
from iowbc.evaluation.trials.plan import Trial
from iowbc.evaluation.trials.rollout import Acting
from iowbc.recipe.evaluation.evaluation import Video
from iowbc.task.specification import Specification
from iowbc.task.vector.vector_env import VectorEnv

SMALL = Video(width=480, height=368, fps=10)
"""A film of 10 s takes some 15 s to draw without a graphics card, and 0.4 MB."""


class TrainingFilms:
    """The films that are due. An existing one is not made again."""

    def __init__(self, world: Specification, trial: Trial, folder: Path, parts: int) -> None:
        """`parts`: into which a training is divided; a film is due after each."""
        self.world, self.trial, self.folder, self.parts = world, trial, folder, parts

    def due(self, steps: int, planned: int) -> Path | None:
        """The newest film that is due after so many of the planned steps, if it is missing."""
        part = min(steps, planned) * self.parts // planned
        if not part:
            return None
        path = self.folder / f"{part * planned // self.parts:010}_steps.mp4"
        return None if path.exists() else path

    def make(self, path: Path, policy: Acting, say: Callable[[str], None]) -> bool:
        """Plays the trial and films it; where nothing can be drawn it says so once, and none is due any more."""
        title = f"{self.trial.case}, {self.trial.mass:g} kg, after {int(path.name.partition('_')[0]):,} steps"
        episodes = (self.trial.episode,)
        try:
            with (
                closing(VectorEnv(self.world, num_envs=1, workers=0, seed=0, episodes=episodes)) as environment,
                written_film(path, SMALL.fps) as add,
            ):
                film_episode(environment, policy, add, SMALL, title)
        except NoRenderer as reason:
            say(f"no films: {reason}")
            self.parts = 0
            return False
        return True
