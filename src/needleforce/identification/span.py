# SPDX-License-Identifier: Apache-2.0
"""The samples of one whole cycle: insertion, hold and withdrawal."""

import numpy as np

from ..segmentation import Events
from ..vocabulary import Phase
from .strokes import Strokes

STROKES = ("insertion", "hold", "withdrawal")


MIDDLE = (0.2, 0.8)  # of the travel: outside, the needle speeds up and slows down


def stroke_speed(time: np.ndarray, depth: np.ndarray) -> float:
    """Mean speed [m/s] over the middle of an inward stroke, time [s] and depth [m] (n,)."""
    low, high = (depth[0] + share * (depth[-1] - depth[0]) for share in MIDDLE)
    first, last = int(np.argmax(depth > low)), int(np.argmax(depth >= high))
    return float((depth[last] - depth[first]) / max(time[last] - time[first], 1e-9))


def cycle_span(strokes: Strokes, events: Events) -> tuple[slice, np.ndarray]:
    """Where the first cycle stands in its recording, and for each of its samples (n,) 0, 1 or 2 for its stroke.

    A recording that was cut off before the needle came back ends with its hold.
    """
    first, stop = strokes.inwards.start, strokes.inwards.stop
    leave, end = strokes.outwards.start, strokes.outwards.stop
    if end <= leave:
        holds = [span.last for span in events.spans(Phase.hold) if span.first >= stop]
        leave = end = holds[0] if holds else stop
    stroke = np.zeros(end - first, dtype=np.int64)
    stroke[stop - first :] = 1
    stroke[leave - first :] = 2
    return slice(first, end), stroke
