# SPDX-License-Identifier: Apache-2.0
"""The insertion and withdrawal strokes of a recording for identification, and the friction reversal between them."""

from dataclasses import dataclass

import numpy as np

from .. import core
from ..models.parameter_units import UNITS
from ..recording import Recording
from ..segmentation import Events, Span
from ..vocabulary import Phase
from .estimates import Estimate
from .motion import DepthSignal, at_the_cut, middle_of, resting, sliding_back

STROKES = ("insertion", "hold", "withdrawal")
MIDDLE_OF_STROKE = (0.2, 0.8)  # [of the travel] outside, the needle accelerates and brakes
BIN_M = 0.25e-3  # [m] of travel
N_BINS_AHEAD = 8  # without a stronger pull: 2 mm, longer than ripples and shorter than a layer
MAX_BINS = 10_000  # 2.5 m: more is a wrong unit, for which no memory is spent
MIN_REVERSAL_RATIO = 50.0  # [of the range of the depth at rest] that range then changes the force by 2 %


@dataclass(frozen=True, kw_only=True)
class FrictionReversal:
    """``samples`` of the withdrawal until the needle slides, and the travel [m] to half of the friction reversal,
    between low and high; ``measured`` is False where the noise of the depth at rest sets that travel."""

    samples: int
    half: float
    low: float
    high: float
    measured: bool


