"""`iowbc bench train`: the teacher's training against stable-baselines3's PPO over SubprocVecEnv, alternately."""

import time
from functools import partial
from typing import Any

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.vec_env import SubprocVecEnv, VecNormalize

from iowbc.benchmarks.standing_generator import benchmark_world
from iowbc.control.action import action_mirror
from iowbc.learning.computing import prepare_process
from iowbc.learning.perceptron import ACTIVATIONS
from iowbc.learning.ppo import Learner
from iowbc.learning.teacher import TeacherTraining
from iowbc.processes import available_cores
from iowbc.recipe.recipe import Recipe
from iowbc.robot.description import load_robot
from iowbc.task.gym.environment import Environment
from iowbc.task.specification import Specification
from iowbc.task.vector.vector_env import VectorEnv

PARTS = ("simulation", "inference", "learning", "rest")
"""Parts of an update: waiting for environments, inference, gradient steps with their preparation, and the rest."""


def main(recipe: Recipe, *, scene: str = "lift", turns: int = 6, others: int | None = None) -> dict[str, float]:
    """Measures, prints a table, returns every figure by name (rates in environment steps a second, times in s).

    Both trainings alternate, with equally many samples, epochs and minibatches per update and networks of one size.
    Rates are of the best repetition, which other programs disturbed least; the ratio is a median over repetitions.
    `others`: processes of stable-baselines3, each with one environment; by default one a core.
    """
    cores = available_cores()
    with benchmark_world(recipe, scene) as specification:
        recipe, settings = specification.recipe, specification.recipe.teacher
        samples, count = settings.environments * settings.rollout, others or cores
        print(f"{recipe.name}: scene {scene}, networks {list(settings.hidden)}, {settings.environments} environments")
        environments = VectorEnv(specification, num_envs=settings.environments, workers=cores, seed=recipe.seed)
        mirrors = environments.layout.mirror, action_mirror(load_robot(specification.robot))
        other = _plain(specification, scene, count, samples)
        try:
            prepare_process()
            training = TeacherTraining(Learner(settings, environments, mirrors, recipe.seed, cores=cores))
            rows, rates, other_rates = [], [], []
            for _ in range(turns + 1):
                begin = time.perf_counter()
                figures = training.update()
                rates.append(samples / (time.perf_counter() - begin))
                other_rates.append(_other_rate(other))
                rows.append([figures[f"seconds/{part}"] for part in PARTS])
            del rows[0], rates[0], other_rates[0]  # the first update warms up
        finally:
            environments.close()
            other.env.close()
    best = int(np.argmax(rates))
    found = {"train": rates[best]} | {f"seconds_{part}": rows[best][place] for place, part in enumerate(PARTS)}
    print(f"{'this training':34}{rates[best]:10.0f} steps/s")
    for part, seconds in zip(PARTS, rows[best], strict=True):
        print(f"  {part:32}{1e3 * seconds:10.0f} ms an update {100 * seconds / sum(rows[best]):6.1f} %")
    found |= {"sb3": max(other_rates), "ratio": float(np.median(np.divide(rates, other_rates)))}
    print(f"{f'SB3 PPO, SubprocVecEnv of {count}':34}{found['sb3']:10.0f} steps/s")
    print(f"this training is {found['ratio']:.1f} times as fast")
    return found


def _plain(given: Specification, scene: str, count: int, samples: int) -> Any:
    """stable-baselines3's unmodified PPO with the recipe's hyperparameters."""
    settings, make = given.recipe.teacher, partial(Environment, scene, given.recipe, given.robot, given.rg)
    hidden = list(settings.hidden)
    torch.set_num_threads(available_cores())
    steps = max(samples // count, 2)
    model = PPO(
        "MlpPolicy",
        VecNormalize(SubprocVecEnv([make] * count, start_method="forkserver"), gamma=settings.gamma),
        learning_rate=settings.learning_rate,
        n_steps=steps,
        batch_size=steps * count // settings.minibatches,
        n_epochs=settings.epochs,
        device="cpu",
        policy_kwargs={
            "net_arch": {"pi": hidden, "vf": hidden},
            "activation_fn": ACTIVATIONS[settings.activation].module,
        },
    )
    model.set_logger(Logger(folder=None, output_formats=[]))
    return model


def _other_rate(model: Any) -> float:
    """Environment steps a second over one update, on all cores."""
    samples = model.n_steps * model.n_envs
    torch.set_num_threads(available_cores())
    begin = time.perf_counter()
    model.learn(samples, log_interval=None, reset_num_timesteps=False)
    spent = time.perf_counter() - begin
    torch.set_num_threads(1)
    return float(samples / spent)
