"""An exported controller in plain MuJoCo, without iowbc: `python examples/plain_mujoco.py runs/quickstart/export`."""

import json
import os
import sys
from pathlib import Path

import mujoco
import numpy as np

os.environ.setdefault("ORT_DISABLE_TELEMETRY", "1")  # onnxruntime reads it when it loads; else it sends reports home
import onnxruntime

HEIGHT = 0.72  # of the pelvis, the fourth entry of the command [m]


def stand(folder: Path, seconds: float = 5.0) -> float:
    """Let the controller stand with its arms in their grasp and no object; returns the pelvis height at the end [m]."""
    contract = json.loads((folder / "contract.json").read_text())
    kp, kd, effort, rest = (np.array(contract[name]) for name in ("kp", "kd", "effort", "default_position"))
    spec = mujoco.MjSpec.from_file(str(next((folder / "robot").glob("*.xml"))))
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1])
    model = spec.compile()
    model.opt.timestep = 1.0 / contract["physics_frequency"]
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    model.dof_damping[6:] = kd  # the PD loop's damping, where an implicit integrator keeps it stable
    data = mujoco.MjData(model)
    data.qpos[2], data.qpos[7:] = 0.79, rest
    options = onnxruntime.SessionOptions()
    options.enable_mem_reuse = False  # loads in a tenth of the time
    settle, step = (onnxruntime.InferenceSession(folder / f"{name}.onnx", options) for name in ("settle", "step"))
    given = {port["name"]: np.zeros((1, *port["shape"]), np.float32) for port in contract["inputs"]}
    left = np.array(contract["references"]["grasps"]["free"])
    given["command"][0, 3], given["grasp"][0] = HEIGHT, [left, left * [1, -1, 1]]
    (given["state"],) = settle.run(["state"], {name: given[name] for name in contract["settle"]})
    if "object_quaternion" in given:
        given["object_quaternion"][0, 0] = 1.0
    for _ in range(round(seconds * contract["control_frequency"])):
        rotation = np.zeros(9)
        mujoco.mju_quat2Mat(rotation, data.qpos[3:7])
        given["projected_gravity"][0], given["base_angular_velocity"][0] = -rotation[6:], data.qvel[3:6]
        given["heading"][0] = np.arctan2(rotation[3], rotation[0])
        given["joint_position"][0], given["joint_velocity"][0] = data.qpos[7:], data.qvel[6:]
        (target,), given["state"] = step.run(["target", "state_next"], given)
        for _ in range(round(contract["physics_frequency"] / contract["control_frequency"])):
            torque = kp * (target - data.qpos[7:])
            data.qfrc_applied[6:] = np.clip(torque, -effort, effort)
            mujoco.mj_step(model, data)
    return float(data.qpos[2])


if __name__ == "__main__":
    print(f"the pelvis is {stand(Path(sys.argv[1])):.2f} m high after 5 s")
