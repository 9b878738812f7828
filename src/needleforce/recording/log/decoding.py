# SPDX-License-Identifier: Apache-2.0
"""CDR messages of any recorder back to numbers. What does not decode raises ValueError or struct.error, no more."""

import struct

from . import ros_messages

_SECOND = 1_000_000_000  # ns
_LONGEST = 4096  # joints in a state: no robot has more


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
    stamp = cursor.stamp() if message == ros_messages.WRENCH_STAMPED else 0
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
