# SPDX-License-Identifier: Apache-2.0
"""The messages of the file as CDR, little-endian: layouts are fixed, because frame and joint have one name each.

CDR: OMG DDS-XTypes 1.3, sec. 7.4 (encoding version 1). Numbers stand at multiples of their size, counted from behind
the four bytes that say how the rest is encoded; a string is its length with the closing zero, and its bytes.
"""

import struct
from collections.abc import Sequence

FRAME = b"needle"  # frame_id of every message, and the name of the one joint
_LITTLE_ENDIAN = b"\0\1\0\0"
_NAMED = len(FRAME) + 1
_SECOND = 1_000_000_000  # ns
# encoding, seconds, nanoseconds, frame; forces and torques
_WRENCH = struct.Struct(f"<4siII{_NAMED}s5x6d")
# … frame; one name; one position; one velocity; no effort
_STATE = struct.Struct(f"<4siII{_NAMED}sxII{_NAMED}sxIdI4xdI")


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
