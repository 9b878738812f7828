# SPDX-License-Identifier: Apache-2.0
"""The rig without sockets, step by step, determined by seed, commands and their times: the tissue at its sites, the
source paper's phantom or any model, and a log of the ground truth to check a recording against."""

from array import array
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...errors import InputError
from ...models.model import Insertion, Model
from ...vocabulary import Status
from ...wire.axis_lines import Answer, AxisState, answer_line, parse_command, range_line
from ...wire.net_ft import Command
from ..experiment import streams
from ..run import FORCE_RATE_HZ, wrench_of
from ..sensor import RANGE, Sensor
from ..specimen import PRESLIDING, PhantomSite, Scatter, Specimen, draw_site, stick_slip
from .axis import LIMITS, Axis, Encoder
from .faults import Datagram, SentRecords, checked_faults
from .sensor import RecordStreaming, SixAxis

_KEY = (1 << 17,)  # spawn key of the rig's random numbers, distinct from those of the sites
MAX_SITES = 65_535
MIN_STEPS_LOGGED = 3_600_000  # an hour, 24 bytes each
_NO_LATERAL = {"fx": 0.0, "fy": 0.0, "tx": 0.0, "ty": 0.0}


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


class ModelTissue:
    """A site in tissue described by ``model``, with its surface at 0 and the memory of its hole; axial force only."""

    surface = 0.0

    def __init__(self, model: Model):
        self._insertion = Insertion(model)
        self.refused = 0  # steps without a force of the model

    def step(self, depth: float, dt: float) -> dict[str, float]:
        """The wrench [N, N m] by axis when the tip moves to ``depth`` [m] in the rig's zero within ``dt`` [s]."""
        sample = self._insertion.step(depth, None, dt)
        self.refused += sample.status != Status.ok
        return {"force": sample.force} | _NO_LATERAL


class PhantomTissue:
    """One site of the paper's phantom as in ``Specimen.force``: first pass, second pass, and further passes."""

    def __init__(self, site: PhantomSite):
        self.surface, self._site, self._insertion = site.surface, site, Insertion(site.specimen.model())
        self._second, self._deepest, self._max_step = False, 0.0, 0.0
        self._depth: float | None = None
        self._start = 0.0
        self._sliding = 1.0  # bristle state, +1 for insertion to -1 for withdrawal
        self.refused = 0

    def step(self, depth: float, dt: float) -> dict[str, float]:
        """The wrench [N, N m] by axis when the tip moves to ``depth`` [m] in the rig's zero within ``dt`` [s]."""
        depth -= self.surface
        self._follow(depth, dt)
        sample = self._insertion.step(depth, None, dt)
        self.refused += sample.status != Status.ok
        sliding = self._sliding if self._pierced else 0.0
        more = self._site.specimen.unmodelled_forces(depth, sliding, self._second)
        return wrench_of(self._site, sample.force + float(sum(more.values())))

    @property
    def _pierced(self) -> bool:
        return self._second or self._deepest > self._site.specimen.puncture_depth

    def _follow(self, depth: float, dt: float) -> None:
        if self._depth is None:
            self._depth, self._start = depth, min(depth, 0.0)
        move = depth - self._depth
        self._depth, self._deepest = depth, max(self._deepest, depth)
        self._max_step = max(self._max_step, abs(move))
        self._sliding = min(max(self._sliding + move / PRESLIDING, -1.0), 1.0)
        if depth < 0.0 and move < 0.0 and self._pierced and not self._second:
            self._insertion, self._second = self._pierced_before(depth, dt), True

    def _pierced_before(self, depth: float, dt: float) -> Insertion:
        """A second-pass insertion with the hole of this one, moved outside the tissue from its start to ``depth``."""
        insertion = self._site.specimen.pierced(self._deepest, self._start, self._max_step, dt)
        outside = np.linspace(self._start, depth, 2 + int(abs(depth - self._start) / self._max_step))
        insertion.run(outside, None, np.full(len(outside), dt))
        return insertion


def phantom_site(seed: int, number: int) -> PhantomSite:
    """Site ``number`` of the phantom of ``seed``, equal to that of ``paper_experiment`` at its first speed."""
    draws = streams(seed, (0, number), 3)[0]
    return draw_site(Specimen(cutting=stick_slip), Scatter(), 0.0, number, draws)
