# SPDX-License-Identifier: Apache-2.0
"""The rig without sockets, step by step, determined by seed, commands and their times; and a log of the ground truth to
check a recording against."""

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
from .faults import Datagram, SentRecords, checked_faults
from .sensor import RecordStreaming, SixAxis
from .tissue import ModelTissue, PhantomTissue, phantom_site

_KEY = (1 << 17,)  # spawn key of the rig's random numbers, distinct from those of the sites
MAX_SITES = 65_535
MIN_STEPS_LOGGED = 3_600_000  # an hour, 24 bytes each


@dataclass(frozen=True, eq=False, kw_only=True)
class LiveTruth:
    """Ground truth of the rig.

    Attributes
    ----------
    time, depth, force : ndarray
        Time (n,) [s], depth of the needle (n,) [m] and axial force (n,) [N].
    streams : list of SentRecords
        Faults in each stream of the sensor.
    refused : int
        Steps that the model of the tissue refused.
    garbage : int
        Invalid requests to the sensor.
    """

    time: np.ndarray
    depth: np.ndarray
    force: np.ndarray
    streams: list[SentRecords]
    refused: int
    garbage: int


class SimulatedRig:
    """Axis, sensor and tissue, simulated in steps of 1 ms.

    Times [s] begin at 0 and never decrease. Call ``advance(now)`` before a command or request at ``now``.

    Parameters
    ----------
    seed : int
        Seed of all random numbers, at least 0.
    model : Model, optional
        The tissue; default: the source paper's phantom.
    faults : mapping of str to float, optional
        Values of faults by name as in ``FAULTS``.
    sensor : Sensor, optional
        Filter and noise of the force sensor.

    Raises
    ------
    InputError
        If the seed or a fault is invalid.
    """

    def __init__(
        self,
        seed: int = 1,
        model: Model | None = None,
        faults: Mapping[str, float] | None = None,
        sensor: Sensor | None = None,
    ):
        if not isinstance(seed, int | np.integer) or seed < 0:
            raise InputError("seed", repr(seed), "must be an integer, at least 0")
        self.faults = checked_faults(faults or {})
        of_sensor, of_encoder, of_faults = streams(seed, _KEY, 3)
        self.axis = Axis(self.faults["stall_at_s"])
        self.sensor = SixAxis(of_sensor, sensor or Sensor())
        self.transfer = RecordStreaming(self.faults, of_faults)
        drift = 1e-6 * self.faults["axis_drift_ppm"]
        self._encoder = Encoder(self.axis, of_encoder, drift, self.faults["clock_offset_s"])
        self._sensor_rate = FORCE_RATE_HZ * (1.0 + 1e-6 * self.faults["sensor_drift_ppm"])
        self._seed, self._model, self._sites = seed, model, {}
        self._truth_log, self._states = TruthLog(), []
        self._ticks = self._readings = 0
        self._tissue = self._wrench = None
        self.go_to_site(1)
        self.advance(0.0)

    @property
    def greeting(self) -> str:
        """The line that the axis sends to a new client."""
        return range_line(LIMITS)

    def advance(self, until: float) -> None:
        """Simulate up to ``until`` [s], or to the power cut."""
        until = min(until, self.faults["power_cut_s"])
        while (time := self._ticks / FORCE_RATE_HZ) <= until:
            self.axis.tick(time)
            before, self._wrench = self._wrench, self._tissue_wrench()
            self._read_sensor(before if self._ticks else self._wrench, time)
            self._truth_log.add(time, self.axis.needle, self._wrench[2])
            if time < self.faults["axis_silent_at_s"]:
                self._states += self._encoder.states()
            self._ticks += 1

    def command(self, now: float, line: str) -> str | None:
        """Execute a line to the axis; its answer, or None if the axis is silent."""
        if now >= self.faults["axis_silent_at_s"]:
            return None
        self.axis.client_active(now)
        try:
            name, numbers = parse_command(line)
        except InputError:
            return answer_line(Answer("line", False, "unknown command"))
        match name:
            case "move":
                return answer_line(self.axis.move(now, *numbers))
            case "stop":
                return answer_line(self.axis.stop(now))
            case "site":
                return answer_line(self._change_site(numbers[0]))
        return answer_line(Answer(name, True))

    def request(self, now: float, data: bytes, stops: bool = True) -> Command | None:
        """Execute the request in a datagram to the sensor; its command, or None if there is none.

        A stop is executed only if ``stops``: if it comes from the client that receives the records.
        """
        if now >= self.faults["sensor_silent_at_s"]:
            return None
        command = self.transfer.request(data, stops)
        if command == Command.BIAS:
            self.sensor.zero()
        return command

    def datagrams(self, now: float) -> list[Datagram]:
        """The datagrams from the sensor that are due by ``now`` [s]."""
        return self.transfer.due(now)

    def states(self) -> list[AxisState]:
        """The axis' states since the last call."""
        states, self._states = self._states, []
        return states

    def go_to_site(self, number: int) -> None:
        """Place the needle above a site; a site that was visited before keeps its hole."""
        if number not in self._sites:
            tissue = ModelTissue(self._model) if self._model else PhantomTissue(phantom_site(self._seed, number))
            self._sites[number] = tissue
        self._tissue = self._sites[number]

    def truth(self) -> LiveTruth:
        """The ground truth so far."""
        refused = sum(site.refused for site in self._sites.values())
        return self._truth_log.truth(self.transfer.streams, refused, self.transfer.garbage)

    def _tissue_wrench(self) -> np.ndarray:
        """The wrench (6,) [N, N m] of the tissue at the present depth of the needle."""
        wrench = self._tissue.step(self.axis.needle, 1.0 / FORCE_RATE_HZ)
        return np.array([wrench.get(axis, 0.0) for axis in RANGE])

    def _read_sensor(self, before: np.ndarray, time: float) -> None:
        """The readings due since the last step, on the sensor's own clock."""
        while (due := self._readings / self._sensor_rate) <= time:
            share = 1.0 - (time - due) * FORCE_RATE_HZ
            reading = self.sensor.read(due, before + share * (self._wrench - before))
            self.transfer.record(due, self._readings, reading)
            self._readings += 1

    def _change_site(self, number: float) -> Answer:
        if not 1 <= number <= MAX_SITES:
            return Answer("site", False, f"sites are numbered from 1 to {MAX_SITES}")
        if self.axis.condition != "idle":
            return Answer("site", False, f"the axis is {self.axis.condition}")
        if self.axis.needle > self._tissue.surface:
            return Answer("site", False, "the needle is in the tissue")
        self.go_to_site(int(number))
        return Answer("site", True)


class TruthLog:
    """The steps of the last hour or more."""

    def __init__(self):
        self._columns = tuple(array("d") for _ in range(3))

    def add(self, time: float, depth: float, force: float) -> None:
        """Add a step: time [s], depth [m], force [N]."""
        for column, value in zip(self._columns, (time, depth, force)):
            column.append(value)
        if len(self._columns[0]) >= 2 * MIN_STEPS_LOGGED:
            for column in self._columns:
                del column[:MIN_STEPS_LOGGED]

    def truth(self, streams: list[SentRecords], refused: int, garbage: int) -> LiveTruth:
        """The ground truth, with copies of the steps."""
        time, depth, force = (np.array(column) for column in self._columns)
        return LiveTruth(time=time, depth=depth, force=force, streams=list(streams), refused=refused, garbage=garbage)
