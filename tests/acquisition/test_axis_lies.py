# SPDX-License-Identifier: Apache-2.0
"""Axes that lie while a needle moves: they ignore stops, report another motion, flood the recorder, or move unordered.

The true depth is that of the fake axis, which no lie changes. The bounds are those of docs/evidence/safety_case.md.
"""

import json
import re
import threading
import time
from itertools import pairwise

import numpy as np
import pytest
from fake_rig import CONFIGURATION, FAR, SPEED, STIFFNESS, Disobedient, FakeAxis, FakeSensor, tissue
from test_record_command import arguments, page  # noqa: F401 - a fixture
from typer.testing import CliRunner

from needleforce import InputError
from needleforce.acquisition.recorder import AxisNotStopped, record_run
from needleforce.acquisition.settings import Settings
from needleforce.acquisition.sources.axis import AxisClient
from needleforce.acquisition.sources.net_ft_sensor import SensorClient
from needleforce.cli import app


@pytest.mark.parametrize(
    "lie", [{"answers": True}, {"answers": False}, {"state": lambda s: s._replace(condition="idle")}]
)
def test_an_axis_that_ignores_a_stop_is_reported_with_its_last_depth(recorded, lie):
    with Disobedient(**lie) as axis, tissue(axis) as sensor:
        outcome, log = recorded(sensor, axis, [(0.055, 0.02)], force_limit=1.0)
    assert outcome.ended in ("axis did not stop", "axis stopped") and not outcome.rest_confirmed
    assert "ordered to stop, did not; last seen at" in outcome.detail and "switch the axis off" in outcome.detail
    assert outcome.stop.beyond and outcome.stop.speed == pytest.approx(SPEED, rel=0.2)
    assert log.complete and log.end["ended"] == outcome.ended and log.end["stop_at_rest"] == "False"
    assert axis.received.count("stop") > 2, "each of two threads orders it, and one of them again"


def test_an_axis_that_stops_only_in_silence_gets_silence_and_is_reported(recorded):
    with Disobedient(watched=True) as axis, tissue(axis) as sensor:
        outcome, _ = recorded(sensor, axis, [(0.055, 0.01)], force_limit=0.5)
        assert axis.target is None and axis.depth < 0.055, "it was left in silence"
    assert outcome.ended == "axis did not stop"
    assert "did not in time: at rest at" in outcome.detail and "force limit" in outcome.detail


def test_a_depth_at_rest_with_a_rising_force_is_not_believed(recorded):
    frozen = []

    def state(s):
        if "stop" in axis.received:
            frozen.append(s.depth)
            return s._replace(depth=frozen[0], velocity=0.0, condition="idle")
        return s

    with Disobedient(state=state) as axis, tissue(axis) as sensor:
        outcome, _ = recorded(sensor, axis, [(0.055, 0.02)], force_limit=1.0)
    assert outcome.ended == "axis did not stop" and not outcome.rest_confirmed
    assert "the force rises from" in outcome.detail and "the needle still moves" in outcome.detail


def test_an_axis_that_falls_silent_after_the_stop_is_not_confirmed(recorded):
    with FakeAxis(reply=lambda line: setattr(axis, "silent", axis.silent or line == "stop")) as axis:
        with tissue(axis) as sensor:
            outcome, _ = recorded(sensor, axis, FAR, force_limit=1.0)
    assert outcome.ended == "force limit" and not outcome.rest_confirmed
    assert "not seen at rest; last seen at" in outcome.detail


def test_an_axis_that_obeys_is_confirmed_with_distance_and_time(recorded):
    with FakeAxis() as axis, tissue(axis) as sensor:
        outcome, log = recorded(sensor, axis, FAR, force_limit=1.0)
    assert outcome.ended == "force limit" and outcome.rest_confirmed
    assert outcome.stop.depth == pytest.approx(axis.depth, abs=1e-6)
    assert axis.depth < 1.0 / STIFFNESS + outcome.stop.allowed
    assert "at rest at" in outcome.detail and log.end["stop_at_rest"] == "True"
    assert log.card["force_limit_N"] == "1" and log.card["force_limit_source"] == "given"


