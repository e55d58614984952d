"""Stage `teacher`: PPO with privileged information on the vector environment, resumable at every checkpoint."""

from collections.abc import Iterator, Mapping
from contextlib import ExitStack, closing
from pathlib import Path
from typing import TYPE_CHECKING

from iowbc.errors import StageFailed
from iowbc.learning.curves import TABLE
from iowbc.pipeline.stage import START, ExternalInput, Job, Stage
from iowbc.recipe.recipe import Recipe
from iowbc.stages.inputs import generator_stage, not_privileged
from iowbc.stages.training import STATE, leave_extendable, rolls_elsewhere, train

if TYPE_CHECKING:
    from iowbc.evaluation.trials.quick import QuickEvaluation
    from iowbc.learning.teacher import TeacherTraining
    from iowbc.task.specification import Specification
    from iowbc.task.vector.vector_env import VectorEnv

PANELS = (
    *("episode_seconds", "terminations/fallen", "terminations/dropped", "reward", "curriculum_level"),
    *(f"check/{name}" for name in ("score", "survived", "E_v", "transport")),
    *(f"train/{name}" for name in ("kl", "clip_share", "learning_rate", "std", "explained_variance", "gain")),
    "steps_per_second",
)
"""Shown in the figure of the learning curves, before the reward's terms."""


def problems(recipe: Recipe) -> Iterator[tuple[str, str]]:
    """Problems: names that are not in s_priv, or that are taken twice."""
    yield from not_privileged(recipe, "teacher.value_only", recipe.teacher.value_only)
    if recipe.task.observation.own:
        from iowbc.task.layout import taken_names

        yield from taken_names(recipe.task.observation)


def borrows(recipe: Recipe) -> Mapping[str, ExternalInput]:
    """The teacher or student that training begins from."""
    path, named = recipe.teacher.beginning
    stage = "teacher" if path == "teacher.start" else "distill"
    return {} if named is None else {START: ExternalInput(path, named, stage)}


def run(job: Job) -> None:
    """Train the teacher; leave its best network, normalisation, curves, and an SB3 zip for users' own code."""
    import torch

    from iowbc.control.action import action_mirror
    from iowbc.learning.computing import prepare_process
    from iowbc.learning.environments import HistoryEnvironments
    from iowbc.learning.ppo import Learner
    from iowbc.learning.storage import save_network
    from iowbc.learning.teacher import TeacherTraining
    from iowbc.processes import available_cores
    from iowbc.robot.description import load_robot
    from iowbc.stages.environments import training_environments
    from iowbc.task.specification import Specification

    prepare_process()
    recipe, settings = job.recipe, job.recipe.teacher
    if recipe.execution.device != "cpu" and not torch.cuda.is_available():
        wanted = f"execution.device: {recipe.execution.device}"
        raise StageFailed(f"{wanted}: this torch ({torch.__version__}) finds no graphics card; `cpu` needs none")
    seed = recipe.seed if settings.seed is None else settings.seed
    world = Specification(recipe, job.robot, job.inputs.get("rg-fit"))
    with ExitStack() as open_ones:
        environments = training_environments(job, count=settings.environments, seed=seed, group=settings.group)
        open_ones.enter_context(closing(environments))
        score = None
        if settings.check.every is not None:
            check = open_ones.enter_context(closing(check_of(world, job.workers)))
            score = check.play
        rows = environments
        if settings.history is not None:
            rows = HistoryEnvironments(environments, environments.layout.state.size, settings.history.length)
        learner = Learner(
            settings,
            rows,
            (environments.layout.mirror, action_mirror(load_robot(job.robot))),
            seed,
            cores=available_cores(),
            value_only=environments.layout.privileged_places(settings.value_only).tolist(),
            device=recipe.execution.device,
        )
        training = TeacherTraining(learner, score, job.report.say)
        if START in job.inputs:
            _begin(training, environments, job.inputs[START])
        curves = train(job, training, settings.checkpoint_every, _note)
        leave_extendable(job, training)
        training.keep_best()
        about = {"layout": environments.layout.describe(), "curriculum": environments.curriculum()}

    network, architecture = training.network()
    save_network(network, architecture, job.out, "teacher", about)
    training.model.save_for_sb3(job.out / "teacher_sb3.zip")
    terms = sorted({name for row in curves.rows for name in row if name.startswith(("level/", "falls/", "reward/"))})
    figures = curves.write_artifact(job.out, f"{recipe.name}: teacher", PANELS, terms)
    kept = {"best_score": training.best.score} if settings.check.every is not None else {}
    job.summarize(kept | figures)


def _begin(training: "TeacherTraining", environments: "VectorEnv", start: Path) -> None:
    """Initialise a training from another one's network. Raises StageFailed if the observations differ."""
    from iowbc.learning.storage import load_network

    network, about = load_network(start)
    if about["layout"] != environments.layout.describe():
        path, _ = training.settings.beginning
        raise StageFailed(f"{path}: that policy observes something else; leave the observation as it was")
    training.begin(network)
    if "curriculum" in about:  # missing in students of earlier versions
        environments.set_curriculum(about["curriculum"])


def check_of(world: "Specification", workers: int) -> "QuickEvaluation":
    """The recipe's evaluation during training. It depends on `teacher.check` and the task, not on `eval`."""
    from iowbc.evaluation.trials.quick import QuickEvaluation, quick_trials
    from iowbc.recipe.evaluation.evaluation import Evaluation
    from iowbc.task.specification import Specification

    check, shares = world.recipe.teacher.check, world.recipe.task.scenes
    recipe = world.recipe.model_copy(update={"eval": Evaluation(sequence=check.sequence, scripts=check.scripts)})
    own = Specification(recipe, world.robot, world.rg)
    played = {"lift": check.lifting, "push": check.pushing} | check.others
    trials = [
        trial
        for scene, masses in played.items()
        if getattr(shares, scene, 0.0) > 0.0
        for trial in quick_trials(own, scene, masses, check.trials, check.seed)
    ]
    trials = trials or quick_trials(own, "lift", (0.0,), check.trials, check.seed)
    return QuickEvaluation(own, trials, check, workers=min(workers, len(trials)))


def _note(values: Mapping[str, float]) -> str:
    return (
        f"{values['episode_seconds']:.1f} s an episode, {100 * values['terminations/fallen']:.0f} % fall, "
        f"level {values['curriculum_level']:.2f}, KL {values.get('train/kl', float('nan')):.3f}, "
        f"{values['steps_per_second']:,.0f} steps/s"
    )


STAGE = Stage(
    name="teacher",
    version=3,
    slice=("seed", "rg.height", "simulation", "task", "teacher"),
    reads=generator_stage,
    run=run,
    problems=problems,
    results=("teacher.safetensors", "teacher.json"),
    extends="teacher.steps",
    extends_from=(STATE, TABLE),
    borrows=borrows,
    counts=("teacher.steps",),
    headline=("best_score", "check/survived", "episode_seconds"),
    columns=("best_score",),
    curves=("reward", "episode_seconds", "terminations/fallen", "curriculum_level", "check/score", "check/E_v"),
    trained_by="PPO",
    leaves_policy=True,
    spreads=rolls_elsewhere,
)
