# SPDX-License-Identifier: Apache-2.0
"""The two strokes of a recording as identification takes them: force beside the depth it belongs to."""

from dataclasses import dataclass

import numpy as np

from ..recording import Recording
from ..segmentation import Events
from ..vocabulary import Phase
from .friction_reversal import Turning, turning_of


@dataclass(frozen=True, eq=False)
class Strokes:
    """Depth (n,) [m] and force (n,) [N] of insertion and withdrawal, and where the whole strokes stand in the
    recording.

    The withdrawal's arrays begin where the needle slides: before, friction only turns round, as ``turning`` tells.
    """

    depth_in: np.ndarray
    force_in: np.ndarray
    depth_out: np.ndarray
    force_out: np.ndarray
    inwards: slice
    outwards: slice
    turning: Turning | None

    def mask(self, n: int) -> np.ndarray:
        """True (n,) at the samples of either stroke."""
        inside = np.zeros(n, bool)
        inside[self.inwards] = inside[self.outwards] = True
        return inside


def strokes_of(recording: Recording, events: Events) -> Strokes:
    """Insertion from the start of the free travel before it to the hold; withdrawal to the recording's end."""
    inwards, outwards = _inwards(events), _outwards(events)
    depth, force = undelayed_depth(recording), recording.force
    turning = turning_of(depth, force, outwards, events.spans(Phase.hold))
    sliding = slice(outwards.start + (turning.samples if turning else 0), outwards.stop)
    return Strokes(depth[inwards], force[inwards], depth[sliding], force[sliding], inwards, outwards, turning)


def undelayed_depth(recording: Recording) -> np.ndarray:
    """The depth (n,) [m] that the filtered force belongs to: an average filter of n samples is late by (n - 1) / 2."""
    delay = 0.5 * (recording.card.filter_length - 1) / recording.rate
    return recording.depth if delay == 0.0 else np.interp(recording.time - delay, recording.time, recording.depth)


def _inwards(events: Events) -> slice:
    spans = [*events.spans(Phase.deformation), *events.spans(Phase.insertion)]
    if not spans:
        return slice(0, 0)
    free = [span for span in events.spans(Phase.free) if span.last <= spans[0].first]
    first = free[-1].first if free else spans[0].first
    return slice(first, _first_cycle_end(spans))


def _first_cycle_end(spans: list) -> int:
    """Deformation and insertion follow one another without a hold; a later cycle is not of this insertion."""
    end = spans[0].last
    for span in sorted(spans, key=lambda span: span.first)[1:]:
        if span.first != end:
            break
        end = span.last
    return end


def _outwards(events: Events) -> slice:
    spans = events.spans(Phase.extraction)
    if not spans:
        return slice(0, 0)
    after = [span for span in events.spans(Phase.free) if span.first >= spans[0].last]
    return slice(spans[0].first, after[0].last if after else spans[0].last)