@pytest.mark.parametrize("line", [b"state 1 1.0 0.0 0.0 idle\n", b"ok alive\n", b"state 900000 1.0 0.0 0.0 moving\n"])
def test_a_flood_of_lines_stops_the_axis_and_does_not_delay_the_force_limit(recorded, line):
    def reply(command):
        if command.startswith("move"):
            axis.garbage = line * 4000  # 800 000 lines a second

    with FakeAxis(reply=reply) as axis, tissue(axis) as sensor:
        outcome, log = recorded(sensor, axis, FAR, force_limit=1.0)
    assert outcome.ended in ("axis fault", "force limit", "axis did not stop") and log.complete
    assert axis.depth < 1.0 / STIFFNESS + SPEED * 0.1, "a tenth of a second after the limit at the latest"
    assert len(log.axis.sequence) < 20_000


@pytest.mark.parametrize(
    "lie, words",
    [
        ({"state": lambda s: s._replace(velocity=50.0 if s.velocity else 0.0)}, "check its units"),
        ({"state": lambda s: s._replace(number=max(0, s.number - 50 * (s.depth > 0.0)))}, "it restarted"),
    ],
)
def test_states_that_contradict_themselves_stop_the_axis(recorded, lie, words):
    with FakeAxis(**lie) as axis, FakeSensor() as sensor:
        outcome, _ = recorded(sensor, axis, FAR)
    assert outcome.ended == "axis fault" and words in outcome.detail and outcome.rest_confirmed
    assert axis.depth < 0.01


@pytest.mark.parametrize("factor, words", [(10.0, "was ordered"), (-1.0, "outside the commanded range")])
def test_an_axis_at_another_speed_than_ordered_is_stopped(recorded, factor, words):
    class Wrong(FakeAxis):
        def obey(self, line, connection):
            super().obey(line, connection)
            self.speed = 0.005 * abs(factor)
            self.target = self.target and (0.055 if factor > 0.0 else -0.019)

    with Wrong(state=lambda s: s._replace(velocity=50.0 if factor < 0.0 and s.velocity else 0.005)) as axis:
        with FakeSensor() as sensor:
            outcome, _ = recorded(sensor, axis, [(0.03, 0.005)])
    assert outcome.ended == "axis fault"
    assert words in outcome.detail or "check its units" in outcome.detail
    assert abs(axis.depth + 0.002) < (0.25e-3 + 0.00525 * 0.25) * 10 / 8.95 + 0.05 * 0.15


@pytest.mark.usefixtures("simulated_time")
def test_the_exit_code_of_an_axis_that_did_not_stop_is_its_own(tmp_path, page):  # noqa: F811
    with Disobedient() as axis, tissue(axis) as sensor:
        more = ["--axis", f"127.0.0.1:{axis.port}", "--depth-mm", "55", "--speed-mm-s", "20", "--start-mm", "-2"]
        more += ["--force-limit-N", "1", "--bias-s", "0.1", "--json", str(tmp_path / "o.json")]
        done = CliRunner().invoke(app, arguments(tmp_path / "run.mcap", sensor, page, *more))
    assert done.exit_code == 3
    assert "axis did not stop: force limit" in done.output and "last seen at" in done.output
    assert "force limit 1 N (given); a stop from 20 mm/s takes at most 2.37 mm" in done.output  # from 21 mm/s
    outcome = json.loads((tmp_path / "o.json").read_text())
    assert outcome["ended"] == "axis did not stop" and outcome["stop"]["at_rest"] is False


def test_an_axis_that_moves_before_the_run_is_refused(recorded, tmp_path):
    with FakeAxis() as axis, FakeSensor() as sensor:
        axis.target, axis.speed = 0.05, 0.01
        with pytest.raises(InputError, match="it must rest before a run"):
            recorded(sensor, axis, FAR)
    assert "stop" in axis.received and not list(tmp_path.glob("*.mcap"))


