# SPDX-License-Identifier: Apache-2.0
"""From recordings to mechanics: fits, intervals, and what cannot be known."""

from .compare import Row, compare
from .correlations import Correlations
from .draws import Draws
from .estimates import Estimate, Quality
from .fit import Fit, RecordingFit
from .identify import identify
from .lugre_filter import LuGreFilter
from .lugre_recording import FilteredLuGre, filter_lugre
from .profile import Profile, profile
from .two_pass import Site, TwoPass

__all__ = [
    "Correlations",
    "Draws",
    "Estimate",
    "FilteredLuGre",
    "Fit",
    "LuGreFilter",
    "Profile",
    "Quality",
    "RecordingFit",
    "Row",
    "Site",
    "TwoPass",
    "compare",
    "filter_lugre",
    "identify",
    "profile",
]
