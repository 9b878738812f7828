# SPDX-License-Identifier: Apache-2.0
"""The names of phases and of status values, and the version, read from the compiled core."""

from enum import StrEnum

from . import core
from .core import version as __version__

Phase = StrEnum("Phase", core.phase_names())
Status = StrEnum("Status", [*core.status_names(), "no_contact", "no_puncture", "incomplete", "unreadable"])


__all__ = ["Phase", "Status", "__version__"]
