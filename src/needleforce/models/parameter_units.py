# SPDX-License-Identifier: Apache-2.0
"""The SI unit of every parameter by its name: those of the laws from the core's tables, and those that a fit has in
addition to the laws."""

import re

from .. import core
from ..mechanics.foundation import READINGS

OF_LAWS = {row["name"]: row["unit"] for law in vars(core.laws).values() if hasattr(law, "table") for row in law.table()}
"""Where two laws have a parameter of one name, it has one unit: a test of the vocabulary."""

UNITS = OF_LAWS | {
    # contact and punctures of a recording, in its own zero
    "contact_depth": "m",
    "puncture_depth": "m",
    "puncture_indentation": "m",
    "puncture_force": "N",
    "force_offset": "N",
    # one layer
    "stiffness_coefficient": "N/m^2",
    "saturation_depth": "m",
    "friction_per_length": "N/m",
    "friction_bend": "1",
    "cutting_force": "N",
    "rupture_onset": "m",
    "rupture_exponent": "1",
    "machine_stiffness": "N/m",
    # several layers
    "top": "m",
    "contact_stiffness": "N/m",
    "tissue_stiffness": "N/m",
    "relaxation_share_1": "1",
    "relaxation_share_2": "1",
    "relaxation_time_1": "s",
    "relaxation_time_2": "s",
    "speed_exponent": "1",
    # moduli and what follows from them
    "young_modulus": "Pa",
    "tissue_young_modulus": "Pa",
    "needle_young_modulus": "Pa",
    "bending_stiffness": "N m^2",
    "clamp_compliance": "rad/(N m)",
    "implied_poisson_ratio": "1",
    **{f"friction_coefficient_{reading}": "1" for reading in READINGS},
    # an indentation curve
    "baseline": "N",
    "baseline_slope": "N/m",
    "hardness": "Pa",
    "unloading_stiffness": "N/m",
    "residual_depth": "m",
}


def unit_of(name: str) -> str:
    """The unit of a parameter, also of a deeper layer's, such as ``layer_2_friction_per_length``."""
    return UNITS[re.sub(r"^layer_\d+_", "", name)]
