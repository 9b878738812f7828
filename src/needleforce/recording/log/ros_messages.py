# SPDX-License-Identifier: Apache-2.0
"""The ROS 2 messages of a log: their schemas as text, ours encoded as CDR, those of any recorder decoded."""

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
_NAMED = len(FRAME) + 1
_SECOND = 1_000_000_000  # ns
# encoding, seconds, nanoseconds, frame; forces and torques
_WRENCH = struct.Struct(f"<4siII{_NAMED}s5x6d")
# … frame; one name; one position; one velocity; no effort
_STATE = struct.Struct(f"<4siII{_NAMED}sxII{_NAMED}sxIdI4xdI")
_LONGEST = 4096  # joints in a state: no robot has more


def schema_text(message: str) -> str:
    """The definition of a message, such as ``WRENCH_STAMPED``, and of all it is made of, each after a line of ``=``."""
    names = [message.replace("/msg/", "/")]
    for name in names:  # grows while it is walked
        kinds = (line.split()[0].removesuffix("[]") for line in _FIELDS[name].splitlines())
        names += [kind for kind in kinds if kind in _FIELDS and kind not in names]
    first, *others = names
    parts = [_FIELDS[first], *(f"MSG: {name}\n{_FIELDS[name]}" for name in others)]
    return ("\n" + "=" * 80 + "\n").join(parts) + "\n"


def wrench_message(stamp: int, wrench: Sequence[float]) -> bytes:
    """A WrenchStamped: time [ns], six floats fx fy fz [N] tx ty tz [N m]."""
    return _WRENCH.pack(_LITTLE_ENDIAN, *divmod(stamp, _SECOND), _NAMED, FRAME, *wrench)


def state_message(stamp: int, depth: float, velocity: float) -> bytes:
    """A JointState of the one joint: time [ns], depth [m] as its position, velocity [m/s]."""
    header = (_LITTLE_ENDIAN, *divmod(stamp, _SECOND), _NAMED, FRAME)
    return _STATE.pack(*header, 1, _NAMED, FRAME, 1, depth, 1, velocity, 0)


def string_message(text: str) -> bytes:
    """A String."""
    data = text.encode() + b"\0"
    return _LITTLE_ENDIAN + struct.pack("<I", len(data)) + data


class _Cursor:
    """Reads CDR of encoding version 1 in either byte order, from behind its four bytes of encoding."""

    def __init__(self, data: bytes):
        if len(data) < 4 or data[0] != 0 or data[1] > 1:
            raise ValueError("no plain CDR")
        self._data, self._at, self._order = data, 4, "<" if data[1] else ">"

    def numbers(self, code: str, count: int, size: int) -> tuple:
        """``count`` numbers of ``size`` bytes, from the next multiple of it."""
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
        return self.numbers("d", self._few(), 8)

    def strings(self) -> list[str]:
        return [self.string() for _ in range(self._few())]

    def stamp(self) -> int:
        """The time [ns] of a header, whose frame is passed over."""
        seconds, rest = self.numbers("i", 1, 4)[0], self.length()
        self.string()
        return seconds * _SECOND + rest

    def _few(self) -> int:
        count = self.length()
        if count > _LONGEST:
            raise ValueError("more entries than any message has")
        return count


def wrench_of(data: bytes, message: str) -> tuple[int, tuple]:
    """Time [ns], 0 without a header, and fx fy fz tx ty tz of a Wrench or WrenchStamped."""
    cursor = _Cursor(data)
    stamp = cursor.stamp() if message == WRENCH_STAMPED else 0
    return stamp, cursor.numbers("d", 6, 8)


def joints_of(data: bytes) -> tuple[int, dict[str, tuple[float, float]]]:
    """Time [ns], and position and velocity of each joint of a JointState; NaN for a velocity that is not there."""
    cursor = _Cursor(data)
    stamp, names, positions, velocities = cursor.stamp(), cursor.strings(), cursor.doubles(), cursor.doubles()
    if len(names) != len(positions):
        raise ValueError("as many positions as names are needed")
    if len(velocities) != len(names):
        velocities = (float("nan"),) * len(names)
    return stamp, dict(zip(names, zip(positions, velocities)))


def place_of(data: bytes) -> tuple[int, dict[str, tuple[float, float]]]:
    """Time [ns], and x, y, z of a PoseStamped, each with NaN as its velocity."""
    cursor = _Cursor(data)
    stamp, place = cursor.stamp(), cursor.numbers("d", 3, 8)
    return stamp, {axis: (value, float("nan")) for axis, value in zip("xyz", place)}


def string_of(data: bytes) -> str:
    """The text of a String."""
    return _Cursor(data).string()
