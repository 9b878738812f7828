# SPDX-License-Identifier: Apache-2.0
"""Values of the source paper's experiment, sec. 1 and 2: mean and standard deviation [SI], None if it gives none."""

from .. import core

PAPER = {
    "needle_young_modulus": (14.1e9, 1.6e9),
    "tissue_young_modulus": (116e3, None),
    "puncture_force": (0.2101, 0.0105),
    "puncture_indentation": (3.237e-3, 0.1347e-3),
    "friction_per_length": (18.6, None),
    "cutting_force": (0.0776, 0.0139),
}
# range of the stick–slip oscillation of the cutting force [N] at 1 mm/s; at 3 mm/s there is none
CUTTING_OSCILLATION = {"cutting_force_low_1mm_s": 0.04, "cutting_force_high_1mm_s": 0.1}
_ARREST_SPEED = 1.5e-3  # [m/s] any value between the two speeds gives the same forces
_STEADY_SPEED = 3e-3  # [m/s]


def stick_slip(force: float) -> core.laws.StickSlip:
    """A cutting law with a steady ``force`` [N] at 3 mm/s that oscillates at 1 mm/s over the paper's scaled range."""
    low, high = (force / PAPER["cutting_force"][0] * end for end in CUTTING_OSCILLATION.values())
    return core.laws.StickSlip(
        break_force=high,
        arrest_force=low,
        arrest_speed=_ARREST_SPEED,
        damping=(force - low) / (_STEADY_SPEED - _ARREST_SPEED),
    )
