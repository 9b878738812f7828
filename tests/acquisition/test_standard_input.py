# SPDX-License-Identifier: Apache-2.0
"""Lines of any program as samples: values, counters and clocks against those written."""

import contextlib
import os
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import needleforce as nf
from needleforce.acquisition.recorder import record_run
from needleforce.acquisition.settings import Settings
from needleforce.acquisition.sources.gauge_calibration import Calibration
from needleforce.acquisition.sources.standard_input import StandardInput
from needleforce.recording.log import read_log

HEADER = "time_s,fx_N,fy_N,fz_N,tx_Nm,ty_Nm,tz_Nm\n"


@contextlib.contextmanager
def piped(text: str | bytes, chunk: int = 1 << 20, wait: float = 0.0):
    """The reading end of a pipe into which a thread writes ``text`` in pieces and which it then closes."""
    reading, writing = os.pipe()
    data = text.encode() if isinstance(text, str) else text

    def write():
        with contextlib.suppress(BrokenPipeError), os.fdopen(writing, "wb", buffering=0) as out:
            for start in range(0, len(data), chunk):
                out.write(data[start : start + chunk])
                time.sleep(wait)

    writer = threading.Thread(target=write)
    writer.start()
    try:
        with os.fdopen(reading, "rb", buffering=0) as stream:
            yield stream
    finally:
        writer.join()


def everything(source: StandardInput):
    samples = []
    with pytest.raises(EOFError):
        while True:
            samples += source.receive(1.0)
    return samples


def read(text, calibration=None, **how):
    with piped(text, **how) as stream:
        source = StandardInput(stream, calibration)
        source.start()
        return everything(source), source


@pytest.mark.parametrize("chunk", [1, 7, 1000, 1 << 20])
def test_every_line_is_a_sample_for_any_size_of_the_pieces(chunk):
    numbers = np.random.default_rng(2).normal(size=(40, 6))
    lines = [f"{10 + 1e-3 * k:.3f}," + ",".join(f"{x:.6f}" for x in row) for k, row in enumerate(numbers)]
    samples, source = read(HEADER + "\n".join(lines) + "\n", chunk=chunk)
    np.testing.assert_allclose([s.wrench for s in samples], np.round(numbers, 6), atol=1e-12)
    assert [s.sequence for s in samples] == list(range(40))
    np.testing.assert_allclose([s.device for s in samples], [10**10 + k * 10**6 for k in range(40)], atol=1)
    assert all(s.arrival <= s.read and s.status == 0 for s in samples)
    assert (source.lines, source.wrong_size, source.axis) == (40, 0, None)


def test_units_and_delimiters_are_those_of_recordings():
    text = '# a sensor\n\n"time (ms)";Fz [mN];tx_Nmm;note;sequence\n5;-250;3;7;41\n6;500;-3;8;43\n'
    samples, _ = read(text.replace("time (ms)", "time_ms"))
    assert [s.sequence for s in samples] == [41, 43] and [s.device for s in samples] == [5_000_000, 6_000_000]
    np.testing.assert_allclose([s.wrench for s in samples], [[0, 0, -0.25, 3e-3, 0, 0], [0, 0, 0.5, -3e-3, 0, 0]])


def test_the_counter_in_the_lines_is_unwrapped_as_32_bits():
    counters = [2**32 - 2, 2**32 - 1, 0, 1, *range(2**31 + 7, 2**31 + 47), 2**40]
    samples, source = read("sequence,fz_N\n" + "".join(f"{n},0.5\n" for n in counters) + "2,1e308\n")
    assert np.diff([s.sequence for s in samples]).tolist()[:3] == [1, 1, 1]
    assert max(np.diff([s.sequence for s in samples])) < 1000 and source.restart == 1
    assert len(samples) == 44 and source.wrong_size == 2


def test_without_a_time_column_the_time_is_the_arrival():
    before = time.time_ns()
    samples, _ = read("fz_N  fx_N\n1 2\n3 4\n")
    assert all(before <= s.device == s.arrival <= time.time_ns() for s in samples)
    assert [s.wrench[:3] for s in samples] == [(2, 0, 1), (4, 0, 3)]


def test_a_depth_column_is_an_axis_without_commands(tmp_path):
    _, source = read("time_s,depth_mm,fz_N\n1.0,-4,0\n1.5,-2.5,0\n2.0,-2.5,0\n")
    states = [state for state, _ in source.axis.receive()]
    assert [(s.number, s.time, s.depth) for s in states] == [(0, 1.0, -4e-3), (1, 1.5, -2.5e-3), (2, 2.0, -2.5e-3)]
    np.testing.assert_allclose([s.velocity for s in states], [0.0, 3e-3, 0.0])
    assert [s.condition for s in states] == ["idle", "moving", "idle"] and source.axis.receive() == []
    with pytest.raises(nf.InputError, match="a run cannot stop it"):
        record_run(tmp_path / "run.mcap", source, source.axis, [(0.0, 1e-3)], {}, Settings(force_limit=1.0))
    _, source = read("time_s,depth_mm,velocity_mm_s,fz_N\n1.0,-4,3,0\n")
    assert source.axis.receive()[0][0].velocity == 3e-3


