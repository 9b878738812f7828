# SPDX-License-Identifier: Apache-2.0
"""What really happened on the rig, for whoever checks a recording against it."""

from array import array
from dataclasses import dataclass

import numpy as np

from .lossy_link import Stream

KEPT = 3_600_000  # steps of the course that are remembered at least: an hour, 24 bytes each


@dataclass(frozen=True, eq=False)
class LiveTruth:
    """The needle's ``depth`` [m] and the axial ``force`` [N] at ``time`` [s], (n,) each; what was done to each of the
    sensor's ``streams``; how often the tissue's model ``refused`` a step, and what came as ``garbage``.
    """

    time: np.ndarray
    depth: np.ndarray
    force: np.ndarray
    streams: list[Stream]
    refused: int
    garbage: int


class Course:
    """The last steps, an hour of them or more."""

    def __init__(self):
        self._columns = tuple(array("d") for _ in range(3))

    def add(self, time: float, depth: float, force: float) -> None:
        """One step."""
        for column, value in zip(self._columns, (time, depth, force)):
            column.append(value)
        if len(self._columns[0]) >= 2 * KEPT:
            for column in self._columns:
                del column[:KEPT]

    def truth(self, streams: list[Stream], refused: int, garbage: int) -> LiveTruth:
        """All of it, as arrays of their own."""
        return LiveTruth(*(np.array(column) for column in self._columns), list(streams), refused, garbage)
