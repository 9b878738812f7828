# SPDX-License-Identifier: Apache-2.0
"""Faults of the recorder itself while a needle moves: a clock, a disk, a display or a program that stands still.

The true depth is that of the fake axis, which no lie changes. The bounds are those of docs/evidence/safety_case.md.
"""

import subprocess
import sys
import threading
import time

import pytest
from fake_rig import Disobedient, FakeAxis, FakeSensor, tissue
from test_record_command import arguments, page  # noqa: F401 - a fixture
from typer.testing import CliRunner

from needleforce.cli import app
from needleforce.recording.log.reader import read_log


def test_a_clock_that_is_set_back_changes_no_time_stamp(recorded, monkeypatch):
    begun, wall = time.monotonic(), time.time_ns
    monkeypatch.setattr(time, "time_ns", lambda: wall() - 3600 * 10**9 * (time.monotonic() - begun > 0.6))
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


def test_the_first_reason_is_the_one_that_is_reported(recorded):
    """Nothing is written for seconds; the axis, stopped for that, then reports a speed that it has not."""

    def view(now):
        if now.depth and now.depth > 0.0 and "stop" not in axis.received:
            time.sleep(2.5)

    def lie_once_stopped(state):
        return state._replace(velocity=1.0) if "stop" in axis.received else state

    with FakeSensor() as sensor, FakeAxis(state=lie_once_stopped) as axis:
        outcome, _ = recorded(sensor, axis, [(0.055, 0.005)], view=view)
    assert outcome.ended == "file not written" and "nothing could be written" in outcome.detail, outcome.detail


def test_a_program_that_did_not_run_stops_the_axis_and_reports_it(tmp_path, page, simulated_time):  # noqa: F811
    path, stopped = tmp_path / "run.mcap", []

    def stand_still(state):
        if state.depth > 0.0 and not stopped:
            stopped.append(simulated_time.pass_by(0.6))
        return state

    with FakeSensor() as sensor, FakeAxis(state=stand_still) as axis:
        more = ["--axis", f"127.0.0.1:{axis.port}", "--depth-mm", "50", "--speed-mm-s", "5", "--start-mm", "-2"]
        done = CliRunner().invoke(app, arguments(path, sensor, page, *more, "--bias-s", "0.1", "--plain"))
    assert done.exit_code == 1 and "recorder delayed: this program did not run for 0.6" in done.output, done.output
    assert axis.received[-1] == "stop" and read_log(path).end["ended"] == "recorder delayed"


def test_memory_of_a_long_recording_is_bounded(monkeypatch):
    """What is kept for the alignment and for the seconds does not grow: a smaller bound needs a shorter recording."""
    from needleforce.acquisition import run_writer
    from needleforce.acquisition.sources.source import ForceSample

    class Nothing:
        def __getattr__(self, name):
            return lambda *arguments, **facts: None

    assert run_writer._MAX_PAIRS <= 100_000
    monkeypatch.setattr(run_writer, "_MAX_PAIRS", 500)  # reached by 5000 readings, and four times more by these
    writer, count, step = run_writer.RunWriter(Nothing(), object()), 40_000, 997_000_000  # a second apart
    for begin in range(0, count, 10_000):
        writer.force(
            [
                ForceSample(sequence=k, device=k * step, arrival=k * step, read=k * step, wrench=(0.0,) * 6, status=0)
                for k in range(begin, begin + 10_000)
            ]
        )
    assert 100 < len(writer.pairs) <= 500 and not writer.check.seconds
    assert writer.pairs[-1][0] > 0.99 * count * step


def test_the_needle_stops_although_the_disk_hangs(recorded, monkeypatch):
    from needleforce.recording.log import writer

    released, plain = threading.Event(), writer._Appended.write

    def hanging(self, data):
        if axis.depth > 0.0 and not released.is_set():
            released.wait(3.0)  # longer than the recorder waits for a write
            released.set()
        plain(self, data)

    monkeypatch.setattr(writer._Appended, "write", hanging)
    with FakeAxis() as axis, FakeSensor() as sensor:
        outcome, log = recorded(sensor, axis, [(0.055, 0.005)], flush_every=0.02)
    assert outcome.ended == "file not written" and log.complete and len(log.wrench.sequence) > 500
    assert axis.depth < 0.005 * 3.0, "stopped while the disk hung"


def test_random_lies_of_another_process_violate_nothing(root, many):
    """A short run of the benchmark, in which the needle's true path is judged."""
    script, runs = root / "benchmarks" / "lies.py", str(many(12, 24))
    done = subprocess.run([sys.executable, script, "--runs", runs, "--jobs", "4"], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"{runs} runs, 0 violated" in done.stdout


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
    assert outcome.detail.count("nothing more can be written") == 1, (
        "once, although the file also fails when it is closed"
    )


@pytest.mark.usefixtures("simulated_time")
def test_a_result_that_cannot_be_written_does_not_hide_it_either(tmp_path, page, monkeypatch):  # noqa: F811
    gone = tmp_path / "gone"
    gone.mkdir()
    with Disobedient() as axis, tissue(axis) as sensor:
        more = ["--axis", f"127.0.0.1:{axis.port}", "--depth-mm", "55", "--speed-mm-s", "20", "--start-mm", "-2"]
        more += ["--force-limit-N", "1", "--bias-s", "0.1", "--json", str(gone / "o.json")]
        threading.Timer(0.7, gone.rmdir).start()
        done = CliRunner().invoke(app, arguments(tmp_path / "run.mcap", sensor, page, *more))
    assert done.exit_code == 3 and "last seen at" in done.output
