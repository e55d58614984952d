"""Stage `skill`: a robot and a human learn to transport together, on top of the frozen controller."""

from collections.abc import Iterator, Mapping
from contextlib import closing

from iowbc.errors import StageFailed
from iowbc.learning.curves import TABLE
from iowbc.pipeline.stage import Job, Stage
from iowbc.recipe.recipe import Recipe
from iowbc.stages.inputs import generator_stage, policy_stage, without_student
from iowbc.stages.training import STATE, leave_extendable, train

PANELS = (
    *(
        f"scripted/{name}"
        for name in ("success", "partner_force_p90", "reward", "fallen", "partner_work", "path_error")
    ),
    *(f"learnt/{name}" for name in ("success", "partner_force_p90", "reward")),
    *("robot/kl", "robot/std", "robot/learning_rate", "human/kl", "human/std", "human/learning_rate"),
    *("train/imitation_error", "train/explained_variance", "train/value_loss", "steps_per_second"),
)
"""Shown in the figure of the learning curves."""


def problems(recipe: Recipe) -> Iterator[tuple[str, str]]:
    """Problems: no trained student, or the learnt human among the scripted training partners."""
    yield from without_student(recipe, "skill")
    if "agent" in recipe.skill.partners.training:
        text = "agent: the learnt human joins by skill.learning.scripted_steps and learnt_share; leave it out here"
        yield "skill.partners.training", text


def run(job: Job) -> None:
    """Train robot and human; leave both policies, the exported skill, curves and the state of the training."""
    import torch

    from iowbc.export.folder import write_skill
    from iowbc.learning.storage import save_network
    from iowbc.skill.game import ROBOT, TransportGame
    from iowbc.skill.learner import SkillTraining
    from iowbc.skill.lower_layer import load_student
    from iowbc.task.specification import Specification

    torch.set_num_threads(1)  # the networks are small, and the simulation has the cores
    recipe, settings = job.recipe, job.recipe.skill.learning
    seed = recipe.seed if settings.seed is None else settings.seed
    world = Specification(recipe, job.robot, job.inputs.get("rg-fit")).deployed
    student = load_student(job.inputs[policy_stage(recipe)], world)
    with closing(TransportGame(world, student, n=settings.games, workers=job.workers, seed=seed)) as game:
        training = SkillTraining(settings, game, seed)
        curves = train(job, training, settings.checkpoint_every, _note)
        observations = training.golden_observations(GOLDEN_DECISIONS)
    leave_extendable(job, training)
    for name, agent in training.agents.items():
        save_network(agent.finished(), agent.architecture, job.out, name, {"algorithm": settings.algorithm})
    figures = curves.write_artifact(job.out, f"{recipe.name}: skill", PANELS)
    sources = {stage: folder.name for stage, folder in job.inputs.items()} | {"skill": job.key}
    parity = write_skill(job.out, training.agents[ROBOT].finished(), recipe, sources, observations)
    if not parity <= recipe.export.parity_tolerance:
        raise StageFailed(
            f"parity: the action differs by {parity:.2e} between torch and onnxruntime, export.parity_tolerance is "
            f"{recipe.export.parity_tolerance:.0e}; try another export.opset or raise it"
        )
    job.summarize(figures | {"parity": parity})


def _note(values: Mapping[str, float]) -> str:
    parts = [f"{kind} {100 * values[f'{kind}/success']:.0f} %" for kind in KINDS if f"{kind}/success" in values]
    parts += [f"KL {values['robot/kl']:.3f}"] if "robot/kl" in values else []
    parts += [f"{values['steps_per_second']:,.0f} decisions/s"]
    return ", ".join(parts)


GOLDEN_DECISIONS = 10
"""Decisions of all games whose observations are the golden vectors."""
KINDS = ("scripted", "learnt")
GAME = tuple(
    f"skill.{part}"
    for part in (
        "frequency",
        "tasks",
        "goal_known",
        "robot",
        "human",
        "pursuit",
        "finish",
        "reward",
        "partners.training",
    )
)
"""Dotted recipe paths that decide how a game goes."""

STAGE = Stage(
    name="skill",
    version=1,
    slice=("seed", "rg.height", "simulation", "task", *GAME, "skill.learning", "export.opset"),
    reads=lambda recipe: (*generator_stage(recipe), policy_stage(recipe)),
    run=run,
    problems=problems,
    results=(
        *(f"{agent}.{end}" for agent in ("robot", "human") for end in ("safetensors", "json")),
        "skill.onnx",
        "skill_*",
    ),
    extends="skill.learning.steps",
    extends_from=(STATE, TABLE),
    counts=("skill.learning.steps",),
    headline=("*/success", "*/partner_force_p90"),
    columns=("scripted/success", "scripted/partner_force_p90"),
    curves=("scripted/success", "scripted/partner_force_p90", "scripted/reward", "learnt/success"),
    trained_by="MAPPO",
)
