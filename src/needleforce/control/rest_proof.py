# SPDX-License-Identifier: Apache-2.0
"""The largest stiffness of tissue that is proved to come to rest in the loop of a device.

With G(z) from the force of the tissue to the retreat of the needle, tissue of stiffness K that slips within limits
comes to rest from any state if for one gamma in (0, 1]

    1/K + Re G - gamma cot(w/2) Im G - (1 - gamma) f |G|^2 > 0    on the unit circle, z = exp(i w), 0 < w <= pi;

Its page has the proof. In x = tan(w/2)^2 this is a polynomial, whose positive roots are counted exactly (Sturm),
in rational numbers: nothing is left between the points of a grid. It is the form that the criteria of Tsypkin and of
Jury and Lee take for an element that slips.
"""

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import pairwise, zip_longest

import numpy as np
from numpy.polynomial import polynomial as poly

from .device_loop import Device

GRID = 1200  # frequencies of the search, which only proposes; the roots are counted exactly
AROUND_A_POLE = np.concatenate([-np.geomspace(0.1, 30.0, 12), [0.0], np.geomspace(0.1, 30.0, 12)])  # in its widths
GAMMAS = (*np.geomspace(1e-5, 1e-3, 9, endpoint=False).tolist(), *np.geomspace(1e-3, 1.0, 49).tolist())
SHARES = (1e-9, 1e-6, 1e-4, 1e-3, 1e-2, 5e-2, 0.2, 0.5)  # taken off a proposed stiffness until it is proved
MINUS, PLUS = np.array([Fraction(1), Fraction(-1)]), np.array([Fraction(1), Fraction(1)])  # 1 - s, 1 + s