def test_an_axis_that_cannot_be_stopped_before_the_run_has_its_own_error(recorded):
    with Disobedient() as axis, FakeSensor(ends=100) as sensor:
        axis.depth = 0.03
        with pytest.raises(AxisNotStopped, match="ordered to stop, did not") as caught:
            recorded(sensor, axis, [(-0.015, 0.01), (0.03, 0.01)])
    assert caught.value.exit_code == 3


@pytest.mark.usefixtures("simulated_time")
def test_while_an_operator_moves_the_phantom_the_axis_is_kept_connected(tmp_path):
    heard = []
    with FakeSensor() as sensor, FakeAxis(reply=lambda line: heard.append((line, time.monotonic()))) as axis:
        force = SensorClient("127.0.0.1", sensor.port, CONFIGURATION)
        record_run(
            tmp_path / "run.mcap",
            force,
            AxisClient("127.0.0.1", axis.port),
            [(0.002, 0.02)],
            {},
            Settings(force_limit=5.0, bias_time=0.1),
            when_withdrawn=lambda: (heard.append(("asked", time.monotonic())), time.sleep(1.5)),
        )
    begun = next(at for line, at in heard if line == "asked")
    times = [begun, *[at for line, at in heard if line == "alive" and begun < at < begun + 1.5], begun + 1.5]
    assert max(b - a for a, b in pairwise(times)) < 0.5


def test_a_second_recorder_is_refused_by_the_axis_and_moves_nothing():
    from needleforce.rig.live import VirtualRig

    with VirtualRig() as rig:
        first = AxisClient("127.0.0.1", rig.axis_port)
        with pytest.raises(InputError, match="one client at a time"):
            AxisClient("127.0.0.1", rig.axis_port)
        first.close()


def test_a_force_limit_stops_an_axis_that_was_not_ordered_to_move(recorded):
    with Disobedient() as axis, tissue(axis) as sensor:
        threading.Timer(0.8, lambda: vars(axis).update(target=0.05, speed=0.02)).start()
        outcome, _ = recorded(sensor, axis, [], force_limit=1.0, duration=3.0)
    assert "ordered to stop" in outcome.detail or outcome.ended == "axis fault"
    assert axis.received.count("stop") > 1 and not outcome.rest_confirmed


class Dragging(FakeAxis):
    """An axis with a true ``force`` of friction that reverses over 0.2 mm; it reports what was ``late`` [s] ago."""

    def __init__(self, late):
        super().__init__(state=self.reported)
        self.late, self.force, self.past = late, 0.0, []

    def advance(self):
        before = self.depth
        super().advance()
        inside = 30.0 * max(self.depth, 0.0)
        self.force = float(np.clip(self.force + 2.0 * inside * (self.depth - before) / 0.2e-3, -inside, inside))

    def reported(self, state):
        self.past.append(state)
        known = [each for each in self.past if each.time <= state.time - self.late] or self.past[:1]
        return known[-1]._replace(number=state.number, time=state.time)


@pytest.mark.parametrize("late", [0.0, 0.1, 0.2, 0.5])
@pytest.mark.parametrize("hold", [0.0, 0.4])
def test_a_depth_that_is_later_than_the_force_is_found_where_the_needle_turns(recorded, late, hold):
    moves = [(0.012, 0.01), (0.012, hold), (-0.002, 0.01)]
    with Dragging(late) as axis, FakeSensor(lambda t: axis.force) as sensor:
        outcome, log = recorded(sensor, axis, moves, silence=1.0)
    assert outcome.ended == ("depth late" if late else "done"), outcome.detail
    assert log.end["ended"] == outcome.ended
    if late:
        low, high = map(float, re.search(r"pulled at the withdrawal (.*) to (.*) s before", outcome.detail).groups())
        assert low - 0.03 <= late <= high + 0.03 and high - low < 0.15
