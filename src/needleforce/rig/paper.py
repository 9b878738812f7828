# SPDX-License-Identifier: Apache-2.0
"""The numbers of the source paper's experiment, sec. 1 and 2, as mean and standard deviation [SI]; None where it has
none."""

PAPER = {
    "needle_young_modulus": (14.1e9, 1.6e9),
    "tissue_young_modulus": (116e3, None),
    "puncture_force": (0.2101, 0.0105),
    "puncture_indentation": (3.237e-3, 0.1347e-3),
    "friction_per_length": (18.6, None),
    "cutting_force": (0.0776, 0.0139),
}
# the range over which the cutting force swings at 1 mm/s; the law that swings is not there yet
SWING = {"cutting_force_low_1mm_s": 0.04, "cutting_force_high_1mm_s": 0.1}
