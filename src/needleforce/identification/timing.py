# SPDX-License-Identifier: Apache-2.0
"""Whether force and depth of a recording belong to the same instants: a lag between them, or a depth that is late.

A needle at rest in tissue that is withdrawn changes its force in the instant in which it moves, whatever the tissue.
"""

import dataclasses
import itertools
import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .. import core
from ..recording import Recording
from ..recording.force_signal import late_depth
from ..segmentation import Events
from ..segmentation.strokes import cycles, updated_depth, white_noise
from ..vocabulary import Phase
from .motion import DepthSignal, smoothed
from .one_layer.puncture_force import filter_of_the_fall
from .statistics.noise import SIGNIFICANT, TWO_SIDED, noise_of, undeclared_filter
from .strokes import depth_before, filter_delay, own_spans

BEFORE_S, AFTER_S = 0.3, 0.5  # [s] of rest before the withdrawal, and of withdrawal, that are looked at
MAX_LAG_S = 0.15  # [s]
MAX_LATE_S = 1.0  # [s] of a depth before its turn, in which the force is compared: no lag may reach beyond
MIN_TURN_REST_S = 0.1  # [s] of rest before the turn, below which the insertion disturbs the search
PULL_SIGMA, PULL_SHARE = 5.0, 0.05  # [sd of a sample], and of the range of the force, that pull a needle
MAX_SAMPLES = 100  # of the window: more add time and little knowledge
STRETCHES = np.geomspace(5e-6, 5e-3, 8)  # [m] travel over which the force follows the reversal
MIN_CHANGE_SIGMA = 20.0  # [standard deviations of a sample] of the force, so that a tenth of it is seen
MIN_FOLLOWING = 1e-6  # mean square of the travel over its stretch
FOLLOWED = 0.8  # of the change of the force
MIN_REST_SAMPLES = 5


@dataclass(frozen=True)
class Lag:
    """Time [s] by which the force is behind the depth (negative: ahead) at the start of the withdrawal, between ``low``
    and ``high`` whichever way the force follows the reversal, and the standard ``error`` [s] from noise."""

    low: float
    high: float
    error: float

    @property
    def time(self) -> float:
        """Middle of the range [s]."""
        return 0.5 * (self.low + self.high)

    @property
    def ends(self) -> tuple[float, float]:
        """The ends [s] of the range, with their 95 % error."""
        return self.low - TWO_SIDED * self.error, self.high + TWO_SIDED * self.error

    @property
    def largest(self) -> float:
        """The end [s] of the range that is farther from no lag, with its error."""
        return max(self.ends, key=abs)

    @property
    def significant(self) -> bool:
        """Whether no lag is excluded: noise leads to that less than once in a thousand recordings."""
        return not self.allows(0.0)

    def allows(self, time: float) -> bool:
        """Whether a lag of so much ``time`` [s] is not excluded, at the same level."""
        return self.low - SIGNIFICANT * self.error <= time <= self.high + SIGNIFICANT * self.error


