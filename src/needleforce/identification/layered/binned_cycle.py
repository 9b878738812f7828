# SPDX-License-Identifier: Apache-2.0
"""The cycle of one recording for the fit: means over short bins of travel and of the hold, and the time constants of
relaxation by the decay of its force."""

import itertools
from dataclasses import dataclass, field, replace

import numpy as np

from ...recording import Recording
from ...segmentation import Events
from ..one_layer.force_zero import MIN_FREE_SAMPLES, Drift, drift_of, free_samples
from ..replay import force_of_puncture
from ..statistics.noise import Noise, noise_of
from ..strokes import Strokes, cycle_span, stroke_speed, strokes_of, undelayed_depth

COARSE, BETWEEN, FINE = {"as_fitted": 125, "passive": 250, "yielding": 250}, 500, 2000
"""Bins of a stroke: 0.2 mm of a stroke of 25 mm for the search, half of it in a passive form, whose tissue relaxes
while it slips and so depends more on the step; and short enough in the final fit that the model has the same force
along the samples."""
BIN_ERROR = 0.005  # [of the peak] between the force along the bins of the search and along the samples
FINER = 4  # so many times shorter are bins where the force falls
HOLD_BINS = 24  # their edges are the squares of whole numbers, as relaxation is fastest at first
DEFAULT_TIMES_S = (0.3, 3.0)  # [s] for recordings without a hold
SPEED_AT_REST = 1e-4  # [m/s] as in the engine
MIN_BINS = 8  # of a hold, for a level and two exponentials with samples to spare
SHORTEST = 0.01  # [of the hold] its first bins show no shorter time, and none of it a longer one than itself
MIN_RATIO = 2.0  # of the two times: nearer ones have the same decay
GRID, ZOOMS = 9, 4  # times in each direction, and how often the grid is narrowed


@dataclass(frozen=True, kw_only=True)
class ForceZero:
    """The force [N] that the sensor shows without a load, its standard error, and its drift; an infinite error where
    no free travel shows it. ``noise`` is that of the free travel, NaN without any."""

    value: float = 0.0
    error: float = np.inf
    drift: Drift = field(default_factory=Drift)
    noise: Noise = field(default_factory=Noise)

    @property
    def known(self) -> bool:
        """True if the free travel shows it."""
        return bool(np.isfinite(self.error))

    def at(self, recording: Recording) -> np.ndarray:
        """The zero (n,) [N] at the samples of the recording."""
        return self.value + self.drift.at(recording)


@dataclass(frozen=True)
class RecordedPuncture:
    """A puncture of segmentation: depth [m] of its force peak, depth [m] of the end of its drop, drop [N], and force
    [N] at the peak, NaN where it is not known."""

    depth: float
    end: float
    drop: float
    force: float = np.nan

    def moved(self, shift: float) -> "RecordedPuncture":
        """The same deeper by ``shift`` [m]."""
        return replace(self, depth=self.depth + shift, end=self.end + shift)


def recorded_punctures(events: Events, recording: Recording) -> tuple[RecordedPuncture, ...]:
    """The punctures of segmentation, each with the depth at which its drop has ended."""
    last = len(recording) - 1
    return tuple(
        RecordedPuncture(
            each.depth, float(recording.depth[min(each.high, last)]), each.drop, force_of_puncture(each, events)
        )
        for each in events.punctures
    )


