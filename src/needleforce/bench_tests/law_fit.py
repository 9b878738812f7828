# SPDX-License-Identifier: Apache-2.0
"""One stress-stretch law, fitted to the readings of tension and compression tests by least squares; Ogden's
without a starting value: a search over its exponents, then a local fit."""

import math
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import Any

import numpy as np

from ..vocabulary import SMALLEST
from .laws import (
    OGDEN,
    SUMS,
    initial_modulus,
    is_stable,
    mode_number,
    nominal_stress,
    ogden_column,
    ogden_slope,
    stable_range,
)

MAX_CONDITION = 1e10  # of the scaled normal equations: beyond, the readings do not determine the coefficients
MAX_EXPONENT = 20.0
"""[1 / largest logarithmic strain] A term with a larger exponent has at half the strain less than exp(-10), 5e-5 of its
largest stress, which no load cell resolves: it is a term of the last readings, whose exponent they do not determine."""
GRID = 61  # exponents of the search, from -MAX_EXPONENT to MAX_EXPONENT
N_STARTS = 5  # sets of exponents, each of its own valley
N_BOUNDED = 2  # of these, also fitted within the bounds, at which a coefficient may end
MAX_COMPARED = 500  # best sets
MAX_STEPS = 600  # an exact curve takes up to 300 of them, depending on rounding; a noisy one 20
_OPTIONS = {"ftol": 1e-10, "xtol": 1e-10, "gtol": 1e-15, "x_scale": "jac"}
SEARCH_READINGS = 200  # the search uses about so many


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
        misfit=float(np.sqrt(np.mean(residual**2))) / readings.peak,
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


