# SPDX-License-Identifier: Apache-2.0
"""What a file holds, before it is a recording: messages with their counters and clocks, and marks."""

from dataclasses import dataclass, field

import numpy as np

from ..recording import Note

_LATE = 10_000  # messages: what comes so late that it is behind by more is no late one, its sender began anew


@dataclass
class Messages:
    """Messages of one topic, sorted by ``sequence`` (n,) int64 unwrapped, each counter once.

    ``arrival``, ``device`` and ``stamp`` (n,) int64 [ns] are the times of arrival here, of the device's own clock and
    of the message's header; ``values`` (n, k) float64. ``counted``: the sequence is the sender's own, else the order.
    """

    sequence: np.ndarray
    arrival: np.ndarray
    device: np.ndarray
    stamp: np.ndarray
    values: np.ndarray
    counted: bool = False
    doubled: int = 0
    topic: str = ""

    def __len__(self) -> int:
        return len(self.sequence)

    def kept(self, mask: np.ndarray) -> "Messages":
        """Those where ``mask`` (n,) is True, or in the order of an index."""
        arrays = (each[mask] for each in (self.sequence, self.arrival, self.device, self.stamp, self.values))
        return Messages(*arrays, self.counted, self.doubled, self.topic)


@dataclass
class Mark:
    """Something that happened: when it was written [ns], its kind, and its facts."""

    arrival: int
    kind: str
    facts: dict


@dataclass
class Log:
    """All of a file: wrenches (n, 6) [N, N m], states of the axis (n, 2) [m, m/s], marks, the card, and how it ended.

    ``complete``: the file was closed. ``notes`` tell what could not be read.
    """

    wrench: Messages
    axis: Messages
    marks: list[Mark]
    card: dict
    end: dict | None
    complete: bool
    notes: list[Note] = field(default_factory=list)


def in_sequence(counters: np.ndarray, arrays: list[np.ndarray], topic: str) -> Messages:
    """Messages from what came: ``counters`` (n,) int64 modulo 2^32, and arrival, device, stamp, values as above.

    Counters that do not count, as of recorders that leave them at zero, give way to the order.
    """
    counted = _count(counters)
    sequence = unwrapped(counters) if counted else np.arange(len(counters))
    kept, first = np.unique(sequence, return_index=True)
    return Messages(kept, *(each[first] for each in arrays), counted, len(sequence) - len(kept), topic)


def unwrapped(counters: np.ndarray) -> np.ndarray:
    """Counters (n,) modulo 2^32 in the order of their coming, without the wrap; one that begins anew goes on."""
    steps = (np.diff(counters) + 2**31) % 2**32 - 2**31
    steps[steps < -_LATE] = 1
    return counters[0] + np.concatenate([[0], np.cumsum(steps)])


def _count(counters: np.ndarray) -> bool:
    return len(counters) > 0 and len(np.unique(counters)) > len(counters) // 2
