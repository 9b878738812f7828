# SPDX-License-Identifier: Apache-2.0
"""Rows of plain numbers, against Python's own conversion of each cell."""

import hashlib
import random
import struct

import numpy as np
import pytest

from needleforce import core
from needleforce.errors import InputError
from needleforce.recording import read
from needleforce.recording.formats.text import tables

NOTATIONS = ("{!r}", "{:.6g}", "{:+.3f}", "{:e}", "{:.17E}", "{:.0f}", "{:#.0f}")
WORDS = ["NaN", "--", "n/a"]


def rows_of(text, *, delimiter=",", decimal=".", used=(True, True, True)):
    content = text.encode()
    found = core.number_rows(content, 0, len(content), delimiter, decimal, used=list(used), words=WORDS)
    return None if found is None else found[0]


def any_double(rng):
    value = struct.unpack("d", rng.randbytes(8))[0]
    return value if np.isfinite(value) and abs(value) > 1e-300 else rng.gauss(0.0, 1.0)


@pytest.mark.parametrize("delimiter", [",", ";", "\t", "|", ""])
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_every_number_is_the_one_that_python_reads(delimiter, end):
    rng = random.Random(0)
    cells = [[rng.choice(NOTATIONS).format(any_double(rng)) for _ in range(3)] for _ in range(2000)]
    text = end.join((delimiter or rng.choice(("\t", "  "))).join(row) for row in cells)
    assert np.array_equal(rows_of(text, delimiter=delimiter), np.array(cells, float).T)


def test_a_decimal_comma_is_a_point_and_a_point_is_no_part_of_the_number():
    rng = random.Random(1)
    cells = [[f"{rng.gauss(0.0, 1e3):.{rng.randint(0, 18)}g}" for _ in range(3)] for _ in range(500)]
    text = "\n".join(";".join(row) for row in cells).replace(".", ",")
    assert np.array_equal(rows_of(text, delimiter=";", decimal=","), np.array(cells, float).T)
    assert rows_of("1,5;2;1.500\n", delimiter=";", decimal=",") is None


def test_absent_cells_and_words_for_no_value_are_nan():
    found = rows_of('1,,3\n--,2, n/a \n\n  \n4,"5"\n')
    assert np.array_equal(found, [[1, np.nan, 4], [np.nan, 2, 5], [3, np.nan, np.nan]], equal_nan=True)


def test_texts_are_passed_over_where_they_are_expected():
    found = rows_of("1,gel A,3\n2,,4\n3,#7,nan\n", used=(True, False, True))
    assert np.array_equal(found, [[1, 2, 3], [3, 4, np.nan]], equal_nan=True)


@pytest.mark.parametrize(
    "line", ["1,2,3,4", "1,2,3,", "1,x,3", "1,2,3 # note", "1,0x10,3", "1,1e999,3", "1,2 2,3", '1,"2,3', "1,+-2,3",
             "1,1_000,3", "1,nano,3", "1,.,3", "1,2.5.1,3", "1,\u22122,3", "1,2\0,3"]
)  # fmt: skip
def test_a_line_that_is_no_row_of_numbers_is_not_guessed(line):
    assert rows_of(f"1,2,3\n{line}\n4,5,6\n") is None


@pytest.mark.parametrize("begin, end", [(5, 4), (0, 99)])
def test_bytes_outside_the_text_are_refused(begin, end):
    with pytest.raises(ValueError, match="bytes in order"):
        core.number_rows(b"1,2,3\n", begin, end, ",", ".", used=[True], words=[])


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "latin-1"])
@pytest.mark.parametrize("comment", ["", "# paused\n"])
def test_a_file_has_the_same_values_whichever_way_it_is_read(tmp_path, encoding, comment):
    """Large enough for two threads; with a comment between its rows it is read by pandas."""
    rng = np.random.default_rng(2)
    values = np.column_stack([np.arange(20_000) / 1000.0, rng.normal(size=(20_000, 2))])
    lines = [",".join(map(repr, row)) + "\n" for row in values.tolist()]
    path = tmp_path / "run.csv"
    path.write_bytes(
        ("time_s,depth_mm,force_N\n" + "".join([*lines[:15_000], comment, *lines[15_000:]])).encode(encoding)
    )
    table = tables(path)[0]
    assert np.array_equal(np.column_stack([table.numbers(k) for k in range(3)]), values)
    assert table.digest() == hashlib.sha256(path.read_bytes()).hexdigest()


ROWS = [f"{0.01 * k:.3f},{0.02 * k:.4f},{0.001 * k * k:.6f},21.5" for k in range(300)]
FOUR = "time_s,depth_mm,force_N,temperature_C\n"


def test_a_row_that_lacks_a_cell_does_not_shift_the_others(tmp_path):
    """Without the force, what follows it would be read as the force."""
    (tmp_path / "run.csv").write_text(FOUR + "\n".join([*ROWS[:100], "1.000,2.0000,21.5", *ROWS[101:]]) + "\n")
    with pytest.raises(InputError, match=r"line 102: number of cells is 3, the header has 4"):
        read(tmp_path / "run.csv")


def test_a_truncated_last_row_is_left_out_although_it_has_all_that_is_read(tmp_path):
    (tmp_path / "run.csv").write_text(FOUR + "\n".join([*ROWS, "3.000,6.0000,9"]))
    run = read(tmp_path / "run.csv")
    assert len(run) == 300 and any(note.kind == "cut_off" for note in run.notes)


def test_columns_that_end_before_others_are_read(tmp_path):
    (tmp_path / "run.csv").write_text(FOUR + "\n".join([*ROWS[:200], *(row[:-5] for row in ROWS[200:])]) + "\n")
    assert len(read(tmp_path / "run.csv")) == 300


@pytest.mark.parametrize("comment", [[], ["# mark"]])
@pytest.mark.parametrize("sign", [",", "."])
def test_a_sign_that_may_be_one_of_thousands_is_not_guessed(tmp_path, sign, comment):
    depths = [f"{k:,d}".replace(",", sign) for k in range(0, 1500, 5)]
    rows = [f"{10 * k};{depth};{2 * k}" for k, depth in enumerate(depths)]
    rows = [*rows[:290], *comment, *rows[290:]]
    (tmp_path / "run.csv").write_text("Time (ms);Depth (um);Force (mN)\n" + "\n".join(rows) + "\n")
    with pytest.raises(InputError, match=r"999 and 1.000|number|unit"):
        read(tmp_path / "run.csv")
