# SPDX-License-Identifier: Apache-2.0
"""The content of a log before it becomes a recording: messages with their counters and clocks, and marks."""

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ..recording import Note

_MAX_DECREASE = 10_000  # messages: a counter that decreases by more is a restart of the sender, not a late message


@dataclass(kw_only=True)
class Messages:
    """The messages of one topic, sorted by sequence, without duplicates.

    Parameters
    ----------
    sequence : (n,) int64 array
        Unwrapped counter.
    arrival, device, stamp : (n,) int64 array
        Times [ns] of arrival at this computer, of the device's clock, and in the message's header.
    values : (n, k) array
        The values.
    counted : bool
        True if the sequence is the sender's counter, False if it is the order of arrival.
    duplicated : int
        Number of duplicates that were removed.
    topic : str
        The topic.
    """

    sequence: np.ndarray
    arrival: np.ndarray
    device: np.ndarray
    stamp: np.ndarray
    values: np.ndarray
    counted: bool = False
    duplicated: int = 0
    topic: str = ""

    def __len__(self) -> int:
        return len(self.sequence)

    def kept(self, mask: np.ndarray) -> "Messages":
        """The messages where ``mask`` (n,) is True, or in the order of an index."""
        return replace(
            self,
            sequence=self.sequence[mask],
            arrival=self.arrival[mask],
            device=self.device[mask],
            stamp=self.stamp[mask],
            values=self.values[mask],
        )


@dataclass
class Mark:
    """An entry of the log other than a sample.

    Parameters
    ----------
    arrival : int
        Time of writing [ns].
    kind : str
        Such as ``bias``, ``status`` or ``phase``.
    facts : dict
        Its data.
    """

    arrival: int
    kind: str
    facts: dict


@dataclass(kw_only=True)
class Log:
    """The content of a log file.

    Parameters
    ----------
    wrench : Messages
        Forces and torques of the sensor, (n, 6) [N, N m].
    axis : Messages
        Depth and velocity of the axis, (n, 2) [m, m/s].
    marks : list of Mark
        Events during the run.
    card : dict
        The provenance, as text.
    end : dict or None
        Why the run ended; None for a file that was not closed.
    complete : bool
        Whether the file was closed.
    notes : list of Note
        What could not be read.
    others : tuple of str
        Topics of other types, which are not read, each with its type.
    axial : str
        The axis of the force that was chosen, empty if none.
    files : tuple of Path
        The MCAP files, in order.
    sha256 : str
        Of what was read, empty of a folder.
    """

    wrench: Messages
    axis: Messages
    marks: list[Mark]
    card: dict
    end: dict | None
    complete: bool
    notes: list[Note] = field(default_factory=list)
    others: tuple[str, ...] = ()
    axial: str = ""
    files: tuple[Path, ...] = ()
    sha256: str = ""


def in_sequence(counters: np.ndarray, arrays: list[np.ndarray], topic: str) -> Messages:
    """Messages from received data: ``counters`` (n,) int64 modulo 2^32; ``arrays`` are arrival, device, stamp, values.

    Counters that do not increase, such as those that a recorder leaves at zero, are replaced by the order of arrival.
    """
    counted = _is_counter(counters)
    sequence = unwrapped(counters) if counted else np.arange(len(counters))
    increasing = bool(np.all(np.diff(sequence) > 0))  # then nothing is sorted or copied
    kept, first = (sequence, slice(None)) if increasing else np.unique(sequence, return_index=True)
    arrival, device, stamp, values = (each[first] for each in arrays)
    return Messages(
        sequence=kept,
        arrival=arrival,
        device=device,
        stamp=stamp,
        values=values,
        counted=counted,
        duplicated=len(sequence) - len(kept),
        topic=topic,
    )


def unwrapped(counters: np.ndarray) -> np.ndarray:
    """Unwrap counters (n,) modulo 2^32 in the order of arrival; after a restart of the sender the count continues."""
    steps = (np.diff(counters) + 2**31) % 2**32 - 2**31
    steps[steps < -_MAX_DECREASE] = 1
    return counters[0] + np.concatenate([[0], np.cumsum(steps)])


def _is_counter(counters: np.ndarray) -> bool:
    return len(counters) > 0 and distinct(counters) > len(counters) // 2


def distinct(values: np.ndarray) -> int:
    """How many of (n,) values differ; sorting those that are in order already is faster than ``np.unique``."""
    return 1 + int(np.count_nonzero(np.diff(np.sort(values))))
