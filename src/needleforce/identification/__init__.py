# SPDX-License-Identifier: Apache-2.0
"""From recordings to mechanics: fits, intervals, and what cannot be known."""

from .compare import Row, compare
from .correlations import Correlations
from .draws import Draws
from .estimates import Estimate, Quality
from .fit import Fit, RecordingFit
from .identify import identify
from .indentation_curve import IndentationFit, fit_indentation
from .lugre_filter import LuGreFilter
from .lugre_recording import FilteredLuGre, filter_lugre
from .profile import Profile, profile
from .tip_comparison import TipRow, compare_tips
from .two_pass import Bias, Site, TwoPass

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
