# SPDX-License-Identifier: Apache-2.0
"""Where contact begins on an indentation curve, without a starting value.

For a contact depth c the rest of F = baseline + E_r F_1(depth - c) is linear and is solved for (variable projection,
Golub & Pereyra 1973), so that the sum of squares is a function of c alone. It is looked at over the whole curve, then
closer around its lowest places, and polished where its derivative, which is exact, changes sign.
"""

import numpy as np

from ..mechanics.contact import contact

FEW, ENOUGH = 2000, 200  # samples on which the whole curve is looked at, where so many of them are in contact
PLACES = 100  # contact depths over the whole curve, in equal steps, and as many in equal ratios of the indentation
CLOSER = 24  # between the neighbours of a low place
FOLLOWED, KEPT = 3, 2  # low places, on few samples and on all
LEAST_IN_CONTACT = 10  # samples
CLOSE = 1e-6  # of the curve's length: where the polish starts; a sum of squares is flat below 1e-8


class ContactSearch:
    """Least squares of force (n,) on a baseline and one rising contact, for any contact depth.

    ``depth`` (n,) counts from the least; ``baseline`` (k, n) are its parts. ``gain(c)`` is the part of the sum of
    squares [N^2] that contact from c on explains beyond the baseline, 0 where the force does not rise.
    """

    def __init__(self, depth: np.ndarray, force: np.ndarray, baseline: np.ndarray, tip, shank_radius: float | None):
        self.depth, self.tip, self.shank_radius = depth, tip, shank_radius
        self.baseline = np.linalg.qr(baseline.T)[0].T  # orthonormal
        self.span = float(depth.max())
        self.force_given, self.force = force, self._beyond(force)

    @property
    def deepest(self) -> float:
        """The last contact depth that is looked at: a few samples are left in contact."""
        return float(np.partition(self.depth, -LEAST_IN_CONTACT)[-LEAST_IN_CONTACT])

    def best(self) -> float:
        """The contact depth of least squares, to rounding."""
        few = self._share(max(len(self.depth) // FEW, 1))
        left = np.geomspace(self.span, max(self.span - self.deepest, 1e-6 * self.span), PLACES)
        places = np.unique([*(self.span - left), *np.linspace(0.0, self.span - left[-1], PLACES)])
        looked = [self._enough(few, c) for c in places]
        gains = np.array([search.gain(float(c)) / len(search.depth) for search, c in zip(looked, places)])
        found = []
        for low, high in _brackets(places, gains, FOLLOWED):
            search = self._enough(few, high)
            found.append((search.gain(search._closer(low, high)) / len(search.depth), low, high))
        found.sort(reverse=True)
        return self._polished(max((self._closer(low, high) for _, low, high in found[:KEPT]), key=self.gain))

    def unit_force(self, c: float) -> tuple[np.ndarray, np.ndarray]:
        """F_1 and its slope by depth, (n,) each, for E_r = 1 Pa; 0 where there is no contact."""
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
        """See above."""
        return self._solved(self.unit_force(c)[0])[1]

    def _share(self, every: int) -> "ContactSearch":
        depth, force, baseline = self.depth[::every], self.force_given[::every], self.baseline[:, ::every]
        return ContactSearch(depth, force, baseline, self.tip, self.shank_radius)

    def _enough(self, few: "ContactSearch", c: float) -> "ContactSearch":
        """The ``few`` samples where enough of them are in contact at c, else all."""
        return few if np.count_nonzero(few.depth > c) >= ENOUGH else self

    def _beyond(self, values: np.ndarray) -> np.ndarray:
        """What no baseline explains."""
        return values - (self.baseline @ values) @ self.baseline

    def _solved(self, unit: np.ndarray) -> tuple[float, float]:
        beyond = self._beyond(unit)
        square, product = float(beyond @ beyond), float(beyond @ self.force)
        modulus = max(product / square, 0.0) if square > 0.0 else 0.0
        return modulus, modulus * product

    def _closer(self, low: float, high: float) -> float:
        from scipy.optimize import minimize_scalar

        places = np.linspace(low, high, CLOSER)
        ((low, high),) = _brackets(places, np.array([self.gain(float(c)) for c in places]), 1)
        options = {"xatol": CLOSE * self.span}
        return float(minimize_scalar(lambda c: -self.gain(c), bounds=(low, high), method="bounded", options=options).x)

    def _rise(self, c: float) -> float:
        """d gain / dc over 2 E_r: by the envelope theorem only the contact itself moves."""
        unit, slope = self.unit_force(c)
        residual = self.force - self._solved(unit)[0] * self._beyond(unit)
        return -float(slope @ residual)

    def _polished(self, c: float) -> float:
        """Where ``_rise`` goes from + to - next to c; c itself at an end of the curve."""
        from scipy.optimize import brentq

        for step in CLOSE * self.span * 4.0 ** np.arange(6):
            low, high = max(c - step, 0.0), min(c + step, self.deepest)
            if self._rise(low) > 0.0 > self._rise(high):
                return brentq(self._rise, low, high, xtol=1e-18 * self.span, rtol=1e-15)
        return c


def _brackets(places: np.ndarray, gains: np.ndarray, most: int) -> list[tuple[float, float]]:
    """The neighbours of the ``most`` highest local maxima, highest first."""
    padded = np.concatenate([[-np.inf], gains, [-np.inf]])
    tops = np.flatnonzero((gains >= padded[:-2]) & (gains >= padded[2:]))
    tops = tops[np.argsort(-gains[tops], kind="stable")][:most]
    last = len(places) - 1
    return [(float(places[max(k - 1, 0)]), float(places[min(k + 1, last)])) for k in tops]
