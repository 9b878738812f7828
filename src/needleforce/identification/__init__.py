# SPDX-License-Identifier: Apache-2.0
"""From recordings to mechanics: fits, intervals, and what cannot be known."""

from .bench_tests import BendingFit, LawFit, StressCurve, StressFit, fit_stress, needle_modulus, three_point_modulus
from .bench_tests.penetration import PenetrationTest, penetration_test
from .bench_tests.penetration_statistics import PenetrationTests, penetration_tests
from .compare import Comparison, ModelRow, compare
from .estimates import Correlations, Estimate, Quality
from .identify import identify
from .indentation import IndentationFit, fit_indentation
from .indentation_tips import TipFit, compare_tips
from .lugre import FilteredLuGre, filter_lugre
from .lugre_filter import LuGreFilter
from .profile_likelihood import Profile, profile
from .result import Fit, RecordingFit
from .statistics.draws import Draws
from .two_pass.result import BiasTerm, Site, TwoPass

__all__ = [
    "BendingFit",
    "BiasTerm",
    "Comparison",
    "Correlations",
    "Draws",
    "Estimate",
    "FilteredLuGre",
    "Fit",
    "IndentationFit",
    "LawFit",
    "LuGreFilter",
    "ModelRow",
    "PenetrationTest",
    "PenetrationTests",
    "Profile",
    "Quality",
    "RecordingFit",
    "Site",
    "StressCurve",
    "StressFit",
    "TipFit",
    "TwoPass",
    "compare",
    "compare_tips",
    "filter_lugre",
    "fit_indentation",
    "fit_stress",
    "identify",
    "needle_modulus",
    "penetration_test",
    "penetration_tests",
    "profile",
    "three_point_modulus",
]
