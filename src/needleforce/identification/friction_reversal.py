# SPDX-License-Identifier: Apache-2.0
"""How friction turns from push to pull when the needle starts back: over micrometres in a phantom, millimetres in
tissue."""

from dataclasses import dataclass

import numpy as np

from ..segmentation import Span
from .estimates import Estimate

BIN = 0.25e-3  # [m]
BINS_AHEAD = 8  # without a stronger pull: 2 mm, longer than ripples and shorter than a layer
MOST_BINS = 10_000  # 2.5 m: more is a wrong unit, and memory is not spent on it
WANDERS = (
    50.0  # so many times what the recorded depth strays at rest: the force then strays by 2 % over the middle of a hold
)


@dataclass(frozen=True)
class Turning:
    """``samples`` of the withdrawal until the needle slides, and the travel [m] to half of the turn, within low and
    high; ``seen`` is False where that is the least that the noise of the depth at rest allows, not a travel seen."""

    samples: int
    half: float
    low: float
    high: float
    seen: bool


def turning_of(depth: np.ndarray, force: np.ndarray, outwards: slice, holds: tuple[Span, ...]) -> Turning | None:
    """The turn at the start of the withdrawal ``outwards`` of depth and force (n,); None without a withdrawal.

    The needle slides from where the pull first stops to grow, as a mean over bins of travel. Half-way in force is
    half-way in the turn of an elastic-slip element, so its travel is the element's presliding, if the cutting force
    unloads over the whole turn; the upper limit is for one that lets go at once.
    """
    if outwards.stop - outwards.start < 2:
        return None
    rest = _rest(depth, outwards, holds)
    if rest.stop >= outwards.stop:
        return None
    slides = outwards.start + _slides(depth[outwards], force[outwards])
    push, pull = float(np.mean(force[rest])), -float(np.mean(force[slides : slides + 5]))
    k = max(rest.stop + int(np.argmax(force[rest.stop : outwards.stop] <= 0.5 * (push - pull))), 1)
    travel = float(np.median(depth[rest])) - depth[[k - 1, k]]
    wander = WANDERS * float(np.ptp(depth[rest]))
    seen = float(travel.mean()) >= wander
    half = max(float(travel.mean()), wander, 0.0)
    at_once = max(0.5 * (push + pull) / pull, 1.0) if pull > 0.0 else 1.0
    low, high = max(float(travel.min()) - wander, 0.0), max(float(travel.max()) * at_once + wander, half)
    return Turning(slides - outwards.start, half, low, high, seen)


def presliding_of(turning: Turning) -> Estimate:
    """``presliding`` [m] of the friction law."""
    source = "travel from the start of the withdrawal to half of the turn from push to pull"
    if not turning.seen:
        source = f"the turn is too short to see: {WANDERS:g} times what the recorded depth strays at rest"
    half, low, high = turning.half, turning.low, turning.high
    return Estimate("presliding", half, "m", low, high, identifiable=turning.seen, source=source)


def _slides(depth: np.ndarray, force: np.ndarray) -> int:
    """Samples until the mean pull of a bin of travel is not exceeded in the bins ahead."""
    bins = np.maximum.accumulate(np.floor(np.clip((depth[0] - depth) / BIN, 0, MOST_BINS)).astype(int))
    count = np.bincount(bins)
    mean = np.where(count > 0, np.bincount(bins, force) / np.maximum(count, 1), np.inf)
    ahead = np.lib.stride_tricks.sliding_window_view(np.append(mean, np.full(BINS_AHEAD, np.inf)), BINS_AHEAD + 1)
    return int(np.searchsorted(bins, int(np.argmax(mean <= ahead.min(axis=1)))))


def _rest(depth: np.ndarray, outwards: slice, holds: tuple[Span, ...]) -> slice:
    """The samples at rest before the withdrawal: the middle of the hold, or where the needle was deepest."""
    if not holds:
        deepest = int(np.argmax(depth[: outwards.stop]))
        return slice(deepest, deepest + 1)
    first, last = holds[0].first, holds[0].last
    margin = 3 * (last - first) // 10  # the braking and the start of the withdrawal
    return slice(first + margin, max(last - margin, first + margin + 1))
