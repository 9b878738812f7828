# SPDX-License-Identifier: Apache-2.0
"""Detection of contact, punctures, hold and exit in a recording."""

from .events import Event, Events, Puncture, Span
from .segment import segment

__all__ = ["Event", "Events", "Puncture", "Span", "segment"]
