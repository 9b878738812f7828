# SPDX-License-Identifier: Apache-2.0
"""Identified quantities with their intervals."""

from dataclasses import dataclass
from math import inf, isfinite, sqrt

from .one_layer.cycle_fit import CycleFit
from .one_layer.loading_curves import CURVES

UNITS = {name: unit for curve in CURVES.values() for name, unit in curve.units.items()} | {
    "contact_depth": "m",
    "puncture_depth": "m",
    "puncture_indentation": "m",
    "puncture_force": "N",
    "friction_per_length": "N/m",
    "cutting_force": "N",
}


@dataclass(frozen=True)
class Estimate:
    """One quantity [SI ``unit``] with its 95 % interval ``low`` to ``high``; ``source`` says how it was obtained.

    ``between_repeats_sd`` is the scatter of the repeats' values, ``within_run_sd`` the root mean square of their own
    standard errors, which is part of it; both are None with fewer than two repeats. ``identifiable`` is False where a
    log alone cannot tell it.
    """

    name: str
    value: float
    unit: str
    low: float
    high: float
    between_repeats_sd: float | None = None
    identifiable: bool = True
    source: str = ""
    within_run_sd: float | None = None

    @property
    def specimen_sd(self) -> float | None:
        """Scatter between repeats beyond what their own errors make of it (moments): that of specimen and needle."""
        if self.between_repeats_sd is None or self.within_run_sd is None:
            return None
        return sqrt(max(self.between_repeats_sd**2 - self.within_run_sd**2, 0.0))


@dataclass(frozen=True)
class Quality:
    """Residual of the model over the strokes: rms [N], rms over the peak force, and R squared."""

    rmse_N: float
    nrmse: float
    r2: float


def estimates_of(fit: CycleFit, has_withdrawal: bool) -> dict[str, Estimate]:
    """The estimates of one cycle; without a withdrawal, friction and cutting rest on the insertion's slope alone."""
    source = f"{'fit by stages' if fit.by_stages else 'complete fit'}, {fit.law}" + (
        "" if has_withdrawal else ", insertion only"
    )
    names = [name for name in UNITS if name in fit.values and not _absent(name, fit)]
    return {name: _estimate(name, fit, source) for name in names}


def _estimate(name: str, fit: CycleFit, source: str) -> Estimate:
    limits = fit.values[name], UNITS[name], fit.low[name], fit.high[name]
    return Estimate(name, *limits, identifiable=_known(name, fit), source=source)


def _absent(name: str, fit: CycleFit) -> bool:
    """The complete fit gives an infinite saturation depth for a bare cone, which has none."""
    return any(name in curve.units for curve in CURVES.values()) and name not in CURVES[fit.law].units


def _known(name: str, fit: CycleFit) -> bool:
    """False without an interval, for a stiffness that may be none, and for factors of which only the product is
    known."""
    curve = CURVES[fit.law]
    if name in curve.not_told_apart(fit.values):
        return False
    if [name] == list(curve.amplitudes) and not fit.low[name] > 0.0:
        return False
    anything = fit.low[name] == 0.0 and fit.high[name] == inf
    return isfinite(fit.low[name]) and not anything
