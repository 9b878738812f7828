# SPDX-License-Identifier: Apache-2.0
"""When each message was measured, on this computer's clock: aligned anew from all times of arrival."""

import numpy as np

from ..alignment import align
from ..recording import Note
from .messages import Messages

_RESTARTS = 20  # a device whose clock goes back more often has none
_SECOND = 1e9  # ns


def on_one_clock(streams: dict[str, Messages], ours: bool) -> tuple[dict[str, np.ndarray], list[str], list[Note]]:
    """Times (n,) [s] from the first message of the first stream, what is assumed, and how well clocks are known.

    ``ours``: recorded by this package. Other recorders' headers tell the time of measuring; so do all, where no
    device has a clock of its own.
    """
    present = {name: each for name, each in streams.items() if len(each)}
    if all(_stamped(each) for each in present.values()) and not (ours and any(map(_has_clock, present.values()))):
        origin = int(next(iter(present.values())).stamp[0])
        said = ["times are those of the messages' headers, one clock for all"]
        return {name: (each.stamp - origin) / _SECOND for name, each in present.items()}, said, []
    origin, times, said, notes = int(next(iter(present.values())).arrival[0]), {}, [], []
    for name, each in present.items():
        times[name], told, found = _aligned(name, each, origin)
        said, notes = said + told, notes + found
    return times, said, notes


def forward(time: np.ndarray) -> np.ndarray:
    """Whether each of ``time`` (n,) is later than all before it."""
    return np.concatenate([[True], time[1:] > np.maximum.accumulate(time)[:-1]])


def _stamped(messages: Messages) -> bool:
    return len(np.unique(messages.stamp)) > len(messages) // 2


def _has_clock(messages: Messages) -> bool:
    return not np.array_equal(messages.device, messages.arrival)


def _aligned(name: str, messages: Messages, origin: int) -> tuple[np.ndarray, list[str], list[Note]]:
    arrival, device = (messages.arrival - origin) / _SECOND, (messages.device - messages.device[0]) / _SECOND
    starts = np.flatnonzero(np.diff(messages.device) < 0) + 1
    if not _has_clock(messages) or len(starts) > _RESTARTS:
        return arrival, [f"the {name} has no clock of its own: its times are those of arrival"], []
    parts, notes = np.split(np.arange(len(device)), starts), []
    host = np.empty(len(device))
    for part in parts:
        found = align(device[part], arrival[part])
        host[part] = found.host(device[part])
        drift, within = (found.rate - 1.0) * 1e6, found.uncertainty * 1e3
        sure = f"within {within:.3g} ms" if np.isfinite(within) else "with too few samples to say how well"
        notes.append(Note("alignment", f"the clock of the {name} is aligned {sure}, its drift is {drift:.3g} ppm"))
    if len(parts) > 1:
        notes.append(Note("restart", f"the clock of the {name} began anew {len(starts)} times", len(starts)))
    return host, [], notes
