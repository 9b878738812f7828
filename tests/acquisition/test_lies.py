# SPDX-License-Identifier: Apache-2.0
"""Axes and sensors that lie while a needle moves: what the recorder orders, how far the needle gets, what is reported.

The true depth is that of the fake axis, which no lie changes. The bounds are those of docs/safety_case.md.
"""

import json
import random
import re
import signal
import subprocess
import sys
import threading
import time
from itertools import pairwise

import pytest
from fake_rig import CONFIGURATION, FakeAxis, FakeSensor
from test_record_command import CODE, arguments, page  # noqa: F401 - a fixture
from typer.testing import CliRunner

from needleforce import InputError
from needleforce.acquisition.recorder import AxisNotStopped, record_run
from needleforce.acquisition.settings import Settings
from needleforce.acquisition.sources import source
from needleforce.acquisition.sources.axis import AxisClient
from needleforce.acquisition.sources.net_ft_sensor import SensorClient
from needleforce.cli import app
from needleforce.commands.record import force_limit
from needleforce.recording.log.reader import read_log

SPEED, FAR = 0.02, [(0.05, 0.02)]
STIFFNESS = 500.0  # of the simulated tissue [N/m]
GAP = Settings(force_limit=1.0).max_force_gap


class Disobedient(FakeAxis):
    """Ignores every stop; ``answers`` it or not; stops by itself after half a second without a line if ``watched``."""

    def __init__(self, answers=True, watched=False, **more):
        super().__init__(**more)
        self.answers, self.watched, self.heard = answers, watched, time.monotonic()

    def obey(self, line, connection):
        self.heard = time.monotonic()
        if line != "stop":
            return super().obey(line, connection)
        self.received.append(line)
        if self.answers:
            connection.sendall(b"ok stop\n")

    def advance(self):
        if self.watched and time.monotonic() - self.heard > 0.5:
            self.target = None
        super().advance()


def tissue(axis):
    return FakeSensor(lambda t: max(0.0, STIFFNESS * axis.depth))


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
    assert axis.received.count("stop") > 1, "it is ordered again"


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


def frozen_sequence(sensor, k):
    return [sensor.packet(min(k, 200))]


def random_counters(sensor, k):
    packet = sensor.packet(k)
    return [packet if k < 200 else packet._replace(sequence=random.getrandbits(32), sample=random.getrandbits(32))]


def frozen_values(sensor, k):
    return [sensor.packet(k)._replace(counts=sensor.packet(min(k, 200)).counts)]


def faulty(sensor, k):
    return [sensor.packet(k)._replace(status=(1 << 20 | 1 << 31) * (k > 200))]


def doubled(sensor, k):
    return [sensor.packet(k if k < 200 else 199 + (k & 1))]


def two_buffers(sensor, k):
    return [sensor.packet(k)._replace(counts=sensor.packet(k if k < 200 else 199 + (k & 1)).counts)]


def axial_frozen(sensor, k):
    packet = sensor.packet(k)
    return [
        packet._replace(counts=(k % 7, *packet.counts[1:2], 2001 if k > 200 else packet.counts[2], *packet.counts[3:]))
    ]


def restarted(sensor, k):
    return [sensor.packet(k if k < 200 else k + 5_000_000)]


@pytest.mark.parametrize(
    "lie", [frozen_sequence, random_counters, frozen_values, two_buffers, axial_frozen, faulty, doubled, restarted]
)
def test_motion_ends_without_usable_force(recorded, lie):
    with FakeAxis() as axis:
        reached = []

        def packets(sensor, k):
            reached.extend([axis.depth] * (k == 200))
            return lie(sensor, k)

        with FakeSensor(packets=packets) as sensor:
            outcome, log = recorded(sensor, axis, FAR, silence=1.0)
    assert outcome.ended == "sensor fault" and outcome.rest_confirmed and log.complete
    assert axis.depth - reached[0] < SPEED * (GAP + 0.1) + outcome.stop.allowed


