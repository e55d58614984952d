"""crocoddyl and pinocchio fit together: a mismatch of their binaries crashes where a contact is computed."""

import subprocess
import sys

import pytest

CONTACT = """
import crocoddyl, numpy as np, pinocchio
from iowbc.robot.description import load_robot, robot_folder
from iowbc.reference.labels.support_model import build_model
robot = load_robot(robot_folder("g1"))
model = build_model(robot)
state = crocoddyl.StateMultibody(model)
actuation = crocoddyl.ActuationModelFloatingBase(state)
contact = crocoddyl.ContactModel6D(
    state, model.getFrameId("left_sole"), pinocchio.SE3.Identity(), pinocchio.LOCAL, actuation.nu, np.array([0.0, 0.0]))
data = model.createData()
made = contact.createData(data)
pinocchio.computeAllTerms(model, data, pinocchio.neutral(model), np.zeros(model.nv))
pinocchio.forwardKinematics(model, data, pinocchio.neutral(model), np.zeros(model.nv), np.zeros(model.nv))
contact.calc(made, state.zero())
print(actuation.nu, np.linalg.matrix_rank(made.Jc))
"""


def test_a_contact_model_computes() -> None:
    pytest.importorskip("crocoddyl")
    result = subprocess.run([sys.executable, "-c", CONTACT], capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    assert result.stdout.split() == ["29", "6"]
