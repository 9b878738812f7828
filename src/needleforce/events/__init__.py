# SPDX-License-Identifier: Apache-2.0
"""Events while the needle moves: a stream that is watched, its rows from a file or a program, and how to choose the
detector's settings."""

from ..core import Detection, EventDetector, EventSettings
from .choice import SettingsChoice, SettingsRow, choose
from .rows import Losses, Row, replayed, rows_of_lines
from .watch import Watch

__all__ = [
    "Detection",
    "EventDetector",
    "EventSettings",
    "Losses",
    "Row",
    "SettingsChoice",
    "SettingsRow",
    "Watch",
    "choose",
    "replayed",
    "rows_of_lines",
]
