"""Complete runs over loopback: what is recorded, and every reason for which a run can end."""

import threading
import time

import numpy as np
import pytest
from fake_rig import BIAS, FakeAxis, FakeSensor

from needleforce import InputError
from needleforce.recording.log import read_log
from needleforce.wire.net_ft import Command, status_words

MOVES = [(0.002, 0.02), (0.002, 0.1), (-0.002, 0.02)]


def marks(log, kind):
    return [mark for mark in log.marks if mark.kind == kind]


def facts(mark):
    return mark.facts


def test_a_complete_run_is_recorded(recorded):
    with FakeSensor() as sensor, FakeAxis() as axis:
        shown = []
        outcome, log = recorded(sensor, axis, MOVES, view=shown.append)
    assert outcome.ended == "done"
    assert log.complete
    assert sensor.requests[0] == Command.START and sensor.requests[-1] == Command.STOP
    assert axis.received[:2] == ["move 0.00200000 0.0200000", "move -0.00200000 0.0200000"]
    assert axis.received[2] == "stop"
    assert (outcome.lost, outcome.duplicated, outcome.late) == (0, 0, 0)
    assert np.array_equal(log.wrench.sequence, np.arange(1, outcome.received + 1))
    assert outcome.received <= sensor.sent
    assert log.axis.values[:, 0].max() == pytest.approx(0.002, abs=1e-7)
    assert [facts(mark)["name"] for mark in marks(log, "phase")] == ["insertion", "hold", "extraction"]
    assert np.all(np.diff(log.wrench.device) == 2_000_000)  # 500 Hz
    assert np.all(log.wrench.stamp <= log.wrench.arrival)
    assert log.card["sensor_serial"] == "FT00042" and float(log.card["wrench_rate_Hz"]) == 500.0
    assert shown and {progress.phase for progress in shown} <= {"free", "insertion", "hold", "extraction"}


def test_a_view_that_fails_does_not_end_a_run_with_moves(recorded):
    def view(now):
        raise BrokenPipeError

    with FakeSensor() as sensor, FakeAxis() as axis:
        outcome, log = recorded(sensor, axis, MOVES, view=view)
    assert outcome.ended == "done" and log.complete and outcome.lost == 0


def test_an_exception_stops_the_axis_and_closes_the_file(recorded, tmp_path):
    with FakeSensor() as sensor, FakeAxis() as axis:
        with pytest.raises(ZeroDivisionError):
            recorded(sensor, axis, [(0.05, 0.005)], view=lambda now: now.depth and 1 / 0)
    log = read_log(tmp_path / "run.mcap")
    assert axis.received[1] == "stop" and log.complete and log.end["ended"] == "failed"


def test_the_bias_is_marked_and_not_subtracted(recorded):
    with FakeSensor() as sensor:
        outcome, log = recorded(sensor, duration=0.2)
    noise = np.array([0.002 * ((k * 7919 % 13) - 6) / 6 for k in range(1, outcome.bias.samples + 1)])
    assert outcome.bias.wrench == pytest.approx([*BIAS[:2], BIAS[2] + noise.mean(), *BIAS[3:]], abs=6e-4)
    assert outcome.bias.noise[2] == pytest.approx(noise.std(), rel=0.5)
    assert facts(marks(log, "bias")[0])["wrench"] == pytest.approx(outcome.bias.wrench)
    assert log.wrench.values[:, 2].mean() == pytest.approx(2.0, abs=1e-3)
    assert abs(outcome.peak_force) < 0.01


@pytest.mark.parametrize("force", [lambda t: 20.0 * t, lambda t: 0.3 * (t > 0.05)])
def test_a_force_that_drifts_or_jumps_at_rest_is_refused(recorded, force, tmp_path):
    with FakeSensor(force) as sensor, FakeAxis() as axis:
        with pytest.raises(InputError, match="--steady-N"):
            recorded(sensor, axis, MOVES)
    assert not list(tmp_path.iterdir())
    assert not any(line.startswith("move") for line in axis.received)


