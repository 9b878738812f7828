# SPDX-License-Identifier: Apache-2.0
"""Identified quantities with their intervals."""

from dataclasses import dataclass
from math import isfinite

from .cycle_fit import CycleFit

AT_ONCE = 0.05  # of the indentation

UNITS = {
    "stiffness_coefficient": "N/m^2",
    "contact_depth": "m",
    "saturation_depth": "m",
    "puncture_depth": "m",
    "puncture_indentation": "m",
    "puncture_force": "N",
    "friction_per_length": "N/m",
    "cutting_force": "N",
}


@dataclass(frozen=True)
class Estimate:
    """One quantity [SI ``unit``] with its 95 % interval ``low`` to ``high``; ``source`` says how it was obtained.

    ``between_repeats_sd`` is None with fewer than two repeats. ``identifiable`` is False where a log alone cannot tell
    it.
    """

    name: str
    value: float
    unit: str
    low: float
    high: float
    between_repeats_sd: float | None = None
    identifiable: bool = True
    source: str = ""


@dataclass(frozen=True)
class Quality:
    """Residual of the model over the strokes: rms [N], rms over the peak force, and R squared."""

    rmse_N: float
    nrmse: float
    r2: float


def estimates_of(fit: CycleFit, has_withdrawal: bool) -> dict[str, Estimate]:
    """The estimates of one cycle; without a withdrawal, friction and cutting rest on the insertion's slope alone."""
    source = f"complete fit, {fit.law}" + ("" if has_withdrawal else ", insertion only")
    names = [name for name in UNITS if name in fit.values and not _absent(name, fit)]
    return {name: _estimate(name, fit, source) for name in names}


def _estimate(name: str, fit: CycleFit, source: str) -> Estimate:
    limits = fit.values[name], UNITS[name], fit.low[name], fit.high[name]
    return Estimate(name, *limits, identifiable=_known(name, fit), source=source)


def _absent(name: str, fit: CycleFit) -> bool:
    """A bare cone has no saturation depth."""
    return name == "saturation_depth" and fit.law == "cone"


def _known(name: str, fit: CycleFit) -> bool:
    """False without an interval, for a stiffness that may be none, and for the two factors of a contact that saturates
    at once: their product is known."""
    if name in ("stiffness_coefficient", "saturation_depth") and fit.law == "cone_cylinder":
        if fit.values["saturation_depth"] < AT_ONCE * fit.values["puncture_indentation"]:
            return False
    if name == "stiffness_coefficient" and not fit.low[name] > 0.0:
        return False
    return isfinite(fit.low[name])