@dataclass(frozen=True, eq=False, kw_only=True)
class LagSearch:
    """A search for the lag at the start of the withdrawal after a hold: ``time`` and ``force`` (n,) of the window, the
    times and the ``travel`` (m,) back from the hold around it, the ``stretches`` that the noise of the depth leaves,
    the noise's ``correlation``, and the ``resolution`` [s] of sampling and depth.

    Least squares of F(t) = a + b t + c g(d(t - lag) / s), where d is the travel back from the hold: a relaxing force,
    then one that follows the reversal over a stretch s of any length, g being 1 - exp(-x) or x up to 1. How the force
    follows is not known better than between these two, which give the range. The error is half the range of lags whose
    sum of squares the noise allows, and a sample.
    """

    time: np.ndarray
    force: np.ndarray
    travel_time: np.ndarray
    travel: np.ndarray
    stretches: np.ndarray
    correlation: float
    resolution: float

    @cached_property
    def significant(self) -> Lag | None:
        """The lag, if it is significant and a tip that unloads at once does not explain it, otherwise None. No lag is
        outside the range of both if it is inside that of the first, so that the second need not be looked at."""
        lag, half = self.linear
        if abs(lag) <= SIGNIFICANT * self.error(half) or (found := self.possible) is None or not found.significant:
            return None
        return None if found.time < 0.0 and self.unloads_at_once(found.time) else found

    @cached_property
    def possible(self) -> Lag | None:
        """The range of the lags, with the larger error; None for a lag beyond those that are searched."""
        found = [self.linear, self.best(linearly=False)]
        low, high = sorted(lag for lag, _ in found)
        if not -MAX_LAG_S < low <= high < MAX_LAG_S:
            return None
        return Lag(low, high, self.error(max(half for _, half in found)))

    @cached_property
    def linear(self) -> tuple[float, float]:
        """The best lag of a force that follows linearly."""
        return self.best(linearly=True)

    def error(self, half: float) -> float:
        """Standard error [s] with half the range of lags that the noise allows."""
        return math.hypot(half, self.resolution)

    def best(self, *, linearly: bool) -> tuple[float, float]:
        """The lag [s] with the least sum of squares, and half the range of lags that the noise allows [s]."""
        lags = np.linspace(-MAX_LAG_S, MAX_LAG_S, 21)
        for _ in range(3):
            squares = self._squares(lags, linearly=linearly)
            best = int(np.argmin(squares))
            found, width = float(lags[best]), float(lags[1] - lags[0])
            allowed = lags[squares <= squares[best] * (1.0 + self.correlation / max(len(self.time) - 5, 1))]
            lags = found + np.linspace(-width, width, 9)
        return found, max(0.5 * float(np.ptp(allowed)), 0.5 * width)

    def _squares(self, lags: np.ndarray, *, linearly: bool) -> np.ndarray:
        given = {"time": self.time, "force": self.force, "travel_time": self.travel_time, "travel": self.travel}
        given |= {"stretches": self.stretches, "least": MIN_FOLLOWING, "linearly": linearly}
        return core.squares_by_lag(**given, lags=lags)

    def unloads_at_once(self, lag: float) -> bool:
        """Whether a force that follows in part at once explains the samples as well without a lag as one that follows
        over one stretch with the ``lag`` [s]: the tip may unload over less travel than friction needs to reverse."""
        travel = np.maximum(np.interp(self.time, self.travel_time, self.travel), 0.0)
        back = np.arange(len(travel)) > np.flatnonzero(travel <= 0.0).max(initial=-1)
        sudden = (back.astype(float), 1.0 - np.exp(-travel / self.stretches[0]))
        base, lowest = [np.ones_like(travel), self.time - self.time.mean()], math.inf
        for stretch in self.stretches[1:]:
            followed = (1.0 - np.exp(-travel / stretch), np.minimum(travel / stretch, 1.0))
            for first, follows in itertools.product(sudden, followed):
                design = np.column_stack([*base, first, follows])
                values = np.linalg.lstsq(design, self.force)[0]
                if values[2] <= 0.0 and values[3] <= 0.0:
                    lowest = min(lowest, float(np.sum((self.force - design @ values) ** 2)))
        with_lag = min(float(self._squares(np.array([lag]), linearly=each)[0]) for each in (True, False))
        return lowest <= with_lag * (1.0 + SIGNIFICANT**2 * self.correlation / max(len(self.time) - 5, 1))


def lag_search(recording: Recording, events: Events, signal: DepthSignal) -> LagSearch | None:
    """The search for a lag at the start of the withdrawal after a hold; None without both, or where the depth is too
    noisy."""
    outwards = own_spans(events, Phase.extraction)
    holds = [span for span in events.spans(Phase.hold) if outwards and span.last >= outwards[0].first]
    if not holds or holds[0].end - holds[0].start < BEFORE_S:
        return None
    window = _window(recording, float(recording.time[outwards[0].first]))
    window = None if window is None else np.setdiff1d(window, events.outliers, assume_unique=True)
    return None if window is None else _search(recording, signal, window)


