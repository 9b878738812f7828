# SPDX-License-Identifier: Apache-2.0
"""Least squares of Ogden's law without a starting value: a search over its exponents, then a local fit."""

from itertools import combinations

import numpy as np

from ..vocabulary import SMALLEST
from .laws import ogden_column, ogden_slope

MAX_EXPONENT = 20.0
"""[1 / largest logarithmic strain] A term with a larger exponent has at half the strain less than exp(-10), 5e-5 of its
largest stress, which no load cell resolves: it is a term of the last readings, whose exponent they do not determine."""
GRID = 61  # exponents of the search, from -MAX_EXPONENT to MAX_EXPONENT
N_STARTS = 5  # sets of exponents, each of its own valley
N_BOUNDED = 2  # of these, also fitted within the bounds, at which a coefficient may end
MAX_COMPARED = 500  # best sets
MAX_STEPS = 1000  # an exact curve takes up to 300 of them, depending on rounding; a noisy one 20
_OPTIONS = {"ftol": 1e-10, "xtol": 1e-10, "gtol": 1e-15, "x_scale": "jac"}
SEARCH_READINGS = 200  # the search uses about so many


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
