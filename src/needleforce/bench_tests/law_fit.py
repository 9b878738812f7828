# SPDX-License-Identifier: Apache-2.0
"""One stress-stretch law, fitted to the readings of tension and compression tests by least squares."""

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from .laws import OGDEN, SUMS, initial_modulus, is_stable, mode_number, nominal_stress, stable_range
from .ogden import at_bound, fit_ogden

MAX_CONDITION = 1e10  # of the scaled normal equations: beyond, the readings do not determine the coefficients


@dataclass(frozen=True, eq=False)
class StressCurve:
    """One stress-stretch curve of a specimen.

    Attributes
    ----------
    stretch : array_like
        Length over undeformed length (n,) [1], above 0: below 1 in compression.
    stress : array_like
        Nominal stress (n,) [Pa]: force over undeformed area, positive in tension.
    mode : str
        "uniaxial", "equibiaxial" or "planar" (pure shear): a curve does not show which of them it is.
    name : str
        For messages and figures.
    """

    stretch: Any
    stress: Any
    mode: str = "uniaxial"
    name: str = ""


@dataclass(frozen=True, eq=False, kw_only=True)
class LawFit:
    """One law, fitted to all readings.

    Attributes
    ----------
    law : str
        One of ``LAWS``.
    coefficients : numpy.ndarray
        As ``nominal_stress`` takes them.
    young_modulus, standard_error : float
        E = 3 mu_0 and its standard error for this law [Pa].
    freedom : float
        Effective number of readings minus the number of unknowns.
    residual : numpy.ndarray
        Measured minus fitted stress (n,) [Pa].
    misfit : float
        Root mean square of the residual over the largest measured stress [1].
    criterion : float
        Akaike's criterion, corrected for few readings, from the effective number of readings.
    weight : float
        Akaike weight [1]; 0 for a law that is unstable within the readings.
    stable : dict of str to tuple of float
        Loading mode -> the stretches between which the law is stable; 0 or infinity where no end was found.
    excluded : str
        Why the law is not in the choice; empty if it is.
    """

    law: str
    coefficients: np.ndarray
    young_modulus: float
    standard_error: float
    freedom: float
    residual: np.ndarray = field(repr=False)
    misfit: float
    criterion: float
    weight: float = 0.0
    stable: dict[str, tuple[float, float]]
    excluded: str = ""
    zero: np.ndarray = field(default_factory=lambda: np.zeros(0))


class Readings:
    """The readings of all curves in one column each."""

    def __init__(self, curves: tuple[StressCurve, ...], fit_zero: bool):
        self.curves = curves
        self.stretch = np.concatenate([curve.stretch for curve in curves])
        self.stress = np.concatenate([curve.stress for curve in curves])
        lengths = [len(curve.stretch) for curve in curves]
        self.t = np.repeat([mode_number(curve.mode) for curve in curves], lengths)
        owner = np.repeat(np.arange(len(curves)), lengths)
        self.zeros = (owner[:, None] == np.arange(len(curves))).astype(float)[:, : len(curves) * fit_zero]
        self.ends = np.cumsum(lengths)[:-1]
        self.peak = float(np.abs(self.stress).max())

    def of_mode(self, mode: str) -> np.ndarray:
        """The stretches of the readings in a loading mode."""
        return self.stretch[self.t == mode_number(mode)]

    def by_curve(self, values: np.ndarray) -> list[np.ndarray]:
        """``values`` (n,) of all readings, curve by curve."""
        return np.split(values, self.ends)


def solved(name: str, readings: Readings) -> LawFit | None:
    """One law by least squares; None with fewer readings than it needs."""
    count = len(SUMS[name].names) if name in SUMS else 2 * OGDEN[name]
    unknowns = count + readings.zeros.shape[1]
    if len(np.unique(readings.stretch)) <= unknowns:
        return None
    if name in SUMS:
        design = np.column_stack([*SUMS[name].columns(readings.stretch, readings.t), readings.zeros])
        values, gradient = _scaled_solution(design, readings.stress), np.array(SUMS[name].weights)
    else:
        values, design = fit_ogden(OGDEN[name], readings.stretch, readings.t, readings.stress, readings.zeros)
        gradient = 1.5 * np.ravel(np.column_stack([values[1:count:2], values[:count:2]]))
    zero, residual = values[count:], readings.stress - readings.zeros @ values[count:]
    for curve, part in zip(readings.curves, np.split(np.arange(len(residual)), readings.ends)):
        residual[part] -= nominal_stress(name, curve.stretch, values[:count], curve.mode)
    error, determined = _unit_error(design, np.append(gradient, np.zeros(len(zero))))
    stable = {
        curve.mode: stable_range(name, readings.of_mode(curve.mode), values[:count], curve.mode)
        for curve in readings.curves
    }
    return LawFit(
        law=name,
        coefficients=values[:count],
        young_modulus=initial_modulus(name, values[:count]),
        standard_error=error,  # per unit of the noise, until that is known
        freedom=float(unknowns + 1),
        residual=residual,
        misfit=_rms(residual) / readings.peak,
        criterion=math.nan,
        stable=stable,
        excluded=_why_excluded(name, values[:count], readings, determined),
        zero=zero,
    )


def _why_excluded(name: str, coefficients: np.ndarray, readings: Readings, determined: bool) -> str:
    """Why a fit is not one of the choice; empty if it is."""
    if name in OGDEN and at_bound(coefficients[1::2], readings.stretch):
        return _UNDETERMINED["bound"]
    return "" if determined else _UNDETERMINED["ogden" if name in OGDEN else "sum"]


_UNDETERMINED = {
    "bound": "the readings do not determine an exponent: it is at the bound of the search",
    "ogden": "terms are equal or 0: fewer terms fit as well",
    "sum": "the readings do not determine its coefficients",
}


def _scaled_solution(design: np.ndarray, stress: np.ndarray) -> np.ndarray:
    scale = np.linalg.norm(design, axis=0)
    scale[scale == 0.0] = 1.0
    return np.linalg.lstsq(design / scale, stress, rcond=None)[0] / scale


def _unit_error(jacobian: np.ndarray, gradient: np.ndarray) -> tuple[float, bool]:
    """Standard error of a linear function of the coefficients for noise of size 1, infinite if it is not determined,
    and whether each coefficient is."""
    scale = np.linalg.norm(jacobian, axis=0)
    scale[scale == 0.0] = 1.0
    values, vectors = np.linalg.eigh((jacobian / scale).T @ (jacobian / scale))
    known = values > values[-1] / MAX_CONDITION
    parts = vectors.T @ (gradient / scale)
    lost = float(np.linalg.norm(parts[~known])) > 1e-3 * float(np.linalg.norm(parts))
    error = math.inf if lost else math.sqrt(float(np.sum(parts[known] ** 2 / values[known])))
    return error, bool(known.all())


def without_unstable(fit: LawFit, readings: Readings) -> LawFit:
    """The fit, excluded from the choice if the law is not stable within the readings."""
    if fit.excluded:
        return fit
    for mode in dict.fromkeys(curve.mode for curve in readings.curves):
        own = readings.of_mode(mode)
        path = np.exp(np.linspace(min(np.log(own.min()), 0.0), max(np.log(own.max()), 0.0), 200))
        stable = is_stable(fit.law, path, fit.coefficients, mode)
        if not stable.all():
            first = path[~stable][np.argmin(np.abs(np.log(path[~stable])))]
            return replace(fit, excluded=f"it softens: not stable (Drucker) at a stretch of {first:.3g}, {mode}")
    return fit


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))
