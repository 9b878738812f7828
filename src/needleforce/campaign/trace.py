# SPDX-License-Identifier: Apache-2.0
"""What is kept of a recording's curve: a few points to draw it with, and evenly spaced ones to compare it with."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

COLUMNS = 90  # blocks of equal travel, each with its lowest and highest force
STEP = 0.1e-3  # [m] between the points of a curve that is compared
LONGEST = 1000  # points of it


@dataclass(frozen=True, eq=False)
class Trace:
    """A curve to draw: ``indentation`` (m,) [m] from the contact, ``force`` (m,) [N]; m is some 200 at most."""

    indentation: np.ndarray
    force: np.ndarray


def trace(depth: np.ndarray, force: np.ndarray, surface: float) -> Trace:
    """(n,) ``depth`` [m] and ``force`` [N] in blocks of equal travel, there and back: no peak and no drop is lost."""
    travel = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(depth)))))
    edges = np.searchsorted(travel, np.linspace(0.0, travel[-1], COLUMNS + 1)[1:-1])
    edges = np.unique(np.concatenate(([0], edges, [len(depth)])))
    keep = [0, len(depth) - 1]
    for first, last in pairwise(edges):
        part = force[first:last]
        keep += [first + int(part.argmin()), first + int(part.argmax())]
    keep = np.unique(keep)
    return Trace(depth[keep] - surface, force[keep].copy())


def loading(depth: np.ndarray, force: np.ndarray) -> np.ndarray:
    """The force (m,) [N] of an inward stroke every ``STEP`` of travel from its start; empty for one too short to
    compare.

    Not from the contact: where the tissue lies is part of what tells two specimens apart.
    """
    travel = np.maximum.accumulate(depth) - depth[0]
    grid = STEP * np.arange(min(int(travel[-1] / STEP) + 1, LONGEST))
    return np.interp(grid, travel, force) if len(grid) >= 20 else np.empty(0)
