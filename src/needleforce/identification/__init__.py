# SPDX-License-Identifier: Apache-2.0
"""From recordings to mechanics: fits, intervals, and what cannot be known."""

from .compare import Comparison, ModelRow, compare
from .estimates import Correlations, Estimate, Quality
from .identify import identify
from .indentation import IndentationFit, fit_indentation
from .indentation_tips import TipFit, compare_tips
from .indentation_unloading import UnloadingFit, fit_unloading
from .lugre import FilteredLuGre, filter_lugre
from .lugre_filter import LuGreFilter
from .profile_likelihood import Profile, profile
from .result import Fit, RecordingFit
from .statistics.draws import Draws
from .two_pass.result import BiasTerm, Site, TwoPass

__all__ = [
    "BiasTerm",
    "Comparison",
    "Correlations",
    "Draws",
    "Estimate",
    "FilteredLuGre",
    "Fit",
    "IndentationFit",
    "LuGreFilter",
    "ModelRow",
    "Profile",
    "Quality",
    "RecordingFit",
    "Site",
    "TipFit",
    "TwoPass",
    "UnloadingFit",
    "compare",
    "compare_tips",
    "filter_lugre",
    "fit_indentation",
    "fit_unloading",
    "identify",
    "profile",
]
