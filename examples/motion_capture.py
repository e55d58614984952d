"""The object's pose from motion capture: `python examples/motion_capture.py vicon HOST PELVIS OBJECT PORT`.

Sends `iowbc robot --object-pose udp:PORT` where the rigid body OBJECT is, seen from PELVIS, both with origin and axes
of the simulation's bodies. Needs `pip install motioncapture`; in place of `vicon` also `optitrack`, `qualisys`, `vrpn`.
While a body is lost nothing is sent, and the robot is damped. Never tried with cameras.
"""

import json
import socket
import sys
import time
from collections import deque
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from iowbc.arrays import Array
from iowbc.robot import rotations

WINDOW = 0.05
"""Time over which velocities are averaged [s]; they are old by half of it."""


def product(a: Array, b: Array) -> Array:
    """Quaternion a b, wxyz, (4,)."""
    vector = a[0] * b[1:] + b[0] * a[1:] + rotations.cross(a[1:], b[1:])
    return np.array([a[0] * b[0] - a[1:] @ b[1:], *vector])


def inverse(a: Array) -> Array:
    """Of a unit quaternion, wxyz, (4,)."""
    return a * np.array([1.0, -1.0, -1.0, -1.0])


def pose(body: Any) -> tuple[Array, Array]:
    """Position (3,) [m] and orientation, wxyz (4,), of a rigid body, frame of the cameras."""
    turn = body.rotation
    return np.array(body.position, np.float64), np.array([turn.w, turn.x, turn.y, turn.z], np.float64)


def seen(system: Any, base: str, thing: str, clock: Callable[[], float] = time.monotonic) -> Iterator[dict[str, Any]]:
    """The message to send after each frame in which both bodies are tracked."""
    past: deque[tuple[float, Array, Array]] = deque()
    while True:
        system.waitForNextFrame()
        now, bodies = clock(), system.rigidBodies
        if base not in bodies or thing not in bodies:
            past.clear()
            continue
        (origin, frame), (place, turn) = pose(bodies[base]), pose(bodies[thing])
        position, quaternion = rotations.rotate_inverse(frame, place - origin), product(inverse(frame), turn)
        quaternion *= np.copysign(1.0, quaternion[0])
        past.append((now, position, quaternion))
        while len(past) > 2 and now - past[1][0] >= WINDOW:
            past.popleft()
        before, position_before, quaternion_before = past[0]
        passed = max(now - before, 1e-3)
        turned = product(quaternion, inverse(quaternion_before))
        values = {
            "object_position": position,
            "object_quaternion": quaternion,
            "object_linear_velocity": (position - position_before) / passed,
            "object_angular_velocity": 2.0 * np.copysign(1.0, turned[0]) * turned[1:] / passed,
        }
        yield {"seen": {name: value.tolist() for name, value in values.items()}}


if __name__ == "__main__":
    import motioncapture

    kind, host, base, thing, port = sys.argv[1:]
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for message in seen(motioncapture.connect(kind, {"hostname": host}), base, thing):
            sender.sendto(json.dumps(message).encode(), ("127.0.0.1", int(port)))