def test_datagrams_longer_than_any_sensor_sends_are_not_read(recorded):
    def packets(sensor, k):
        return [sensor.packet(k), bytes(36 * 1800)] if k % 2 else [sensor.packet(k)]

    with FakeAxis() as axis:
        with FakeSensor(lambda t: max(0.0, STIFFNESS * axis.depth), packets=packets) as sensor:
            outcome, log = recorded(sensor, axis, FAR, force_limit=1.0)
    assert outcome.ended == "force limit" and outcome.lost == 0
    assert sum(mark.facts["count"] for mark in log.marks if mark.kind == "wrong_size") > 10
    assert axis.depth < 1.0 / STIFFNESS + outcome.stop.allowed + SPEED * 0.1


def test_a_clock_that_is_set_back_changes_no_time_stamp(recorded, monkeypatch):
    begun, wall = time.monotonic(), time.time_ns
    monkeypatch.setattr(source.time, "time_ns", lambda: wall() - 3600 * 10**9 * (time.monotonic() - begun > 0.6))
    with FakeSensor() as sensor, FakeAxis() as axis:
        outcome, log = recorded(sensor, axis, [(0.02, 0.02), (-0.002, 0.04)])
    assert outcome.ended == "done" and outcome.seconds > 1.0
    arrival = log.wrench.arrival
    assert (arrival[1:] - arrival[:-1]).min() >= 0 and arrival[-1] - arrival[0] < 1e9 * (outcome.seconds + 1.0)


def test_a_recorder_that_cannot_write_stops_the_axis(recorded):
    def view(now):
        if now.depth and now.depth > 0.0 and "stop" not in axis.received:
            time.sleep(2.5)

    with FakeSensor() as sensor, FakeAxis() as axis:
        outcome, log = recorded(sensor, axis, [(0.055, 0.005)], view=view)
    assert outcome.ended == "file not written" and "nothing could be written" in outcome.detail
    assert axis.depth < 0.005 * 2.5 and log.complete


@pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX")
def test_a_program_that_did_not_run_stops_the_axis_and_reports_it(tmp_path, page):  # noqa: F811
    path = tmp_path / "run.mcap"
    with FakeSensor() as sensor, FakeAxis() as axis:
        more = ["--axis", f"127.0.0.1:{axis.port}", "--depth-mm", "50", "--speed-mm-s", "5", "--start-mm", "-2"]
        command = [sys.executable, "-c", CODE, *arguments(path, sensor, page, *more, "--bias-s", "0.1", "--plain")]
        with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
            next(line for line in process.stderr if "phase insertion" in line)
            process.send_signal(signal.SIGSTOP)
            time.sleep(1.0)
            process.send_signal(signal.SIGCONT)
            rest = process.stderr.read()
    assert process.returncode == 1 and re.search(r"recorder delayed: this program did not run for (0\.9|1\.)", rest), (
        rest
    )
    assert axis.received[-1] == "stop" and read_log(path).end["ended"] == "recorder delayed"


def test_the_exit_code_of_an_axis_that_did_not_stop_is_its_own(tmp_path, page):  # noqa: F811
    with Disobedient() as axis, tissue(axis) as sensor:
        more = ["--axis", f"127.0.0.1:{axis.port}", "--depth-mm", "55", "--speed-mm-s", "20", "--start-mm", "-2"]
        more += ["--force-limit-N", "1", "--bias-s", "0.1", "--json", str(tmp_path / "o.json")]
        done = CliRunner().invoke(app, arguments(tmp_path / "run.mcap", sensor, page, *more))
    assert done.exit_code == 3
    assert "axis did not stop: force limit" in done.output and "last seen at" in done.output
    assert "force limit 1 N (given); a stop from 20 mm/s takes at most 2.27 mm" in done.output
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


LIMITED = {"counts_per_force": 1e6, "ratings": (12.0, 12.0, 17.0, 0.0, 0.0, 0.0)}


