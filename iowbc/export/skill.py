"""Writes the exported skill: graph, contract, golden vectors."""

from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path

import numpy as np

from iowbc.arrays import Array
from iowbc.control.command import COMMAND
from iowbc.deploy.contract import write_sealed
from iowbc.deploy.controller import open_session, run
from iowbc.deploy.skill import CONTRACT, FILES, GOLDEN, GRAPH, SkillContract
from iowbc.export.folder import PACKAGES
from iowbc.export.golden import largest_difference, write_golden
from iowbc.export.graph import Program, port_entry, run_torch, write_onnx
from iowbc.learning.networks import TeacherNetwork
from iowbc.recipe.recipe import Recipe


def write_skill(
    out: Path, network: TeacherNetwork, recipe: Recipe, sources: Mapping[str, str], observations: Array
) -> float:
    """Write the skill, whose graph is the mean action of the robot's policy; returns the largest difference between
    torch and onnxruntime over the observations (n, size). sources: artifact keys of the skill's inputs, by stage."""
    contract = SkillContract(
        frequency=recipe.skill.frequency,
        observation=observations.shape[1],
        sees_object=recipe.task.observation.observe_object and recipe.distill.observe_object,
        robot=recipe.skill.robot,
        commands=recipe.task.commands,
        sources=dict(sources),
        versions={name: version(name) for name in PACKAGES},
    )
    meaning = "departure of C from the nominal command, in parts of its scales"
    program = Program(
        lambda observation: (network(observation).clamp(-1.0, 1.0),),
        (port_entry("observation", (contract.observation,), "SI", "heading", "see iowbc.control.skill_observation"),),
        (port_entry("action", (len(COMMAND),), "1", "heading", meaning),),
        network,
    )
    about = {"contract": contract.model_dump_json(exclude={"files"}), **sources}
    write_onnx(program, out / GRAPH, recipe.export.opset, about)
    inputs = {"observation": np.ascontiguousarray(observations, np.float32)}
    expected = run_torch(program, inputs)
    write_golden(inputs, expected, out / GOLDEN)
    write_sealed(contract, out / CONTRACT, FILES)
    return max(largest_difference(expected, run(open_session(out / GRAPH), inputs)).values())
