# SPDX-License-Identifier: Apache-2.0
"""Studies: a question as data. Factors with distributions, insertions simulated with their values, and what the outputs
depend on."""

from .result import StudyResult
from .study import study

__all__ = ["StudyResult", "study"]
