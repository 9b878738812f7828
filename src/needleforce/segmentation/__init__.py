# SPDX-License-Identifier: Apache-2.0
"""Where contact, punctures, hold and exit lie in a recording."""

from .events import Event, Events, Puncture, Span
from .segment import segment

__all__ = ["Event", "Events", "Puncture", "Span", "segment"]