@dataclass(frozen=True, eq=False, kw_only=True)
class BinnedCycle:
    """Bins (m,) of insertion, hold and withdrawal: mean depth [m], force [N], time step [s], number of samples.

    ``stroke`` is 0, 1, 2 for insertion, hold, withdrawal. ``contact`` [m] and ``punctures`` are from
    segmentation, all in the recording's own zero; ``speed`` [m/s] is that of the insertion, ``rest`` [s] the length of
    the hold, ``scale`` [N] the divisor of the residuals.
    """

    depth: np.ndarray
    force: np.ndarray
    dt: np.ndarray
    count: np.ndarray
    stroke: np.ndarray
    contact: float
    punctures: tuple[RecordedPuncture, ...]
    speed: float
    rest: float
    scale: float
    zero: ForceZero = field(default_factory=ForceZero)

    @property
    def zero_column(self) -> np.ndarray:
        """The direction (m,) of the zero in the residuals, to be profiled out; empty where the free travel shows it."""
        return np.empty(0) if self.zero.known else self.weight * self.scale

    @property
    def peak(self) -> float:
        """Largest force [N]."""
        return float(np.abs(self.force).max())

    @property
    def deepest(self) -> float:
        """Largest depth [m]."""
        return float(self.depth.max())

    @property
    def weight(self) -> np.ndarray:
        """Factor (m,) [1/N] of a residual, so that the squares sum to the mean square over the scale squared."""
        return np.sqrt(self.count / self.count.sum()) / self.scale


def binned_cycles(recordings: list[tuple[Recording, Events]], bins: int) -> tuple[BinnedCycle, ...]:
    """Several repeats with one scale: with a scale each, repeats of small forces would bias the shared parameters."""
    cycles = [binned_cycle(recording, events, bins) for recording, events in recordings]
    scale = float(np.median([cycle.peak for cycle in cycles]))
    return tuple(replace(cycle, scale=scale) for cycle in cycles)


def binned_cycle(recording: Recording, events: Events, bins: int) -> BinnedCycle:
    """The first insertion with contact, with its hold and withdrawal if present; needs a contact. Outliers of the force
    are left out, and the sensor's zero is taken off where the free travel shows it."""
    strokes = strokes_of(recording, events)
    zero = force_zero(recording, events, strokes)
    span, stroke = cycle_span(strokes, events)
    used = without_outliers(recording, events)[span]
    time, stroke = recording.time[span][used], stroke[used]
    depth, force = undelayed_depth(recording)[span][used], (recording.force - zero.at(recording))[span][used]
    index = _bins(time, depth, stroke, bins, falls(events, len(recording))[span][used])
    count = np.bincount(index)

    def mean(values: np.ndarray) -> np.ndarray:
        return np.bincount(index, values) / count

    middle, step = mean(time - time[0]), float(np.median(np.diff(time)))
    return BinnedCycle(
        depth=mean(depth),
        force=mean(force),
        dt=np.diff(middle, prepend=middle[0] - step),
        count=count,
        stroke=np.rint(mean(stroke)).astype(np.int64),
        contact=events.contact.depth,
        punctures=recorded_punctures(events, recording),
        speed=stroke_speed(time[stroke == 0], depth[stroke == 0]),
        rest=float(np.ptp(time[stroke == 1])) if (stroke == 1).any() else 0.0,
        scale=float(np.abs(mean(force)).max()),
        zero=zero,
    )


def without_outliers(recording: Recording, events: Events) -> np.ndarray:
    """True (n,) at the samples of a recording that are no outliers of the force."""
    used = np.ones(len(recording), bool)
    used[np.asarray(getattr(events, "outliers", ()), dtype=int)] = False
    return used


def force_zero(recording: Recording, events: Events, strokes: Strokes) -> ForceZero:
    """The sensor's zero by the free travel before the contact, or after the exit; with its drift if that shows one.
    Without free travel the zero is a parameter of the fit alone."""
    before, after = free_samples(strokes, events, without_outliers(recording, events))
    drift = drift_of(recording, before, after)
    free = next((part for part in (before, after) if len(part) >= MIN_FREE_SAMPLES), None)
    if free is None:
        return ForceZero()
    force = recording.force[free] - drift.at(recording, free)
    noise = noise_of(force - force.mean(), len(force), recording.card.filter_length, 1.0)
    error = np.sqrt(noise.long_run / len(force) + drift.uncertain_by**2)
    return ForceZero(value=float(force.mean()), error=float(error), drift=drift, noise=noise)


def falls(events: Events, samples: int) -> np.ndarray:
    """True (n,) where the force falls at a puncture of segmentation."""
    found = np.zeros(samples, bool)
    for each in events.punctures:
        found[each.low : max(each.high, each.end) + 2] = True
    return found


