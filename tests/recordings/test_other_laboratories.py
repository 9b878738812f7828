# SPDX-License-Identifier: Apache-2.0
"""Files as instruments of other laboratories wrote them: what is read, against the csv module, openpyxl or nptdms
alone, and what is assumed."""

import csv
import re

import numpy as np
import pytest

from needleforce.bench_tests.tables import read_table
from needleforce.errors import InputError
from needleforce.recording import read, read_all
from needleforce.recording.options import ReadOptions
from needleforce.recording.reader import open_file

NEWTON = 9.80665e-3  # of a gram-force


@pytest.fixture
def labs(recordings):
    return recordings / "other-labs"


def numbers(path, delimiter, *, encoding="utf-8"):
    """Rows of numbers of a text file, by the csv module."""
    found = []
    with path.open(newline="", encoding=encoding) as file:
        for row in csv.reader((line for line in file), delimiter=delimiter):
            try:
                found.append([float(cell) for cell in row])
            except ValueError:
                continue
    width = max(map(len, found))
    return np.array([row for row in found if len(row) == width])


def check(run, rows, factors, quantities):
    """Every row of ``quantities`` against the table in the file's units."""
    assert len(run) == len(rows)
    for quantity, column, factor in zip(quantities, rows.T, factors):
        np.testing.assert_allclose(getattr(run, quantity), factor * column, rtol=1e-12, atol=1e-15)


def sentences(run):
    return [sentence for sentence in run.card.assumptions if not sentence.startswith("velocity is the change")]


def test_every_stalk_of_an_instron(labs):
    paths = sorted((labs / "stalk-puncture-instron").glob("*.csv"))
    assert len(paths) == 21
    for path in paths:
        run = read(path, baseline=False)
        check(run, numbers(path, ","), (1.0, 1e-3, 1.0), ("time", "depth", "force"))
        assert sentences(run) == []


@pytest.mark.parametrize("name, first, last", [
    ("WSR8002_july25_medial.csv", (0.0, 0.0, 1.27243), None),
    ("cyclic-specimen-1.csv", (0.0, 1.25560, 5.16404), None),
])  # fmt: skip
def test_bluehill_with_text_above_and_a_row_of_units(labs, name, first, last):
    path = labs / "bending-bluehill" / name
    run, rows = read(path, baseline=False), numbers(path, ",")
    assert tuple(rows[0]) == first
    check(run, rows, (1.0, 1e-3, 1.0), ("time", "depth", "force"))
    assert sentences(run) == []


@pytest.mark.parametrize("name", ["piuma-x1-y1", "piuma-x2-y1"])
def test_piuma_as_text(labs, name):
    path = labs / "nanoindentation-piuma" / f"{name}.txt"
    run = read(path, test="indentation", baseline=False)
    rows = numbers(path, "\t")
    check(run, rows[:, [0, 2, 1]], (1.0, 1e-9, 1e-6), ("time", "depth", "force"))
    assert sentences(run) == []


@pytest.mark.parametrize("name", ["piuma-x1-y1", "piuma-x2-y1"])
def test_piuma_as_tdms(labs, name):
    """Volts of two channels: the factors are the user's; the time is that of the channels."""
    nptdms = pytest.importorskip("nptdms")
    path = labs / "nanoindentation-piuma" / f"{name}.tdms"
    with pytest.raises(InputError, match=r"Straingauge.*Displacement|'Volts'"):
        read(path)
    options = {"columns": {"force": "Straingauge", "depth": "Displacement"}, "test": "indentation"}
    run = read(path, **options, units={"force": "+2.5 uN", "depth": "1000nm"}, inwards="increasing", baseline=False)
    group = nptdms.TdmsFile.read(path).groups()[0]
    np.testing.assert_allclose(run.force, 2.5e-6 * group["Straingauge"][:], rtol=1e-12)
    np.testing.assert_allclose(run.depth, 1e-6 * group["Displacement"][:], rtol=1e-12)
    step = group["Straingauge"].properties["wf_increment"]
    np.testing.assert_allclose(run.time, step * np.arange(len(run)), rtol=1e-9)


def test_anton_paar(labs):
    path = labs / "cartilage-anton-paar" / "crosslinking_1_head.TXT"
    run = read(path, test="indentation", baseline=False)
    check(run, numbers(path, "\t")[:, :3], (1.0, 1e-6, 1e-6), ("time", "depth", "force"))
    assert len(run) == 48 and sentences(run) == []
    assert read(path, mapping="anton_paar", test="indentation", baseline=False).force.tolist() == run.force.tolist()


