# SPDX-License-Identifier: Apache-2.0
"""Anomalies of a recording, and numbers formatted for their sentences."""

from dataclasses import dataclass

import numpy as np

INVALIDATING = ("sign", "force_unit", "depth_unit", "saturated")
"""Kinds of anomalies that invalidate the values of a recording."""
_DISPLAY_UNITS = {
    "m": (1e3, "mm"),
    "m/s": (1e3, "mm/s"),
    "N/m": (1e-3, "N/mm"),
    "N/m^2": (1e-6, "N/mm²"),
    "1": (1.0, ""),
}


@dataclass(frozen=True, kw_only=True)
class Anomaly:
    """An anomaly of a recording.

    Parameters
    ----------
    kind : str
        A short name, such as ``sign``, ``force_unit``, ``motion`` or ``outlier``.
    quantity : str
        The quantity that is anomalous.
    value : float
        Its value [``unit``].
    usual : float
        The value of the repeats [``unit``], NaN if nothing is compared.
    unit : str
        SI unit.
    sentence : str
        A description with the next step.
    left_out : bool
        True if the pooled fit does not use the recording.
    """

    kind: str
    quantity: str
    value: float
    usual: float
    unit: str
    sentence: str
    left_out: bool = False


def formatted(value: float, unit: str) -> str:
    """Format a value with its unit: three significant digits, or all digits before the decimal point."""
    factor, name = _DISPLAY_UNITS.get(unit, (1.0, unit))
    value = factor * value
    return f"{value:.0f} {name}".rstrip() if 1000.0 <= abs(value) < 1e6 else f"{value:.3g} {name}".rstrip()


def nearest(ratio: float, known: tuple[float, ...], within: float) -> float | None:
    """The factor of ``known``, or the inverse of one, that is within a relative distance ``within`` of ``ratio``, or
    None."""
    if not (np.isfinite(ratio) and ratio > 0.0):
        return None
    candidates = [factor for each in known for factor in (each, 1.0 / each)]
    best = min(candidates, key=lambda factor: abs(np.log(ratio / factor)))
    return best if abs(np.log(ratio / best)) <= np.log1p(within) else None