@pytest.mark.parametrize(
    "given, page_values, words",
    [
        (None, {"ratings": (0.0, 0.0, 1e8, 0.0, 0.0, 0.0)}, "its counts end at"),
        (None, {"counts_per_force": 1.0, "ratings": (0.0, 0.0, 1e8, 0.0, 0.0, 0.0)}, "which no needle needs"),
        (None, {"ratings": (0.0,) * 6}, "no rated range"),
        (40.0, {}, "the sensor measures up to 17 N"),
        (float("inf"), {}, "the sensor measures up to 17 N"),
        (float("inf"), {"ratings": (0.0,) * 6}, "no needle needs more"),
        (float("nan"), {}, "the sensor measures up to 17 N"),
    ],
)
def test_a_limit_that_cannot_protect_is_refused(given, page_values, words):
    configuration = CONFIGURATION.__class__(**(LIMITED | {"counts_per_torque": 1e6, "rate": 1e3} | page_values))
    with pytest.raises(InputError, match=words):
        force_limit(given, configuration, "-fz", "127.0.0.1")


def test_the_default_limit_names_its_source():
    configuration = CONFIGURATION.__class__(**(LIMITED | {"counts_per_torque": 1e6, "rate": 1e3}))
    limit, text = force_limit(None, configuration, "fz", "127.0.0.1")
    assert limit == pytest.approx(13.6) and text == "0.8 of the rated range on the sensor's page"
    assert force_limit(3.0, configuration, "fz", "127.0.0.1") == (3.0, "given")


def test_memory_of_a_long_recording_is_bounded():
    """A day at 1 kHz: what is kept for the alignment and for the seconds does not grow."""
    from needleforce.acquisition.run_writer import _MAX_PAIRS, RunWriter
    from needleforce.acquisition.sources.source import ForceSample

    class Nothing:
        def __getattr__(self, name):
            return lambda *arguments, **facts: None

    writer, step = RunWriter(Nothing(), object()), 997_000_000  # a sample a second: only the counts matter
    for begin in range(0, 2_000_000, 100_000):
        writer.force(
            [
                ForceSample(sequence=k, device=k * step, arrival=k * step, read=k * step, wrench=(0.0,) * 6, status=0)
                for k in range(begin, begin + 100_000)
            ]
        )
    assert len(writer.pairs) <= _MAX_PAIRS and not writer.check.seconds
    assert writer.pairs[-1][0] > 0.99 * 2_000_000 * step


def test_a_second_recorder_is_refused_by_the_axis_and_moves_nothing():
    from needleforce.rig.live import VirtualRig

    with VirtualRig() as rig:
        first = AxisClient("127.0.0.1", rig.axis_port)
        with pytest.raises(InputError, match="one client at a time"):
            AxisClient("127.0.0.1", rig.axis_port)
        first.close()


def test_the_needle_stops_although_the_disk_hangs(recorded, monkeypatch):
    from needleforce.recording.log import writer

    released, plain = threading.Event(), writer._Appended.write

    def hanging(self, data):
        if axis.depth > 0.0 and not released.is_set():
            released.wait(3.0)
        plain(self, data)

    monkeypatch.setattr(writer._Appended, "write", hanging)
    with FakeAxis() as axis, FakeSensor() as sensor:
        outcome, log = recorded(sensor, axis, [(0.055, 0.005)], flush_every=0.02)
    assert outcome.ended == "file not written" and log.complete and len(log.wrench.sequence) > 500
    assert axis.depth < 0.005 * 3.0, "stopped while the disk hung"


