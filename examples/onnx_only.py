"""A robot with onnxruntime alone: `python examples/onnx_only.py runs/quickstart/export`.

Plays the golden rollout of the export, as a port to another language or computer would be held against it. On a robot,
`measured` comes from its sensors and `target` goes to the joints' PD loops, 50 times a second.
"""

import json
import os
import sys
from pathlib import Path

import numpy as np

os.environ.setdefault("ORT_DISABLE_TELEMETRY", "1")  # onnxruntime reads it when it loads; else it sends reports home
import onnxruntime


def largest_difference(folder: Path) -> float:
    """Largest difference between the joint targets and the golden ones [rad], over all steps."""
    settle, step = (onnxruntime.InferenceSession(folder / f"{name}.onnx") for name in ("settle", "step"))
    contract = json.loads(step.get_modelmeta().custom_metadata_map["contract"])
    golden = np.load(folder / "golden.npz", allow_pickle=False)
    state, away = None, 0.0
    for time, expected in enumerate(golden["output/target"]):
        measured = {port.name: golden[f"input/{port.name}"][[time]] for port in step.get_inputs()[:-1]}
        if state is None:
            (state,) = settle.run(["state"], {name: measured[name] for name in contract["settle"]})
        target, state = step.run(["target", "state_next"], measured | {"state": state})
        away = max(away, float(np.nan_to_num(np.abs(target[0] - expected), nan=np.inf).max()))
    return away


if __name__ == "__main__":
    print(f"onnxruntime differs from the golden rollout by {largest_difference(Path(sys.argv[1])):.1e} at most")