def test_a_needle_in_tissue_is_withdrawn_before_the_bias(recorded):
    with FakeAxis() as axis:
        axis.depth = 0.01
        with FakeSensor(lambda t: 100.0 * max(0.0, axis.depth)) as sensor:
            outcome, log = recorded(sensor, axis, [(-0.002, 0.04), (0.002, 0.02)])
    assert outcome.ended == "done"
    assert outcome.bias.wrench[2] == pytest.approx(BIAS[2], abs=2e-3)
    assert log.axis.values[0, 0] < 0.0
    assert outcome.peak_force == pytest.approx(0.2, abs=0.02)


def test_the_force_limit_stops_the_axis(recorded):
    with FakeAxis() as axis:
        with FakeSensor(lambda t: max(0.0, 500.0 * axis.depth)) as sensor:
            outcome, log = recorded(sensor, axis, [(0.05, 0.02)], force_limit=1.0)
    assert outcome.ended == "force limit"
    assert axis.received[0].startswith("move") and axis.received[1] == "stop"
    assert not any(line.startswith("move") for line in axis.received[1:])
    over = facts(marks(log, "limit")[0])
    assert over["limit"] == 1.0 < over["force"] < 1.2  # 20 mm/s on 500 N/m for 20 ms
    assert axis.depth < 0.003
    assert facts(marks(log, "axis")[-1])["condition"] == "idle"  # recorded until it rests
    assert log.complete and log.end["ended"] == "force limit"


def test_saturation_counts_as_exceeding_the_limit(recorded):
    with FakeSensor(status=lambda k: (k > 150) << 17 | (k > 150) << 31) as sensor, FakeAxis() as axis:
        outcome, log = recorded(sensor, axis, [(0.05, 0.02)])
    assert outcome.ended == "force limit"
    status = (1 << 17) | (1 << 31)
    first = {"sequence": 151, "status": status, "words": status_words(status)}
    assert facts(marks(log, "status")[0]) == first


def test_short_sensor_faults_are_marked_and_lasting_ones_end_the_run(recorded):
    def status(k):
        return (1 << 20 | 1 << 31) if 100 < k < 120 or k > 200 else 0

    with FakeSensor(status=status) as sensor:
        outcome, log = recorded(sensor, duration=5.0)
    assert outcome.ended == "sensor fault"
    assert "RDT failure" in facts(marks(log, "status")[0])["words"]
    assert log.wrench.sequence[-1] > 200


def test_a_sensor_that_repeats_its_reading_ends_the_run(recorded):
    with FakeSensor(stale_from=120) as sensor:
        outcome, log = recorded(sensor, duration=5.0)
    assert outcome.ended == "sensor fault"
    assert log.complete


def test_lost_duplicated_late_and_wrong_packets_are_counted(recorded):
    def packets(sensor, k):
        if k in (200, 201):
            return []
        if k == 210:
            return [sensor.packet(211)]
        if k == 211:
            return [sensor.packet(210), sensor.packet(210)]
        if k == 220:
            return [b"x" * 35, sensor.packet(k)]
        return [sensor.packet(k)]

    with FakeSensor(packets=packets) as sensor:
        outcome, log = recorded(sensor, duration=0.7)
    assert (outcome.lost, outcome.duplicated, outcome.late) == (2, 1, 1)
    sequence = log.wrench.sequence.tolist()
    assert sequence == [k for k in range(1, sequence[-1] + 1) if k not in (200, 201)]
    counts = [facts(mark) for mark in marks(log, "lost")]
    assert [sum(each[name] for each in counts) for name in ("lost", "duplicated", "late")] == [2, 1, 1]
    assert facts(marks(log, "wrong_size")[0])["count"] == 1


def test_a_silent_sensor_ends_the_run(recorded):
    with FakeSensor(ends=200) as sensor, FakeAxis() as axis:
        outcome, log = recorded(sensor, axis, [(0.05, 0.005)])
    assert outcome.ended == "sensor silent"
    assert len(log.wrench.sequence) == 200
    assert "stop" in axis.received


