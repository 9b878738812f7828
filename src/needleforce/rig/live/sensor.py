# SPDX-License-Identifier: Apache-2.0
"""A mounted six-axis sensor with bias and thermal drift: from the true wrench to counts, and its side of the network
protocol."""

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ...errors import InputError
from ...wire.net_ft import (
    LINK_FAILED,
    SATURATED,
    SUMMARY,
    Command,
    Packet,
    SensorConfiguration,
    pack_record,
    unpack_request,
)
from ..run import FORCE_RATE_HZ
from ..sensor import COUNTS, RANGE, Sensor
from .faults import Datagram, LossyLink, SentRecords

COUNTS_PER_UNIT = 1e6  # per N and per N m, as in the maker's electronics
READINGS_PER_RECORD = 7  # the sensor reads at 7 kHz
CROSSTALK = 0.01  # standard deviation of the effect of one axis at full scale on another, relative to full scale
MAX_BIAS_N = 0.3  # of a force; for torques with a lever of 10 mm (assumed)
WARM_UP_TIME_S = 600.0  # time constant of the drift after power-on (assumed)
MAX_DRIFT_N = 20e-3  # final value, 2 mN in the first minute; for torques with a lever of 10 mm (assumed)
_LEVER = np.array([1.0, 1.0, 1.0, 0.01, 0.01, 0.01])
_SCALE = np.array(list(RANGE.values()))
_COUNTS = np.array(list(COUNTS.values()), dtype=float)
_NOISE_BLOCK = 1024  # rows of noise drawn at once
RECORDS_PER_DATAGRAM = 40  # in buffered streaming


class Reading(NamedTuple):
    """Six counts as sent, and their status."""

    counts: tuple[int, ...]
    status: int


class SixAxis:
    """One sensor with drawn ``crosstalk`` (6, 6) of the wrench [N, N m], ``bias`` and ``drift`` (6,) [N, N m]."""

    def __init__(self, random: np.random.Generator, settings: Sensor):
        spread = CROSSTALK * random.standard_normal((6, 6)) * _SCALE[:, None] / _SCALE
        self.crosstalk = np.where(np.eye(6, dtype=bool), 1.0, spread)
        self.bias = random.uniform(-MAX_BIAS_N, MAX_BIAS_N, 6) * _LEVER
        self.drift = random.uniform(-MAX_DRIFT_N, MAX_DRIFT_N, 6) * _LEVER
        self._random, self._length = random, settings.filter_length
        self._sd = np.array([settings.noise] * 3 + [settings.torque_noise] * 3)
        self._noise, self._taken = np.empty((0, 6)), 0
        self._window: np.ndarray | None = None
        self._tare = np.zeros(6, dtype=np.int64)
        self._since_saturated = self._length

    @property
    def configuration(self) -> SensorConfiguration:
        """The configuration of the sensor."""
        return SensorConfiguration(
            counts_per_force=COUNTS_PER_UNIT,
            counts_per_torque=COUNTS_PER_UNIT,
            rate=FORCE_RATE_HZ,
            serial="virtual",
            ratings=tuple(RANGE.values()),
        )

    def read(self, time: float, wrench: np.ndarray) -> Reading:
        """The next reading of a true wrench (6,) [N, N m], ``time`` [s] after power-on."""
        drift = self.drift * -np.expm1(-time / WARM_UP_TIME_S)
        measured = self.crosstalk @ wrench + self.bias + drift + self._next_noise()
        end = _SCALE * _COUNTS
        counts = np.clip(np.rint(measured * _COUNTS), -end, end).astype(np.int64)
        self._since_saturated = 0 if (np.abs(counts) >= end).any() else self._since_saturated + 1
        self._sent = np.rint(self._summed(counts) * (COUNTS_PER_UNIT / (self._length * _COUNTS))).astype(np.int64)
        status = SATURATED | SUMMARY if self._since_saturated < self._length else 0
        return Reading(tuple((self._sent - self._tare).tolist()), status)

    def zero(self) -> None:
        """Use the last reading as zero from now on, as the sensor does on request."""
        self._tare = self._sent.copy()

    def _summed(self, counts: np.ndarray) -> np.ndarray:
        """The sum over the filter's length; before the first reading the filter is filled with that reading."""
        if self._window is None:
            self._window, self._oldest = np.tile(counts, (self._length, 1)), 0
            self._sum = self._window.sum(axis=0)
        self._sum += counts - self._window[self._oldest]
        self._window[self._oldest] = counts
        self._oldest = (self._oldest + 1) % self._length
        return self._sum

    def _next_noise(self) -> np.ndarray:
        if self._taken == len(self._noise):
            self._noise, self._taken = self._random.standard_normal((_NOISE_BLOCK, 6)) * self._sd, 0
        self._taken += 1
        return self._noise[self._taken - 1]


class RecordStreaming:
    """One stream of records at a time, to the last client that requested one.

    ``streams`` has the ground truth of each stream; ``garbage`` counts invalid requests.
    """

    def __init__(self, faults: Mapping[str, float], random: np.random.Generator):
        self._faults, self._random = faults, random
        self._link = LossyLink(faults, random.spawn(1)[0])
        self.streams: list[SentRecords] = []
        self.garbage = 0
        self._left, self._buffered, self._records = 0.0, 1, []
        self._number, self._previous = 0, (0, Reading((0,) * 6, 0))

    @property
    def streaming(self) -> bool:
        """Whether records are being sent."""
        return self._left > 0

    def request(self, data: bytes, stops: bool = True) -> Command | None:
        """Execute the request in a datagram and return its command; an invalid one is counted and returns None.

        A stop is executed only if ``stops``: if it comes from the client that receives the records.
        """
        try:
            command, wanted = unpack_request(data)
        except InputError:
            self.garbage += 1
            return None
        if command in (Command.START, Command.START_BUFFERED):
            self._begin(wanted, RECORDS_PER_DATAGRAM if command == Command.START_BUFFERED else 1)
        elif command == Command.STOP and stops:
            self._end()
        return command

    def record(self, time: float, tick: int, reading: Reading) -> None:
        """Send the sensor's reading number ``tick``, taken at ``time`` [s], if a stream is running."""
        status, stale = self._random.random(2).tolist()
        if self._faults["stale"] > stale:
            tick, reading = self._previous
        self._previous = tick, reading
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
        self._gather(time, Packet(self._number, tick * READINGS_PER_RECORD, reading.status, reading.counts))

    def due(self, now: float) -> list[Datagram]:
        """The datagrams that are due by ``now`` [s]."""
        return self._link.due(now)

    def _end(self) -> None:
        """End the stream; records in an incomplete datagram are lost."""
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
