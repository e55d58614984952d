"""Stage `export`: the control step as an ONNX graph, its contract and golden vectors, checked and tried out."""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING

from iowbc.errors import Interrupted, StageFailed
from iowbc.pipeline.stage import Job, Stage
from iowbc.recipe.export import Export
from iowbc.stages.inputs import generator_stage, policy_stage, without_student

if TYPE_CHECKING:
    from iowbc.evaluation.exported import Accepted


def run(job: Job) -> None:
    """Export, compare the graph with torch, and play the acceptance trials with the exported controller."""

    import numpy as np
    import torch

    from iowbc.control.observation import OBJECT, observation_layout
    from iowbc.control.references import ReferenceLayer
    from iowbc.deploy import contract, exported_folder
    from iowbc.deploy.controller import open_session
    from iowbc.deploy.controller import run as run_onnx
    from iowbc.deploy.timing import step_seconds
    from iowbc.evaluation.exported import ExportedPolicy, golden_inputs, run_acceptance
    from iowbc.export import golden
    from iowbc.export.folder import write_folder
    from iowbc.export.graph import ControllerGraph, run_torch
    from iowbc.learning.acting import policy_of
    from iowbc.learning.storage import load_student_network, require_layout
    from iowbc.robot.description import load_robot
    from iowbc.task.specification import Specification

    torch.set_num_threads(1)  # as on the robot, where the controller uses one thread
    rg, trained = job.inputs.get("rg-fit"), job.inputs[policy_stage(job.recipe)]
    student, about = load_student_network(trained)
    robot, task = load_robot(job.robot), job.recipe.task
    sees_object = OBJECT[0].name in {part["name"] for part in about["layout"]["observation"]}
    references, layout = ReferenceLayer(robot, task.references, rg), observation_layout(robot, sees_object)
    require_layout(trained, about, {"observation": layout.describe()})
    graph = ControllerGraph(student, robot, task, layout, references)
    sources = {stage: folder.name for stage, folder in job.inputs.items()} | {"export": job.key}
    statement = write_folder(job.out, graph, job.recipe, rg, sources)
    try:
        world = Specification(job.recipe, job.robot, rg).deployed
        policy, played = run_acceptance(world, partial(ExportedPolicy, job.out), job.interrupted)
        by_torch = policy_of(student)
        _, expected = run_acceptance(world, lambda environment: by_torch, job.interrupted)
        steps = golden_inputs(world, job.out, job.interrupted)
    except Interrupted as stopped:
        raise Interrupted(f"export: {stopped}; it starts anew, which takes less than a minute") from stopped
    inputs = golden.stacked(steps)
    by_graph = golden.played(partial(run_torch, graph.settle), partial(run_torch, graph.step), inputs)
    golden.write_golden(inputs, by_graph, job.out / exported_folder.GOLDEN)
    settle, step = (open_session(job.out / name) for name in (exported_folder.SETTLE, exported_folder.STEP))
    by_onnx = golden.played(partial(run_onnx, settle), partial(run_onnx, step), inputs)
    differences = golden.largest_difference(by_graph, by_onnx)
    seconds = step_seconds(job.out, job.recipe.export.timing_steps)[:, 0]
    metrics = {
        "parity": max(differences.values()),
        "target_difference": policy.largest_difference,
        "step_ms": float(1e3 * np.median(seconds)),
        "step_p99_ms": float(1e3 * np.quantile(seconds, 0.99)),
        "graph_kB": (job.out / exported_folder.STEP).stat().st_size / 1e3,
        "acceptance_trials": float(sum(each.asked.trials for each in played)),
        "acceptance_survived": float(sum(each.survived for each in played)),
        "acceptance_passed": float(sum(each.passed for each in played)),
        **{
            f"errors_differ/{place}": each.differs_from(other)
            for place, (each, other) in enumerate(zip(played, expected, strict=True))
        },
    }
    job.report.metrics(metrics, 0)
    contract.seal(statement, job.out)  # before the summary, whose times differ between runs
    job.summarize(metrics, parity_by_output=differences, acceptance=[each.sentence for each in played])
    job.report.say(
        f"torch and onnxruntime differ by {metrics['parity']:.1e} at most over {len(steps)} steps; "
        f"a control step takes {metrics['step_ms']:.3f} ms"
    )
    for place, each in enumerate(played):
        differ = metrics[f"errors_differ/{place}"]
        job.report.say(f"{each.sentence}; its errors differ from the torch student's by {differ:.2%} at most")
    _require_gates(job.recipe.export, differences, policy.largest_difference, played)


def _require_gates(
    settings: Export, differences: Mapping[str, float], target_difference: float, played: "Sequence[Accepted]"
) -> None:
    """Raises StageFailed for the first gate that is missed: parity, joint targets, acceptance."""
    worst = max(differences, key=lambda name: differences[name])
    if not differences[worst] <= settings.parity_tolerance:
        raise StageFailed(
            f"parity: output {worst} differs by {differences[worst]:.2e} between torch and onnxruntime, "
            f"export.parity_tolerance is {settings.parity_tolerance:.0e}; try another export.opset or raise it"
        )
    if not target_difference <= settings.target_tolerance:
        raise StageFailed(
            f"the controller's joint targets differ by {target_difference:.2e} rad from the simulation's own, "
            f"export.target_tolerance is {settings.target_tolerance:.0e}: its arm kinematics, reference generator, "
            "gait clock or action scale are not those of the task: the code of one of the two has changed"
        )
    for place, each in enumerate(played):
        if not each.enough:
            raise StageFailed(
                f"acceptance: {each.sentence}, export.acceptance.{place}.minimum is {each.asked.minimum}; "
                "train longer (teacher.steps, distill.steps), or lower the mass or the minimum"
            )


STAGE = Stage(
    name="export",
    version=3,
    slice=("name", "seed", "rg.height", "simulation", "task", "export"),
    reads=lambda recipe: (*generator_stage(recipe), policy_stage(recipe)),
    run=run,
    problems=lambda recipe: without_student(recipe, "export"),
    results=("step.onnx", "settle.onnx", "contract.json", "golden.npz"),
    headline=("parity", "step_ms", "acceptance_survived"),
    columns=("parity",),
    leaves_policy=True,
)
