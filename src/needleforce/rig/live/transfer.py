# SPDX-License-Identifier: Apache-2.0
"""The sensor's end of its network protocol: requests in, records out, with the faults of the sensor itself."""

import math
from collections.abc import Mapping

import numpy as np

from ...errors import InputError
from ...wire.rdt import LINK_FAILED, SUMMARY, Command, Packet, pack_record, unpack_request
from .lossy_link import Stream, Way
from .sensor import READINGS, Reading

BUFFERED = 40  # records in a datagram of buffered streaming


class Transfer:
    """One stream at a time, to the last who asked; ``streams`` keeps what was done to each, ``garbage`` counts what was
    no request.
    """

    def __init__(self, faults: Mapping[str, float], random: np.random.Generator):
        self._faults, self._random = faults, random
        self._way = Way(faults, random.spawn(1)[0])
        self.streams: list[Stream] = []
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
        return self._way.due(now)

    def _end(self) -> None:
        """Records gathered for a datagram that will not be full are lost."""
        if self._records:
            self.streams[-1].lost += [record.sequence for record in self._records]
        self._left, self._records = 0, []

    def _begin(self, wanted: int, buffered: int) -> None:
        self._end()
        self.streams.append(self._way.begin())
        self._left, self._buffered, self._number = wanted or math.inf, buffered, 0

    def _gather(self, time: float, packet: Packet) -> None:
        self._records.append(packet)
        if len(self._records) == self._buffered or not self.streaming:
            data = b"".join(map(pack_record, self._records))
            self._way.send(time, data, [record.sequence for record in self._records])
            self._records = []
