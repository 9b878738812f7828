# SPDX-License-Identifier: Apache-2.0
"""From recordings to mechanics: fits, intervals, and what cannot be known."""

from .compare import Row, compare
from .estimates import Estimate, Quality
from .identify import identify
from .indentation import IndentationFit, TipRow, compare_tips, fit_indentation
from .lugre import FilteredLuGre, LuGreFilter, filter_lugre
from .profile_likelihood import Profile, profile
from .result import Fit, RecordingFit
from .statistics.correlations import Correlations
from .statistics.draws import Draws
from .two_pass.result import Bias, Site, TwoPass

__all__ = [
    "Bias",
    "Correlations",
    "Draws",
    "Estimate",
    "FilteredLuGre",
    "Fit",
    "IndentationFit",
    "LuGreFilter",
    "Profile",
    "Quality",
    "RecordingFit",
    "Row",
    "Site",
    "TipRow",
    "TwoPass",
    "compare",
    "compare_tips",
    "filter_lugre",
    "fit_indentation",
    "identify",
    "profile",
]