def _search(
    recording: Recording, signal: DepthSignal, window: np.ndarray, held: float | None = None
) -> LagSearch | None:
    """The search in a window of samples, back from the depth that was ``held`` [m], by default that of its begin."""
    smooth, left = signal.smoothed
    window = window[:: -(-len(window) // MAX_SAMPLES)]
    time, depth, force = (values[window] for values in (recording.time, smooth, recording.force))
    held = core.median(depth[time <= time[0] + 0.5 * BEFORE_S]) if held is None else held
    stretches = STRETCHES[3.0 * left < STRETCHES]
    if not len(stretches):
        return None
    first, last = np.searchsorted(recording.time, (time[0] - 2.0 * MAX_LAG_S, time[-1] + 2.0 * MAX_LAG_S))
    around = slice(max(int(first) - 1, 0), int(last) + 1)
    speed = float(np.ptp(depth)) / float(time[-1] - time[0])  # at which the rest of the depth's noise is passed
    return LagSearch(
        time=time,
        force=force,
        travel_time=recording.time[around],
        travel=held - smooth[around],
        stretches=stretches,
        correlation=_correlation(force),
        resolution=math.hypot(1.0 / recording.rate, left / max(speed, 1e-12)),
    )


def _window(recording: Recording, start: float, rest_s: float = BEFORE_S) -> np.ndarray | None:
    """Samples of the last part of the hold, and of the withdrawal from ``start`` [s] until the force has followed by
    most of its change: then the needle slides, and the force follows the embedded length. None without enough of
    either."""
    time, force = recording.time, recording.force
    first, begin = np.searchsorted(time, (start - rest_s, start))
    rest = np.arange(first, begin)
    after = np.arange(begin, np.searchsorted(time, start + AFTER_S, side="right"))
    if len(rest) < MIN_REST_SAMPLES or len(after) < MIN_REST_SAMPLES:
        return None
    level, noise, follows = core.median(force[rest]), white_noise(force[rest]), smoothed(force[after], 5)
    change = float(follows.min()) - level
    if not -change > MIN_CHANGE_SIGMA * noise:
        return None
    end = after[int(np.argmax(follows <= level + FOLLOWED * change))]
    return np.arange(rest[0], max(end, after[MIN_REST_SAMPLES - 1]) + 1)


def lateness(recording: Recording) -> Lag | None:
    """The lag of a force that pulls the needle before the depth turns back, which only a late depth explains; None for
    any other.

    The search at the turn gives it where the depth is taken back by the middle of the range that follows from the pull,
    and that range where it does not.
    """
    time, force, depth = recording.time, recording.force, updated_depth(recording.depth)
    smooth, left = DepthSignal(depth).smoothed
    for cycle in (each for each in cycles(time, depth) if each.withdrawn):
        size = max((cycle.stop - cycle.start) // 20, MIN_REST_SAMPLES)
        ends = (force[cycle.start : cycle.start + size], force[max(cycle.end - size, cycle.stop) : cycle.end])
        zero = min(core.median(each) for each in ends)
        pull = max(PULL_SIGMA * white_noise(force), PULL_SHARE * (float(force[cycle.start : cycle.end].max()) - zero))
        part = slice(int(np.searchsorted(time, time[cycle.stop - 1] - MAX_LATE_S)), cycle.end)
        found = late_depth((time[part], force[part] - zero), (time[part], smooth[part]), pull, 3.0 * left)
        if found is not None and found[1] < MAX_LATE_S:
            turn = time[part][smooth[part].argmax() :][0]
            return _refined(recording, found, (float(turn), float(time[cycle.withdrawal_start - 1])))
    return None


def late_words(late: Lag) -> str:
    """A sentence on a depth that is late."""
    low, high = (-end for end in reversed(late.ends))
    return (
        f"The depth is {-late.time:.3f} s ({low:.3f} to {high:.3f} s) later than the force, which pulls the needle "
        "before the depth turns back: depths are taken back by it; intervals of a model of one layer hold the range."
    )


def _refined(recording: Recording, late: tuple[float, float], rest: tuple[float, float]) -> Lag:
    """The lag of a depth that is late by a range [s] and rests from one time to another by the recording."""
    middle, length = 0.5 * sum(late), rest[1] - rest[0]
    taken_back = dataclasses.replace(recording, depth=depth_before(recording, -middle))
    signal, lag = DepthSignal(taken_back.depth), None
    window = _window(taken_back, rest[1] - middle, min(length, BEFORE_S)) if length >= MIN_TURN_REST_S else None
    if window is not None and (search := _search(taken_back, signal, window, float(signal.smoothed[0].max()))):
        lag = search.possible
    if lag is None:
        return Lag(-late[1], -late[0], 1.0 / recording.rate)
    return Lag(lag.low - middle, lag.high - middle, lag.error)


def _correlation(force: np.ndarray) -> float:
    """Long-run over plain variance of the noise of the force at rest, at least 1."""
    rest = force[: max(len(force) // 3, 3)]
    noise = noise_of(rest - rest.mean(), len(rest), 1, 1.0)
    return max(noise.long_run / noise.variance, 1.0) if noise.variance > 0.0 else 1.0


@dataclass(frozen=True)
class Timing:
    """The significant ``lag`` between force and depth or None, with its ``search`` where there is one, the lag of a
    ``late`` depth that was taken back by it, the ``filter_length`` [samples] of an average filter that is not declared
    or 0, and a sentence for each."""

    lag: Lag | None = None
    search: LagSearch | None = None
    late: Lag | None = None
    filter_length: int = 0
    notes: tuple[str, ...] = ()


def _play(recording: Recording, events: Events, lag: Lag) -> str:
    """What else a force is behind for: the travel in which a mount that rattles turns from one side to the other."""
    if lag.time < 0.0:
        return ""
    start = float(recording.time[own_spans(events, Phase.extraction)[0].first])
    first, last = np.interp((start, start + lag.time), recording.time, recording.depth)
    return f" So does play of the mount of {1e3 * abs(last - first):.2g} mm, which shifts the withdrawal alone."


def timing_of(recording: Recording, events: Events, signal: DepthSignal, late: Lag | None = None) -> Timing:
    """The lag between force and depth and the undeclared filter of a recording, with their sentences; ``signal`` is
    that of the undelayed depth, which is taken back by a ``late`` lag."""
    found, search = [], lag_search(recording, events, signal)
    lag = None if search is None or late is not None else search.significant
    if lag is not None:
        side = "behind" if lag.time > 0.0 else "ahead of"
        span = sorted(1e3 * abs(end) for end in (lag.low, lag.high))
        found.append(
            f"The force is {span[0]:.0f} to {span[1]:.0f} ms {side} the depth at the start of the withdrawal: a lag of "
            "the recording shifts depths by speed times lag." + _play(recording, events, lag)
        )
    free = recording.force[: events.contact.low] if events.contact is not None else recording.force[:0]
    length = undeclared_filter(free, recording.card.filter_length)
    if length:
        found.append(
            f"The noise of the free travel is that behind an average filter of about {length} samples, declared are "
            f"{recording.card.filter_length}: declare it, so that its delay and its smearing are counted."
        )
    elif (length := filter_of_the_fall(recording, events)) and filter_delay(recording, length) < MAX_LAG_S:
        found.append(
            f"The force falls at the puncture as a sharp rupture does behind an average filter of about {length} "
            "samples, and none is declared: declare it, so that its delay and its smearing are counted. The intervals "
            "of a model of one layer hold the values with and without it."
        )
    return Timing(lag, search, late, length, tuple(found))