def fit_ogden(
    terms: int, stretch: np.ndarray, t: np.ndarray, stress: np.ndarray, zeros: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients mu_1, alpha_1, …, then the zeros of the curves, and the Jacobian (n, p) by them.

    Each term has mu alpha >= 0.
    """
    size = float(np.abs(stress).max())
    fit = _Problem(terms, stretch, t, stress / size, zeros)
    starts = fit.starts()
    found = [x for start in starts if (x := fit.projected(start)) is not None]
    found += [fit.within_bounds(start) for start in starts[:N_BOUNDED]]
    return _coefficients(min(found, key=lambda x: float(np.sum(fit.residual(x) ** 2))), fit, size)


class _Problem:
    """Stress over its largest value as a function of c = mu alpha and of the scaled exponents a = alpha scale."""

    def __init__(self, terms: int, stretch: np.ndarray, t: np.ndarray, stress: np.ndarray, zeros: np.ndarray):
        self.terms, self.stretch, self.t, self.stress = terms, stretch, t, stress
        self.zeros, self.scale = zeros, float(np.abs(np.log(stretch)).max())

    def columns(self, a: np.ndarray) -> np.ndarray:
        """The stress (n, k) of terms with c = 1."""
        return ogden_column(self.stretch[:, None], self.t[:, None], np.asarray(a)[None, :] / self.scale)

    def residual(self, x: np.ndarray) -> np.ndarray:
        k = self.terms
        return self.columns(x[k : 2 * k]) @ x[:k] + self.zeros @ x[2 * k :] - self.stress

    def jacobian(self, x: np.ndarray) -> np.ndarray:
        k = self.terms
        c, a = x[:k], x[k : 2 * k]
        slopes = ogden_slope(self.stretch[:, None], self.t[:, None], a[None, :] / self.scale) / self.scale
        return np.hstack([self.columns(a), slopes * c, self.zeros])

    def within_bounds(self, start: np.ndarray) -> np.ndarray:
        """The least squares from ``start`` with c >= 0 and limited exponents."""
        from scipy.optimize import least_squares

        k, offsets = self.terms, np.full(self.zeros.shape[1], np.inf)
        low = np.r_[np.zeros(k), np.full(k, -MAX_EXPONENT), -offsets]
        high = np.r_[np.full(k, np.inf), np.full(k, MAX_EXPONENT), offsets]
        inside = np.clip(start, low + 1e-9, high - 1e-9)
        return least_squares(self.residual, inside, self.jacobian, bounds=(low, high), max_nfev=100, **_OPTIONS).x

    def projected(self, start: np.ndarray) -> np.ndarray | None:
        """The least squares over the exponents alone, c being the best for them; None if that ends out of bounds.

        Three terms lie in a valley in which c and the exponents together hardly move (variable projection: Golub &
        Pereyra 1973, with the first part of its Jacobian alone).
        """
        from scipy.optimize import least_squares

        k = self.terms
        if len(self.stress) < 2 * k + self.zeros.shape[1]:
            return None

        def linear(a: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
            design = np.hstack([self.columns(a), self.zeros])
            norm = np.linalg.norm(design, axis=0) + SMALLEST
            basis, triangle = np.linalg.qr(design / norm)
            values = np.linalg.lstsq(triangle, basis.T @ self.stress, rcond=None)[0] / norm
            return design @ values - self.stress, basis, values

        def slopes(a: np.ndarray) -> np.ndarray:
            _, basis, values = linear(a)
            columns = self.jacobian(np.r_[values[:k], a, values[k:]])[:, k : 2 * k]
            return columns - basis @ (basis.T @ columns)

        limit = MAX_EXPONENT * (1.0 - 1e-9)
        guess, bounds = np.clip(start[k : 2 * k], -limit, limit), (-MAX_EXPONENT, MAX_EXPONENT)
        a = least_squares(lambda a: linear(a)[0], guess, slopes, bounds=bounds, max_nfev=MAX_STEPS, **_OPTIONS).x
        values = linear(a)[2]
        return np.r_[values[:k], a, values[k:]] if (values[:k] >= 0.0).all() else None

    def starts(self) -> list[np.ndarray]:
        """The best sets of exponents on the grid, each with its coefficients."""
        thin = slice(None, None, max(len(self.stress) // SEARCH_READINGS, 1))
        grid = np.linspace(-MAX_EXPONENT, MAX_EXPONENT, GRID)
        columns, zeros, stress = self.columns(grid)[thin], self.zeros[thin], self.stress[thin]
        basis = np.linalg.qr(zeros)[0] if zeros.shape[1] else zeros
        columns, stress = columns - basis @ (basis.T @ columns), stress - basis @ (basis.T @ stress)
        norm = np.linalg.norm(columns, axis=0)
        gram, right = (columns / norm).T @ (columns / norm), (columns / norm).T @ stress
        sets = np.array(_sets(gram, right, self.terms))
        gain, c = _gains(gram, right, sets)
        order = _apart(sets[np.argsort(-gain, kind="stable")], N_STARTS)
        places = {tuple(each): k for k, each in enumerate(sets.tolist())}
        offset = np.zeros(zeros.shape[1])
        chosen = [places[tuple(each)] for each in order.tolist()]
        return [np.r_[np.maximum(c[k], 1e-6) / norm[sets[k]], grid[sets[k]], offset] for k in chosen]


def _apart(sets: np.ndarray, count: int) -> np.ndarray:
    """The first ``count`` sets of places, best first, without those that are a neighbour of a better one: they descend
    into the same valley."""
    kept = sets[:1]
    for each in sets[:MAX_COMPARED]:
        if len(kept) < count and (np.abs(kept - each).max(axis=1) > 2).all():
            kept = np.vstack([kept, each])
    return kept


def at_bound(alpha: np.ndarray, stretch: np.ndarray) -> bool:
    """Whether an exponent is at ``MAX_EXPONENT``: no optimum, so that its coefficients have no standard error."""
    return bool((np.abs(alpha) * np.abs(np.log(stretch)).max() >= MAX_EXPONENT * (1.0 - 1e-3)).any())


def _sets(gram: np.ndarray, right: np.ndarray, terms: int) -> list[tuple[int, ...]]:
    """Sets of places on the grid to try: all single ones and pairs; for more terms, additions to the best pairs."""
    sets = list(combinations(range(len(right)), min(terms, 2)))
    for size in range(3, terms + 1):
        best = np.argsort(-_gains(gram, right, np.array(sets))[0], kind="stable")[:20]
        sets = list({tuple(sorted({*sets[k], j})) for k in best for j in range(len(right)) if j not in sets[k]})
        sets = sorted(each for each in sets if len(each) == size)
    return sets


def _gains(gram: np.ndarray, right: np.ndarray, sets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Explained sum of squares (m,) and coefficients (m, k) of each set; a set with a negative coefficient gains less
    than any other."""
    k = sets.shape[1]
    matrices = gram[sets[:, :, None], sets[:, None, :]] + 1e-10 * np.eye(k)
    c = np.linalg.solve(matrices, right[sets][..., None])[..., 0]
    gain = np.sum(c * right[sets], axis=1)
    return np.where((c > 0.0).all(axis=1), gain, -np.inf), c


def _coefficients(x: np.ndarray, fit: _Problem, size: float) -> tuple[np.ndarray, np.ndarray]:
    """mu and alpha of each term by exponent, and the Jacobian of the stress by them."""
    k, scale = fit.terms, fit.scale
    order = np.argsort(-x[:k], kind="stable")
    c, a = x[:k][order], x[k : 2 * k][order]
    alpha = np.where(np.abs(a) < 1e-4, 1e-4, a) / scale
    mu = c / alpha
    by_c, by_a = np.split(fit.jacobian(np.r_[c, alpha * scale, x[2 * k :]])[:, : 2 * k], 2, axis=1)
    # c = mu alpha and a = alpha scale: d/dmu = alpha d/dc, d/dalpha = mu d/dc + scale d/da
    columns = np.stack([by_c * alpha, size * (by_c * mu + by_a * scale)], axis=2).reshape(len(fit.stress), 2 * k)
    values = np.r_[np.ravel(np.column_stack([size * mu, alpha])), size * x[2 * k :]]
    return values, np.hstack([columns, fit.zeros])
