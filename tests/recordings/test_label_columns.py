# SPDX-License-Identifier: Apache-2.0
"""Long tables: several recordings one below the other or row by row, which labels distinguish."""

import numpy as np
import pytest
from plain_insertion import insertion, text

from needleforce.errors import InputError
from needleforce.recording import read, read_all

TIME, DEPTH, FORCE = insertion(rate=20.0)
HEADER = "Time (s),Extension (mm),Load (N)"


def rows(factor=1.0, start=0.0):
    return [
        f"{t + start!r},{1e3 * d!r},{factor * f!r}" for t, d, f in zip(TIME.tolist(), DEPTH.tolist(), FORCE.tolist())
    ]


def labelled(labels, headers, start=lambda k: 0.0):
    """A table of one insertion for each of the labels, with forces 1, 2, 3 ... times as large."""
    lines = [f"{each},{row}" for k, each in enumerate(labels) for row in rows(1.0 + k, start(k))]
    return "\n".join([f"{headers},{HEADER}", *lines]) + "\n"


def check(path, names, **options):
    runs = read_all(path, baseline=False, **options)
    assert [run.card.part for run in runs] == names
    for k, run in enumerate(runs):
        np.testing.assert_allclose(run.force, (1.0 + k) * FORCE, rtol=1e-12)
        np.testing.assert_allclose(run.depth, DEPTH, rtol=1e-12, atol=1e-18)


@pytest.mark.parametrize(
    ("labels", "headers", "names"),
    [
        (["A1", "A2", "B3"], "Well", ["A1", "A2", "B3"]),
        ([1, 2, 3], "Specimen", ["Specimen 1", "Specimen 2", "Specimen 3"]),
        ([7, 9], "Test No", ["Test No 7", "Test No 9"]),
        (["A,1", "A,2", "B,1", "B,2"], "Probe,Wiederholung", [f"{s}: Wiederholung {k}" for s in "AB" for k in (1, 2)]),
        (["S1,liver", "S2,liver"], "Sample,Tissue", ["S1", "S2"]),
        (["x,30", "y,30"], "operator,Sample rate", ["x", "y"]),
        (["A", "A", "B"], "Needle", ["A: run 1", "A: run 2", "B"]),
        (["2", "4", "4"], "v_set", ["v_set 2", "v_set 4: run 1", "v_set 4: run 2"]),
    ],
)  # fmt: skip
def test_a_label_names_the_recordings(file, labels, headers, names):
    path = file(labelled(labels, headers))
    check(path, names)
    with pytest.raises(InputError, match=f"number of recordings is {len(names)}.*'{names[0]}'"):
        read(path)
    np.testing.assert_allclose(read(path, part=names[-1], baseline=False).force, len(names) * FORCE, rtol=1e-12)
    np.testing.assert_allclose(read(path, part=2, baseline=False).force, 2.0 * FORCE, rtol=1e-12)


def test_one_clock_for_all_specimens(file):
    """A column named for specimens tells them apart although the time goes on."""
    check(file(labelled(["B3", "B4"], "specimen_id", start=lambda k: 100.0 * k)), ["B3", "B4"])


@pytest.mark.parametrize("column", ["Segment", "Phase", "Comment", "Stage", "Test state"])
def test_the_phases_of_one_recording_are_no_recordings(file, column):
    turn = int(np.argmax(DEPTH))
    words = ["loading"] * turn + ["unloading"] * (len(TIME) - turn)
    path = file("\n".join([f"{column},{HEADER}", *(f"{w},{row}" for w, row in zip(words, rows()))]) + "\n")
    assert len(read(path)) == len(TIME)


def test_a_number_for_each_row_is_no_label(file):
    path = file("\n".join([f"Sample,{HEADER}", *(f"{k},{row}" for k, row in enumerate(rows()))]) + "\n")
    assert len(read(path)) == len(TIME)


def test_labels_of_rows_that_alternate(file):
    """As a table in long form is sorted by time: A, B, A, B."""
    pairs = zip(rows(1.0), rows(2.0))
    lines = [f"{name},{row}" for pair in pairs for name, row in zip("AB", pair)]
    check(file("\n".join([f"needle,{HEADER}", *lines]) + "\n"), ["A", "B"])


def test_a_label_stands_for_the_rows_below_it(file):
    lines = [f"{name if k == 0 else ''},{row}" for j, name in enumerate("AB") for k, row in enumerate(rows(1.0 + j))]
    check(file("\n".join([f"Specimen,{HEADER}", *lines]) + "\n"), ["A", "B"])


def test_no_header_and_no_time(file):
    """Wells one below the other: well, depth, force."""
    lines = [f"{well},{1e3 * d!r},{(1 + k) * f!r}" for k, well in enumerate(("A1", "A2")) for d, f in zip(DEPTH[:200].tolist(), FORCE[:200].tolist())]  # fmt: skip # noqa: E501
    path = file("\n".join(lines) + "\n")
    options = {"columns": {"depth": 2, "force": 3}, "units": {"depth": "mm", "force": "N"}, "test": "indentation"}
    runs = read_all(path, baseline=False, **options)
    assert [run.card.part for run in runs] == ["A1", "A2"]
    np.testing.assert_allclose(runs[1].force, 2.0 * FORCE[:200], rtol=1e-12)


def test_an_error_in_a_labelled_recording_names_its_line(file):
    content = labelled(["A", "B"], "Well").splitlines()
    content[len(TIME) + 5] = content[len(TIME) + 5].rsplit(",", 1)[0] + ",inf"
    with pytest.raises(InputError, match=rf"line {len(TIME) + 6}\b"):
        read(file("\n".join(content)), part="B")


def test_a_long_table_of_a_sheet_with_merged_cells(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    pytest.importorskip("python_calamine")
    book = openpyxl.Workbook()
    book.active.append(["Specimen", "Repeat", "Time [s]", "Weg [mm]", "Kraft [N]"])
    for k, (specimen, repeat) in enumerate([("B3", 1), (None, 2), ("B4", 1)]):
        for j, row in enumerate(zip(TIME.tolist(), (1e3 * DEPTH).tolist(), ((1 + k) * FORCE).tolist())):
            book.active.append([specimen if j == 0 else None, repeat if j == 0 else None, *row])
    book.save(tmp_path / "long.xlsx")
    check(tmp_path / "long.xlsx", ["B3: Repeat 1", "B3: Repeat 2", "B4: Repeat 1"])


def test_a_long_table_of_parquet(tmp_path):
    pyarrow, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    columns = {"sample": np.repeat(["g1", "g2"], len(TIME)), "time_s": np.tile(TIME, 2), "depth_m": np.tile(DEPTH, 2)}
    table = pyarrow.table(columns | {"force_N": np.concatenate([FORCE, 2.0 * FORCE])})
    parquet.write_table(table, tmp_path / "long.parquet")
    check(tmp_path / "long.parquet", ["g1", "g2"])


def test_a_plain_table_has_no_labels(file):
    path = file(text({"Time (s)": TIME, "Specimen": 3.0 + 0 * TIME, "Extension (mm)": 1e3 * DEPTH, "Load (N)": FORCE}))
    assert read(path).card.part == ""


@pytest.mark.parametrize("header", ["Probe_contact", "Sample_number", "Test_running", "Sample_temp", "Needle_valve"])
def test_a_flag_or_a_counter_on_one_clock_is_no_label(file, header):
    lines = [f"{k // 300},{row}" for k, row in enumerate(rows())]
    run = read(file("\n".join([f"{header},{HEADER}", *lines]) + "\n"), baseline=False)
    np.testing.assert_allclose(run.force, FORCE, rtol=1e-12)
