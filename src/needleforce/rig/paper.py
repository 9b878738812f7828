# SPDX-License-Identifier: Apache-2.0
"""The numbers of the source paper's experiment, sec. 1 and 2, as mean and standard deviation [SI]; None where it has
none."""

from .. import core

PAPER = {
    "needle_young_modulus": (14.1e9, 1.6e9),
    "tissue_young_modulus": (116e3, None),
    "puncture_force": (0.2101, 0.0105),
    "puncture_indentation": (3.237e-3, 0.1347e-3),
    "friction_per_length": (18.6, None),
    "cutting_force": (0.0776, 0.0139),
}
# the range over which the cutting force swings at 1 mm/s; at 3 mm/s it does not
CUTTING_OSCILLATION = {"cutting_force_low_1mm_s": 0.04, "cutting_force_high_1mm_s": 0.1}
_ARREST_SPEED = 1.5e-3  # [m/s] between the two; any other between them would do as well
_STEADY_SPEED = 3e-3  # [m/s]


def stick_slip(force: float):
    """The cutting law that is steady at 3 mm/s with ``force`` [N] and swings at 1 mm/s, over the paper's range to
    scale."""
    low, high = (force / PAPER["cutting_force"][0] * end for end in CUTTING_OSCILLATION.values())
    return core.laws.StickSlip(
        break_force=high,
        arrest_force=low,
        arrest_speed=_ARREST_SPEED,
        damping=(force - low) / (_STEADY_SPEED - _ARREST_SPEED),
    )
