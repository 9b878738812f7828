# SPDX-License-Identifier: Apache-2.0
"""What a force source gives the recorder, whatever it is: a sensor on the network, standard input, gauge voltages."""

from typing import NamedTuple, Protocol


class ForceSample(NamedTuple):
    """One reading: its number, unwrapped; the source's own clock, arrival and when the program had it [ns]; six of
    N and N m in the order of ``wire.rdt.AXES``; a status as in ``wire.rdt``, 0 for healthy.

    ``arrival`` is by the kernel's stamp where there is one, of the same clock as ``read``.
    """

    sequence: int
    device: int
    arrival: int
    read: int
    wrench: tuple[float, ...]
    status: int


class ForceSource(Protocol):
    """``clock_rate`` is readings a second [Hz], nominal.

    A source that can tell has also the counts ``foreign``, ``wrong_size``, ``stale``, ``restart`` and ``dropped``,
    which only grow, and ``buffer`` [s], how long this computer keeps what waits.
    """

    clock_rate: float

    def start(self) -> None:
        """Begin to send. Raises InputError for what cannot be reached."""

    def receive(self, timeout: float) -> list[ForceSample]:
        """What came, after at most ``timeout`` [s]; empty if nothing did. EOFError if nothing more can come."""

    def stop(self) -> None:
        """End the stream and give back what it holds; never raises, may be called twice."""
