# SPDX-License-Identifier: Apache-2.0
"""Evidence on the fit of one curve that no law enters: the noise of its readings at every length, whether the residual
is that noise, and the slope at the start. Every bench test is judged by it."""

import math
from dataclasses import dataclass, replace

import numpy as np

from ...segmentation.punctures import quarter_sd, robust_sd
from ...segmentation.strokes import FOURTH_DIFFERENCE, white_noise
from .noise import TWO_SIDED

FALSE_ALARMS = 1e-3
"""Rate at which a right model is judged to miss its curve, for white noise; up to ten times as often where the noise is
correlated over an 80th of the curve."""

FREEDOM_PER_READING = 0.2  # degrees of freedom of the noise over long parts, as measured
LONE_READING = 5.0  # [standard deviations] of one reading: once in two million
MORE_DEGREES = 4  # polynomials in which a departure from a line is searched
RESIDUAL_DEGREES = 8  # and in the residual of another model
DEGREES = (1, 2, 3)  # of the polynomials of a start
GROWTH = 1.2  # of the number of readings from one window at the start to the next
SAFETY = 1.25  # a window ends so much before the readings in which its polynomial fails, which it does late
START_ALARMS, MISSES = (0.1, 0.005), 2  # rates at which a window is not used, and at which so many end the search
CHOSEN = 2.394  # normal quantile of a two-sided interval of 95 % for each of three, of which one is chosen
MIN_NOISE_SHARE = 1e-6  # of the range of the force: a simulated curve may have no noise
MIN_NOISE_PLACES = 20  # fourth differences of means that show the noise over their length
MIN_NOISE_LENGTHS = 45  # distances in the curve, between means whose differences show correlated noise


