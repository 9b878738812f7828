# SPDX-License-Identifier: Apache-2.0
"""From recordings to mechanics: fits, intervals, and what cannot be known."""

from .compare import Row, compare
from .estimates import Estimate, Quality
from .fit import Fit, RecordingFit
from .identify import identify
from .two_pass import Site, TwoPass

__all__ = ["Estimate", "Fit", "Quality", "RecordingFit", "Row", "Site", "TwoPass", "compare", "identify"]
