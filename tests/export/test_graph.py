"""The exported graph against the NumPy functions of the task, part by part, and torch against onnxruntime."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import pytest
import torch

from iowbc.control import observation
from iowbc.control.gait import phase_signal
from iowbc.control.generator import ReferenceNetwork
from iowbc.control.layout import Part
from iowbc.control.observation import Sensed
from iowbc.control.sensors import Measured, quantities
from iowbc.control.stride import Stride
from iowbc.deploy.exported_folder import GRAPH
from iowbc.deploy.session import open_session, run
from iowbc.export.folder import write_folder
from iowbc.export.golden import Values, largest_difference, read_golden, stacked, write_golden
from iowbc.export.graph import ControllerGraph
from iowbc.export.onnx_graph import run_torch, write_onnx
from iowbc.recipe.recipe import Recipe
from iowbc.recipe.task.joint_references import GaitPrior
from iowbc.robot import rotations
from iowbc.robot.description import Robot
from iowbc.robot.mirror import scalar

TOLERANCE = 1e-5


def random_inputs(graph: ControllerGraph, rows: int, seed: int = 0) -> Values:
    random = np.random.default_rng(seed)
    inputs = {port.name: random.normal(size=(rows, *port.shape)).astype(np.float32) for port in graph.input_ports()}
    inputs["command"] *= np.float32(0.3)
    inputs["gait"] = np.stack([random.uniform(size=rows), random.integers(0, 2, rows)], axis=1).astype(np.float32)
    inputs["restart"] = random.integers(0, 2, (rows, 1)).astype(np.float32)
    if "object_quaternion" in inputs:
        inputs["object_quaternion"] = rotations.normalized(inputs["object_quaternion"])
    return inputs


def expected_frame(graph: ControllerGraph, rg: Path | None, robot: Robot, inputs: Values) -> np.ndarray:
    """s_t as the task computes it, and θ_S_ref."""
    rows = len(inputs["command"])
    phase, stepping = inputs["gait"][:, 0].astype(float), inputs["gait"][:, 1] > 0.5
    support = np.tile(robot.default_position[robot.support], (rows, 1))
    if rg is not None:
        support = ReferenceNetwork.load(rg)(inputs["arm_reference"].astype(float), inputs["command"][:, 3:5])
    pitch = np.zeros(rows) if rg is None else inputs["command"][:, 4] - support[:, 14]
    stride = Stride.of(robot, GaitPrior())
    assert stride is not None
    support = stride(np, support, pitch, inputs["command"], phase, stepping)
    reference = np.empty((rows, 29))
    reference[:, robot.support], reference[:, robot.interaction] = support, inputs["arm_reference"]
    seen = (*quantities(of_object=False), *(quantities(of_object=True) if graph.observes_object else ()))
    sensed = Sensed(
        measured=Measured(**{name: inputs[name] for name in seen}),
        command=inputs["command"],
        heading_reference=inputs["heading_reference"],
        joint_reference=reference,
        phase=phase_signal(phase, stepping),
        last_action=inputs["last_action"],
        support_reference=support,
        arm_reference=inputs["arm_reference"],
    )
    return graph.layout.gather(sensed, np.empty((rows, graph.layout.size), np.float32))


@pytest.mark.parametrize("observe_object", [True, False])
@pytest.mark.parametrize("use_rg", [True, False])
def test_the_graph_observes_what_the_task_observes(
    observe_object: bool,
    use_rg: bool,
    make_graph: Callable[[Path | None, bool], ControllerGraph],
    robot: Robot,
    rg: Path,
) -> None:
    source = rg if use_rg else None
    graph = make_graph(source, observe_object)
    inputs = random_inputs(graph, 64)
    outputs = run_torch(graph, inputs)
    frame = expected_frame(graph, source, robot, inputs)
    assert outputs["history_next"][:, -1] == pytest.approx(frame, abs=TOLERANCE)
    assert outputs["support_reference"] == pytest.approx(
        frame[:, graph.layout.slices["support_reference"]], abs=TOLERANCE
    )


def test_history_is_shifted_or_filled_with_the_first_frame(graph: ControllerGraph) -> None:
    inputs = random_inputs(graph, 2)
    inputs["restart"] = np.array([[0.0], [1.0]], np.float32)
    following = run_torch(graph, inputs)["history_next"]
    assert np.array_equal(following[0, :-1], inputs["history"][0, 1:])
    assert np.array_equal(following[1], np.tile(following[1, -1], (graph.history, 1)))


def test_the_action_is_the_students_for_that_history(graph: ControllerGraph) -> None:
    outputs = run_torch(graph, random_inputs(graph, 16))
    with torch.inference_mode():
        action = graph.student(torch.from_numpy(outputs["history_next"])).numpy()
    assert np.array_equal(outputs["action"], np.clip(action, -graph.bound, graph.bound))
    scaled = outputs["support_reference"] + graph.scale.numpy() * outputs["action"]
    assert outputs["support_target"] == pytest.approx(scaled, abs=1e-6)


def test_onnxruntime_agrees_with_torch_for_any_number_of_robots(graph: ControllerGraph, exported: Path) -> None:
    session = open_session(exported / GRAPH)
    for rows in (1, 2, 33):
        inputs = random_inputs(graph, rows, seed=rows)
        differences = largest_difference(run_torch(graph, inputs), run(session, inputs))
        assert max(differences.values()) < TOLERANCE


def test_the_graph_file_is_clean(graph: ControllerGraph, exported: Path) -> None:
    model = onnx.load(exported / GRAPH)
    assert [value.name for value in model.graph.input] == [port.name for port in graph.input_ports()]
    assert [value.name for value in model.graph.output] == [port.name for port in graph.output_ports()]
    assert {value.type.tensor_type.shape.dim[0].dim_param for value in model.graph.input} == {"robots"}
    assert {entry.key: entry.value for entry in model.metadata_props} == {"recipe": "test", "rg-fit": "a" * 8}
    assert not any(node.metadata_props or node.doc_string for node in model.graph.node)
    assert str(Path(__file__).parents[2]).encode() not in (exported / GRAPH).read_bytes()


def test_a_wrong_graph_shows_in_the_difference(graph: ControllerGraph) -> None:
    inputs = random_inputs(graph, 4)
    right = run_torch(graph, inputs)
    wrong = run_torch(graph, inputs | {"command": inputs["command"] + 1})
    broken = right | {"action": np.full_like(right["action"], np.nan)}
    assert largest_difference(right, right)["action"] == 0
    assert largest_difference(right, wrong)["action"] > TOLERANCE
    assert largest_difference(right, broken)["action"] == np.inf


def test_golden_vectors_come_back_as_they_were(graph: ControllerGraph, tmp_path: Path) -> None:
    steps = [random_inputs(graph, 1, seed) for seed in range(3)]
    inputs = stacked(steps)
    outputs = run_torch(graph, inputs)
    write_golden(inputs, outputs, tmp_path / "golden.npz")
    read_inputs, read_outputs = read_golden(tmp_path / "golden.npz")
    assert all(np.array_equal(read_inputs[name], inputs[name]) for name in inputs)
    assert all(np.array_equal(read_outputs[name], outputs[name]) for name in outputs)
    assert np.array_equal(read_inputs["command"][2], steps[2]["command"][0])


def test_opsets_differ_in_form_only(graph: ControllerGraph, tmp_path: Path) -> None:
    inputs = random_inputs(graph, 2)
    write_onnx(graph, tmp_path / "graph.onnx", 20, {})
    outputs = run(open_session(tmp_path / "graph.onnx"), inputs)
    assert max(largest_difference(run_torch(graph, inputs), outputs).values()) < TOLERANCE


def knees(sensed: Sensed) -> Any:
    return sensed.measured.joint_position[:, 3:4] * sensed.measured.joint_position[:, 9:10]


def test_a_part_that_is_added_to_the_list_is_in_graph_file_and_contract(
    make_graph: Callable[[Path | None, bool], ControllerGraph],
    recipe: Recipe,
    robot: Robot,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    added = Part("knees", scalar, "rad²", "joint", knees)
    monkeypatch.setattr(observation, "PROPRIOCEPTION", (*observation.PROPRIOCEPTION, added))
    graph = make_graph(None, False)
    contract = write_folder(tmp_path, graph, recipe, None, {})
    assert [part.name for part in contract.observation][-1] == "knees"
    inputs = random_inputs(graph, 3)
    found = run(open_session(tmp_path / GRAPH), inputs)["history_next"]
    assert found[:, -1] == pytest.approx(expected_frame(graph, None, robot, inputs), abs=TOLERANCE)
    assert found[:, -1, -1] == pytest.approx(inputs["joint_position"][:, 3] * inputs["joint_position"][:, 9])
