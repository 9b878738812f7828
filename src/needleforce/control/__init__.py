# SPDX-License-Identifier: Apache-2.0
"""The force in the hand: what a loop needs around an insertion."""

from .guard import Guard
from .live import LiveInsertion

__all__ = ["Guard", "LiveInsertion"]
