# SPDX-License-Identifier: Apache-2.0
"""Least squares of Ogden's law without a starting value: a search over its exponents, then a local fit."""

from itertools import combinations

import numpy as np

from .laws import ogden_column

MAX_EXPONENT = 20.0  # [1 / largest logarithmic strain]: stresses grow by exp(20) over the readings
GRID = 61  # exponents of the search, from -MAX_EXPONENT to MAX_EXPONENT
N_STARTS = 3
SEARCH_READINGS = 200  # the search uses about so many
_STEP = 1e-4  # [1 / largest logarithmic strain] of the derivative by an exponent


def fit_ogden(
    terms: int, stretch: np.ndarray, t: np.ndarray, stress: np.ndarray, zeros: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients mu_1, alpha_1, …, then the zeros of the curves, and the Jacobian (n, p) by them.

    Each term has mu alpha >= 0.
    """
    from scipy.optimize import least_squares

    size = float(np.abs(stress).max())
    fit = _Problem(terms, stretch, t, stress / size, zeros)
    bounds = np.r_[np.zeros(terms), np.full(terms, -MAX_EXPONENT), np.full(zeros.shape[1], -np.inf)]
    high = np.r_[np.full(terms, np.inf), np.full(terms, MAX_EXPONENT), np.full(zeros.shape[1], np.inf)]
    best = None
    for start in fit.starts():
        start = np.clip(start, bounds + 1e-9, high - 1e-9)
        found = least_squares(
            fit.residual, start, fit.jacobian, bounds=(bounds, high), x_scale="jac", ftol=1e-13, xtol=1e-13, gtol=1e-13,
            max_nfev=100,
        )  # fmt: skip
        best = found if best is None or found.cost < best.cost else best
    return _coefficients(best.x, fit, size)


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
        slopes = (self.columns(a + _STEP) - self.columns(a - _STEP)) / (2.0 * _STEP)
        return np.hstack([self.columns(a), slopes * c, self.zeros])

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
        order = np.argsort(-gain, kind="stable")[:N_STARTS]
        offset = np.zeros(zeros.shape[1])
        return [np.r_[np.maximum(c[k], 1e-6) / norm[sets[k]], grid[sets[k]], offset] for k in order]


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