@dataclass(frozen=True, kw_only=True)
class CurveNoise:
    """Standard ``deviations`` [N] of means over ``lengths`` [samples], the ``quantum`` of the force [N], and the
    ``count`` of samples that show them."""

    lengths: np.ndarray
    deviations: np.ndarray
    quantum: float
    count: int

    def of_mean(self, count: int) -> float:
        """Standard deviation [N] of the mean of ``count`` samples; a quantum above the noise is not averaged."""
        known = int(np.searchsorted(self.lengths, count, side="right")) - 1
        sd = float(self.deviations[known]) * (float(self.lengths[known]) / count) ** 0.5
        return max(sd, self.quantum / 12**0.5) if self.coarse else sd

    def of_blocks(self, size: int) -> "CurveNoise":
        """The noise of means over ``size`` samples."""
        deviations = np.array([self.of_mean(size * int(w)) for w in self.lengths])
        return CurveNoise(lengths=self.lengths, deviations=deviations, quantum=self.quantum if self.coarse else 0.0,
                          count=self.count // size)  # fmt: skip

    @property
    def coarse(self) -> bool:
        """Whether the rounding of the force hides its noise."""
        return bool(self.deviations[0] <= 0.5 * self.quantum)


def curve_noise(force: np.ndarray, quantum: float) -> CurveNoise:
    """The noise of the (n,) force [N] over 1, 2, 4 … samples, from fourth differences of means over that length.

    A smooth curve contributes next to nothing to them, and the smallest quarter of their magnitudes leaves out peaks
    and falls; hum, filtered noise and texture are in them. Neighbouring means of correlated noise differ less than
    distant ones: the distance with the largest differences counts, up to a thirtieth of the curve. The mean over twice
    a length varies no more than that over the length, and no less than over the root of two.
    """
    # readings that alternate between two steps have a deviation of half a step, which robust estimates miss
    floor = max(MIN_NOISE_SHARE * float(np.ptp(force)), 0.5 * quantum, 1e-150)
    sums = np.concatenate(([0.0], np.cumsum(force - force[0])))
    lengths, found = [1], [max(white_noise(force), floor)]
    while len(force) - 10 * lengths[-1] >= MIN_NOISE_PLACES:
        w = lengths[-1]
        distances = [w * 2**k for k in range(16) if not k or w * 2**k * MIN_NOISE_LENGTHS <= len(force)]
        mean = (sums[w:] - sums[:-w]) / w
        own = max(_fourth_difference(mean, distance) for distance in distances)
        found[-1] = max(found[-1], own) if w == 1 else min(max(own, found[-2] / 2**0.5), found[-2])
        lengths.append(2 * w)
        found.append(found[-1] / 2**0.5)
    return CurveNoise(lengths=np.array(lengths), deviations=np.array(found), quantum=quantum, count=len(force))


def _fourth_difference(values: np.ndarray, d: int) -> float:
    """The standard deviation of (n,) values from fourth differences over a distance ``d``."""
    fourth = values[4 * d :] - 4 * values[3 * d : -d] + 6 * values[2 * d : -2 * d] - 4 * values[d : -3 * d]
    fourth = np.ascontiguousarray(fourth + values[: -4 * d])
    # those of an oscillation are not normal: most are far from zero, and few of them show no small part
    return min(quarter_sd(fourth), robust_sd(fourth), float(fourth.std())) / FOURTH_DIFFERENCE


@dataclass(frozen=True, kw_only=True)
class Departure:
    """The variance of the slow part of a residual over that of the noise, ``ratio``, and its ``limit``, which noise
    alone exceeds at the rate asked for."""

    ratio: float
    limit: float

    @property
    def found(self) -> bool:
        """Whether the residual is more than noise."""
        return self.ratio > self.limit


def departure(
    place: np.ndarray,
    values: np.ndarray,
    noise: CurveNoise,
    *,
    degree: int = 1,
    constant: bool = True,
    rate: float = FALSE_ALARMS,
) -> Departure:
    """Whether (n,) values over their place depart from a polynomial of ``degree``, by polynomials of higher degree.

    Their coefficients have the variance of the noise over that length where the values are a polynomial and noise (F
    test; the noise is known as well as by half as many readings).
    """
    more = min(MORE_DEGREES, len(values) - degree - constant)
    if more < 1:
        return Departure(ratio=0.0, limit=math.inf)
    basis = _basis(place, degree + more, constant)
    fitted, further = np.split(basis, [degree + constant], axis=1)
    left = values - fitted @ (fitted.T @ values)
    # the differences that show the noise are small where it is correlated: what is left is then large throughout
    if float(np.abs(left).max()) > LONE_READING * max(noise.of_mean(1), robust_sd(left)):
        return Departure(ratio=math.inf, limit=LONE_READING)
    return _departure(values @ further, len(values), noise, rate)


def residual_departure(place: np.ndarray, residual: np.ndarray, noise: CurveNoise) -> Departure:
    """Whether the (n,) residual of a model departs from noise, by polynomials over its place.

    What the parameters absorb of them makes a false alarm rarer.
    """
    degrees = min(RESIDUAL_DEGREES, len(residual) - 1)
    return _departure(residual @ _basis(place, degrees - 1, constant=True), len(residual), noise, FALSE_ALARMS)


def _basis(place: np.ndarray, degree: int, constant: bool) -> np.ndarray:
    """Orthonormal polynomials (n, k) of rising degree; without a constant, of those that are 0 at 0."""
    x = place / max(float(np.abs(place).max()), 1e-300) if not constant else _centred(place)
    return np.linalg.qr(np.vander(x, degree + 1, increasing=True)[:, 0 if constant else 1 :])[0]


def _centred(place: np.ndarray) -> np.ndarray:
    low, high = float(place.min()), float(place.max())
    return (place - 0.5 * (low + high)) / max(0.5 * (high - low), 1e-300)


def _departure(parts: np.ndarray, count: int, noise: CurveNoise, rate: float) -> Departure:
    from scipy.special import fdtri

    slow = long_run(noise, count)
    # correlated readings show their noise less well
    freedom = max(FREEDOM_PER_READING * noise.count * min(noise.of_mean(1) ** 2 / slow, 1.0), 2.0)
    limit = float(fdtri(len(parts), freedom, 1.0 - rate))
    return Departure(ratio=float(np.mean(parts**2)) / slow, limit=limit)


def long_run(noise: CurveNoise, count: int) -> float:
    """The variance of the noise, times the number of correlated readings that count as one, over ``count`` readings."""
    length = max(count // (2 * (MORE_DEGREES + 2)), 1)
    return length * noise.of_mean(length) ** 2


@dataclass(frozen=True, kw_only=True)
class StartSlope:
    """The slope of a curve at place 0 with its 95 % interval, and the level there with its standard error, 0 where
    it is given; from the ``count`` readings up to the place ``reach``."""

    value: float
    low: float
    high: float
    zero: float
    zero_error: float
    reach: float
    count: int

    @property
    def error(self) -> float:
        """Its standard error."""
        return (self.high - self.low) / (2.0 * TWO_SIDED)


def start_slope(place: np.ndarray, values: np.ndarray, noise: CurveNoise, *, free_zero: bool) -> StartSlope | None:
    """The slope of (n,) values at place 0, ``free_zero`` whether their level there is unknown; None without a window.

    Polynomials of first to third degree are fitted to the readings nearest to 0, over the longest window which each
    describes within the noise. The one with the smallest error counts; by how much it differs from that of the next
    degree widens its interval, as does the window's own choice.
    """
    order = np.argsort(np.abs(place), kind="stable")
    x, y = place[order], values[order]
    found = [each for degree in DEGREES if (each := _longest(x, y, noise, degree, free_zero)) is not None]
    if not found:
        return None
    one, *others = sorted(found, key=lambda each: each.error)
    apart = max((abs(each.value - one.value) for each in others[:1]), default=0.0)
    return replace(one, low=one.low - apart, high=one.high + apart)


def _longest(x: np.ndarray, y: np.ndarray, noise: CurveNoise, degree: int, free_zero: bool) -> StartSlope | None:
    """The slope over the longest window of readings that a polynomial of ``degree`` describes; None without one."""
    fewest = degree + 2  # as many as the next degree has coefficients, with one at 0 that shows no slope
    counts = [fewest]
    while counts[-1] < len(x):
        counts.append(min(max(int(counts[-1] * GROWTH), counts[-1] + 1), len(x)))
    good, missed = 0, 0
    for count in counts if len(x) >= fewest else ():
        doubt, certain = (
            departure(x[:count], y[:count], noise, degree=degree, constant=free_zero, rate=rate).found
            for rate in START_ALARMS
        )
        good, missed = count if not doubt else good, missed + 1 if certain else 0
        if missed == MISSES:
            good = max(int(good / SAFETY), min(good, fewest))
            break
    return _window(x[:good], y[:good], noise, degree + 1, free_zero) if good else None


def _window(x: np.ndarray, y: np.ndarray, noise: CurveNoise, degree: int, free_zero: bool) -> StartSlope | None:
    """The slope at 0 of a polynomial through all the readings."""
    reach = float(np.abs(x).max())
    if not reach > 0.0:
        return None
    design = np.vander(x / reach, degree + 1, increasing=True)[:, 0 if free_zero else 1 :]
    basis, triangle = np.linalg.qr(design)
    if np.abs(np.diag(triangle)).min() < 1e-10 * np.abs(triangle).max():
        return None
    inverse = np.linalg.inv(triangle)
    values, errors = inverse @ (basis.T @ y), np.linalg.norm(inverse, axis=1) * long_run(noise, len(x)) ** 0.5
    slope, half = (float(each[int(free_zero)]) / reach for each in (values, CHOSEN * errors))
    zero = (float(values[0]), float(errors[0])) if free_zero else (0.0, 0.0)
    return StartSlope(value=slope, low=slope - half, high=slope + half, zero=zero[0], zero_error=zero[1], reach=reach,
                      count=len(x))  # fmt: skip
