# SPDX-License-Identifier: Apache-2.0
"""Keys of preset files carry their unit: ``half_angle_deg``, ``reduced_modulus_kPa``. Converted here and nowhere
else."""

import math
from fractions import Fraction

# SI unit of a parameter table -> endings a key may have -> SI units in one
ENDINGS = {
    "m": {"m": "1", "mm": "1/1000", "um": "1/1000000"},
    "Pa": {"Pa": "1", "kPa": "1000", "MPa": "1000000", "GPa": "1000000000"},
    "N": {"N": "1", "mN": "1/1000"},
    "N/m": {"N_per_m": "1", "N_per_mm": "1000"},
    "rad": {"rad": "1", "deg": "pi/180"},
    "J": {"J": "1", "mJ": "1/1000"},
    "1/m": {"per_m": "1", "per_mm": "1000"},
    "N/m^2": {"N_per_m2": "1", "N_per_mm2": "1000000"},
    "s": {"s": "1", "ms": "1/1000"},
    "m/s": {"m_per_s": "1", "mm_per_s": "1/1000"},
    "N s/m": {"N_s_per_m": "1", "N_s_per_mm": "1000"},
    "N s/m^2": {"N_s_per_m2": "1", "N_s_per_mm2": "1000000"},
    "J/m^2": {"J_per_m2": "1", "kJ_per_m2": "1000"},
    "kg": {"kg": "1", "g": "1/1000"},
}


def keys(name: str, unit: str) -> dict[str, str]:
    """Every key under which a parameter may stand, with the SI units in one of the key's."""
    if unit == "1":
        return {name: "1"}
    return {f"{name}_{ending}": factor for ending, factor in ENDINGS[unit].items()}


def to_si(value, factor: str):
    """``value`` in SI as the decimal it was written: 3.237 mm are 3.237e-3 m to the last bit, which 3.237 * 1e-3 is
    not. Of a column each."""
    if isinstance(value, tuple):
        return tuple(to_si(each, factor) for each in value)
    if factor == "pi/180":
        return math.radians(value)
    return float(Fraction(repr(value)) * Fraction(factor)) if math.isfinite(value) else value


def si_key(name: str, unit: str) -> str:
    """The key whose value is SI: what is written."""
    return next(iter(keys(name, unit)))
