"""`examples/motion_capture.py` with a stand-in for the cameras, whose interface is that of motioncapture 1.1."""

import itertools
import json
import runpy
import socket
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from iowbc.arrays import Array
from iowbc.deploy.contract import read_contract
from iowbc.onboard.operators import Udp
from iowbc.onboard.ranges import Ranges
from iowbc.robot import rotations

SEEN = runpy.run_path(str(Path(__file__).parents[2] / "examples" / "motion_capture.py"))["seen"]
PERIOD = 0.01
TURNING, YAWING = 0.4, 0.1
"""Of the object and of the pelvis about the vertical [rad/s]."""
SPEED = np.array([0.2, -0.1, 0.0])
"""Of the object, frame of the cameras [m/s]."""


class Cameras:
    """Cameras that watch a turning pelvis, and an object that turns and moves; the object is lost for a while."""

    frame = 0

    def waitForNextFrame(self) -> None:
        self.frame += 1

    @property
    def rigidBodies(self) -> dict[str, Any]:
        time = PERIOD * self.frame
        bodies = {"pelvis": body(np.array([1.0, 2.0, 0.7]), YAWING * time)}
        if not 20 <= self.frame < 30:
            bodies["crate"] = body(np.array([1.5, 2.0, 0.8]) + SPEED * time, TURNING * time)
        return bodies


def body(position: Array, yaw: float) -> Any:
    w, x, y, z = rotations.from_euler(np.zeros(()), np.zeros(()), np.array(yaw))
    return SimpleNamespace(position=position.astype(np.float32), rotation=SimpleNamespace(w=w, x=x, y=y, z=z))


def test_the_object_is_told_in_the_frame_of_the_pelvis_with_its_relative_velocity() -> None:
    cameras = Cameras()
    messages = list(itertools.islice(SEEN(cameras, "pelvis", "crate", lambda: PERIOD * cameras.frame), 12))
    told = messages[-1]["seen"]
    time, yaw = PERIOD * 12, YAWING * PERIOD * 12
    away = np.array([0.5, 0.0, 0.1]) + SPEED * time
    turn = np.array([[np.cos(yaw), np.sin(yaw), 0.0], [-np.sin(yaw), np.cos(yaw), 0.0], [0.0, 0.0, 1.0]])
    assert told["object_position"] == pytest.approx(turn @ away, abs=1e-6)
    half = 0.5 * (TURNING - YAWING) * time
    assert told["object_quaternion"] == pytest.approx([np.cos(half), 0.0, 0.0, np.sin(half)], abs=1e-6)
    relative = turn @ (SPEED - np.cross([0.0, 0.0, YAWING], away))
    assert told["object_linear_velocity"] == pytest.approx(relative, abs=2e-3)
    assert told["object_angular_velocity"] == pytest.approx([0.0, 0.0, TURNING - YAWING], abs=1e-4)


def test_nothing_is_sent_of_a_lost_object_and_no_velocity_reaches_over_the_gap() -> None:
    cameras = Cameras()
    messages = list(itertools.islice(SEEN(cameras, "pelvis", "crate", lambda: PERIOD * cameras.frame), 20))
    assert cameras.frame == 30
    assert messages[-1]["seen"]["object_linear_velocity"] == [0.0, 0.0, 0.0]


def test_the_robots_program_understands_the_message(sighted: Path) -> None:
    message = next(SEEN(Cameras(), "pelvis", "crate"))
    poses = Udp(Ranges(read_contract(sighted)), 0)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.sendto(json.dumps(message).encode(), ("127.0.0.1", poses.port))
    wanted = poses.wanted(1.0, None)
    poses.close()
    assert {name: values[0].tolist() for name, values in wanted.seen.items()} == message["seen"]
