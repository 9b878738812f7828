# SPDX-License-Identifier: Apache-2.0
"""The ROS 2 messages of a log: their schemas as text, encoding as CDR, and decoding of messages of any recorder."""

import struct
from collections.abc import Sequence

WRENCH_STAMPED = "geometry_msgs/msg/WrenchStamped"
WRENCH = "geometry_msgs/msg/Wrench"
JOINT_STATE = "sensor_msgs/msg/JointState"
POSE_STAMPED = "geometry_msgs/msg/PoseStamped"
STRING = "std_msgs/msg/String"

_FIELDS = {
    "geometry_msgs/WrenchStamped": "std_msgs/Header header\ngeometry_msgs/Wrench wrench",
    "geometry_msgs/Wrench": "geometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque",
    "geometry_msgs/Vector3": "float64 x\nfloat64 y\nfloat64 z",
    "sensor_msgs/JointState": "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\n"
    "float64[] effort",
    "std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id",
    "builtin_interfaces/Time": "int32 sec\nuint32 nanosec",
    "std_msgs/String": "string data",
}
FRAME = b"needle"  # frame_id of every message, and the name of the one joint
_LITTLE_ENDIAN = b"\0\1\0\0"
_NAME_BYTES = len(FRAME) + 1
_NAME = struct.pack(f"<I{_NAME_BYTES}s", _NAME_BYTES, FRAME)
_SECOND = 1_000_000_000  # ns
# encoding, seconds, nanoseconds, frame; forces and torques
_WRENCH = struct.Struct(f"<4siII{_NAME_BYTES}s5x6d")
# … frame; one name; one position; one velocity; no effort
_STATE = struct.Struct(f"<4siII{_NAME_BYTES}sxII{_NAME_BYTES}sxIdI4xdI")
_MAX_ENTRIES = 4096  # joints in a state: more than any robot has


def schema_text(message: str) -> str:
    """The definition of a message, such as ``WRENCH_STAMPED``, and of its components, each after a line of ``=``."""
    names = [message.replace("/msg/", "/")]
    for name in names:  # the list grows during the iteration
        kinds = (line.split()[0].removesuffix("[]") for line in _FIELDS[name].splitlines())
        names += [kind for kind in kinds if kind in _FIELDS and kind not in names]
    first, *others = names
    parts = [_FIELDS[first], *(f"MSG: {name}\n{_FIELDS[name]}" for name in others)]
    return ("\n" + "=" * 80 + "\n").join(parts) + "\n"


def wrench_message(stamp: int, wrench: Sequence[float]) -> bytes:
    """Encode a WrenchStamped: time [ns] and fx fy fz [N] tx ty tz [N m]."""
    return _WRENCH.pack(_LITTLE_ENDIAN, *divmod(stamp, _SECOND), _NAME_BYTES, FRAME, *wrench)


def state_message(stamp: int, depth: float, velocity: float) -> bytes:
    """Encode a JointState of one joint: time [ns], depth [m] as its position, velocity [m/s]."""
    header = (_LITTLE_ENDIAN, *divmod(stamp, _SECOND), _NAME_BYTES, FRAME)
    joint = (1, _NAME_BYTES, FRAME, 1, depth, 1, velocity, 0)
    return _STATE.pack(*header, *joint)


def string_message(text: str) -> bytes:
    """Encode a String."""
    data = text.encode() + b"\0"
    return _LITTLE_ENDIAN + struct.pack("<I", len(data)) + data


class _Cursor:
    """Reads CDR of encoding version 1 in either byte order, after its four-byte header."""

    def __init__(self, data: bytes):
        if len(data) < 4 or data[0] != 0 or data[1] > 1:
            raise ValueError("not plain CDR")
        self._data, self._at, self._order = data, 4, "<" if data[1] else ">"

    def numbers(self, code: str, count: int, size: int) -> tuple:
        """``count`` numbers of ``size`` bytes, aligned to ``size``."""
        if count:
            self._at += -(self._at - 4) % size
        found = struct.unpack_from(f"{self._order}{count}{code}", self._data, self._at)
        self._at += count * size
        return found

    def length(self) -> int:
        return self.numbers("I", 1, 4)[0]

    def string(self) -> str:
        size = self.length()
        text = self._data[self._at : self._at + size]
        if len(text) != size:
            raise ValueError("a string is longer than its message")
        self._at += size
        return text.rstrip(b"\0").decode()

    def doubles(self) -> tuple:
        return self.numbers("d", self._entry_count(), 8)

    def strings(self) -> list[str]:
        return [self.string() for _ in range(self._entry_count())]

    def stamp(self) -> int:
        """The time [ns] of a header; its frame is skipped."""
        seconds, rest = self.numbers("i", 1, 4)[0], self.length()
        self.string()
        return seconds * _SECOND + rest

    def _entry_count(self) -> int:
        count = self.length()
        if count > _MAX_ENTRIES:
            raise ValueError(f"{count} entries, at most {_MAX_ENTRIES} can be read")
        return count


def wrench_of(data: bytes, message: str) -> tuple[int, tuple]:
    """Decode a Wrench or WrenchStamped: time [ns], 0 without a header, and fx fy fz tx ty tz."""
    if len(data) == _WRENCH.size and data[:4] == _LITTLE_ENDIAN and data[12 : 16 + _NAME_BYTES] == _NAME:
        _, seconds, rest, _, _, *wrench = _WRENCH.unpack(data)  # as this package writes it: ten hours have 250 million
        return seconds * _SECOND + rest, tuple(wrench)
    cursor = _Cursor(data)
    stamp = cursor.stamp() if message == WRENCH_STAMPED else 0
    return stamp, cursor.numbers("d", 6, 8)


def joints_of(data: bytes) -> tuple[int, dict[str, tuple[float, float]]]:
    """Decode a JointState: time [ns], and position and velocity of each joint, NaN for a missing velocity."""
    cursor = _Cursor(data)
    stamp, names, positions, velocities = cursor.stamp(), cursor.strings(), cursor.doubles(), cursor.doubles()
    if len(names) != len(positions):
        raise ValueError("the numbers of positions and names differ")
    if len(velocities) != len(names):
        velocities = (float("nan"),) * len(names)
    return stamp, dict(zip(names, zip(positions, velocities)))


def position_of(data: bytes) -> tuple[int, dict[str, tuple[float, float]]]:
    """Decode a PoseStamped: time [ns], and x, y, z, each with NaN as its velocity."""
    cursor = _Cursor(data)
    stamp, place = cursor.stamp(), cursor.numbers("d", 3, 8)
    return stamp, {axis: (value, float("nan")) for axis, value in zip("xyz", place)}


def string_of(data: bytes) -> str:
    """Decode a String."""
    return _Cursor(data).string()
