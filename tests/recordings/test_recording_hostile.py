# SPDX-License-Identifier: Apache-2.0
"""Malicious cards, cells and options are refused with a message and their line."""

import hashlib

import numpy as np
import pytest
from plain_insertion import insertion, text

from needleforce.errors import InputError
from needleforce.recording import read

TIME, DEPTH, FORCE = insertion(rate=50.0)
TABLE = text({"time_s": TIME, "depth_m": DEPTH, "force_N": FORCE})


@pytest.mark.parametrize("length", ["nan", "inf", "1e400", "2.7", "0", "-5", "1e300", "many", "9" * 5000])
def test_a_filter_length_in_the_card_is_a_whole_number(file, length):
    with pytest.raises(InputError, match=r"run.csv, line 3: filter_length in the file's card is .* needed\. Correct"):
        read(file(f"# needle: a\n\n# filter_length: {length}\n{TABLE}"))


@pytest.mark.parametrize("length", ["50", "50.0", "5e1"])
def test_an_integer_filter_length_may_have_any_notation(file, length):
    assert read(file(f"# filter_length: {length}\n{TABLE}")).card.filter_length == 50


@pytest.mark.parametrize("count", ["²", "1" * 5000, "٣"])
def test_a_note_in_the_card_has_a_plain_count(file, count):
    with pytest.raises(InputError, match=r"run.csv, line 2: note in the file's card is .*, its second word is a count"):
        read(file(f"# note: gap 1 one\n# note: gap {count} gaps\n{TABLE}"))


@pytest.mark.parametrize("start", ["nan", "inf"])
def test_a_start_depth_in_the_card_is_finite(file, start):
    table = text({"time_s": TIME, "velocity_m_s": np.gradient(DEPTH, TIME), "force_N": FORCE})
    with pytest.raises(InputError, match=r"line 1: start_depth_m in the file's card is .*, a number is needed"):
        read(file(f"# start_depth_m: {start}\n{table}"))


@pytest.mark.parametrize("name", ["/", "//", "..", "a\0b", r"a\x00b"])
def test_the_motion_in_the_card_is_the_name_of_a_file(file, name):
    with pytest.raises(InputError, match=r"file is binary|line 1: motion in the file's card is .*, the name of a file"):
        read(file(f"# motion: {name}\n{TABLE}"))


def test_a_line_too_long_for_a_table_is_named(file):
    long = "x" * 65536
    for content, line in (
        (TABLE.replace("depth_m", f"depth_m,{long}", 1), 1),
        (TABLE + f"9.9,{long},0\n1,0,0\n", None),
        (f'time_s,depth_m,force_N\n0,"{"1," * 70000}",0\n1,0,0\n', 2),
        (f"# {long}\n1,2,3\n", 1),
    ):
        number = line or content.count("\n") - 1
        with pytest.raises(InputError, match=f"run.csv, line {number}: characters in the line is over 65536"):
            read(file(content))


def test_a_thousand_columns_are_read_and_more_are_refused(file):
    head, *lines = TABLE.splitlines()

    def wide(many):
        return "\n".join([head + "".join(f",c{i}" for i in range(many)), *(line + ",0" * many for line in lines[:3])])

    assert len(read(file(wide(1000).replace("-0.005", "-0.006", 1)))) == 3
    with pytest.raises(InputError, match="number of columns is 1203, at most 1024"):
        read(file(wide(1200)))


@pytest.mark.parametrize("length", [2.5, "x", -1, 0, True, 10**9, np.nan])
def test_the_filter_length_given_is_a_whole_number(file, length):
    with pytest.raises(InputError, match=r"filter_length is .*, a whole number of samples from 1"):
        read(file(TABLE), filter_length=length)
    assert read(file(TABLE), filter_length=np.int64(50)).card.filter_length == 50


@pytest.mark.parametrize(
    ("header", "expected"),
    [
        ("time_s,depth_m,force_N", None),
        ("time_s,depth_nm,force_N", "a travel of 2.5e-11 m"),
        ("time_ms,depth_m,force_N", "a rate of 5e+04 Hz and a speed of 2 m/s"),
        ("time_min,depth_m,force_N", "a rate of 0.833 Hz"),
    ],
)
def test_implausible_stated_units_are_noted(file, header, expected):
    """25 mm at 2 mm/s and 50 Hz, under headers with other units."""
    notes = [note.message for note in read(file(TABLE.replace("time_s,depth_m,force_N", header))).notes]
    found = [message for message in notes if message.startswith("the stated units give")]
    assert not found if expected is None else expected in found[0]


def test_millimetres_under_a_header_in_metres(file):
    """25 mm read as 25 m, at 2 m/s: noted for the header's unit and for a given one."""
    rows = text({"time_s": TIME, "depth_m": 1e3 * DEPTH, "force_N": FORCE})
    (note,) = [note for note in read(file(rows)).notes if note.kind == "implausible"]
    assert "a travel of 25 m and a speed of 2 m/s" in note.message and "--unit depth=mm" in note.message
    given = read(file(rows), units={"depth": "mm"})
    assert not [note for note in given.notes if note.kind == "implausible"]
    fast = text({"time_s": TIME, "depth_m": DEPTH, "velocity_m_s": 1e3 * np.gradient(DEPTH, TIME), "force_N": FORCE})
    assert "a speed of 2 m/s" in next(note.message for note in read(file(fast)).notes if note.kind == "implausible")


def test_the_time_of_a_separate_force_file_needs_no_unit(file):
    motion = file(text({"time_s": TIME, "depth_m": DEPTH}), "motion.csv")
    run = read(file(text({"time": TIME, "force_N": FORCE})), motion=motion)
    np.testing.assert_array_equal(run.depth, DEPTH)


@pytest.mark.parametrize("rows", [3, 200_000])
def test_the_hash_covers_the_complete_file(file, rows):
    content = "time_s,depth_m,force_N\n" + "".join(f"{i / 1000},{i * 1e-6},0.0\n" for i in range(rows))
    for text_ in (content, content + "\n\n# the end\n"):
        assert read(file(text_)).card.sha256 == hashlib.sha256(text_.encode()).hexdigest()


def test_arrays_are_writable_and_independent(file):
    run = read(file(TABLE))
    run.force[:] += 1.0
    run.depth[0] = run.time[0] = 7.0
    assert run.velocity.flags.writeable and run.force[0] == FORCE[0] + 1.0
