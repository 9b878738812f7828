# SPDX-License-Identifier: Apache-2.0
"""The rig without sockets, step by step: all follows from seed, commands and their times; and a log of what really
happened, to check a recording against."""

from array import array
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...errors import InputError
from ...models.model import Model
from ...wire.axis_lines import Answer, AxisState, answer_line, parse_command, range_line
from ...wire.rdt import Command
from ..experiment import streams
from ..run import FORCE_RATE_HZ
from ..sensor import RANGE, Sensor
from .axis import LIMITS, Axis, Encoder
from .faults import checked_faults
from .lossy_link import Datagram, SentRecords
from .sensor import SixAxis, Transfer
from .tissue import ModelTissue, PhantomTissue, phantom_site

_KEY = (1 << 17,)  # spawn key of the rig's draws, beside those of the sites
MOST_SITES = 65_535
KEPT = 3_600_000  # steps of the course that are remembered at least: an hour, 24 bytes each


@dataclass(frozen=True, eq=False)
class LiveTruth:
    """The needle's ``depth`` [m] and the axial ``force`` [N] at ``time`` [s], (n,) each; what was done to each of the
    sensor's ``streams``; how often the tissue's model ``refused`` a step, and what came as ``garbage``.
    """

    time: np.ndarray
    depth: np.ndarray
    force: np.ndarray
    streams: list[SentRecords]
    refused: int
    garbage: int


class SimulatedRig:
    """Axis, sensor and tissue; ``model`` None is the paper's phantom. Times are rig seconds from 0, never going back.

    Mechanics go in steps of 1 ms. What was told at ``now`` acts from then on; ``advance`` first.
    """

    def __init__(
        self,
        seed: int = 1,
        model: Model | None = None,
        faults: Mapping[str, float] | None = None,
        sensor: Sensor | None = None,
    ):
        if not isinstance(seed, int | np.integer) or seed < 0:
            raise InputError("seed", repr(seed), "must be a whole number from 0")
        self.faults = checked_faults(faults or {})
        of_sensor, of_encoder, of_faults = streams(seed, _KEY, 3)
        self.axis = Axis(self.faults["stall_at_s"])
        self.sensor = SixAxis(of_sensor, sensor or Sensor())
        self.transfer = Transfer(self.faults, of_faults)
        drift = 1e-6 * self.faults["axis_drift_ppm"]
        self._encoder = Encoder(self.axis, of_encoder, drift, self.faults["clock_offset_s"])
        self._sensor_rate = FORCE_RATE_HZ * (1.0 + 1e-6 * self.faults["sensor_drift_ppm"])
        self._seed, self._model, self._sites = seed, model, {}
        self._truth_log, self._states = TruthLog(), []
        self._ticks = self._readings = 0
        self._place = self._wrench = None
        self.go_to_site(1)
        self.advance(0.0)

    @property
    def greeting(self) -> str:
        """The line with which the axis answers a connection."""
        return range_line(LIMITS)

    def advance(self, until: float) -> None:
        """Go on to ``until`` [s], or to the power cut."""
        until = min(until, self.faults["power_cut_s"])
        while (time := self._ticks / FORCE_RATE_HZ) <= until:
            self.axis.tick(time)
            before, self._wrench = self._wrench, self._push()
            self._read_sensor(before if self._ticks else self._wrench, time)
            self._truth_log.add(time, self.axis.needle, self._wrench[2])
            if time < self.faults["axis_silent_at_s"]:
                self._states += self._encoder.states()
            self._ticks += 1

    def command(self, now: float, line: str) -> str | None:
        """Do what a line to the axis says; its answer, None where it says nothing any more."""
        if now >= self.faults["axis_silent_at_s"]:
            return None
        self.axis.heard(now)
        try:
            name, numbers = parse_command(line)
        except InputError:
            return answer_line(Answer("line", False, "not one that is known"))
        match name:
            case "move":
                return answer_line(self.axis.move(now, *numbers))
            case "stop":
                return answer_line(self.axis.stop(now))
            case "site":
                return answer_line(self._change_site(numbers[0]))
        return answer_line(Answer(name, True))

    def request(self, now: float, data: bytes, stops: bool = True) -> Command | None:
        """Do what a datagram to the sensor asks for; what that was, None where it was nothing.

        Only who gets the records ``stops`` them.
        """
        if now >= self.faults["sensor_silent_at_s"]:
            return None
        command = self.transfer.request(data, stops)
        if command == Command.BIAS:
            self.sensor.zero()
        return command

    def datagrams(self, now: float) -> list[Datagram]:
        """What leaves the sensor up to ``now`` [s]."""
        return self.transfer.due(now)

    def states(self) -> list[AxisState]:
        """The axis' states since the last call."""
        states, self._states = self._states, []
        return states

    def go_to_site(self, number: int) -> None:
        """Put the needle above a site; one that was there before is as it was left."""
        if number not in self._sites:
            made = ModelTissue(self._model) if self._model else PhantomTissue(phantom_site(self._seed, number))
            self._sites[number] = made
        self._place = self._sites[number]

    def truth(self) -> LiveTruth:
        """What really happened so far."""
        refused = sum(site.refused for site in self._sites.values())
        return self._truth_log.truth(self.transfer.streams, refused, self.transfer.garbage)

    def _push(self) -> np.ndarray:
        """The wrench (6,) [N, N m] of the tissue at the needle's depth now."""
        wrench = self._place.step(self.axis.needle, 1.0 / FORCE_RATE_HZ)
        return np.array([wrench.get(axis, 0.0) for axis in RANGE])

    def _read_sensor(self, before: np.ndarray, time: float) -> None:
        """The readings due since the last step, on the sensor's own clock."""
        while (due := self._readings / self._sensor_rate) <= time:
            share = 1.0 - (time - due) * FORCE_RATE_HZ
            reading = self.sensor.read(due, before + share * (self._wrench - before))
            self.transfer.record(due, self._readings, reading)
            self._readings += 1

    def _change_site(self, number: float) -> Answer:
        if not 1 <= number <= MOST_SITES:
            return Answer("site", False, f"sites are from 1 to {MOST_SITES}")
        if self.axis.condition != "idle":
            return Answer("site", False, f"the axis is {self.axis.condition}")
        if self.axis.needle > self._place.surface:
            return Answer("site", False, "the needle is in the tissue")
        self.go_to_site(int(number))
        return Answer("site", True)


class TruthLog:
    """The last steps, an hour of them or more."""

    def __init__(self):
        self._columns = tuple(array("d") for _ in range(3))

    def add(self, time: float, depth: float, force: float) -> None:
        """One step."""
        for column, value in zip(self._columns, (time, depth, force)):
            column.append(value)
        if len(self._columns[0]) >= 2 * KEPT:
            for column in self._columns:
                del column[:KEPT]

    def truth(self, streams: list[SentRecords], refused: int, garbage: int) -> LiveTruth:
        """All of it, as arrays of their own."""
        return LiveTruth(*(np.array(column) for column in self._columns), list(streams), refused, garbage)
