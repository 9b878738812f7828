# SPDX-License-Identifier: Apache-2.0
"""What a run is told, what it shows while it goes on, and what came of it."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from ..errors import InputError
from ..recording.card import check_filter_length
from ..wire.rdt import AXES


@dataclass(frozen=True)
class Settings:
    """How a run is recorded.

    ``force_limit`` [N] on the axial force without bias, infinite for none. ``bias_time`` [s] at rest before motion, 0
    for no bias; ``steady`` [N] is how far the axial force may wander in it. ``duration`` [s] where no axis moves.
    ``axial`` is the sensor's axis along the needle, with a minus where it opposes the force on the needle.
    ``silence`` [s] without a word, or a movement, ends the run. Raises InputError for what is none of these.
    """

    force_limit: float
    bias_time: float = 0.5
    duration: float | None = None
    flush_every: float = 0.25
    axial: str = "fz"
    filter_length: int = 1
    silence: float = 1.0
    steady: float = 0.05

    def __post_init__(self):
        limits = [
            ("force_limit", self.force_limit, 1e-6, math.inf, "N"),
            ("bias_time", self.bias_time, 0.0, 60.0, "s"),
            ("duration", self.duration if self.duration is not None else 1.0, 1e-3, 1e6, "s"),
            ("flush_every", self.flush_every, 0.01, 10.0, "s"),
            ("silence", self.silence, 0.05, 60.0, "s"),
            ("steady", self.steady, 1e-6, math.inf, "N"),
        ]
        for quantity, value, low, high, unit in limits:
            if not low <= value <= high:
                raise InputError(quantity, value, f"outside {low:g} to {high:g} {unit}")
        if self.axial.removeprefix("-") not in AXES[:3]:
            raise InputError("axial", repr(self.axial), "one of fx, fy, fz, or with a minus")
        check_filter_length(self.filter_length)

    @property
    def column(self) -> int:
        """Where the axial force stands in a wrench."""
        return AXES.index(self.axial.removeprefix("-"))

    @property
    def sign(self) -> float:
        """What makes it positive against insertion."""
        return -1.0 if self.axial.startswith("-") else 1.0


@dataclass(frozen=True)
class RestBias:
    """What the sensor says at rest: mean and standard deviation (6,) [N, N m] over ``samples`` readings."""

    wrench: tuple[float, ...] = (0.0,) * 6
    noise: tuple[float, ...] = (0.0,) * 6
    samples: int = 0


@dataclass(frozen=True)
class RunResult:
    """What a run came to. ``ended`` is one of ``done``, ``force limit``, ``interrupted``, ``source ended``, ``sensor
    silent``, ``sensor fault``, ``sensor lost``, ``axis silent``, ``axis stalled``, ``axis fault``, ``axis stopped``,
    ``axis lost``, ``move refused``, ``disk full``, ``file not written``; ``detail`` says more where there is more.

    ``longest_own_gap`` [s] is the longest that a reading lay in this computer before it was taken; ``peak_force`` [N]
    the largest axial force, with its sign, without bias; ``cpu_share`` processor time over time. Counts are of records;
    of the lost, ``dropped`` packets came and found this computer's buffer full, which holds ``buffer`` [s] of readings.
    """

    ended: str
    detail: str
    seconds: float
    received: int
    lost: int
    doubled: int
    late: int
    longest_own_gap: float
    bias: RestBias
    peak_force: float
    cpu_share: float
    alignment_uncertainty: float | None
    path: Path
    dropped: int = 0
    buffer: float = math.inf


class Progress(NamedTuple):
    """What a live view shows: since the start [s], readings and losses, axial force [N], depth [m], phase of the
    motion, bias [N]; None where there is none."""

    seconds: float
    received: int
    lost: int
    force: float
    depth: float | None
    phase: str | None
    bias: float
