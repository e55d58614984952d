"""Messages of the G1's low-level bus as NumPy records, their wire encoding, and their checksum.

Layouts are the public IDL definitions `unitree_hg.msg.dds_`. A record has the layout of the C structure, which the
checksum covers; CDR, the wire encoding, aligns each number to its own size and does not pad structures.
"""

import zlib
from functools import cache
from typing import Any

import numpy as np

from iowbc.arrays import Array, Indices

MOTORS = 35
"""Motors in a message; the first 29 are the joints of the G1 in the order of its MJCF."""
REMOTE = 40
"""Bytes of the wireless remote."""
MODULE = "unitree_hg.msg.dds_"

Record = np.ndarray[Any, np.dtype[np.void]]
"""A message: an array of shape () with one of the types below."""


def _record(fields: str, **parts: np.dtype[np.void]) -> np.dtype[np.void]:
    """A type from its fields, comma-separated `name kind` or `name kind count`; `parts`: kinds that are records."""
    words = [field.split() for field in fields.split(", ")]
    return np.dtype([(name, parts.get(kind, kind), *map(int, count)) for name, kind, *count in words], align=True)


MOTOR_COMMAND = _record("mode u1, q f4, dq f4, tau f4, kp f4, kd f4, reserve u4")
"""torque = tau + kp (q - position) + kd (dq - velocity), computed by the motor's own drive; mode 1 enables it."""
LOW_COMMAND = _record(
    f"mode_pr u1, mode_machine u1, motor_cmd motor {MOTORS}, reserve u4 4, crc u4", motor=MOTOR_COMMAND
)
"""`mode_pr` 0: ankles and waist by pitch and roll; `mode_machine` repeats that of the state."""
IMU_STATE = _record("quaternion f4 4, gyroscope f4 3, accelerometer f4 3, rpy f4 3, temperature i2")
"""Inertial unit in the pelvis: wxyz, [rad/s], [m/s²], [rad], [°C]."""
MOTOR_STATE = _record(
    "mode u1, q f4, dq f4, ddq f4, tau_est f4, temperature i2 2, vol f4, sensor u4 2, motorstate u4, reserve u4 4"
)
LOW_STATE = _record(
    f"version u4 2, mode_pr u1, mode_machine u1, tick u4, imu_state imu, motor_state motor {MOTORS}, "
    f"wireless_remote u1 {REMOTE}, reserve u4 4, crc u4",
    imu=IMU_STATE,
    motor=MOTOR_STATE,
)
"""`tick` counts milliseconds; `mode_machine` is the model's number."""
BATTERY_STATE = _record(
    "version_high u1, version_low u1, fn u1, cell_vol u2 40, bmsvoltage u4 3, current i4, soc u1, soh u1, "
    "temperature i2 12, cycle u2, manufacturer_date u2, bmsstate u4 5, reserve u4 3"
)
"""`soc`: charge [%]."""
NAMES = {
    MOTOR_COMMAND: "MotorCmd_",
    LOW_COMMAND: "LowCmd_",
    IMU_STATE: "IMUState_",
    MOTOR_STATE: "MotorState_",
    LOW_STATE: "LowState_",
    BATTERY_STATE: "BmsState_",
}
"""Names of the types in their IDL module."""
TOPICS = {LOW_COMMAND: "rt/lowcmd", LOW_STATE: "rt/lowstate", BATTERY_STATE: "rt/lf/bmsstate"}
HEADER = b"\x00\x01\x00\x00"
"""CDR header: little-endian, without options."""


def empty(kind: np.dtype[np.void]) -> Record:
    return np.zeros((), kind)


def to_cdr(message: Record) -> bytes:
    """Wire encoding of the message, with header."""
    record, wire = _places(message.dtype)
    out = np.zeros(int(wire[-1]) + 1, np.uint8)
    out[wire] = np.frombuffer(message.tobytes(), np.uint8)[record]
    return HEADER + out.tobytes()


def from_cdr(kind: np.dtype[np.void], data: bytes) -> Record:
    """Inverse of `to_cdr`. Raises ValueError for bytes of another length or encoding."""
    record, wire = _places(kind)
    padding = len(data) - len(HEADER) - int(wire[-1]) - 1
    if data[:2] != HEADER[:2] or not 0 <= padding < 4:
        raise ValueError(f"{NAMES[kind]}: {len(data)} bytes that begin with {data[:4]!r} are no such message")
    out = np.zeros(kind.itemsize, np.uint8)
    out[record] = np.frombuffer(data, np.uint8, offset=len(HEADER))[wire]
    return out.view(kind).reshape(())


@cache
def _places(kind: np.dtype[np.void]) -> tuple[Indices, Indices]:
    """Offsets of each byte in the record and in the CDR encoding."""
    record, wire, end = [], [], 0
    for start, size in _numbers(kind, 0):
        end += -end % size
        record.append(np.arange(start, start + size))
        wire.append(np.arange(end, end + size))
        end += size
    return np.concatenate(record), np.concatenate(wire)


def _numbers(kind: np.dtype[Any], start: int) -> list[tuple[int, int]]:
    """Offset and size of every number of a type that begins at `start`."""
    if kind.subdtype is not None:
        base, shape = kind.subdtype
        return [place for i in range(int(np.prod(shape))) for place in _numbers(base, start + i * base.itemsize)]
    if kind.fields is None:
        return [(start, kind.itemsize)]
    return [place for name in kind.names or () for place in _numbers(kind[name], start + kind.fields[name][1])]


_REVERSED = np.array([int(f"{byte:08b}"[::-1], 2) for byte in range(256)], np.uint8)
"""Each byte with its bits in the opposite order."""


def checksum(message: Record) -> int:
    """CRC-32 (polynomial 0x04C11DB7, not reflected, no final inversion) of the record's words before the `crc`."""
    words: Array = np.frombuffer(message.tobytes(), np.uint8)[:-4].reshape(-1, 4)[:, ::-1]
    mirrored = ~zlib.crc32(_REVERSED[words].tobytes()) & 0xFFFFFFFF
    return int.from_bytes(_REVERSED[np.frombuffer(mirrored.to_bytes(4, "little"), np.uint8)].tobytes(), "big")


def idl(kind: np.dtype[np.void]) -> str:
    """OMG IDL text of the type and its nested types."""
    words = {"u1": "octet", "u2": "unsigned short", "u4": "unsigned long", "i2": "short", "i4": "long", "f4": "float"}
    needed, text = [], f"module unitree_hg {{ module msg {{ module dds_ {{\n@final struct {NAMES[kind]} {{\n"
    for name in kind.names or ():
        base, shape = kind[name].subdtype or (kind[name], ())
        word = words.get(base.str[1:]) or NAMES[base]
        needed += [idl(base)] if base.fields else []
        text += f"  {word} {name}{f'[{shape[0]}]' if shape else ''};\n"
    return "".join([*needed, text, "};\n}; }; };\n"])
