"""The command ``needleforce record``."""

import json
import os
import signal
import struct
import subprocess
import sys

import pytest
from fake_rig import CONFIGURATION, PATIENCE, FakeAxis, FakeSensor, until
from typer.testing import CliRunner

from needleforce import InputError
from needleforce.acquisition.sources.opening import standard_input
from needleforce.cli import app
from needleforce.recording.log.reader import read_log

RUNS = ["--protocol", "paper", "--folder", "x", "--sensor", "127.0.0.1", "--axis", "127.0.0.1"]
MOVE = ["-o", "x.mcap", *RUNS[4:], "--depth-mm", "3", "--speed-mm-s", "3"]
CODE = "from needleforce.cli import main; main()"


@pytest.fixture
def page(tmp_path):
    (tmp_path / "page.xml").write_bytes(CONFIGURATION.xml())
    return str(tmp_path / "page.xml")


def arguments(path, sensor, page, *more):
    return ["record", "-o", str(path), "--sensor", f"127.0.0.1:{sensor.port}", "--sensor-page", page, *more]


@pytest.mark.usefixtures("simulated_time")
def test_ctrl_c_stops_the_axis_and_completes_the_file(tmp_path, page):
    path, pressed = tmp_path / "run.mcap", []

    def press(state):
        if state.depth > 0.0 and not pressed:
            pressed.append(state.depth)
            os.kill(os.getpid(), signal.SIGINT)
        return state

    with FakeSensor() as sensor, FakeAxis(state=press) as axis:
        more = ["--axis", f"127.0.0.1:{axis.port}", "--depth-mm", "50", "--speed-mm-s", "2", "--start-mm", "-2"]
        done = CliRunner().invoke(app, arguments(path, sensor, page, *more, "--bias-s", "0.1", "--plain"))
    assert done.exit_code == 0, done.output
    assert "phase insertion" in done.output and "depth" in done.output and "interrupted" in done.output
    log = read_log(path)
    assert log.complete and log.end["ended"] == "interrupted"
    assert axis.received[-1] == "stop" and axis.target is None


@pytest.mark.usefixtures("simulated_time")
def test_the_json_agrees_with_the_recorded_file(tmp_path, page):
    with FakeSensor() as sensor:
        options = arguments(
            tmp_path / "run.mcap", sensor, page, "--duration-s", "0.3", "--json", str(tmp_path / "o.json")
        )
        done = CliRunner().invoke(app, options)
    assert done.exit_code == 0, done.output
    outcome = json.loads((tmp_path / "o.json").read_text())
    assert outcome["ended"] == "done" and outcome["lost"] == 0
    assert outcome["received"] == len(read_log(tmp_path / "run.mcap").wrench.sequence)


def test_a_name_too_long_and_one_name_for_two_files_are_refused(tmp_path, page):
    with FakeSensor() as sensor:
        long = CliRunner().invoke(app, arguments(tmp_path / ("x" * 300), sensor, page))
        twice = CliRunner().invoke(
            app, arguments(tmp_path / "a.mcap", sensor, page, "--json", str(tmp_path / "." / "a.mcap"))
        )
    assert isinstance(long.exception, InputError) and "file to write" in str(long.exception)
    assert isinstance(twice.exception, InputError) and "another option" in str(twice.exception)
    assert not sensor.requests


def test_a_closed_standard_input_is_refused(monkeypatch, tmp_path):
    monkeypatch.setattr(sys, "stdin", None)
    with pytest.raises(InputError, match="standard input is closed"):
        standard_input(None)


@pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX")
def test_ctrl_c_while_waiting_for_a_header_leaves_no_file(tmp_path):
    import fcntl
    import termios

    code = "import sys; sys.argv[0] = 'needleforce'; " + CODE
    command = [sys.executable, "-c", code, "record", "-o", str(tmp_path / "run.mcap"), "--from", "-"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE, bufsize=0) as process:
        process.stdin.write(b"time")
        until(lambda: struct.unpack("i", fcntl.ioctl(process.stdin, termios.FIONREAD, bytes(4))) == (0,))
        process.send_signal(signal.SIGINT)  # it has read the beginning of a header and waits for the rest
        assert process.wait(timeout=PATIENCE) == 130, "a header that does not come ends it with another code"
    assert not list(tmp_path.iterdir())


@pytest.mark.usefixtures("simulated_time")
def test_the_readings_of_a_sensor_that_falls_silent_are_kept(tmp_path, page):
    with FakeSensor(ends=400) as sensor:
        done = CliRunner().invoke(app, arguments(tmp_path / "run.mcap", sensor, page))
    assert done.exit_code == 1
    assert len(read_log(tmp_path / "run.mcap").wrench.sequence) == 400


@pytest.mark.parametrize(
    "more, message",
    [
        (["-o", "x.mcap"], "--sensor"),
        (["-o", "x.mcap", "--sensor", "127.0.0.1", "--from", "-"], "--sensor"),
        (["-o", "x.mcap", "--from", "file"], "only -"),
        (["--sensor", "127.0.0.1"], "--output"),
        (["-o", "x.mcap", "--sensor", "127.0.0.1", "--depth-mm", "3"], "--speed-mm-s"),
        (["-o", "x.mcap", "--sensor", "127.0.0.1", "--depth-mm", "3", "--speed-mm-s", "3"], "--axis"),
        (["-o", "x.mcap", "--sensor", "127.0.0.1:x"], "HOST:PORT"),
        (["-o", "x.mcap", "--sensor", "127.0.0.1:70000"], "HOST:PORT"),
        (["-o", "x.mcap", "--sensor", "127.0.0.1", "--calibration", "x.toml"], "--from"),
        ([*MOVE, "--duration-s", "2"], "a motion has its own end"),
        ([*RUNS, "--duration-s", "2"], "a motion has its own end"),
        ([*RUNS, "--depth-mm", "3", "--speed-mm-s", "3"], "the protocol has its own"),
        (["--protocol", "paper", "--sensor", "127.0.0.1", "--axis", "127.0.0.1"], "--folder"),
    ],
)
def test_wrong_usage_is_refused(more, message):
    done = CliRunner().invoke(app, ["record", *more])
    assert done.exit_code != 0
    assert message in str(done.exception)
