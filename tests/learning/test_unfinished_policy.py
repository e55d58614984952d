"""A training that goes on shows its newest policy to who only reads."""

from pathlib import Path

import numpy as np
import pytest
from point_masses import MIRRORS, PointMasses

from iowbc.errors import Damaged
from iowbc.learning.acting import policy_of, unfinished_policy
from iowbc.learning.checkpoint import save_checkpoint
from iowbc.learning.ppo import Learner
from iowbc.learning.teacher import TeacherTraining
from iowbc.recipe.teacher import Teacher

KEY = "a key"


@pytest.mark.parametrize("symmetry", ["construction", "none"])
def test_the_newest_whole_checkpoint_acts_as_the_training_does(tmp_path: Path, symmetry: str) -> None:
    settings = Teacher.model_validate(
        {"steps": 512, "environments": 8, "rollout": 16, "minibatches": 2, "hidden": [16], "symmetry": symmetry}
    )
    training, path = (
        TeacherTraining(Learner(settings, PointMasses(), MIRRORS, seed=3)),
        tmp_path / "training.checkpoint",
    )
    acting = []
    for _ in range(2):
        training.update()
        save_checkpoint(path, KEY, training.arrays())
        acting.append(policy_of(training.network()[0]))
    seen = np.random.default_rng(0).normal(size=(5, MIRRORS[0].sign.size)).astype(np.float32)
    none = np.zeros((5, 0), np.float32)

    def shown() -> np.ndarray:
        return unfinished_policy(path, KEY, settings, MIRRORS).act(seen, none)

    np.testing.assert_array_equal(shown(), acting[1].act(seen, none))
    content = path.read_bytes()
    path.write_bytes(content[:-1])
    np.testing.assert_array_equal(shown(), acting[0].act(seen, none))
    assert path.read_bytes() == content[:-1], "who looks on changes nothing"
    with pytest.raises(Damaged, match="no whole checkpoint"):
        unfinished_policy(path, "another key", settings, MIRRORS)
