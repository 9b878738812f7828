"""Conversion between formats changes neither the values nor the identified parameters."""

import shutil

import numpy as np
import pytest
from typer.testing import CliRunner

import needleforce as nf
from needleforce.cli import app
from needleforce.errors import InputError
from needleforce.recording.log import LogWriter


@pytest.fixture
def insertion(root, tmp_path):
    return shutil.copy(root / "examples" / "insertion.csv", tmp_path / "insertion.csv")


def convert(*arguments):
    return CliRunner().invoke(app, ["convert", *map(str, arguments)])


@pytest.mark.parametrize("ending", ["csv", "parquet", "mcap"])
def test_conversion_does_not_change_the_identified_parameters(insertion, tmp_path, ending):
    target = tmp_path / f"again.{ending}"
    done = convert(insertion, "-o", target)
    assert done.exit_code == 0 and "1592 samples" in done.stderr
    first, again = nf.read(insertion), nf.read(target)
    np.testing.assert_allclose(again.time, first.time, atol=1e-9)  # messages have whole nanoseconds
    for name in ("depth", "velocity", "force"):
        np.testing.assert_array_equal(getattr(again, name), getattr(first, name))
    expected, found = nf.identify(first).parameters, nf.identify(again).parameters
    for name, estimate in expected.items():
        np.testing.assert_allclose(found[name].value, estimate.value, rtol=1e-6)


def test_columns_and_units_are_options_of_convert(tmp_path):
    path = tmp_path / "odd.csv"
    rows = "".join(f"{10 * k},{0.1 * k:.3f},{0.01 * k:.3f}\n" for k in range(100))
    path.write_text("clock,weg,kraft\n" + rows)
    options = [f"--column={c}" for c in ("time=clock", "depth=weg", "force=kraft")]
    options += ["--unit=time=ms", "--unit=depth=mm", "--unit=force=N"]
    assert convert(path, "-o", tmp_path / "out.parquet", *options).exit_code == 0
    np.testing.assert_allclose(nf.read(tmp_path / "out.parquet").depth[-1], 9.9e-3)


def test_an_unreadable_file_leaves_no_output(tmp_path):
    path = tmp_path / "broken.csv"
    path.write_text("time,depth\n1,2\n")
    done = convert(path, "-o", tmp_path / "out.csv")
    assert done.exit_code == 1 and "force" in done.stderr and not (tmp_path / "out.csv").exists()


@pytest.mark.parametrize("name, message", [("out.xls", "known endings"), ("insertion.csv", "is also read")])
def test_an_invalid_target_is_refused(insertion, tmp_path, name, message):
    done = convert(insertion, "-o", tmp_path / name)
    assert isinstance(done.exception, InputError) and message in str(done.exception)


def test_a_log_in_parts_at_a_lower_rate(tmp_path):
    """Of the whole; the rate of a file without time is another option, which a note states."""
    recording = nf.simulate(nf.preset("paper"), nf.Motion.insert(-2e-3, 3e-3, 10e-3, 0.0, True), 1000)
    log = LogWriter(tmp_path / "run.mcap", {}, part_samples=2000)
    for k, (time, force, depth) in enumerate(zip(recording.time, recording.force, recording.depth)):
        clocks = (k, *[round(1e9 * time)] * 3)
        log.wrench(*clocks, (0.0, 0.0, force, 0.0, 0.0, 0.0))
        log.state(*clocks, depth, 0.0)
    log.close({})
    target = tmp_path / "slow.csv"
    done = convert(tmp_path / "run.mcap", "-o", target, "--decimate-to-hz", 100)
    assert done.exit_code == 0 and f"{len(recording)} samples are reduced to 100 a second" in done.stderr
    slow = nf.read(target)
    assert slow.rate == pytest.approx(100.0) and slow.depth.max() == pytest.approx(10e-3, abs=1e-4)
    fall = np.abs(slow.force - np.interp(slow.time, recording.time, recording.force))
    assert np.median(fall) < 1e-4 and slow.force.max() <= recording.force.max()
    notes = " ".join(note.message for note in nf.read(tmp_path / "run.mcap", rate=100.0).notes)
    assert "rate that was given is not used, because the file has its own time (--decimate-to-hz" in notes
