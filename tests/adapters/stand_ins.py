"""Small controllers that stand in for those of others: linear networks, and the configuration that belongs to them."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import yaml
from numpy.typing import NDArray
from onnx import TensorProto, helper, numpy_helper

from iowbc.adapters.deploy import MOTORS

HOLOSOMA_SIZE = 100
RANGES = {"lin_vel_x": [-0.5, 1.0], "lin_vel_y": [-0.3, 0.3], "ang_vel_z": [-0.2, 0.2]}


def linear(path: Path, weight: NDArray[np.float32], bias: NDArray[np.float32], **metadata: Any) -> Path:
    """An ONNX file of `weight @ observation + bias`; metadata as JSON texts."""
    actions, size = weight.shape
    graph = helper.make_graph(
        [helper.make_node("Gemm", ["obs", "weight", "bias"], ["actions"])],
        "linear",
        [helper.make_tensor_value_info("obs", TensorProto.FLOAT, [1, size])],
        [helper.make_tensor_value_info("actions", TensorProto.FLOAT, [1, actions])],
        [
            numpy_helper.from_array(np.ascontiguousarray(weight.T, np.float32), "weight"),
            numpy_helper.from_array(bias.astype(np.float32), "bias"),
        ],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    helper.set_model_props(model, {name: json.dumps(value) for name, value in metadata.items()})
    onnx.save(model, path)
    return path


def holosoma_file(path: Path, **changes: Any) -> Path:
    """What a walker of holosoma looks like from outside; it holds its default posture."""
    said = {
        "dof_names": list(MOTORS),
        "kp": [100.0] * 29,
        "kd": [3.0] * 29,
        "command_ranges": {"lin_vel_x": [-1.0, 1.0], "lin_vel_y": [-1.0, 1.0], "ang_vel_yaw": [-0.3, 0.3]},
    } | changes
    kept = {name: value for name, value in said.items() if value is not None}
    return linear(path, np.zeros((29, HOLOSOMA_SIZE), np.float32), np.zeros(29, np.float32), **kept)


def deploy_folder(folder: Path, order: list[int], text: str = "", history: int = 2) -> Path:
    """A folder as unitree_rl_lab leaves one, its joints in an order of the motors; `text`: further lines of YAML."""
    folder.mkdir(parents=True, exist_ok=True)
    size = history * (3 + 3 + 3 + 3 * 29)
    linear(folder / "policy.onnx", np.zeros((29, size), np.float32), np.zeros(29, np.float32))
    default = [round(0.01 * place, 3) for place in range(29)]
    terms = {
        "base_ang_vel": 0.2,
        "projected_gravity": 1.0,
        "velocity_commands": 1.0,
        "joint_pos_rel": 1.0,
        "joint_vel_rel": 0.05,
        "last_action": 1.0,
    }
    lengths = dict.fromkeys(terms, 3) | dict.fromkeys(("joint_pos_rel", "joint_vel_rel", "last_action"), 29)
    said = {
        "joint_ids_map": order,
        "step_dt": 0.02,
        "stiffness": [100.0 + motor for motor in range(29)],
        "damping": [1.0 + motor for motor in range(29)],
        "default_joint_pos": default,
        "commands": {"base_velocity": {"ranges": RANGES}},
        "actions": {"JointPositionAction": {"clip": None, "scale": [0.25] * 29, "offset": default}},
        "observations": {
            name: {"params": {}, "clip": None, "scale": [factor] * lengths[name], "history_length": history}
            for name, factor in terms.items()
        },
    }
    (folder / "deploy.yaml").write_text(f"{yaml.safe_dump(said, sort_keys=False)}{text}\n")
    return folder