@dataclass(frozen=True, eq=False, kw_only=True)
class Strokes:
    """Depth (n,) [m] and force (n,) [N] of insertion and withdrawal, and the complete strokes as slices of the
    recording.

    The insertion's arrays hold the samples at the deepest depth so far, the withdrawal's those where the needle slides
    back, also in a pull-back after the puncture; see ``motion``. ``index_in`` and ``index_out`` are their sample
    numbers in the recording. Where the withdrawal begins, friction reverses, see ``friction_reversal``.
    """

    depth_in: np.ndarray
    force_in: np.ndarray
    depth_out: np.ndarray
    force_out: np.ndarray
    index_in: np.ndarray
    index_out: np.ndarray
    inwards: slice
    outwards: slice
    friction_reversal: FrictionReversal | None
    depth_noise: float = 0.0
    """[m] standard deviation of the noise of the depth."""
    backtrack: float = 0.0
    """[m] the longest pull-back within the insertion, 0 for none beyond the noise of the depth."""

    @property
    def arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Depth and force of the insertion, then those of the withdrawal."""
        return self.depth_in, self.force_in, self.depth_out, self.force_out

    def mask(self, n: int) -> np.ndarray:
        """True (n,) at the samples of either stroke."""
        inside = np.zeros(n, bool)
        inside[self.inwards] = inside[self.outwards] = True
        return inside

    def reversing(self, mask: np.ndarray) -> np.ndarray:
        """True where friction reverses, for the samples of a ``mask`` (n,) of the recording."""
        samples = self.friction_reversal.samples if self.friction_reversal else 0
        number = np.flatnonzero(mask) - self.outwards.start
        return (number >= 0) & (number < samples)

    def place_in(self, sample: int) -> int:
        """Position in the insertion's arrays of the recording's ``sample``, or of the next one that they hold."""
        return int(np.searchsorted(self.index_in, sample))


def strokes_of(recording: Recording, events: Events, signal: DepthSignal | None = None) -> Strokes:
    """Insertion from the start of the free travel before it to the hold; withdrawal to the recording's end.

    ``signal`` is that of the undelayed depth, where it is known.
    """
    inwards, outwards = _inwards(events), _outwards(events)
    signal = signal or DepthSignal(undelayed_depth(recording))
    depth, force = signal.depth, recording.force
    reversal = friction_reversal_of(signal.steady, force, outwards, events.spans(Phase.hold))
    inner = DepthSignal(depth[inwards])
    cut, back, backtrack = _insertion_samples(
        recording.time, inner, inwards, events, _stretch(depth, outwards, reversal)
    )
    begin = outwards.start + (reversal.samples if reversal else 0)
    slides = begin + np.flatnonzero(at_the_cut(DepthSignal(-depth[begin : outwards.stop])))
    usable = usable_samples(recording, events)
    cut, out = cut[usable[cut]], np.concatenate([back, slides])
    out = out[usable[out]]
    return Strokes(
        depth_in=depth[cut],
        force_in=force[cut],
        depth_out=depth[out],
        force_out=force[out],
        index_in=cut,
        index_out=out,
        inwards=inwards,
        outwards=outwards,
        friction_reversal=reversal,
        depth_noise=inner.noise,
        backtrack=backtrack,
    )


def usable_samples(recording: Recording, events: Events) -> np.ndarray:
    """True (n,) at the samples that are no outliers of the force, and not in the fall of a gradual rupture: there
    neither the loading curve nor friction and cutting hold."""
    usable = np.ones(len(recording), bool)
    usable[events.outliers] = False
    for puncture in events.punctures:
        if puncture.gradual:
            usable[int(np.searchsorted(recording.time, puncture.time)) + 1 : max(puncture.end, 0)] = False
    return usable


def _stretch(depth: np.ndarray, outwards: slice, reversal: FrictionReversal | None) -> float:
    """Travel [m] of the withdrawal until the needle slides; infinite if the recording does not show it."""
    if reversal is None:
        return np.inf
    return float(depth[outwards.start] - depth[min(outwards.start + reversal.samples, outwards.stop - 1)])


def _insertion_samples(
    time: np.ndarray, depth: DepthSignal, inwards: slice, events: Events, stretch: float
) -> tuple[np.ndarray, np.ndarray, float]:
    """Sample numbers at the cut, those sliding back after the first puncture, and the longest pull-back [m]."""
    samples = np.arange(inwards.start, inwards.stop)
    if not len(samples):
        return samples, samples, 0.0
    contact = events.contact.high - inwards.start if events.contact is not None else 0
    moving = ~resting(time[inwards], depth)
    moving[: max(contact, 0)] = True
    backtrack = float(np.max(depth.deepest - depth.depth))
    if backtrack <= depth.backtrack_limit:
        return inwards.start + np.flatnonzero(moving), samples[:0], 0.0
    puncture = events.punctures[0].high if events.punctures else inwards.stop
    back = sliding_back(depth, stretch) & (samples > puncture)
    return samples[at_the_cut(depth) & moving], samples[back], backtrack


def undelayed_depth(recording: Recording) -> np.ndarray:
    """The depth (n,) [m] at the time of the filtered force: an average filter of n samples delays by (n - 1) / 2."""
    return depth_before(recording, filter_delay(recording, recording.card.filter_length))


def filter_delay(recording: Recording, length: int) -> float:
    """Delay [s] of the force behind an average filter of ``length`` samples."""
    return 0.5 * (length - 1) / recording.rate


def depth_before(recording: Recording, delay: float) -> np.ndarray:
    """The depth (n,) [m] by a ``delay`` [s] before each sample."""
    return recording.depth if delay == 0.0 else np.interp(recording.time - delay, recording.time, recording.depth)


def own_spans(events: Events, phase: Phase) -> tuple[Span, ...]:
    """Spans of a phase from the contact of the events on: an earlier insertion, such as a touch without puncture, is
    not theirs."""
    since = 0 if events.contact is None else events.contact.low
    return tuple(span for span in events.spans(phase) if span.last > since)


def _inwards(events: Events) -> slice:
    spans = [*own_spans(events, Phase.deformation), *own_spans(events, Phase.insertion)]
    if not spans:
        return slice(0, 0)
    free = [span for span in events.spans(Phase.free) if span.last <= spans[0].first]
    first = free[-1].first if free else spans[0].first
    return slice(first, _first_cycle_end(spans))


def _first_cycle_end(spans: list) -> int:
    """End of the spans that follow one another without a hold; a later cycle is another insertion."""
    end = spans[0].last
    for span in sorted(spans, key=lambda span: span.first)[1:]:
        if span.first != end:
            break
        end = span.last
    return end


def _outwards(events: Events) -> slice:
    spans = own_spans(events, Phase.extraction)
    if not spans:
        return slice(0, 0)
    after = [span for span in events.spans(Phase.free) if span.first >= spans[0].last]
    return slice(spans[0].first, after[0].last if after else spans[0].last)


def stroke_speed(time: np.ndarray, depth: np.ndarray) -> float:
    """Mean speed [m/s] over the middle of an inward stroke, time [s] and depth [m] (n,); over all of it where the depth
    jumps over the middle."""
    low, high = (depth[0] + share * (depth[-1] - depth[0]) for share in MIDDLE_OF_STROKE)
    first, last = int(np.argmax(depth > low)), int(np.argmax(depth >= high))
    first, last = (first, last) if last > first else (0, len(depth) - 1)
    return float((depth[last] - depth[first]) / max(time[last] - time[first], 1e-9))


def cycle_span(strokes: Strokes, events: Events) -> tuple[slice, np.ndarray]:
    """The first cycle as a slice of its recording, and for each of its samples (n,) the index of its stroke, 0 to 2.

    The cycle of a recording without a withdrawal ends with its hold.
    """
    first, stop = strokes.inwards.start, strokes.inwards.stop
    withdrawal, end = strokes.outwards.start, strokes.outwards.stop
    if end <= withdrawal:
        holds = [span.last for span in events.spans(Phase.hold) if span.first >= stop]
        withdrawal = end = holds[0] if holds else stop
    stroke = np.zeros(end - first, dtype=np.int64)
    stroke[stop - first :] = 1
    stroke[withdrawal - first :] = 2
    return slice(first, end), stroke


def friction_reversal_of(
    depth: np.ndarray, force: np.ndarray, outwards: slice, holds: tuple[Span, ...]
) -> FrictionReversal | None:
    """The friction reversal at the start of the withdrawal ``outwards`` of depth and force (n,); None without one.

    The needle slides a bin of travel behind that in which the pull, as a mean over bins, first stops growing: in a part
    of that one friction still reverses. For an elastic-slip
    element the travel to half of the change of force is its presliding, if the cutting force unloads over the complete
    reversal; the upper limit is for a cutting force that unloads at once.
    """
    if outwards.stop - outwards.start < 2:
        return None
    rest = _rest(depth, outwards, holds)
    if rest.stop >= outwards.stop:
        return None
    slides = outwards.start + core.sliding_start(
        depth[outwards], force[outwards], bin=BIN_M, ahead=N_BINS_AHEAD, max_bins=MAX_BINS
    )
    slides += int(np.argmax(depth[slides : outwards.stop] <= depth[slides] - BIN_M))
    push, pull = float(np.mean(force[rest])), -float(np.mean(force[slides : slides + 5]))
    held, still = core.median(depth[rest]), slice(rest.stop, outwards.stop)
    k = max(rest.stop + int(max(np.argmax(force[still] <= 0.5 * (push - pull)), np.argmax(depth[still] < held))), 1)
    travel = held - depth[[k - 1, k]]
    resolution = MIN_REVERSAL_RATIO * float(np.ptp(depth[rest]))
    half = max(float(travel.mean()), float(np.ptp(depth[rest])))
    at_once = max(0.5 * (push + pull) / pull, 1.0) if pull > 0.0 else 1.0
    return FrictionReversal(
        samples=slides - outwards.start,
        half=half,
        low=max(float(travel.min()) - resolution, 0.0),
        high=max(float(travel.max()) * at_once + resolution, half),
        measured=float(travel.mean()) >= resolution,
    )


def presliding_of(friction_reversal: FrictionReversal) -> Estimate:
    """``presliding`` [m] of the friction law."""
    source = "travel from the start of the withdrawal to half of the friction reversal"
    if not friction_reversal.measured:
        limit = f"{MIN_REVERSAL_RATIO:g} times the range of the depth at rest"
        source = f"friction reversal too short to measure: less than {limit}"
    half, low, high = friction_reversal.half, friction_reversal.low, friction_reversal.high
    return Estimate(
        "presliding", half, UNITS["presliding"], low, high, identifiable=friction_reversal.measured, source=source
    )


def _rest(depth: np.ndarray, outwards: slice, holds: tuple[Span, ...]) -> slice:
    """The samples at rest before the withdrawal: the middle of the hold, or the deepest sample."""
    if not holds:
        deepest = int(np.argmax(depth[: outwards.stop]))
        return slice(deepest, deepest + 1)
    return middle_of(holds[0].first, holds[0].last)