def silent_when_moving(axis):
    def reply(line):
        axis.silent = axis.silent or line.startswith("move")

    return reply


def garbage_when_moving(axis, line):
    if line.startswith("move"):
        axis.garbage = b"state 1 nan\n"


@pytest.mark.parametrize(
    "fault, ended",
    [
        (lambda axis: {"reply": silent_when_moving(axis)}, "axis silent"),
        (lambda axis: {"reply": lambda line: "" if "move" in line else None}, "axis silent"),
        (lambda axis: {"reply": lambda line: "refused move door open" if "move" in line else None}, "move refused"),
        (lambda axis: {"state": lambda s: s._replace(condition="stalled") if s.depth > 0 else s}, "axis stalled"),
        (lambda axis: {"state": lambda s: s._replace(depth=min(s.depth, 0.003))}, "axis stalled"),
        (lambda axis: {"state": lambda s: s._replace(depth=-0.002 - 1.2 * (s.depth + 0.002))}, "axis fault"),
        (lambda axis: {"state": lambda s: s._replace(depth=s.depth + 0.04 * (s.depth > 0))}, "axis fault"),
        (lambda axis: {"state": lambda s: s._replace(condition="fault") if s.depth > 0 else s}, "axis fault"),
        (lambda axis: {"state": lambda s: s._replace(condition="idle") if s.depth > 0 else s}, "axis stopped"),
        (lambda axis: {"reply": lambda line: setattr(axis, "hangs_up", "move" in line)}, "axis lost"),
        (lambda axis: {"reply": lambda line: garbage_when_moving(axis, line)}, "axis lost"),
    ],
)  # fmt: skip
def test_a_failing_axis_ends_the_run(recorded, fault, ended):
    with FakeSensor() as sensor, FakeAxis() as axis:
        vars(axis).update(fault(axis))
        outcome, log = recorded(sensor, axis, [(0.03, 0.04)])
    assert outcome.ended == ended
    assert log.complete and log.end["ended"] == ended
    assert ended == "axis lost" or "stop" in axis.received


def test_the_stop_event_ends_the_run(recorded):
    stop = threading.Event()
    with FakeSensor() as sensor, FakeAxis() as axis:
        outcome, log = recorded(sensor, axis, [(0.05, 0.005)], stop=stop, view=lambda now: now.depth and stop.set())
    assert outcome.ended == "interrupted"
    assert axis.received[1] == "stop" and log.complete


def test_the_stop_event_stops_the_axis_while_the_terminal_blocks(recorded):
    stop, stopped = threading.Event(), []

    def view(now):
        if now.depth and not stop.is_set():
            stop.set()
            until = time.monotonic() + 5.0
            while "stop" not in axis.received and time.monotonic() < until:
                time.sleep(0.01)
            stopped.append("stop" in axis.received)

    with FakeSensor() as sensor, FakeAxis() as axis:
        outcome, log = recorded(sensor, axis, [(0.05, 0.005)], stop=stop, view=view)
    assert stopped == [True] and outcome.ended == "interrupted" and log.complete


@pytest.mark.parametrize("moves", [[(0.2, 0.01)], [(0.01, 1.0), (0.02, 1.0)]])
def test_moves_outside_the_range_of_the_axis_are_refused_before_the_start(recorded, moves, tmp_path):
    with FakeSensor() as sensor, FakeAxis() as axis:
        with pytest.raises(InputError, match="the axis moves"):
            recorded(sensor, axis, moves)
    assert Command.START not in sensor.requests
    assert not list(tmp_path.iterdir())


def test_an_existing_file_is_not_overwritten(recorded, tmp_path):
    (tmp_path / "run.mcap").write_text("mine")
    with FakeSensor() as sensor, pytest.raises(InputError, match="never overwritten"):
        recorded(sensor, duration=0.1)
    assert (tmp_path / "run.mcap").read_text() == "mine"


