# SPDX-License-Identifier: Apache-2.0
"""Settings of a run, its progress for a live view, and its result."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from ..checks import within
from ..errors import InputError
from ..files import MAX_PART_SAMPLES
from ..recording.card import check_filter_length
from ..wire.axis_lines import MAX_SILENCE_S, AxisState
from ..wire.net_ft import AXES
from .axis_check import StopReport
from .motion_sequence import EndReason
from .sources.source import ForceSample
from .stop_at import StopAt


@dataclass(frozen=True)
class Settings:
    """How a run is recorded.

    Parameters
    ----------
    force_limit : float
        Limit of the absolute axial force minus the bias [N], at least 1e-6; infinite for no limit.
    limit_source : str
        Where the limit comes from, for the card of the recording.
    bias_time : float
        Time at rest before the motion from which the bias is determined [s], 0 to 60; 0 for no bias.
    duration : float, optional
        Duration of a recording without motion [s], 1e-3 to 1e6. Default: until it is stopped or the source ends.
    flush_every : float
        Interval at which the file is flushed [s], 0.01 to 10.
    axial : str
        The sensor's axis along the needle, ``"fx"``, ``"fy"`` or ``"fz"``; with a minus, such as ``"-fz"``, if its
        reading decreases when the force against insertion increases.
    filter_length : int
        Samples in the sensor's moving-average filter, for the card of the recording.
    silence : float
        Time without a reading, an axis state or a movement after which the run ends [s], 0.05 to 60.
    steady : float
        Largest drift and standard deviation of the axial force at rest [N], at least 1e-6.
    max_force_gap : float
        Time without a usable reading after which a moving axis is stopped [s], 0.02 to 0.5, when it stops by itself.
    frozen_check : bool
        Whether readings that repeat more often than the noise at rest explains are not usable.
    part_samples : int
        Readings after which the recording is continued in the next file, 100 to 2^22.
    part_time : float
        Time after which it is [s], at least 0.1; infinite for none.
    stop_at : StopAt, optional
        The event at which the axis stops and the run ends.

    Raises
    ------
    InputError
        If a value is outside its range.
    """

    force_limit: float
    bias_time: float = 0.5
    duration: float | None = None
    flush_every: float = 0.25
    axial: str = "fz"
    filter_length: int = 1
    silence: float = 1.0
    steady: float = 0.05
    max_force_gap: float = 0.25
    frozen_check: bool = True
    limit_source: str = "given"
    part_samples: int = MAX_PART_SAMPLES
    part_time: float = math.inf
    stop_at: StopAt | None = None

    def __post_init__(self):
        limits = [
            ("force_limit", self.force_limit, 1e-6, math.inf, "N"),
            ("bias_time", self.bias_time, 0.0, 60.0, "s"),
            ("duration", self.duration if self.duration is not None else 1.0, 1e-3, 1e6, "s"),
            ("flush_every", self.flush_every, 0.01, 10.0, "s"),
            ("silence", self.silence, 0.05, 60.0, "s"),
            ("steady", self.steady, 1e-6, math.inf, "N"),
            ("max_force_gap", self.max_force_gap, 0.02, MAX_SILENCE_S, "s"),
            ("part_samples", self.part_samples, 100, MAX_PART_SAMPLES, ""),
            ("part_time", self.part_time, 0.1, math.inf, "s"),
        ]
        for quantity, value, low, high, unit in limits:
            within(quantity, value, low, high, unit)
        if self.axial.removeprefix("-") not in AXES[:3]:
            raise InputError("axial", repr(self.axial), "not fx, fy or fz, with or without a minus")
        check_filter_length(self.filter_length)

    @property
    def column(self) -> int:
        """Index of the axial force in a wrench."""
        return AXES.index(self.axial.removeprefix("-"))

    @property
    def sign(self) -> float:
        """Factor that makes the axial force positive against insertion."""
        return -1.0 if self.axial.startswith("-") else 1.0


@dataclass(frozen=True)
class RestBias:
    """Readings at rest: mean and standard deviation (6,) [N, N m] over ``samples`` readings."""

    wrench: tuple[float, ...] = (0.0,) * 6
    noise: tuple[float, ...] = (0.0,) * 6
    samples: int = 0


@dataclass(frozen=True, kw_only=True)
class RunResult:
    """Result of a run.

    Attributes
    ----------
    ended : EndReason
        Why the run ended.
    detail : str
        Details of the reason, if there are any.
    seconds : float
        Duration [s].
    received, lost, duplicated, late : int
        Counts of records.
    longest_own_gap : float
        Longest time that a reading waited in this computer before it was read [s].
    bias : RestBias
        The bias at rest.
    peak_force : float
        Axial force of the largest magnitude, with its sign, minus the bias [N].
    cpu_share : float
        Processor time over duration [1].
    alignment_uncertainty : float or None
        95 % uncertainty of the sensor's clock relative to this computer's [s]; None with too few readings.
    path : Path
        The recorded file.
    dropped : int
        Packets among the lost ones that arrived when this computer's receive buffer was full.
    buffer : float
        Time for which that buffer holds unread readings [s].
    restarts : int
        How often the sensor's counter restarted.
    frozen_axes : tuple of str
        Axes of the sensor across the needle that froze; nothing is limited by them.
    unwritten : int
        Readings that arrived and are not in the file, because it could not be written.
    stop : StopReport or None
        What the axis did after its last stop; None without an axis that was moved.
    past_event : float or None
        Distance [m] from the event at which the axis was to stop to where it rests; None without such an event.
    """

    ended: EndReason
    detail: str
    seconds: float
    received: int
    lost: int
    duplicated: int
    late: int
    longest_own_gap: float
    bias: RestBias
    peak_force: float
    cpu_share: float
    alignment_uncertainty: float | None
    path: Path
    dropped: int = 0
    buffer: float = math.inf
    restarts: int = 0
    frozen_axes: tuple[str, ...] = ()
    unwritten: int = 0
    stop: StopReport | None = None
    past_event: float | None = None

    @property
    def rest_confirmed(self) -> bool:
        """Whether the axis, if it was moved, was seen to stop within the distance in which it must."""
        return self.stop is None or (self.stop.confirmed and self.ended is not EndReason.AXIS_NOT_STOPPED)


class Progress(NamedTuple):
    """Values for a live view: time since the start [s], readings and losses, axial force [N], depth [m] and phase of
    the motion or None, bias [N]."""

    seconds: float
    received: int
    lost: int
    force: float
    depth: float | None
    phase: str | None
    bias: float


class Written(NamedTuple):
    """What a run wrote since the last call: readings with the times in the file [ns] and the axial force [N] of each,
    states of the axis with their times [ns], and marks with time [ns], kind and facts."""

    samples: list[tuple[ForceSample, int]]
    forces: list[float]
    states: list[tuple[AxisState, int]]
    marks: list[tuple[int, str, dict[str, Any]]]
    progress: Progress
