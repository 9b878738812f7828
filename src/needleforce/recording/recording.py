# SPDX-License-Identifier: Apache-2.0
"""A recording of one experiment, simulated or measured, with its provenance."""

from dataclasses import dataclass, field

import numpy as np

from ..errors import InputError


@dataclass(frozen=True)
class Note:
    """An observation made while reading a recording.

    Parameters
    ----------
    kind : str
        A short name, such as ``gap``, ``jitter``, ``baseline`` or ``glitch``.
    message : str
        A sentence for the user.
    count : int
        How often it occurs.
    """

    kind: str
    message: str
    count: int = 1


@dataclass(frozen=True)
class Card:
    """The provenance of a recording.

    Parameters
    ----------
    source : str
        The file, or the simulation.
    sha256 : str
        SHA-256 of the file.
    needle, tissue, rig : str
        Descriptions.
    filter_length : int
        Samples in the average filter of the force, 1 if none is known.
    assumptions : tuple of str
        Sentences on what was assumed while reading.
    """

    source: str = ""
    sha256: str = ""
    needle: str = ""
    tissue: str = ""
    rig: str = ""
    filter_length: int = 1
    assumptions: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Recording:
    """One experiment as arrays of equal length in SI, sorted by time.

    Parameters
    ----------
    time : (n,) array
        Time [s].
    depth : (n,) array
        Depth of the tip [m], positive inwards, in the recording's own zero.
    velocity : (n,) array
        Velocity of the tip [m/s], positive inwards.
    force : (n,) array
        Axial force of the tissue on the needle [N]; positive opposes insertion.
    axes : dict
        Further quantities, (n,) each: fx, fy [N], tx, ty, tz [N m], or the parts of a simulated force [N].
    card : Card
        The provenance.
    notes : tuple of Note
        Observations made while reading.

    Raises
    ------
    InputError
        Arrays of unequal length.
    """

    time: np.ndarray
    depth: np.ndarray
    velocity: np.ndarray
    force: np.ndarray
    axes: dict[str, np.ndarray] = field(default_factory=dict)
    card: Card = Card()
    notes: tuple[Note, ...] = ()

    def __post_init__(self):
        """Convert the columns to contiguous float64 arrays and check their lengths."""
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
