# SPDX-License-Identifier: Apache-2.0
"""Interfaces of force sources and motion axes."""

from typing import NamedTuple, Protocol

from ...wire.axis_lines import Answer, AxisRange, AxisState


class ForceSample(NamedTuple):
    """One reading of a force sensor.

    ``sequence`` is its unwrapped number. Times [ns]: ``device`` on the source's clock, ``arrival`` by the kernel's time
    stamp if there is one, ``read`` when the program read it; the last two are on the same clock. ``wrench`` [N, N m] is
    in the order of ``wire.net_ft.AXES``. ``status`` is as in ``wire.net_ft``, 0 for healthy. ``fresh`` is whether it is
    a new measurement by its counters: not repeated, not overtaken, and without a jump that no loss explains.
    """

    sequence: int
    device: int
    arrival: int
    read: int
    wrench: tuple[float, ...]
    status: int
    fresh: bool = True


class ForceSource(Protocol):
    """A source of force readings with the nominal rate ``clock_rate`` [Hz].

    Optional attributes: the counts ``foreign``, ``wrong_size``, ``stale``, ``restart`` and ``dropped``, which never
    decrease, and ``buffer`` [s], the time for which this computer holds unread readings.
    """

    clock_rate: float

    def start(self) -> None:
        """Start the stream. Raises InputError if the source cannot be reached."""

    def receive(self, timeout: float) -> list[ForceSample]:
        """The new readings after at most ``timeout`` [s], perhaps none; EOFError at the end of the source."""

    def stop(self) -> None:
        """End the stream and release its resources; never raises, may be called twice."""


class MotionAxis(Protocol):
    """A motion axis with its ``limits``, None for one that takes no commands. Depth is + inwards."""

    limits: AxisRange | None

    def receive(self) -> list[tuple[AxisState, int]]:
        """The states since the last call, each with its arrival by ``host_time_ns``; returns at once.

        Raises InputError if the axis is lost.
        """

    def send_move(self, depth: float, speed: float) -> None:
        """Send the tip to ``depth`` [m] at ``speed`` [m/s] and return, as a stop waits; ``answer`` has the result."""

    def answer(self, command: str) -> Answer | None:
        """The answer to the last command of this name, None until it arrives."""

    def site(self, number: int) -> None:
        """Go to the site ``number`` of the specimen, from 1. Raises InputError if the axis cannot."""

    def check_move(self, depth: float, speed: float) -> None:
        """Raise InputError for a move outside the limits."""

    def alive(self) -> None:
        """Let the axis continue."""

    def send_stop(self) -> None:
        """Send a stop and return at once."""

    def close(self) -> None:
        """Close the connection."""
