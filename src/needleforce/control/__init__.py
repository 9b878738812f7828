# SPDX-License-Identifier: Apache-2.0
"""Control loops: limits of a haptic device or robot around an insertion, models replaced while the loop runs, and
whether a held needle comes to rest in a device's loop."""

from .device_loop import Device
from .guard import BaseGuard, Guard, LiveInsertion, depth_noise
from .rest import Chatter, RestResult, rest_in_loop, simulated_hold

__all__ = [
    "BaseGuard",
    "Chatter",
    "Device",
    "Guard",
    "LiveInsertion",
    "RestResult",
    "depth_noise",
    "rest_in_loop",
    "simulated_hold",
]
