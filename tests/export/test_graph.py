"""The exported programs: torch against onnxruntime, their state, and what is in the files."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import pytest
import torch
from exported_policies import read_golden

from iowbc.control import observation
from iowbc.control.layout import Part
from iowbc.control.observation import PolicyInputs
from iowbc.deploy.contract import Contract
from iowbc.deploy.controller import open_session, run
from iowbc.deploy.exported_folder import SETTLE, STEP
from iowbc.export.folder import write_folder
from iowbc.export.golden import Values, largest_difference, stacked, write_golden
from iowbc.export.graph import ControllerGraph, run_torch, write_onnx
from iowbc.recipe.recipe import Recipe
from iowbc.robot import rotations
from iowbc.robot.description import Robot
from iowbc.robot.mirror import scalar

TOLERANCE = 1e-5


def random_inputs(graph: ControllerGraph, rows: int, seed: int = 0) -> Values:
    random = np.random.default_rng(seed)
    inputs = {port.name: random.normal(size=(rows, *port.shape)).astype(np.float32) for port in graph.step.inputs}
    state = {name: random.normal(size=(rows, *shape)) for name, shape in graph.equations.shapes.items()}
    state |= {name: random.integers(0, 2, (rows, 1)) for name in ("stepping", "begun")}
    state |= {"phase": random.uniform(size=(rows, 1)), "command": 0.3 * state["command"]}
    state["feedback"] *= 0.2  # feet within their reach, beyond which the stride amplifies rounding
    inputs["state"] = np.concatenate([part.reshape(rows, -1) for part in state.values()], axis=1).astype(np.float32)
    inputs["command"] *= np.float32(0.3)
    if "object_quaternion" in inputs:
        inputs["object_quaternion"] = rotations.normalized(inputs["object_quaternion"])
    return inputs


def part(graph: ControllerGraph, values: np.ndarray, name: str) -> Any:
    """A part of packed states."""
    return getattr(graph.equations.unpacked(values), name)


@pytest.mark.parametrize("observe_object", [True, False])
@pytest.mark.parametrize("use_rg", [True, False])
def test_the_program_of_tensors_is_that_of_arrays(
    observe_object: bool, use_rg: bool, make_graph: Callable[[Path | None, bool], ControllerGraph], rg: Path
) -> None:
    graph = make_graph(rg if use_rg else None, observe_object)
    inputs = random_inputs(graph, 64)
    graph.equations.policy = lambda history: graph.student(torch.from_numpy(history.astype(np.float32))).numpy()
    given = {name: value.astype(np.float64) for name, value in inputs.items()}
    others = {name: given.pop(name) for name in ("command", "grasp", "load", "state")}
    state = graph.equations.unpacked(others.pop("state"))
    expected = graph.equations.step(observation.Measured(**given), **others, state=state)
    outputs = run_torch(graph.step, inputs)
    for name in ("target", "action", "support_reference"):
        assert outputs[name] == pytest.approx(getattr(expected, name), abs=TOLERANCE)
    assert outputs["state_next"] == pytest.approx(graph.equations.packed(expected.state), abs=TOLERANCE)


def test_history_is_shifted_or_filled_with_the_first_observation(graph: ControllerGraph) -> None:
    inputs = random_inputs(graph, 8)
    begun = part(graph, inputs["state"], "begun")[:, 0] > 0.5
    assert 0 < begun.sum() < 8
    before = part(graph, inputs["state"], "history")
    following = part(graph, run_torch(graph.step, inputs)["state_next"], "history")
    assert np.array_equal(following[begun, :-1], before[begun, 1:])
    assert np.array_equal(following[~begun], np.repeat(following[~begun, -1:], graph.student.history, axis=1))


def test_the_action_is_the_students_for_that_history(graph: ControllerGraph, robot: Robot) -> None:
    inputs = random_inputs(graph, 16)
    outputs = run_torch(graph.step, inputs)
    with torch.inference_mode():
        action = graph.student(torch.from_numpy(part(graph, outputs["state_next"], "history").copy())).numpy()
    bound = graph.equations.bound
    assert np.array_equal(outputs["action"], np.clip(action, -bound, bound))
    followed = 0.7 * outputs["action"] + 0.3 * part(graph, inputs["state"], "action")
    scaled = outputs["support_reference"] + graph.equations.scale * followed
    assert outputs["target"][:, robot.support] == pytest.approx(scaled, abs=1e-6)


def test_a_state_comes_back_from_its_rows(graph: ControllerGraph) -> None:
    rows = random_inputs(graph, 3)["state"]
    assert np.array_equal(graph.equations.packed(graph.equations.unpacked(rows)), rows)


def test_onnxruntime_agrees_with_torch_for_any_number_of_robots(graph: ControllerGraph, exported: Path) -> None:
    for name, program in ((SETTLE, graph.settle), (STEP, graph.step)):
        session = open_session(exported / name)
        for rows in (1, 2, 33):
            given = random_inputs(graph, rows, seed=rows)
            inputs = {port.name: given[port.name] for port in program.inputs}
            differences = largest_difference(run_torch(program, inputs), run(session, inputs))
            assert max(differences.values()) < TOLERANCE


def test_the_files_are_clean_and_say_what_they_are(graph: ControllerGraph, exported: Path, robot: Robot) -> None:
    for name, program in ((SETTLE, graph.settle), (STEP, graph.step)):
        model = onnx.load(exported / name)
        assert [value.name for value in model.graph.input] == [port.name for port in program.inputs]
        assert [value.name for value in model.graph.output] == [port.name for port in program.outputs]
        assert {value.type.tensor_type.shape.dim[0].dim_param for value in model.graph.input} == {"robots"}
        told = {entry.key: entry.value for entry in model.metadata_props}
        assert (told["recipe"], told["rg-fit"], told["joint_names"]) == ("test", "a" * 8, ",".join(robot.joints))
        assert Contract.model_validate_json(told["contract"]).control_frequency == 50.0
        assert not any(node.metadata_props or node.doc_string for node in model.graph.node)
        assert str(Path(__file__).parents[2]).encode() not in (exported / name).read_bytes()


def test_a_wrong_graph_shows_in_the_difference(graph: ControllerGraph) -> None:
    inputs = random_inputs(graph, 4)
    right = run_torch(graph.step, inputs)
    wrong = run_torch(graph.step, inputs | {"state": inputs["state"] + 1})
    broken = right | {"action": np.full_like(right["action"], np.nan)}
    assert largest_difference(right, right)["action"] == 0
    assert largest_difference(right, wrong)["action"] > TOLERANCE
    assert largest_difference(right, broken)["action"] == np.inf


def test_golden_vectors_come_back_as_they_were(graph: ControllerGraph, tmp_path: Path) -> None:
    steps = [random_inputs(graph, 1, seed) for seed in range(3)]
    inputs = stacked(steps)
    outputs = run_torch(graph.step, inputs)
    write_golden(inputs, outputs, tmp_path / "golden.npz")
    read_inputs, read_outputs = read_golden(tmp_path / "golden.npz")
    assert all(np.array_equal(read_inputs[name], inputs[name]) for name in inputs)
    assert all(np.array_equal(read_outputs[name], outputs[name]) for name in outputs)
    assert np.array_equal(read_inputs["command"][2], steps[2]["command"][0])


def test_opsets_differ_in_form_only(graph: ControllerGraph, tmp_path: Path) -> None:
    inputs = random_inputs(graph, 2)
    write_onnx(graph.step, tmp_path / "graph.onnx", 20, {})
    outputs = run(open_session(tmp_path / "graph.onnx"), inputs)
    assert max(largest_difference(run_torch(graph.step, inputs), outputs).values()) < TOLERANCE


def knees(sensed: PolicyInputs) -> Any:
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
    found = part(graph, run(open_session(tmp_path / STEP), inputs)["state_next"], "history")
    assert found[:, -1, -1] == pytest.approx(inputs["joint_position"][:, 3] * inputs["joint_position"][:, 9])
