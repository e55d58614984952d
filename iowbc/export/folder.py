"""Folders of an exported controller and of an exported skill: graphs, contracts, and all other files that they load."""

import shutil
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from iowbc.arrays import Array
from iowbc.control.command import COMMAND
from iowbc.deploy import contract, exported_folder
from iowbc.deploy.controller import open_session, run
from iowbc.deploy.skill import CONTRACT, FILES, GOLDEN, GRAPH, SkillContract
from iowbc.export.golden import largest_difference, write_golden
from iowbc.export.graph import ControllerGraph, Program, port_entry, run_torch, write_onnx
from iowbc.learning.networks import TeacherNetwork
from iowbc.recipe.evaluation.evaluation import Evaluation
from iowbc.recipe.generator import ReferenceGenerator
from iowbc.recipe.recipe import Recipe
from iowbc.recipe.section import Section, sentences
from iowbc.robot.description import DESCRIPTION

PACKAGES = ("iowbc", "mujoco", "numpy", "onnx", "onnxruntime", "onnxscript", "torch")
"""Packages whose versions the contract records."""
ROBOT_FIELDS = ("support", "interaction", "kp", "kd", "effort", "velocity_limit", "lower", "upper", "default_position")
"""Arrays of the robot that the contract holds by the same name."""


def write_folder(
    out: Path, graph: ControllerGraph, recipe: Recipe, rg: Path | None, sources: Mapping[str, str]
) -> contract.Contract:
    """Write both graphs, `contract.json`, `recipe.json`, the robot's folder, and with `rg` the generator's folder;
    sources: artifact keys of the inputs of the graph, by stage."""
    robot, drawn = graph.robot, recipe.simulation.randomization
    arrays: dict[str, Any] = {name: tuple(getattr(robot, name).tolist()) for name in ROBOT_FIELDS}
    (out / exported_folder.ROBOT).mkdir()
    for source in (robot.folder / DESCRIPTION, robot.mjcf):
        shutil.copy(source, out / exported_folder.ROBOT / source.name)
    if rg is not None:
        (out / exported_folder.GENERATOR).mkdir()
        for name in contract.GENERATOR_FILES:
            shutil.copy(rg / name, out / exported_folder.GENERATOR / name)
    (out / exported_folder.RECIPE).write_text(world_of(recipe).model_dump_json(indent=1) + "\n")
    statement = contract.Contract(
        recipe=recipe.name,
        robot=robot.name,
        opset=recipe.export.opset,
        control_frequency=recipe.task.control_frequency,
        physics_frequency=1.0 / recipe.simulation.physics.timestep,
        inputs=graph.step.inputs,
        outputs=graph.step.outputs,
        settle=tuple(port.name for port in graph.settle.inputs),
        state=graph.state,
        joints=robot.joints,
        **arrays,
        action_scale=tuple(graph.equations.scale.tolist()),
        action_bound=graph.equations.bound,
        history=graph.student.history,
        observation=tuple(contract.PartEntry.model_validate(part) for part in graph.layout.describe()),
        command=COMMAND,
        commands=recipe.task.commands,
        references=recipe.task.references,
        sensing=recipe.simulation.sensing,
        latency=contract.Latency(
            action=(drawn.action_latency.low, drawn.action_latency.high),
            sensors=(drawn.sensor_latency.low, drawn.sensor_latency.high),
            object=(drawn.object_latency.low, drawn.object_latency.high),
        ),
        sentences=meanings(contract.Contract),
        versions={name: version(name) for name in PACKAGES},
        sources=dict(sources),
    )
    for name, program in ((exported_folder.SETTLE, graph.settle), (exported_folder.STEP, graph.step)):
        write_onnx(program, out / name, recipe.export.opset, metadata(statement))
    return contract.seal(statement, out)


def metadata(statement: contract.Contract) -> dict[str, str]:
    """Metadata of both ONNX files: the contract without file digests, and main entries by other exporters' names."""

    def listed(values: tuple[float, ...]) -> str:
        return ",".join(f"{value:g}" for value in values)

    return {
        "recipe": statement.recipe,
        **statement.sources,
        "joint_names": ",".join(statement.joints),
        "joint_stiffness": listed(statement.kp),
        "joint_damping": listed(statement.kd),
        "default_joint_pos": listed(statement.default_position),
        "action_scale": listed(statement.action_scale),
        "command_names": ",".join(statement.command),
        "observation_names": ",".join(part.name for part in statement.observation),
        "contract": statement.model_dump_json(exclude={"files"}),
    }


def meanings(section: type[Section], path: str = "") -> dict[str, str]:
    """Attribute docstring of each field of a section, and of its subsections, by dotted path."""
    found = {f"{path}{name}": sentence.replace("\n", " ") for name, sentence in sentences(section).items()}
    for name, about in section.model_fields.items():
        if isinstance(about.annotation, type) and issubclass(about.annotation, Section):
            found |= meanings(about.annotation, f"{path}{name}.")
    return found


def world_of(recipe: Recipe) -> Recipe:
    """The recipe reduced to what the export depends on and the sequence of the acceptance test; defaults elsewhere."""
    played = recipe.export.acceptance[:1]
    return Recipe(
        name=recipe.name,
        seed=recipe.seed,
        robot=recipe.robot,
        rg=ReferenceGenerator(height=recipe.rg.height),
        simulation=recipe.simulation,
        task=recipe.deployed.task,
        eval=Evaluation(sequence=played[0].sequence) if played else Evaluation(),
        export=recipe.export,
    )


def write_skill(
    out: Path, network: TeacherNetwork, recipe: Recipe, sources: Mapping[str, str], observations: Array
) -> float:
    """Write the skill, whose graph is the mean action of the robot's policy; returns the largest difference between
    torch and onnxruntime over the observations (n, size). sources: artifact keys of the skill's inputs, by stage."""
    statement = SkillContract(
        frequency=recipe.skill.frequency,
        observation=observations.shape[1],
        sees_object=recipe.student_sees_object,
        robot=recipe.skill.robot,
        commands=recipe.task.commands,
        sources=dict(sources),
        versions={name: version(name) for name in PACKAGES},
    )
    meaning = "departure of C from the nominal command, in parts of its scales"
    program = Program(
        lambda observation: (network(observation).clamp(-1.0, 1.0),),
        (port_entry("observation", (statement.observation,), "SI", "heading", "see iowbc.control.skill_observation"),),
        (port_entry("action", (len(COMMAND),), "1", "heading", meaning),),
        network,
    )
    about = {"contract": statement.model_dump_json(exclude={"files"}), **sources}
    write_onnx(program, out / GRAPH, recipe.export.opset, about)
    inputs = {"observation": np.ascontiguousarray(observations, np.float32)}
    expected = run_torch(program, inputs)
    write_golden(inputs, expected, out / GOLDEN)
    contract.seal(statement, out, CONTRACT, FILES)
    return max(largest_difference(expected, run(open_session(out / GRAPH), inputs)).values())
