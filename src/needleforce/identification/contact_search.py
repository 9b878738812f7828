# SPDX-License-Identifier: Apache-2.0
"""Contact depth of an indentation curve, without a starting value.

For a contact depth c the other parameters of F = baseline + E_r F_1(depth - c) are linear and are solved for (variable
projection, Golub & Pereyra 1973), so that the sum of squares depends only on c. It is evaluated over the complete
curve, then on finer steps around its minima, and refined to the zero of its exact derivative.
"""

from typing import Any

import numpy as np

from ..mechanics.contact import contact

SCREENING_SAMPLES = 2000  # on about so many the complete curve is searched, to save time
MIN_SCREENING_CONTACT = 200  # samples in contact; with fewer, all samples are used
N_DEPTHS = 100  # contact depths over the complete curve, in equal steps, and as many in equal ratios of the indentation
N_FINER = 24  # contact depths between the neighbours of a minimum
N_MINIMA, N_FINALISTS = 3, 2  # best minima on the screening samples, and on all
MIN_IN_CONTACT = 10  # samples
REFINEMENT_START = 1e-6  # [of the curve's length]; a sum of squares is flat below 1e-8


class ContactSearch:
    """Least squares of force (n,) on a baseline and one rising contact, for any contact depth.

    ``depth`` (n,) is measured from its smallest value; ``baseline`` (k, n) has a row for each term. ``gain(c)`` is the
    part of the sum of squares [N^2] that contact from c on explains in addition to the baseline, 0 where the force does
    not rise.
    """

    def __init__(
        self, depth: np.ndarray, force: np.ndarray, baseline: np.ndarray, tip: Any, shank_radius: float | None
    ):
        self.depth, self.tip, self.shank_radius = depth, tip, shank_radius
        self.baseline = np.linalg.qr(baseline.T)[0].T  # orthonormal
        self.span = float(depth.max())
        self.force_given, self.force = force, self._without_baseline(force)

    @property
    def deepest(self) -> float:
        """The largest contact depth of the search, with ``MIN_IN_CONTACT`` samples in contact."""
        return float(np.partition(self.depth, -MIN_IN_CONTACT)[-MIN_IN_CONTACT])

    def best(self) -> float:
        """The contact depth of least squares, to rounding."""
        fewer = self._thinned(max(len(self.depth) // SCREENING_SAMPLES, 1))
        left = np.geomspace(self.span, max(self.span - self.deepest, 1e-6 * self.span), N_DEPTHS)
        places = np.unique([*(self.span - left), *np.linspace(0.0, self.span - left[-1], N_DEPTHS)])
        searches = [self._screening(fewer, c) for c in places]
        gains = np.array([search.gain(float(c)) / len(search.depth) for search, c in zip(searches, places)])
        found = []
        for low, high in _brackets(places, gains, N_MINIMA):
            search = self._screening(fewer, high)
            found.append((search.gain(search._bounded_best(low, high)) / len(search.depth), low, high))
        found.sort(reverse=True)
        finalists = (self._bounded_best(low, high) for _, low, high in found[:N_FINALISTS])
        return self._refined(max(finalists, key=self.gain))

    def unit_force(self, c: float) -> tuple[np.ndarray, np.ndarray]:
        """F_1 and its slope by depth, (n,) each, for E_r = 1 Pa; 0 without contact."""
        force, slope = np.zeros_like(self.depth), np.zeros_like(self.depth)
        inside = self.depth > c
        if inside.any():
            found = contact(self.tip, depth=self.depth[inside] - c, reduced_modulus=1.0, shank_radius=self.shank_radius)
            force[inside], slope[inside] = found.force, found.slope
        return force, slope

    def modulus(self, c: float) -> float:
        """E_r [Pa] for contact at c, not below 0."""
        return self._solved(self.unit_force(c)[0])[0]

    def gain(self, c: float) -> float:
        """Part of the sum of squares [N^2] that contact from c on explains."""
        return self._solved(self.unit_force(c)[0])[1]

    def _thinned(self, every: int) -> "ContactSearch":
        depth, force, baseline = self.depth[::every], self.force_given[::every], self.baseline[:, ::every]
        return ContactSearch(depth, force, baseline, self.tip, self.shank_radius)

    def _screening(self, fewer: "ContactSearch", c: float) -> "ContactSearch":
        """The search on ``fewer`` samples if enough of them are in contact at c, otherwise on all."""
        return fewer if np.count_nonzero(fewer.depth > c) >= MIN_SCREENING_CONTACT else self

    def _without_baseline(self, values: np.ndarray) -> np.ndarray:
        """The part of values (n,) that no baseline explains."""
        return values - (self.baseline @ values) @ self.baseline

    def _solved(self, unit: np.ndarray) -> tuple[float, float]:
        rest = self._without_baseline(unit)
        square, product = float(rest @ rest), float(rest @ self.force)
        modulus = max(product / square, 0.0) if square > 0.0 else 0.0
        return modulus, modulus * product

    def _bounded_best(self, low: float, high: float) -> float:
        """The contact depth of the largest gain between low and high."""
        from scipy.optimize import minimize_scalar

        places = np.linspace(low, high, N_FINER)
        ((low, high),) = _brackets(places, np.array([self.gain(float(c)) for c in places]), 1)
        options = {"xatol": REFINEMENT_START * self.span}
        return float(minimize_scalar(lambda c: -self.gain(c), bounds=(low, high), method="bounded", options=options).x)

    def _gain_slope(self, c: float) -> float:
        """d gain / dc over 2 E_r: by the envelope theorem the linear parameters do not enter."""
        unit, slope = self.unit_force(c)
        residual = self.force - self._solved(unit)[0] * self._without_baseline(unit)
        return -float(slope @ residual)

    def _refined(self, c: float) -> float:
        """The zero of ``_gain_slope`` next to c; c itself at an end of the curve."""
        from scipy.optimize import brentq

        for step in REFINEMENT_START * self.span * 4.0 ** np.arange(6):
            low, high = max(c - step, 0.0), min(c + step, self.deepest)
            if self._gain_slope(low) > 0.0 > self._gain_slope(high):
                return brentq(self._gain_slope, low, high, xtol=1e-18 * self.span, rtol=1e-15)
        return c


def _brackets(places: np.ndarray, gains: np.ndarray, count: int) -> list[tuple[float, float]]:
    """The neighbours of the ``count`` highest local maxima, highest first."""
    padded = np.concatenate([[-np.inf], gains, [-np.inf]])
    tops = np.flatnonzero((gains >= padded[:-2]) & (gains >= padded[2:]))
    tops = tops[np.argsort(-gains[tops], kind="stable")][:count]
    last = len(places) - 1
    return [(float(places[max(k - 1, 0)]), float(places[min(k + 1, last)])) for k in tops]