def test_the_velocity_is_continuous_across_pieces():
    lines = "".join(f"{0.1 * k:.1f},{0.3 * k:.1f},0\n" for k in range(8))
    _, source = read("time_s,depth_mm,fz_N\n" + lines, chunk=11, wait=0.01)
    velocities = [state.velocity for state, _ in source.axis.receive()]
    np.testing.assert_allclose(velocities, [0.0] + [3e-3] * 7, rtol=1e-6)


@pytest.mark.parametrize("names", ["v0,v1,v2,v3,v4,v5", "g1,g2,g3,g4,g5,g6", *["gauge 1 [V],gauge 2 [V],gauge 3 [V],"
                         "gauge 4 [V],gauge 5 [V],gauge 6 [V]"]])  # fmt: skip
def test_gauge_voltages_are_converted_by_the_calibration(names):
    matrix, bias = np.diag([1.0, 2.0, 3.0, 0.1, 0.2, 0.3]) + 0.01, np.arange(6) * 0.1
    calibration = Calibration(matrix, bias)
    volts = np.random.default_rng(3).uniform(-2, 2, (9, 6)).round(4)
    volts[4, 2] = -10.0
    text = "".join(f"{k},{','.join(map(str, row))}\n" for k, row in enumerate(volts.tolist()))
    samples, _ = read(f"time_ms,{names}\n" + text, calibration)
    np.testing.assert_allclose([s.wrench for s in samples], [matrix @ (v - bias) for v in volts], atol=1e-14)
    assert [s.status for s in samples] == [0, 0, 0, 0, 1 << 17, 0, 0, 0, 0]


def test_invalid_lines_are_counted_and_left_out():
    good = "".join(f"{k},0,0,{k},0,0,0\n" for k in range(200))
    bad = "1,2,3\n,,,,,,\n1,0,0,nan,0,0,0\n1,0,0,inf,0,0,0\nx,0,0,1,0,0,0\n1_0,0,0,1,0,0,0\n1,0,0,1,0,0,0,0\n\xff\n"
    samples, source = read((HEADER + good + "\n# a comment\n").encode() + bad.encode("latin1") + b"7,0,0,0.0")
    assert [s.wrench[2] for s in samples] == list(range(200))
    assert (source.lines, source.wrong_size) == (209, 9)


def test_values_outside_the_range_of_a_recording_make_a_line_invalid():
    head = "time_s,sequence,fz_N,depth_mm,velocity_mm_s\n"
    bad = ["-1,4,0,0,0", "1e300,4,0,0,0", "5e9,4,0,0,0", "1,1e30,0,0,0", "1,4,0,1e308,0", "1,4,0,0,-1e308"]
    good = [f"{k},{k},0,0,0" for k in range(90)]
    samples, source = read(head + "\n".join(good + bad) + "\n")
    assert source.wrong_size == len(bad)
    assert [sample.sequence for sample in samples] == list(range(90))


def test_too_many_invalid_lines_are_an_error():
    with pytest.raises(nf.InputError, match=r"'oh no'.*20 of 120 lines"):
        read(HEADER + "0,0,0,0,0,0,0\n" * 100 + "oh no\n" * 20)
    with pytest.raises(nf.InputError, match=r"3 of 3 lines"):
        read(HEADER + "oh no\n" * 3)
    with pytest.raises(nf.InputError, match="no end"):
        read(HEADER + "0" * 200_000)


@pytest.mark.parametrize(
    "header, calibration, message",
    [
        ("", None, "ends before"),
        ("time_s,depth_mm\n", None, "axial force.*'time_s', 'depth_mm'"),
        ("time_s,fz\n", None, "unit of column 'fz'.*fz_N"),
        ("time,fz_N\n", None, "unit of column 'time'"),
        ("fz_N,tz\n", None, "unit of column 'tz'.*tz_Nm"),
        ("fz_furlong\n", None, "axial force"),
        ("time_s,fz_N,fz_N\n", None, "2 times"),
        ("time_s,velocity_mm_s,fz_N\n", None, "depth"),
        ("v0,v1,v2,v3,v4,v5\n", None, "need a calibration"),
        ("time_s,fz_N\n", Calibration(np.eye(6), np.zeros(6)), "six voltages"),
        ("v0,v1,v2,v3,v4\n", Calibration(np.eye(6), np.zeros(6)), "6 are needed"),
        ("v2,v3,v4,v5,v6,v7\n", Calibration(np.eye(6), np.zeros(6)), "from 0 or 1"),
    ],
)
def test_invalid_headers_are_refused(header, calibration, message):
    with pytest.raises(nf.InputError, match=message):
        read(header, calibration)


