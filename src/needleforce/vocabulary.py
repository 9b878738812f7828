# SPDX-License-Identifier: Apache-2.0
"""What the whole package shares: the names of phases and of status values and the version, read from the compiled core,
and the number that stands in place of a 0 that would divide."""

from enum import StrEnum

from . import core
from .core import version as __version__

Phase = StrEnum("Phase", core.phase_names())
Status = StrEnum("Status", [*core.status_names(), "no_contact", "no_puncture", "incomplete", "unreadable"])

SMALLEST = 1e-300
"""In place of 0, by which nothing is divided and which has no logarithm: far below the square of any recorded force [N]
or length [m], and its own quotients are still finite."""

__all__ = ["SMALLEST", "Phase", "Status", "__version__"]
