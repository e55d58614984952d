"""The trained teacher in stable-baselines3: `python examples/teacher_in_sb3.py quickstart/teacher`.

`teacher_sb3.zip` is for code of your own that speaks stable-baselines3: to look at the policy, or to train it on. Its
networks normalise their observations themselves, so they take what the environment gives: no VecNormalize around it.
Reading it executes what is pickled in it: only open files that you trust. iowbc itself never reads it.
"""

import sys
from pathlib import Path

from stable_baselines3 import PPO

from iowbc import open_artifact
from iowbc.recipe.recipe import Recipe
from iowbc.task.gym.environment import Environment


def hold(policy: Path, environment: Environment) -> int:
    """Let the policy in an SB3 zip play an episode; returns the steps that it lasted."""
    model = PPO.load(policy, device="cpu")
    observation, _ = environment.reset(seed=1)
    steps, ended = 0, False
    while not ended:
        action, _ = model.predict(observation, deterministic=True)
        observation, _, terminated, truncated, _ = environment.step(action)
        ended, steps = terminated or truncated, steps + 1
    return steps


if __name__ == "__main__":
    word, runs = sys.argv[1], sys.argv[2] if len(sys.argv) > 2 else "runs"
    teacher, generator = open_artifact(word, runs), open_artifact(word.replace("/teacher", "/rg-fit"), runs)
    policy = teacher.folder / "teacher_sb3.zip"
    if not policy.is_file():
        sys.exit(f"{word}: what is published has no teacher_sb3.zip; `iowbc run` with --until teacher trains one")
    world = Environment("lift", Recipe.model_validate(teacher.recipe), rg=generator.folder)
    print(f"{word} held the box for {hold(policy, world)} steps")