def _bins(time: np.ndarray, depth: np.ndarray, stroke: np.ndarray, bins: int, falls: np.ndarray) -> np.ndarray:
    """The bin (n,) of every sample, numbered without gaps: by largest travel in a stroke, shorter where the force falls
    as the law jumps there and a mean over the jump would outweigh all other bins; by time in the hold."""
    width = float(np.ptp(depth)) / bins
    place = np.zeros(len(time), dtype=np.int64)
    for k in range(3):
        here = stroke == k
        if not here.any():
            continue
        if k == 1:
            since = time[here] - time[here][0]
            place[here] = HOLD_BINS * np.sqrt(since / max(since[-1], 1e-9))
        else:
            travel = np.maximum.accumulate((depth[here] - depth[here][0]) * (1 - k))
            steps = np.diff(travel, prepend=0.0) * np.where(falls[here], FINER, 1.0)
            place[here] = np.cumsum(steps) / width
    return np.cumsum(np.diff(place + (FINER * bins + HOLD_BINS + 2) * stroke, prepend=0) != 0)


def relaxation_times(cycles: tuple[BinnedCycle, ...]) -> tuple[float, float]:
    """The two time constants [s] with which the force of all holds decays, by least squares.

    At rest every layer relaxes alike, so that the force of a run is a level and two exponentials whatever the layers
    are. Level and amplitudes of each run are projected out; the times are common.

    Parameters
    ----------
    cycles : tuple of BinnedCycle
        The repeats; those without a hold, or with fewer than ``MIN_BINS`` bins in it, are left out.

    Returns
    -------
    tuple of float
        The shorter and the longer time; ``DEFAULT_TIMES_S`` without a hold.
    """
    holds = [_hold(cycle) for cycle in cycles if at_rest(cycle).sum() >= MIN_BINS]
    if not holds:
        return DEFAULT_TIMES_S
    length = float(np.median([time[-1] for time, _, _ in holds]))
    low, high = np.log(SHORTEST * length), np.log(length)
    middle, half = np.full(2, 0.5 * (low + high)), 0.5 * (high - low)
    for _ in range(ZOOMS):
        axes = [np.clip(np.linspace(at - half, at + half, GRID), low, high) for at in middle]
        pairs = np.array([pair for pair in itertools.product(*axes) if pair[1] - pair[0] >= np.log(MIN_RATIO)])
        squares = sum(_squares(hold, np.exp(pairs)) for hold in holds)
        middle, half = pairs[int(np.argmin(squares))], 2.0 * half / (GRID - 1)
    return float(np.exp(middle[0])), float(np.exp(middle[1]))


def at_rest(cycle: BinnedCycle) -> np.ndarray:
    """True (m,) for bins of the hold before and after which the needle does not move: where it still settles, or has
    begun to withdraw, the force changes with the travel."""
    speed = np.abs(np.diff(cycle.depth, prepend=cycle.depth[0])) / cycle.dt
    still = speed < SPEED_AT_REST
    return (cycle.stroke == 1) & still & np.append(still[1:], True)


def _hold(cycle: BinnedCycle) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time [s] since rest began, weighted force over the scale, and weights (bins,) of one hold."""
    here = at_rest(cycle)
    weight = cycle.weight[here]
    time = np.cumsum(cycle.dt)[here]
    return time - time[0], weight * cycle.force[here], weight


def _squares(hold: tuple[np.ndarray, np.ndarray, np.ndarray], times: np.ndarray) -> np.ndarray:
    """Sums of squares (pairs,) that a level and two exponentials with ``times`` (pairs, 2) [s] leave."""
    since, force, weight = hold
    decay = np.exp(-since[:, None] / times[:, None, :])
    columns = weight[:, None] * np.concatenate([np.ones((len(times), len(since), 1)), decay], axis=2)
    along = np.einsum("pbk,b->pk", np.linalg.qr(columns)[0], force)
    return force @ force - (along**2).sum(axis=1)