@pytest.mark.parametrize("name, rows", [("20250424_PDMS_D5_Test2.csv", 201), ("20250504_PDMS_E4_Test1.csv", 175)])
def test_a_printer_that_indents_without_headers_and_time(labs, name, rows):
    path = labs / "pdms-indentation-asmi" / name
    with pytest.raises(InputError, match=r"time and the force and the depth, the file has no header; inspect shows its "
                                         r".*--column force=NAME --column depth="):  # fmt: skip
        read(path)
    run = read(path, columns={"depth": 2, "force": 3}, units={"depth": "mm"}, test="indentation", baseline=False)
    cells = [line.split(",") for line in path.read_text().split("\n") if line.strip()]
    sign = 1.0 if "D5" in name else -1.0  # the first never touches the specimen: nothing shows its direction
    np.testing.assert_allclose(run.depth, [sign * 1e-3 * float(row[1]) for row in cells], rtol=1e-12)
    np.testing.assert_array_equal(run.force, [float(row[2]) for row in cells])
    assert len(run) == rows and any("no time" in each for each in sentences(run))
    assert any("sign is reversed" in each for each in sentences(run)) == (sign < 0)


def test_mach1(labs):
    path = labs / "tension-mach1" / "mach1-04-a.txt"
    run, rows = read(path, inwards="increasing", units={"force": "+gf"}, baseline=False), numbers(path, "\t")
    check(run, rows, (1.0, 1e-3, NEWTON), ("time", "depth", "force"))
    assert len(run) == 29070 and sentences(run) == []


def test_stress_and_stretch_without_headers(labs):
    for path in (labs / "brain-tissue").glob("*.txt"):
        table, rows = read_table(path), numbers(path, ",")
        assert not table.has_header
        np.testing.assert_array_equal(table.values(0), rows[:, 0])
        np.testing.assert_array_equal(table.values(1), rows[:, 1])


def test_microneedles_in_a_sheet(labs):
    """Against openpyxl alone: every column with numbers is a recording, of the readings below the summary in row 3."""
    openpyxl = pytest.importorskip("openpyxl")
    path = labs / "microneedle-penetration" / "microneedle-data-2.xlsx"
    book = openpyxl.load_workbook(path, data_only=True)
    cells = list(book["RAW DATA"].iter_rows(values_only=True))
    expected = {}
    for column, name in enumerate(cells[1]):
        values = [row[column] for row in cells[3:] if column < len(row) and isinstance(row[column], int | float)]
        if name and values:
            expected[name] = values
    options = {"columns": {"force": "*"}, "units": {"force": "N"}, "step": 5e-6, "speed": 1e-3, "first_row": 4}
    with pytest.raises(InputError, match=r"number of recordings is \d+, .*'RAW DATA: WT1.1-1'.*campaign takes all"):
        read(path, **options)
    run = read(path, part="RAW DATA: WT1.1-1", **options, baseline=False)
    np.testing.assert_array_equal(run.force, expected["WT1.1-1"])
    np.testing.assert_allclose(run.depth, 5e-6 * np.arange(len(run)), rtol=1e-12)
    assert run.card.part == "RAW DATA: WT1.1-1"
    opened = open_file(path, ReadOptions(**options, baseline=False))
    assert len(expected) > 200
    for name, values in expected.items():
        each = opened.read(f"RAW DATA: {name}")[0]
        assert each.card.part == f"RAW DATA: {name}"
        np.testing.assert_array_equal(each.force, values)


def test_a_broken_needle_is_named_by_its_cell(labs):
    path = labs / "microneedle-penetration" / "microneedle-data-2.xlsx"
    with pytest.raises(InputError, match=r"RAW DATA, cell C4.*force \(column 'WT1.1-3'\) is 'Broken'"):
        read(path, part="RAW DATA", columns={"force": "WT1.1-3"}, units={"force": "N"}, step=5e-6, speed=1e-3)


def test_files_of_the_rig_are_read_as_before(recordings):
    paths = sorted((recordings / "needle-insertion-rig").glob("*.csv"))[:20]
    for path in paths:
        try:
            (run,) = read_all(path)
        except InputError as error:
            assert re.search("constant", str(error))
            continue
        assert not any("sign is reversed" in sentence for sentence in run.card.assumptions)
