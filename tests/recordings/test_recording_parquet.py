# SPDX-License-Identifier: Apache-2.0
"""Recordings as Parquet: exact, with the options of CSV, and refused with a message."""

import datetime
import decimal
import sys

import numpy as np
import pytest
from plain_insertion import insertion

from needleforce.errors import InputError
from needleforce.recording import Card, Note, Recording, read, write

pyarrow = pytest.importorskip("pyarrow")
parquet = pytest.importorskip("pyarrow.parquet")
NAMES = ("time", "depth", "velocity", "force")
TIME, DEPTH, FORCE = insertion(rate=50.0)


@pytest.fixture
def stored(tmp_path):
    def made(columns, name="run.parquet"):
        path = tmp_path / name
        parquet.write_table(pyarrow.table(columns), path)
        return path

    return made


def awkward(size=500):
    """Values without a short decimal form, an axis, and a complete card."""
    draw = np.random.default_rng(7)
    time = np.cumsum(draw.uniform(1e-4, 1e-2, size))
    force = np.cumsum(draw.exponential(0.01, size)) * np.pi
    card = Card("a source", "0" * 64, "18 G\nnot 17 G", "µ, \\ and \x85", "", 5, ("a wild guess",))
    notes = (Note("sign", "of life", 3),)
    return Recording(time, time * 1e-3 / 3, draw.normal(size=size), force, {"fx": draw.normal(size=size)}, card, notes)


def test_written_and_read_is_the_same_bit_for_bit_as_from_csv(tmp_path):
    run = awkward()
    back = read(write(run, tmp_path / "run.parquet"), baseline=False)
    from_csv = read(write(run, tmp_path / "run.csv"), baseline=False)
    for name in NAMES:
        assert getattr(back, name).tobytes() == getattr(run, name).tobytes()
    assert back.axes["fx"].tobytes() == run.axes["fx"].tobytes() and set(back.axes) == {"fx"}
    for name in ("needle", "tissue", "rig", "filter_length", "assumptions"):
        assert getattr(back.card, name) == getattr(run.card, name)
    assert back.notes == from_csv.notes and Note("sign", "of life", 3) in back.notes


def test_any_tool_reads_what_is_written(tmp_path):
    import pandas

    run = awkward()
    frame = pandas.read_parquet(write(run, tmp_path / "run.parquet"))
    assert list(frame) == ["time_s", "depth_m", "velocity_m_s", "force_N", "fx_N"]
    assert (frame["force_N"].to_numpy() == run.force).all()


def test_same_data_give_same_bytes_and_no_temporary_file(tmp_path):
    run = awkward()
    assert write(run, tmp_path / "a.parquet").read_bytes() == write(run, tmp_path / "b.parquet").read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.parquet", "b.parquet"]


@pytest.mark.parametrize("value, match", [(np.nan, "force is not finite"), (np.inf, "force is not finite")])
def test_invalid_values_are_not_written(tmp_path, value, match):
    force = FORCE.copy()
    force[5] = value
    with pytest.raises(InputError, match=match):
        write(Recording(TIME, DEPTH, DEPTH, force), tmp_path / "run.parquet")
    assert not list(tmp_path.iterdir())


def test_without_pyarrow_the_extra_is_named(stored, tmp_path, monkeypatch):
    path = stored({"time_s": TIME, "depth_m": DEPTH, "force_N": FORCE})
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    for attempt in (lambda: read(path), lambda: write(awkward(), tmp_path / "new.parquet")):
        with pytest.raises(InputError, match=r"needleforce\[parquet\]"):
            attempt()


def test_the_name_of_the_file_does_not_matter(stored):
    path = stored({"time_s": TIME, "depth_m": DEPTH, "force_N": FORCE}, "run.csv")
    assert (read(path).force == FORCE).all()


def test_other_types_names_units_and_columns(stored):
    path = stored(
        {
            "t [ms]": np.round(TIME * 1e3).astype(np.int32),
            "sample": pyarrow.array(["a"] * len(TIME)),
            "Weg": (DEPTH * 1e3).astype(np.float32),
            "Force (mN)": FORCE * -1e3,
        }
    )
    run = read(path, columns={"depth": "Weg"}, units={"depth": "mm", "force": "-mN"})
    np.testing.assert_allclose(run.time, TIME, atol=1e-12)
    np.testing.assert_allclose(run.depth, DEPTH, atol=2e-9)
    np.testing.assert_allclose(run.force, FORCE, atol=1e-12)


