# SPDX-License-Identifier: Apache-2.0
"""The samples of one whole cycle: insertion, hold and withdrawal."""

import numpy as np

from ..segmentation import Events
from ..vocabulary import Phase
from .strokes import Strokes

STROKES = ("insertion", "hold", "withdrawal")


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