def test_silence_of_the_input_does_not_block(monkeypatch):
    monkeypatch.setattr("needleforce.acquisition.sources.standard_input.HEADER_TIMEOUT_S", 0.05)
    reading, writing = os.pipe()
    with os.fdopen(reading, "rb", buffering=0) as stream, os.fdopen(writing, "wb", buffering=0) as out:
        source = StandardInput(stream)
        with pytest.raises(nf.InputError, match="none within"):
            source.start()
        out.write(HEADER.encode())
        source.start()
        assert source.receive(0.01) == []
        out.write(b"0,0,0,1,0,0,0\n")
        assert len(source.receive(5.0)) == 1
        out.write(b"0,0,0,2,0,0,0\n" * 3)
        source.stop()
        source.start()  # lines between two runs belong to neither
        out.write(b"0,0,0,3,0,0,0\n")
        assert [s.wrench[2] for s in source.receive(5.0)] == [3.0]


def test_where_a_system_selects_no_pipes_a_thread_waits_for_the_lines(monkeypatch):
    monkeypatch.setattr("needleforce.acquisition.sources.standard_input.HEADER_TIMEOUT_S", 0.05)
    monkeypatch.setattr("needleforce.acquisition.sources.standard_input._SELECTS", False)
    reading, writing = os.pipe()
    with os.fdopen(reading, "rb", buffering=0) as stream:
        with os.fdopen(writing, "wb", buffering=0) as out:
            source = StandardInput(stream)
            with pytest.raises(nf.InputError, match="none within"):
                source.start()
            monkeypatch.setattr("needleforce.acquisition.sources.standard_input.HEADER_TIMEOUT_S", 5.0)
            out.write(HEADER.encode())
            source.start()
            assert source.receive(0.01) == []
            out.write(b"0,0,0,1,0,0,0\n")
            assert [s.wrench[2] for s in source.receive(5.0)] == [1.0]
            out.write(b"0,0,0,2,0,0,0\n")
        assert [s.wrench[2] for s in everything(source)] == [2.0]


def test_a_regular_file_is_read_to_its_end(tmp_path):
    path = tmp_path / "lines.csv"
    path.write_text(HEADER + "".join(f"{k},0,0,{k},0,0,0\n" for k in range(20_000)))
    with open(path, "rb") as stream:
        source = StandardInput(stream)
        source.start()
        samples = everything(source)
    assert [s.wrench[2] for s in samples] == list(range(20_000))


def test_the_output_of_another_program_is_read_to_its_end():
    code = "import sys\nprint('time_s,fx_N,fy_N,fz_N,tx_Nm,ty_Nm,tz_Nm')\n"
    code += "for k in range(10000): print(f'{k/1000:.3f},0.001,0.002,{k},0.0001,0.0002,0.0003')"
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE) as program:
        source = StandardInput(program.stdout)
        source.start()
        samples = everything(source)
    assert [s.sequence for s in samples] == list(range(10_000)) and source.wrong_size == 0
    assert samples[-1].wrench[2] == 9999.0


def test_a_recording_from_lines_has_the_written_values(tmp_path):
    """Half a second of free travel, then a force proportional to the depth; the end of the input ends the recording."""
    depth = np.clip(np.linspace(-4.0, 4.0, 801), -4.0, None)
    force = 0.05 * np.clip(depth, 0.0, None) + 0.3
    text = "time_ms,sequence,depth_mm,fz_N\n"
    text += "".join(f"{k},{k},{d:.4f},{f:.6f}\n" for k, (d, f) in enumerate(zip(depth, force)) if k != 400)
    settings = Settings(force_limit=5.0, bias_time=0.0)
    with piped(text, chunk=2000, wait=0.02) as stream:
        outcome = record_run(tmp_path / "lines.mcap", StandardInput(stream), None, [], {"needle": "n"}, settings)
    log = read_log(tmp_path / "lines.mcap")
    assert (outcome.ended, outcome.received, outcome.lost) == ("source ended", 800, 1)
    assert log.complete and log.card["needle"] == "n"
    np.testing.assert_array_equal(log.wrench.sequence, np.delete(np.arange(801), 400))
    np.testing.assert_allclose(log.wrench.values[:, 2], np.delete(force, 400), atol=1e-6)
    np.testing.assert_allclose(log.axis.values[:, 0], np.delete(depth, 400) * 1e-3, atol=1e-7)