def test_random_lies_of_another_process_violate_nothing(root):
    """A short run of the benchmark, in which the needle's true path is judged."""
    script = root / "benchmarks" / "lies.py"
    done = subprocess.run([sys.executable, script, "--runs", "24", "--jobs", "4"], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "24 runs, 0 violated" in done.stdout


def test_a_stream_that_gets_later_and_later_ends_the_motion(recorded):
    """Counters fresh, order kept, nothing lost: the network only delays more and more, by half of the time."""
    kept, sent = [], []

    def packets(sensor, k):
        kept.append(sensor.packet(k))
        due = k if k < 250 else 250 + (k - 250) // 2
        released = kept[len(sent) : due]
        sent.extend(released)
        return released

    with FakeAxis() as axis:
        with FakeSensor(lambda t: max(0.0, STIFFNESS * axis.depth), packets=packets) as sensor:
            outcome, _ = recorded(sensor, axis, [(0.05, 0.01)], force_limit=4.0)
    assert outcome.ended == "sensor fault" and "late" in outcome.detail
    assert axis.depth < 0.02


def test_a_sensor_that_never_changes_is_refused_unless_that_is_wanted(recorded):
    constant = lambda sensor, k: [sensor.packet(k)._replace(counts=(0, 0, 2000, 0, 0, 0))]  # noqa: E731
    with FakeSensor(packets=constant) as sensor, FakeAxis() as axis:
        with pytest.raises(InputError, match="--no-frozen-check"):
            recorded(sensor, axis, FAR)
    with FakeSensor(packets=constant) as sensor, FakeAxis() as axis:
        outcome, _ = recorded(sensor, axis, [(0.002, 0.02)], frozen_check=False)
    assert outcome.ended == "done"


def test_without_a_usable_reading_no_move_is_made(recorded):
    faulty_always = FakeSensor(status=lambda k: 1 << 20 | 1 << 31)
    with faulty_always as sensor, FakeAxis() as axis:
        axis.depth = 0.03
        with pytest.raises(InputError):
            recorded(sensor, axis, [(-0.015, 0.05), (0.03, 0.01)])
    assert axis.depth > 0.03 - 0.05 * 0.15


def test_the_force_is_watched_while_the_needle_is_withdrawn_before_the_bias(recorded):
    with FakeAxis() as axis:
        axis.depth = 0.05
        with FakeSensor(lambda t: 1000.0 * (0.05 - axis.depth)) as sensor:
            with pytest.raises(InputError, match="force limit"):
                recorded(sensor, axis, [(-0.015, 0.02), (0.03, 0.01)], force_limit=3.0)
    assert 0.05 - axis.depth < 3e-3 + SPEED * 0.1 + 0.5e-3


def test_a_force_limit_stops_an_axis_that_was_not_ordered_to_move(recorded):
    with Disobedient() as axis, tissue(axis) as sensor:
        threading.Timer(0.8, lambda: vars(axis).update(target=0.05, speed=0.02)).start()
        outcome, _ = recorded(sensor, axis, [], force_limit=1.0, duration=3.0)
    assert "ordered to stop" in outcome.detail or outcome.ended == "axis fault"
    assert axis.received.count("stop") > 1 and not outcome.rest_confirmed


def test_a_full_disk_does_not_hide_an_axis_that_does_not_stop(recorded, monkeypatch):
    import errno

    from needleforce.recording.log import writer

    plain = writer._Appended.write

    def full(self, data):
        if axis.depth > 0.002:
            raise OSError(errno.ENOSPC, "No space left on device")
        plain(self, data)

    monkeypatch.setattr(writer._Appended, "write", full)
    with Disobedient() as axis, FakeSensor() as sensor:
        outcome, _ = recorded(sensor, axis, [(0.055, 0.02)], flush_every=0.02)
    assert outcome.ended == "axis did not stop" and not outcome.rest_confirmed
    assert "last seen at" in outcome.detail and "No space left" in outcome.detail


def test_a_result_that_cannot_be_written_does_not_hide_it_either(tmp_path, page, monkeypatch):  # noqa: F811
    gone = tmp_path / "gone"
    gone.mkdir()
    with Disobedient() as axis, tissue(axis) as sensor:
        more = ["--axis", f"127.0.0.1:{axis.port}", "--depth-mm", "55", "--speed-mm-s", "20", "--start-mm", "-2"]
        more += ["--force-limit-N", "1", "--bias-s", "0.1", "--json", str(gone / "o.json")]
        threading.Timer(0.7, gone.rmdir).start()
        done = CliRunner().invoke(app, arguments(tmp_path / "run.mcap", sensor, page, *more))
    assert done.exit_code == 3 and "last seen at" in done.output