def test_an_axis_that_moves_during_a_hold_ends_the_run(recorded):
    rests = []

    def state(s):
        rests.extend([s] * (s.depth == 0.002))
        return s._replace(depth=-0.001) if len(rests) > 40 else s

    with FakeSensor() as sensor, FakeAxis(state=state) as axis:
        outcome, _ = recorded(sensor, axis, [(0.002, 0.02), (0.002, 5.0)])
    assert outcome.ended == "axis fault" and "stop" in axis.received


@pytest.mark.parametrize("steps", [(3.9e9, 0.0), (0.0, 3.9e9)])
def test_an_axis_that_sets_its_clock_does_not_end_the_run(recorded, steps):
    def state(s):
        return s._replace(time=s.time + steps[s.number > 40])

    with FakeSensor() as sensor, FakeAxis(state=state) as axis:
        outcome, log = recorded(sensor, axis, MOVES)
    assert outcome.ended == "done" and log.complete
    assert np.all(log.axis.stamp >= 0)


def test_a_counter_that_does_not_advance_is_refused(recorded, tmp_path):
    with FakeSensor(packets=lambda sensor, k: [sensor.packet(1)]) as sensor:
        with pytest.raises(InputError, match="hardly advance"):
            recorded(sensor, duration=0.1, bias_time=0.05)
    assert not list(tmp_path.iterdir()) and sensor.requests[-1] == Command.STOP


def test_a_counter_that_runs_backwards_ends_the_run(recorded):
    with FakeSensor(packets=lambda sensor, k: [sensor.packet(k if k < 100 else 4000 - k)]) as sensor:
        outcome, log = recorded(sensor, duration=10.0)
    assert outcome.ended == "sensor fault" and "counters" in outcome.detail
    assert log.complete


def test_a_view_that_fails_is_not_called_again(recorded):
    shown = []

    def view(now):
        shown.append(now)
        raise BrokenPipeError

    with FakeSensor() as sensor:
        outcome, log = recorded(sensor, duration=0.4, view=view)
    assert outcome.ended == "done" and log.complete and len(shown) == 1


def test_a_sensor_that_does_not_answer_is_refused(recorded):
    sensor = FakeSensor()
    with sensor:
        sensor.leave.set()
        sensor.thread.join()
        with pytest.raises(InputError, match="no reading for"):
            recorded(sensor, duration=0.1, silence=0.2)


def test_a_full_disk_ends_the_run(recorded, monkeypatch):
    import errno
    import os

    from needleforce.recording.log import writer

    written = []

    def full(self, data):
        written.append(len(data))
        if len(written) > 40:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        plain(self, data)

    plain = writer._Appended.write
    monkeypatch.setattr(writer._Appended, "write", full)
    with FakeSensor() as sensor, FakeAxis() as axis:
        outcome, log = recorded(sensor, axis, [(0.05, 0.003)], flush_every=0.02)
    assert outcome.ended == "disk full"
    assert not log.complete and len(log.wrench.sequence)
    assert outcome.lost == 0 and outcome.unwritten == outcome.received - len(log.wrench.sequence) > 0
    assert "stop" in axis.received


def test_a_run_is_recorded_in_parts(recorded):
    with FakeSensor() as sensor, FakeAxis() as axis:
        outcome, log = recorded(sensor, axis, [(0.02, 0.02), (-0.002, 0.04)], part_samples=300)
    assert outcome.ended == "done" and outcome.lost == outcome.unwritten == 0 and log.complete
    assert len(log.wrench.sequence) == outcome.received and len(log.files) == -(-outcome.received // 300) > 3
    assert {mark.facts["name"] for mark in log.marks if mark.kind == "phase"} >= {"insertion", "extraction"}
    assert [mark.kind for mark in log.marks].count("bias") == 1
    with FakeSensor() as sensor, pytest.raises(InputError, match="this file exists"):
        recorded(sensor, duration=0.1)
