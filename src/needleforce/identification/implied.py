# SPDX-License-Identifier: Apache-2.0
"""What identified numbers imply about quantities that a log cannot tell, under stated priors."""

import math

from ..mechanics.contact import contact
from ..mechanics.foundation import READINGS, friction_coefficient


def implied_reduced_modulus(force: float, depth: float, tip, shank_radius: float | None = None) -> float:
    """E_r [Pa] at which ``tip`` needs ``force`` [N] to reach ``depth`` [m]: force is proportional to E_r."""
    return force / contact(tip, depth=depth, reduced_modulus=1.0, shank_radius=shank_radius).force


def implied_poisson_ratio(reduced_modulus: float, young_modulus: float, needle=None) -> float:
    """nu_2 that makes a tissue of ``young_modulus`` [Pa] meet ``reduced_modulus`` [Pa]; NaN where none in 0 to 1 does.

    ``needle`` None is a rigid one; otherwise eq. (4) in full.
    """
    needle_part = 0.0 if needle is None else (1.0 - needle.poisson_ratio**2) / needle.young_modulus
    squared = 1.0 - young_modulus * (1.0 / reduced_modulus - needle_part)
    return math.sqrt(squared) if 0.0 <= squared <= 1.0 else math.nan


def implied_friction_coefficients(per_length: float, needle, tissue) -> dict[str, float]:
    """The friction coefficient under each reading of the paper's foundation formula."""
    return {reading: friction_coefficient(per_length, needle, tissue, reading=reading) for reading in READINGS}
