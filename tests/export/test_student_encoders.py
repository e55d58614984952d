"""Every student that a recipe can ask for becomes a graph that answers as it does, and obeys the mirror."""

from pathlib import Path

import numpy as np
import torch
from exported_policies import graph_of
from mirrored import mirror_tensor
from test_graph import random_inputs

from iowbc.control.action import action_mirror
from iowbc.control.observation import observation_layout
from iowbc.deploy.controller import open_session, run
from iowbc.export.golden import largest_difference
from iowbc.export.graph import run_torch, write_onnx
from iowbc.learning.networks import StudentNetwork, mirror_as_json
from iowbc.recipe.recipe import Recipe
from iowbc.robot.description import Robot

HISTORY = 7


def test_a_symmetric_student_is_exported_with_its_encoder(robot: Robot, recipe: Recipe, tmp_path: Path) -> None:
    torch.manual_seed(0)
    layout = observation_layout(robot, True)
    mirrors = [mirror_as_json(layout.mirror), mirror_as_json(action_mirror(robot))]
    student = StudentNetwork(layout.size, HISTORY, 15, 8, 8, [16, 8], "elu", 10.0, mirrors=mirrors)
    graph = graph_of(student, recipe, robot, layout, None)
    write_onnx(graph.step, tmp_path / "step.onnx", 18, {})
    inputs = random_inputs(graph, 5)
    theirs = run(open_session(tmp_path / "step.onnx"), inputs)
    assert max(largest_difference(theirs, run_torch(graph.step, inputs)).values()) < 1e-5
    history = torch.from_numpy(np.random.default_rng(1).normal(size=(5, HISTORY, layout.size)).astype(np.float32))
    with torch.no_grad():
        expected = mirror_tensor(action_mirror(robot), student(history))
        torch.testing.assert_close(student(mirror_tensor(layout.mirror, history)), expected, rtol=0, atol=1e-5)
