# SPDX-License-Identifier: Apache-2.0
"""While the needle moves: parameters, force ahead, next puncture."""

from .force_ahead import ForceAhead
from .identifier import OnlineIdentifier
from .prior import Prior

__all__ = ["ForceAhead", "OnlineIdentifier", "Prior"]
