# SPDX-License-Identifier: Apache-2.0
"""Evidence on the fit of a tension or compression test: whether a law describes the curve, the modulus by the slope at
its start, which no law enters, and where a slack specimen takes the load."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..display.quantities import plain
from ..identification.estimates import Estimate
from ..identification.statistics.evidence import (
    FALSE_ALARMS,
    CurveNoise,
    Departure,
    StartSlope,
    curve_noise,
    departure,
    residual_departure,
    start_slope,
)
from ..identification.statistics.noise import SIGNIFICANT, TWO_SIDED
from ..recording.force_signal import quantum_of
from .law_fit import StressCurve
from .laws import initial_stiffness, mode_number

MIN_START_READINGS = 40  # of a curve
MIN_SLACK_READINGS = 5
MAX_SLACK_PLACES = 100  # at which a slack specimen may take the load
SLACK_DEGREE, SLACK_WINDOW = 3, 6.0  # of the polynomial from there on, and its end over that of the slack


@dataclass(frozen=True, eq=False, kw_only=True)
class CurveEvidence:
    """One curve with all its readings in the order of stretch, its ``noise`` [Pa], and the slope by stretch at its
    start [Pa], None where the readings do not resolve it."""

    curve: StressCurve
    noise: CurveNoise
    start: StartSlope | None


def evidence_of(curve: StressCurve, *, free_zero: bool) -> CurveEvidence:
    """The evidence of a curve (n,), its stretches in order."""
    noise = curve_noise(np.ascontiguousarray(curve.stress), quantum_of(np.ascontiguousarray(curve.stress)))
    start = start_slope(curve.stretch - 1.0, curve.stress, noise, free_zero=free_zero)
    return CurveEvidence(curve=curve, noise=noise, start=start)


def worst_departure(
    known: Sequence[CurveEvidence], means: Sequence[StressCurve], residuals: Sequence[np.ndarray]
) -> Departure:
    """The largest departure from the curves of a law that leaves ``residuals`` of their ``means`` of neighbours."""
    found = [
        residual_departure(mean.stretch, left, each.noise.of_blocks(max(len(each.curve.stretch) // len(left), 1)))
        for each, mean, left in zip(known, means, residuals, strict=True)
    ]
    return max(found, key=lambda each: each.ratio / each.limit)


def start_modulus(known: Sequence[CurveEvidence]) -> tuple[float, float] | None:
    """Young's modulus by the slope at the start of the curves and its standard error [Pa]; None where a curve does not
    show it."""
    if any(each.start is None for each in known):
        return None
    stiffness = [float(initial_stiffness(mode_number(each.curve.mode))) for each in known]
    slopes = [(each.start.value / k, each.start.error / k) for each, k in zip(known, stiffness) if each.start]
    weights = np.array([1.0 / max(error, 1e-300) ** 2 for _, error in slopes])
    value = float(weights @ np.array([value for value, _ in slopes]) / weights.sum())
    return value, float(weights.sum() ** -0.5)


def held_by_start(by_laws: Estimate, known: Sequence[CurveEvidence]) -> Estimate:
    """The modulus, its interval with that of the slope at the start, which no law enters.

    A law whose shape is fitted may describe within the noise a material that follows another law, and misses the slope
    at its start; a law of one coefficient has no shape to adapt. Few readings do not show their own noise over the
    length of a start.
    """
    start = start_modulus(known)
    if start is None or min(len(each.curve.stretch) for each in known) < MIN_START_READINGS:
        return by_laws
    low, high = (
        choose(end, start[0] + sign * TWO_SIDED * start[1])
        for choose, end, sign in ((min, by_laws.low, -1.0), (max, by_laws.high, 1.0))
    )
    return replace(by_laws, low=low, high=high, identifiable=low > 0.0)


def judged(
    by_laws: Estimate, known: Sequence[CurveEvidence], missed: Departure, law: str, *, chosen: bool
) -> tuple[Estimate, list[str]]:
    """The modulus, and sentences where the laws do not describe the curve within its noise.

    Where they also miss the slope at the start, or leave it less certain, that is the modulus; of a law that was given
    it widens the interval.
    """
    if not missed.found:
        return by_laws, []
    times = f"{missed.ratio**0.5:.3g} times what the noise of the readings explains"
    noise = f"The slow part of what {law} leaves is {times}"
    start, error = start_modulus(known), (by_laws.high - by_laws.low) / (2.0 * TWO_SIDED)
    if start and error <= start[1] and abs(by_laws.value - start[0]) <= SIGNIFICANT * math.hypot(start[1], error):
        return by_laws, [f"{noise}; its initial modulus is that of the slope at the start."]
    if start is None:
        open_end = replace(by_laws, low=-math.inf, high=math.inf, identifiable=False)
        return open_end, [f"{noise}, and the first readings do not resolve the slope at the start: give more readings "
                          "there."]  # fmt: skip
    low, high = start[0] - TWO_SIDED * start[1], start[0] + TWO_SIDED * start[1]
    first = known[0].start
    where = f"the first {first.count} readings, within {first.reach:.3g} of stretch 1" if first else ""
    both = f"{noise}. Its initial modulus is {by_laws.shown}, that of the slope of {where}, is {plain(start[0], 'Pa')}"
    if not chosen:
        low, high = min(low, by_laws.low), max(high, by_laws.high)
        return replace(by_laws, low=low, high=high, identifiable=low > 0.0), [f"{both}: the interval holds both."]
    source = f"slope of {where}; the laws miss it"
    return replace(by_laws, value=start[0], low=low, high=high, identifiable=low > 0.0, source=source), [
        f"{both}, which is the result."
    ]


def without_slack(known: CurveEvidence) -> StressCurve | None:
    """The curve from where its specimen takes the load, its stretch counted from there; None if it is not slack.

    Slack: the stress of five readings and more is constant within its noise, then it rises at once: a constant with a
    polynomial from a kink on describes the readings up to six times that strain within the noise, and a polynomial
    with as many coefficients does not.
    """
    curve, noise = known.curve, known.noise
    strain, stress = curve.stretch - 1.0, curve.stress
    if strain.min() < -1e-9 or known.start is None or known.start.low > 0.0:
        return None
    flat = _flat_readings(strain, stress, noise)
    if flat < MIN_SLACK_READINGS:
        return None
    used = strain <= SLACK_WINDOW * strain[flat - 1]
    x, y = strain[used], stress[used]
    kink, left = _kink(x, y, flat)
    smooth = departure(x, y, noise, degree=SLACK_DEGREE + 2)
    if not smooth.found or residual_departure(x, left, noise).found:
        return None
    loaded = strain >= kink
    level = float(y[x < kink].mean())
    return replace(curve, stretch=curve.stretch[loaded] / (1.0 + kink), stress=stress[loaded] - level)


def _flat_readings(x: np.ndarray, y: np.ndarray, noise: CurveNoise) -> int:
    """How many readings from the first on are constant within the noise."""
    good, count = 0, MIN_SLACK_READINGS
    while count <= len(x) and not departure(x[:count], y[:count], noise, degree=0, rate=FALSE_ALARMS).found:
        good, count = count, max(int(1.1 * count), count + 1)
    return good


def _kink(x: np.ndarray, y: np.ndarray, flat: int) -> tuple[float, np.ndarray]:
    """The place of the kink of a constant and a polynomial, by least squares, and the residual (n,)."""

    def residual(place: float) -> np.ndarray:
        risen = np.maximum(x - place, 0.0) / float(np.ptp(x))
        basis = np.linalg.qr(np.vander(risen, SLACK_DEGREE + 1, increasing=True))[0]
        return y - basis @ (basis.T @ y)

    from scipy.optimize import minimize_scalar

    last = min(2 * flat, len(x) - SLACK_DEGREE - 2)
    places = np.linspace(x[1], x[max(last, 2)], MAX_SLACK_PLACES)
    squares = [float(np.sum(residual(place) ** 2)) for place in places]
    best = int(np.argmin(squares))
    low, high = places[max(best - 1, 0)], places[min(best + 1, len(places) - 1)]
    found = minimize_scalar(lambda place: float(np.sum(residual(place) ** 2)), bounds=(low, high), method="bounded")
    return float(found.x), residual(float(found.x))


def slack_note(given: StressCurve, loaded: StressCurve) -> str:
    """The sentence on a curve from which its slack is taken."""
    start = f"{float(given.stretch[-1] / loaded.stretch[-1]):.5g}"
    return f"{given.name or 'The curve'}: the specimen is slack up to a stretch of {start}, from which strain counts."
