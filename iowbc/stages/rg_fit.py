"""Stage rg-fit: fits the reference generator to the labels and judges it on held-out samples."""

from iowbc.errors import StageFailed
from iowbc.pipeline.stage import Job, Stage
from iowbc.stages.rg_dataset import LABELLED

WORST_SHOWN = 5


def run(job: Job) -> None:
    """Leaves `rg.safetensors`, `rg.json`, `feasible.npz`, `summary.json` and figures."""
    import numpy as np

    from iowbc.control.feasible_map import FeasibleMap
    from iowbc.control.generator import ReferenceNetwork
    from iowbc.reference.fit.errors import check_fit, measure_jumps, task_errors
    from iowbc.reference.fit.fitting import fit, prepare
    from iowbc.reference.labels.dataset import Dataset
    from iowbc.reference.labels.plan import SamplePlan
    from iowbc.reference.pictures.figures import error_figures, gentle_figure, learning_figure
    from iowbc.reference.region import measure_smooth_region
    from iowbc.robot.description import load_robot

    rg, source = job.recipe.rg, job.inputs["rg-dataset"]
    robot = load_robot(job.robot)
    dataset = Dataset.load(source / "dataset.npz")
    labelled = FeasibleMap.load(source / LABELLED)
    prepared = prepare(dataset, robot, rg, job.recipe.seed, job.interrupted)
    job.report.say(f"{len(prepared.train.inputs)} training samples, {len(prepared.held_out)} held out")

    def epoch_done(epoch: int, training: float, validation: float) -> None:
        job.report.metrics({"loss": training, "validation_loss": validation}, epoch)
        job.report.progress(epoch, rg.fit.epochs, f"validation loss {validation:.2e}")

    fitted = fit(prepared.train, prepared.validation, rg.fit, job.recipe.seed, epoch_done, job.interrupted)
    numbers = {name: getattr(fitted, name) for name in ("input_mean", "input_std", "output_mean", "output_std")}
    ReferenceNetwork.of(robot, rg.height, layers=fitted.layers, **numbers).save(job.out)
    network = ReferenceNetwork.load(job.out)
    plan = SamplePlan(robot, rg, job.recipe.seed)
    learnt = prepared.training[dataset.index[prepared.training] < plan.drawn]
    try:
        feasible, jump = measure_smooth_region(plan, labelled, network, dataset.arm[learnt])
    except ValueError as error:
        raise StageFailed(f"{error}; or raise rg.feasible.jump") from error
    feasible.save(job.out / "feasible.npz")

    held = prepared.held_out
    predicted = network(dataset.arm[held], dataset.command[held])
    errors = task_errors(prepared.support, [prepared.samples[i] for i in held], predicted.astype(np.float64))
    jumps = measure_jumps(network, rg, feasible, dataset.arm[held], job.recipe.seed)
    verdict = check_fit(rg.fit.gates, dataset, held, predicted, errors, jumps)
    samples = {"training": len(prepared.train.inputs), "held_out": len(held), "best_epoch": fitted.epochs}
    job.summarize(verdict.metrics, gates=verdict.gates, worst=verdict.worst, samples=samples)
    job.report.metrics(verdict.metrics, fitted.epochs)
    figures = job.out / "figures"
    error_figures(figures, dataset.support[held], predicted, errors, jumps, rg.fit.gates, network.outputs)
    gentle_figure(figures, plan, feasible, jump, labelled)
    learning_figure(figures, fitted.training_loss, fitted.validation_loss)
    if verdict.failures:
        raise StageFailed(
            "the reference generator misses its gates on held-out samples: "
            + "; ".join(verdict.failures)
            + f". Worst samples: {'; '.join(verdict.worst[:WORST_SHOWN])}. Use more samples "
            "(rg.sampling.samples) or epochs (rg.fit.epochs), or loosen rg.fit.gates openly"
        )


STAGE = Stage(
    name="rg-fit",
    version=4,
    slice=("seed", "rg.fit", "rg.height", "rg.sampling", "rg.problem", "rg.feasible"),
    reads=lambda recipe: ("rg-dataset",),
    run=run,
    results=("rg.safetensors", "rg.json", "feasible.npz"),
    counts=("rg.sampling.samples", "rg.fit.epochs"),
    headline=("joint_rmse", "height_p95", "foot_p95"),
    columns=("joint_rmse",),
)