def test_units_are_assumed_or_required_as_in_text_files(stored):
    run = read(stored({"time": TIME * 1e6, "pz": DEPTH * 1e3, "fz": FORCE}))
    assert any("time is assumed to be in us" in sentence for sentence in run.card.assumptions)
    np.testing.assert_allclose(run.time, TIME, atol=1e-12)
    with pytest.raises(InputError, match="--column depth=2"):
        read(stored({"time": TIME, "way": DEPTH, "force": FORCE}))


@pytest.mark.parametrize("unit, per_second", [("ms", 1e3), ("us", 1e6), ("ns", 1e9)])
@pytest.mark.parametrize("header", ["time", "timestamp", "time_ms"])
def test_time_stamps_are_seconds(stored, unit, per_second, header):
    start = datetime.datetime(2021, 11, 23, 3, 11, 48, tzinfo=datetime.UTC).timestamp()
    counts = np.round((start + TIME) * per_second).astype(np.int64)
    stamps = pyarrow.array(counts).cast(pyarrow.timestamp(unit, tz="UTC"))
    run = read(stored({header: stamps, "depth_m": DEPTH, "force_N": FORCE}))
    np.testing.assert_allclose(run.time - start, TIME, atol=1e-6)


def test_nulls_are_missing_values(stored):
    holes = [None if k == 100 else value for k, value in enumerate(FORCE)]
    run = read(stored({"time_s": TIME, "depth_m": DEPTH, "force_N": pyarrow.array(holes)}))
    assert len(run) == len(TIME) - 1 and np.isfinite(run.force).all()
    (note,) = [note for note in run.notes if note.kind == "missing"]
    assert note.count == 1 and "run.parquet, row 101" in note.message
    many = [None if k % 10 == 0 else value for k, value in enumerate(FORCE)]
    with pytest.raises(InputError, match=r"row 1: .*125 of 1250 rows"):
        read(stored({"time_s": TIME, "depth_m": DEPTH, "force_N": pyarrow.array(many)}))


@pytest.mark.parametrize(
    "values",
    [
        pyarrow.array([str(value) for value in FORCE]),
        pyarrow.array([decimal.Decimal(round(1000 * value)) / 1000 for value in FORCE]),
        pyarrow.array([value > 0 for value in FORCE]),
        pyarrow.array([{"z": value} for value in FORCE]),
        pyarrow.array([[value] for value in FORCE]),
    ],
    ids=["text", "decimal", "truth", "struct", "list"],
)
def test_a_column_without_numbers_is_refused_by_name(stored, values):
    with pytest.raises(InputError, match=r"force \(column 'fz'\) is of type .*a column of numbers is needed"):
        read(stored({"time_s": TIME, "depth_m": DEPTH, "fz": values}))


def test_a_decreasing_time_is_refused_with_its_row(stored):
    time = TIME.copy()
    time[200] = 0.0
    with pytest.raises(InputError, match="row 201: time is 0 after"):
        read(stored({"time_s": time, "depth_m": DEPTH, "force_N": FORCE}))


def test_a_motion_file_may_be_parquet(stored):
    clock = np.arange(-0.01, TIME[-1] + 0.1, 0.05)
    depth = np.interp(clock, TIME, DEPTH)
    motion = stored({"time_s": clock, "depth_m": depth}, "motion.parquet")
    run = read(stored({"time_s": TIME, "force_N": FORCE}), motion=motion)
    np.testing.assert_allclose(run.depth, np.interp(TIME, clock, depth), atol=1e-15)


def test_a_file_without_rows_is_refused(stored):
    with pytest.raises(InputError, match="number of samples is 0"):
        read(stored({"time_s": TIME[:0], "depth_m": DEPTH[:0], "force_N": FORCE[:0]}))


def test_damaged_files_are_refused_or_read_without_other_errors(tmp_path):
    run = awkward(300)
    complete = write(run, tmp_path / "whole.parquet").read_bytes()
    draw, path, refused = np.random.default_rng(3), tmp_path / "run.parquet", 0
    for number in range(400):
        data = bytearray(complete)
        if number % 4 == 0:
            del data[int(draw.integers(4, len(data))) :]
        else:
            for at in draw.integers(4, len(data), 1 + number % 7):
                data[at] = int(draw.integers(256))
        path.write_bytes(data)
        try:
            back = read(path, baseline=False)
        except InputError as error:
            assert "run.parquet" in str(error)
            refused += 1
        else:  # data with a checksum are never read as other values
            assert len(back) == len(run)
            for name in NAMES:  # damage may hide a column, which is then computed from the others
                assert name == "velocity" or (getattr(back, name) == getattr(run, name)).all()
    assert refused > 250
