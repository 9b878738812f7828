# SPDX-License-Identifier: Apache-2.0
"""A six-axis sensor as mounted, warm or cold, never zeroed: from the true wrench to counts, and its end of the
network protocol."""

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ...errors import InputError
from ...wire.rdt import LINK_FAILED, SATURATED, SUMMARY, Command, Packet, pack_record, unpack_request
from ...wire.sensor_configuration import SensorConfiguration
from ..run import FORCE_RATE_HZ
from ..sensor import COUNTS, RANGE, Sensor
from .lossy_link import LossyLink, SentRecords

PER_UNIT = 1e6  # counts sent per N and per N m, as the maker's electronics do
READINGS = 7  # of the sensor's own for each one sent: it reads at 7 kHz
CROSSTALK = 0.01  # standard deviation of what an axis' full scale shows on another, as a share of full scale
BIAS = 0.3  # [N] at most on a force; torques have it at 10 mm of lever (assumed)
WARMING = 600.0  # [s] time constant of the drift from switching on (assumed)
DRIFT = 20e-3  # [N] at most, in the end: 2 mN in the first minute; torques at 10 mm of lever (assumed)
_LEVER = np.array([1.0, 1.0, 1.0, 0.01, 0.01, 0.01])
_SCALE = np.array(list(RANGE.values()))
_COUNTS = np.array(list(COUNTS.values()), dtype=float)
_BLOCK = 1024  # rows of noise drawn at once
BUFFERED = 40  # records in a datagram of buffered streaming


class Reading(NamedTuple):
    """Six counts as sent, and the status beside them."""

    counts: tuple[int, ...]
    status: int


class SixAxis:
    """One sensor, drawn: ``crosstalk`` (6, 6) of the wrench [N, N m], ``bias`` and ``drift`` (6,) [N, N m]."""

    def __init__(self, random: np.random.Generator, settings: Sensor):
        spread = CROSSTALK * random.standard_normal((6, 6)) * _SCALE[:, None] / _SCALE
        self.crosstalk = np.where(np.eye(6, dtype=bool), 1.0, spread)
        self.bias = random.uniform(-BIAS, BIAS, 6) * _LEVER
        self.drift = random.uniform(-DRIFT, DRIFT, 6) * _LEVER
        self._random, self._length = random, settings.filter_length
        self._sd = np.array([settings.noise] * 3 + [settings.torque_noise] * 3)
        self._noise, self._taken = np.empty((0, 6)), 0
        self._window: np.ndarray | None = None
        self._tare = np.zeros(6, dtype=np.int64)
        self._since_saturated = self._length

    @property
    def configuration(self) -> SensorConfiguration:
        """What the sensor says of itself."""
        return SensorConfiguration(PER_UNIT, PER_UNIT, FORCE_RATE_HZ, "virtual", tuple(RANGE.values()))

    def read(self, time: float, wrench: np.ndarray) -> Reading:
        """The next reading, ``time`` [s] after it was switched on, of a true wrench (6,) [N, N m]."""
        warm = self.drift * -np.expm1(-time / WARMING)
        seen = self.crosstalk @ wrench + self.bias + warm + self._next_noise()
        end = _SCALE * _COUNTS
        counts = np.clip(np.rint(seen * _COUNTS), -end, end).astype(np.int64)
        self._since_saturated = 0 if (np.abs(counts) >= end).any() else self._since_saturated + 1
        self._sent = np.rint(self._summed(counts) * (PER_UNIT / (self._length * _COUNTS))).astype(np.int64)
        status = SATURATED | SUMMARY if self._since_saturated < self._length else 0
        return Reading(tuple((self._sent - self._tare).tolist()), status)

    def zero(self) -> None:
        """Take the last reading as zero from now on, as the sensor does when it is asked to."""
        self._tare = self._sent.copy()

    def _summed(self, counts: np.ndarray) -> np.ndarray:
        """The sum over the filter's length; it has been running before the first reading, on that."""
        if self._window is None:
            self._window, self._oldest = np.tile(counts, (self._length, 1)), 0
            self._sum = self._window.sum(axis=0)
        self._sum += counts - self._window[self._oldest]
        self._window[self._oldest] = counts
        self._oldest = (self._oldest + 1) % self._length
        return self._sum

    def _next_noise(self) -> np.ndarray:
        if self._taken == len(self._noise):
            self._noise, self._taken = self._random.standard_normal((_BLOCK, 6)) * self._sd, 0
        self._taken += 1
        return self._noise[self._taken - 1]


class Transfer:
    """One stream at a time, to the last who asked; ``streams`` keeps what was done to each, ``garbage`` counts what was
    no request.
    """

    def __init__(self, faults: Mapping[str, float], random: np.random.Generator):
        self._faults, self._random = faults, random
        self._link = LossyLink(faults, random.spawn(1)[0])
        self.streams: list[SentRecords] = []
        self.garbage = 0
        self._left, self._buffered, self._records = 0.0, 1, []
        self._number, self._before = 0, (0, Reading((0,) * 6, 0))

    @property
    def streaming(self) -> bool:
        """Whether records are asked for."""
        return self._left > 0

    def request(self, data: bytes, stops: bool = True) -> Command | None:
        """Do what a datagram asks for, and tell what that was; None, and counted, where it asks for nothing.

        A request to stop is done where it ``stops``, as it comes from who gets the records.
        """
        try:
            command, wanted = unpack_request(data)
        except InputError:
            self.garbage += 1
            return None
        if command in (Command.START, Command.START_BUFFERED):
            self._begin(wanted, BUFFERED if command == Command.START_BUFFERED else 1)
        elif command == Command.STOP and stops:
            self._end()
        return command

    def record(self, time: float, tick: int, reading: Reading) -> None:
        """The sensor's reading number ``tick``, taken at ``time`` [s]."""
        status, stale = self._random.random(2).tolist()
        if self._faults["stale"] > stale:
            tick, reading = self._before
        self._before = tick, reading
        if self._left <= 0 or time >= self._faults["sensor_silent_at_s"]:
            return
        self._left -= 1
        self._number += 1
        stream = self.streams[-1]
        stream.sent += 1
        if self._faults["stale"] > stale:
            stream.stale.append(self._number)
        if self._faults["status_error"] > status:
            stream.status_error.append(self._number)
            reading = reading._replace(status=reading.status | LINK_FAILED | SUMMARY)
        self._gather(time, Packet(self._number, tick * READINGS, reading.status, reading.counts))

    def due(self, now: float) -> list:
        """The datagrams that leave up to ``now`` [s]."""
        return self._link.due(now)

    def _end(self) -> None:
        """Records gathered for a datagram that will not be full are lost."""
        if self._records:
            self.streams[-1].lost += [record.sequence for record in self._records]
        self._left, self._records = 0, []

    def _begin(self, wanted: int, buffered: int) -> None:
        self._end()
        self.streams.append(self._link.begin())
        self._left, self._buffered, self._number = wanted or math.inf, buffered, 0

    def _gather(self, time: float, packet: Packet) -> None:
        self._records.append(packet)
        if len(self._records) == self._buffered or not self.streaming:
            data = b"".join(map(pack_record, self._records))
            self._link.send(time, data, [record.sequence for record in self._records])
            self._records = []
