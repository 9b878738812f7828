# SPDX-License-Identifier: Apache-2.0
"""Control loops: limits of a haptic device or robot around an insertion, and models replaced while the loop runs."""

from .guard import Guard
from .live import LiveInsertion

__all__ = ["Guard", "LiveInsertion"]
