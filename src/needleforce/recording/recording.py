# SPDX-License-Identifier: Apache-2.0
"""A whole experiment, simulated or measured."""

from dataclasses import dataclass, field

import numpy as np

from ..errors import InputError


@dataclass(frozen=True)
class Note:
    """Something found while reading, told and never hidden: its kind, a sentence, and how often."""

    kind: str
    message: str
    count: int = 1


@dataclass(frozen=True)
class Card:
    """Where a recording comes from. ``filter_length`` [samples] is the average filter's, 1 if none is known."""

    source: str = ""
    sha256: str = ""
    needle: str = ""
    tissue: str = ""
    rig: str = ""
    filter_length: int = 1
    assumptions: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Recording:
    """Equal-length (n,) float64 arrays in SI, sorted by time, and the card that says where they come from.

    time [s], depth [m] (+ inwards, in the recording's own zero), velocity [m/s], force [N] (+ opposes insertion);
    ``axes`` holds what else was recorded: fx, fy [N], tx, ty, tz [N m], or the parts of a simulated force [N].
    """

    time: np.ndarray
    depth: np.ndarray
    velocity: np.ndarray
    force: np.ndarray
    axes: dict[str, np.ndarray] = field(default_factory=dict)
    card: Card = Card()
    notes: tuple[Note, ...] = ()

    def __post_init__(self):
        """Makes the columns contiguous float64; InputError for lengths that differ."""
        columns = {name: getattr(self, name) for name in ("time", "depth", "velocity", "force")}
        checked = {name: np.ascontiguousarray(values, dtype=float) for name, values in (columns | self.axes).items()}
        for name, values in checked.items():
            if values.shape != checked["time"].shape or values.ndim != 1:
                raise InputError(f"shape of {name}", values.shape, f"time has {checked['time'].shape}", "recording")
        for name in columns:
            object.__setattr__(self, name, checked.pop(name))
        object.__setattr__(self, "axes", checked)

    def __len__(self) -> int:
        return len(self.time)

    @property
    def rate(self) -> float:
        """Median sampling rate [Hz]."""
        return 1.0 / float(np.median(np.diff(self.time)))
