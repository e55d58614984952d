"""The exported graph with onnxruntime alone: `python examples/onnx_only.py runs/quickstart/export`.

Holds the graph against the golden rollout of its export, as a port to another language or computer would be held.
"""

import os
import sys
from pathlib import Path

import numpy as np

os.environ.setdefault("ORT_DISABLE_TELEMETRY", "1")  # onnxruntime reads it when it loads; else it sends reports home
import onnxruntime


def largest_difference(folder: Path) -> float:
    """Largest difference between the graph's outputs and the golden ones, over all steps."""
    session = onnxruntime.InferenceSession(folder / "policy.onnx", providers=["CPUExecutionProvider"])
    golden = np.load(folder / "golden.npz", allow_pickle=False)
    inputs = {port.name: golden[f"input/{port.name}"] for port in session.get_inputs()}
    names = [port.name for port in session.get_outputs()]
    outputs = dict(zip(names, session.run(names, inputs), strict=True))
    return max(float(np.abs(outputs[name] - golden[f"output/{name}"]).max()) for name in names)


if __name__ == "__main__":
    print(f"onnxruntime differs from the golden rollout by {largest_difference(Path(sys.argv[1])):.1e} at most")