@dataclass(frozen=True)
class Loop:
    """G(z) of a device with its delay and its controller's damping, as a ratio of polynomials in s = (z - 1) / (z + 1):
    coefficients as fractions, lowest power first."""

    numerator: np.ndarray
    denominator: np.ndarray

    @classmethod
    def of(cls, device: Device) -> "Loop":
        """The loop of a device; the numbers of its discretised matrices are taken as exact."""
        below, above = _transfer(device)
        order, delay = len(below) - 1, int(device.delay)
        damping = Fraction(device.controller_damping) * Fraction(float(device.rate))
        # z - 1 = 2 s / (1 - s), z = (1 + s) / (1 - s): all times a power of 1 - s
        below, above = ([c * 2**k for k, c in enumerate(each)] for each in (below, above))
        denominator = _sum_of_powers(below, order)
        numerator = _sum_of_powers(above, order)
        denominator = poly.polymul(denominator, poly.polypow(PLUS, delay))
        numerator = poly.polymul(numerator, poly.polypow(MINUS, delay))
        if damping:  # G / (1 + c (1 - 1/z) / T G), with 1 - 1/z = 2 s / (1 + s)
            brake = damping * poly.polymul(numerator, np.array([Fraction(0), Fraction(2)]))
            denominator = poly.polyadd(poly.polymul(denominator, PLUS), brake)
            numerator = poly.polymul(numerator, PLUS)
        return cls(numerator, denominator)

    def response(self, tangent: np.ndarray) -> np.ndarray:
        """G(exp(i w)) [m/N], (n,), at ``tangent`` = tan(w/2), (n,)."""
        size = max(len(self.numerator), len(self.denominator))
        s, above, below = 1j * tangent, np.zeros(size), np.zeros(size)
        above[: len(self.numerator)], below[: len(self.denominator)] = self.numerator, self.denominator
        near = np.abs(s) <= 1.0
        inner, outer = np.where(near, s, 1.0), np.where(near, 1.0, 1.0 / s)  # powers of both stay finite
        low = poly.polyval(inner, above) / poly.polyval(inner, below)
        return np.where(near, low, np.polyval(above, outer) / np.polyval(below, outer))

    @cached_property
    def conditions(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """|A|^2, Re(N conj A), cot(w/2) Im(N conj A) and |N|^2 of G = N / A, as polynomials in x = tan(w/2)^2."""
        (n_even, n_skew), (a_even, a_skew) = _parts(self.numerator), _parts(self.denominator)
        x = np.array([Fraction(0), Fraction(1)])
        square = poly.polyadd(poly.polymul(a_even, a_even), poly.polymul(x, poly.polymul(a_skew, a_skew)))
        real = poly.polyadd(poly.polymul(n_even, a_even), poly.polymul(x, poly.polymul(n_skew, a_skew)))
        phase = poly.polysub(poly.polymul(n_skew, a_even), poly.polymul(n_even, a_skew))
        own = poly.polyadd(poly.polymul(n_even, n_even), poly.polymul(x, poly.polymul(n_skew, n_skew)))
        return square, real, phase, own

    @cached_property
    def stable(self) -> bool:
        """Whether the device alone comes to rest; one that nothing holds in place may keep its place."""
        own = poly.polytrim(self.denominator)
        return _hurwitz(own[1:] if own[0] == 0 else own)

    def proved(self, stiffness: float, gamma: float, weakening: float = 0.0) -> bool:
        """Whether the inequality holds at every frequency for tissue of a stiffness [N/m]: exact, without a grid. The
        multiplier ``gamma`` is above 0 and at most 1; ``weakening`` is how fast the force falls while the needle slides
        outwards, at most f [N/m]."""
        if not self.stable:
            return False
        square, real, phase, own = self.conditions
        share, found = Fraction(gamma), square / Fraction(stiffness)
        for factor, part in ((1, real), (-share, phase), ((share - 1) * Fraction(weakening), own)):
            found = poly.polyadd(found, factor * part)
        complete = len(poly.polytrim(found)) == len(poly.polytrim(square))  # the value at z = -1
        return complete and found[0] > 0 and found[-1] > 0 and positive_roots(found) == 0

    def max_stiffness(self, weakening: float = 0.0, gammas: tuple[float, ...] = GAMMAS) -> tuple[float, float]:
        """The largest stiffness [N/m] that is proved to come to rest, and its gamma; 0 if there is none. ``gammas`` are
        the multipliers that apply to the tissue: (1.0,) for one whose force may fall while it slips."""
        if not self.stable:
            return 0.0, 1.0
        best, gamma = self.proposed(weakening, gammas)
        for share in SHARES:
            if best > 0.0 and self.proved(best * (1.0 - share), gamma, weakening):
                return float(best * (1.0 - share)), gamma
        return 0.0, gamma

    def proposed(self, weakening: float, gammas: tuple[float, ...]) -> tuple[float, float]:
        """As ``max_stiffness``, on a grid of frequencies: not proved."""
        if not self.stable:
            return 0.0, 1.0
        tangent, response = self._grid
        for _ in range(2):  # finer around the frequency that decides
            needed = _needed(tangent, response, weakening, gammas)
            highest = needed.max(axis=1)
            best = int(highest.argmin())
            k = int(needed[best].argmax())
            more = np.geomspace(tangent[max(0, k - 1)], tangent[min(k + 1, len(tangent) - 1)], 41)[1:-1]
            tangent, response = np.append(tangent, more), np.append(response, self.response(more))
            order = tangent.argsort()
            tangent, response = tangent[order], response[order]
        return (1.0 / highest[best] if highest[best] > 1e-12 else 1e12), gammas[best]

    @cached_property
    def _grid(self) -> tuple[np.ndarray, np.ndarray]:
        poles = np.roots(self.denominator[::-1].astype(float))
        near = np.abs(poles.imag)[:, None] + np.abs(poles.real)[:, None] * AROUND_A_POLE
        tangent = np.unique(np.concatenate([np.geomspace(1e-7, 1e4, GRID), near[near > 1e-7]]))
        return tangent, self.response(tangent)


def _needed(tangent: np.ndarray, response: np.ndarray, weakening: float, gammas: tuple[float, ...]) -> np.ndarray:
    """The compliance 1/K [m/N] that the inequality needs, (gammas, frequencies)."""
    gamma = np.array(gammas)[:, None]
    own = weakening * np.abs(response) ** 2
    return gamma * (response.imag / tangent - own) + own - response.real


def positive_roots(polynomial: np.ndarray) -> int:
    """Number of distinct roots above 0 of a polynomial, by Sturm's theorem in rational numbers. Coefficients are
    fractions, lowest power first; the first and the last are not 0."""
    chain = [_whole(polynomial), _whole(poly.polyder(polynomial))]
    while len(chain[-1]) > 1:
        rest, divisor = chain[-2], chain[-1]
        while len(rest) >= len(divisor):  # whole multiples above 0 keep every sign
            taken = divisor * (rest[-1] if divisor[-1] > 0 else -rest[-1])
            rest = rest * abs(divisor[-1])
            rest[-len(divisor) :] -= taken
            rest = poly.polytrim(rest[:-1])
        if not rest.any():
            break
        chain.append(_whole(-rest))
    return _changes([each[0] for each in chain]) - _changes([each[-1] for each in chain])


def _whole(polynomial: np.ndarray) -> np.ndarray:
    """A multiple above 0 with whole coefficients without a common divisor."""
    fractions = [Fraction(c) for c in polynomial]
    denominator = math.lcm(*(c.denominator for c in fractions))
    whole = [int(c * denominator) for c in fractions]
    divisor = math.gcd(*whole) or 1
    return np.array([c // divisor for c in whole], dtype=object)


def _changes(values: list[int]) -> int:
    signs = [value > 0 for value in values if value != 0]
    return sum(a != b for a, b in pairwise(signs))


def _hurwitz(polynomial: np.ndarray) -> bool:
    """Whether every root has a real part below 0, by Routh's table."""
    rows = [list(polynomial[::-2]), list(polynomial[-2::-2])] if len(polynomial) > 1 else []
    for _ in range(len(polynomial) - 1):
        upper, lower = rows[-2], rows[-1]
        if not lower or lower[0] * polynomial[-1] <= 0:
            return False
        share = upper[0] / lower[0]
        rows.append([a - share * b for a, b in zip_longest(upper[1:], lower[1:], fillvalue=Fraction(0))])
    return True


def _transfer(device: Device) -> tuple[list[Fraction], list[Fraction]]:
    """det(d - E) and the retreat's numerator as polynomials in d = z - 1, lowest power first (Faddeev, LeVerrier)."""
    change, inputs = device.step
    n = len(change)
    exact = np.array([[Fraction(x) for x in row] for row in change.tolist()])
    push = np.array([-Fraction(x) for x in inputs[:, 0].tolist()])
    unit = np.array([[Fraction(i == j) for j in range(n)] for i in range(n)])
    auxiliary, below, above = unit, [Fraction(1)], []
    for k in range(1, n + 1):
        above.append(auxiliary[0] @ push)
        product = exact @ auxiliary
        below.append(-np.trace(product) / k)
        auxiliary = product + below[-1] * unit
    return below[::-1], above[::-1]


def _sum_of_powers(coefficients: list[Fraction], order: int) -> np.ndarray:
    """The polynomial sum of c_k s^k (1 - s)^(order - k)."""
    total = np.array([Fraction(0)])
    for k, value in enumerate(coefficients):
        power = poly.polymul(np.array([Fraction(0)] * k + [Fraction(1)]), poly.polypow(MINUS, order - k))
        total = poly.polyadd(total, value * power)
    return total


def _parts(polynomial: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Even part and odd part over i nu at s = i nu, as polynomials in x = nu^2."""
    halves = [polynomial[::2], polynomial[1::2] if len(polynomial) > 1 else np.array([Fraction(0)])]
    even, skew = ([(-1) ** k * c for k, c in enumerate(half)] for half in halves)
    return np.array(even), np.array(skew)
