# SPDX-License-Identifier: Apache-2.0
"""Tables of text as instruments write them: every form has the same values as the plain one."""

import numpy as np
import pytest
from plain_insertion import insertion, text

from needleforce.errors import InputError
from needleforce.recording import read, read_all

TIME, DEPTH, FORCE = insertion(rate=50.0)
COLUMNS = {"Time (s)": TIME, "Extension (mm)": DEPTH * 1e3, "Load (N)": FORCE}
PLAIN = text(COLUMNS)
ROWS = "\n".join(PLAIN.splitlines()[1:]) + "\n"
UNITS = "Time,Extension,Load\n(s),(mm),(N)\n"


def quoted(table):
    return "\n".join(",".join(f'"{cell}"' for cell in line.split(",")) for line in table.splitlines()) + "\n"


def clock(times, date=""):
    """h:m:s of a clock that begins at ten to midnight."""
    seconds = 86400.0 - 600.0 + times
    return [f"{date}{int(s % 86400 // 3600):02d}:{int(s % 3600 // 60):02d}:{s % 60:06.3f}" for s in seconds]


def with_clock(cells):
    lines = [f"{cell},{d!r},{f!r}" for cell, d, f in zip(cells, (DEPTH * 1e3).tolist(), FORCE.tolist())]
    return "Clock time,Extension (mm),Load (N)\n".replace("Clock time", "Time") + "\n".join(lines) + "\n"


FORMS = {
    "preamble": "Specimen 3\nOperator: N. N.\nSpeed,2.0,mm/s\n\n" + PLAIN,
    "preamble with colons and tabs": "Date:\t29/09/2021\tTime:\t17:38:03\nDevice:\tx\n\n" + PLAIN.replace(",", "\t"),
    "row of units": UNITS + ROWS,
    "row of units without brackets": UNITS.replace("(", "").replace(")", "") + ROWS,
    "preamble, row of units, quotes": 'Test : Rate 1,"2.0",mm/s\n\n' + UNITS + quoted(ROWS),
    "blank row below the headers": PLAIN.replace("\n", "\n\n", 1),
    "blank rows at the end": PLAIN + "\n\n\n\n",
    "rows without values at the end": PLAIN + ",,\n" * 4,
    "cells of other rows at the end": PLAIN + "\nEnd of test\nRemarks: none\n",
    "comments below": PLAIN + "# done\n",
    "a delimiter at the end of every row": "\n".join(line + "," for line in PLAIN.splitlines()),
    "a delimiter at the end of the headers": PLAIN.replace("\n", ",\n", 1),
    "units after a comma": "Time, s\tExtension, mm\tLoad, N\n" + ROWS.replace(",", "\t"),
    "decimal comma": text(COLUMNS, ";", ","),
    "decimal comma, blanks": "Zeit_s Weg_mm Kraft_N\n" + text(COLUMNS, " ", ",").split("\n", 1)[1],
    "three kinds of line end": PLAIN.replace("\n", "\r\r\n"),
    "old line ends": PLAIN.replace("\n", "\r"),
    "numbers with D": PLAIN.replace("e-", "D-"),
}  # fmt: skip


@pytest.mark.parametrize("form", FORMS)
def test_every_form_gives_the_same_values(file, form):
    run = read(file(FORMS[form]))
    np.testing.assert_allclose(run.time, TIME, rtol=1e-15)
    np.testing.assert_allclose(run.depth, DEPTH, rtol=1e-14, atol=1e-18)
    np.testing.assert_allclose(run.force, FORCE, rtol=1e-15)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "latin-1"])
def test_every_encoding(file, encoding):
    table = PLAIN.replace("Extension (mm)", "déplacement (µm)").replace("Load (N)", "effort (N)")
    run = read(file(f"Prüfung Nr. 5\n\n{table}".encode(encoding)))
    np.testing.assert_allclose(run.depth, DEPTH * 1e-3, rtol=1e-14, atol=1e-18)
    np.testing.assert_array_equal(run.force, FORCE)


@pytest.mark.parametrize(
    "words",
    [
        "Zeit,Weg,Kraft", "Prüfzeit,Standardweg,Standardkraft", "Temps,Déplacement,Effort", "temps,Enfoncement,Force",
        "Tiempo,Desplazamiento,Fuerza", "Tempo,Spostamento,Forza", "Time,Pd,Fn", "t,z,F", "Time,Crosshead,Load",
        "Elapsed Time,Indentation,Load", "Time,Position (z),Fz", "Time,Distance,Force", "Time,Travel,Compressive load",
        "Test time,Axial Displacement,Axial Force", "Time,Tip position,Load cell 5 kN", "Zeit,Traversenweg,Prüfkraft",
    ],
)  # fmt: skip
def test_headers_in_several_languages(file, words):
    units = [f"{word} [{unit}]" for word, unit in zip(words.split(","), ("s", "mm", "N"))]
    run = read(file(",".join(units) + "\n" + ROWS))
    np.testing.assert_allclose(run.depth, DEPTH, rtol=1e-14, atol=1e-18)
    np.testing.assert_array_equal(run.force, FORCE)


@pytest.mark.parametrize("word", ["Force rate", "Target force", "Load speed", "Stress", "Energy of load"])
def test_a_header_of_another_quantity_is_no_force(file, word):
    with pytest.raises(InputError, match="no column holds the force"):
        read(file(PLAIN.replace("Load (N)", word)))


def test_a_clock_that_passes_midnight(file):
    run = read(file(with_clock(clock(TIME))))
    np.testing.assert_allclose(run.time, TIME, atol=1e-9)
    np.testing.assert_allclose(run.depth, DEPTH, rtol=1e-14, atol=1e-18)


@pytest.mark.parametrize("pattern", ["%Y-%m-%dT%H:%M:%S.%f", "%Y-%m-%d %H:%M:%S.%f", "%d.%m.%Y %H:%M:%S.%f"])
def test_times_of_a_calendar(file, pattern):
    import datetime

    start = datetime.datetime(2021, 9, 30, 23, 59, 55)
    cells = [(start + datetime.timedelta(seconds=float(t))).strftime(pattern) for t in TIME]
    np.testing.assert_allclose(read(file(with_clock(cells))).time, TIME, atol=1e-6)


def test_a_table_without_headers_is_read_by_position(file):
    path = file(ROWS)
    with pytest.raises(
        InputError, match=r"time and the force and the depth, the file has no header; inspect shows its"
    ):
        read(path)
    run = read(path, columns={"time": 1, "depth": 2, "force": "3"}, units={"depth": "mm", "time": "s", "force": "N"})
    np.testing.assert_allclose(run.depth, DEPTH, rtol=1e-14, atol=1e-18)


def test_headers_that_occur_twice_are_read_by_position(file):
    columns = [line.split(",") for line in PLAIN.splitlines()]
    path = file("\n".join(",".join([*row, row[2]]) for row in columns))
    with pytest.raises(InputError, match=r"'Load .N.' is present 2 times.*--column force=3"):
        read(path)
    np.testing.assert_array_equal(read(path, columns={"force": 4}).force, FORCE)


def test_several_tables_one_below_the_other(file):
    block = "<INFO>\nVelocity, mm/s:\t0.1\n<DATA>\n" + PLAIN.replace(",", "\t").replace("Load (N)", "Fz, gf")
    second = block.replace("<INFO>", "<INFO>\nRepeat:\t2", 1)
    path = file(block + "<END DATA>\n" + second + "<END DATA>\n")
    with pytest.raises(InputError, match=r"number of recordings is 2, the file has 'table 1', 'table 2'.*--part"):
        read(path)
    for run in read_all(path):
        np.testing.assert_allclose(run.force, FORCE * 9.80665e-3, rtol=1e-14)
    assert [run.card.part for run in read_all(path)] == ["table 1", "table 2"]


def test_settings_above_a_table_are_no_table(file):
    settings = "Step,Rate,Limit\n1,0.5,2\n2,0.1,3\n\n"
    np.testing.assert_array_equal(read(file(settings + PLAIN)).force, FORCE)


def test_runs_whose_time_starts_again(file):
    lines = PLAIN.splitlines()
    path = file("\n".join([*lines, *lines[1:], *lines[1:]]))
    with pytest.raises(InputError, match="number of recordings is 3, the file has 'run 1', 'run 2', 'run 3'"):
        read(path)
    np.testing.assert_array_equal(read(path, part="run 2").force, FORCE)
    np.testing.assert_array_equal(read(path, part=3).time, TIME)


def test_groups_of_columns_side_by_side(file):
    lines = PLAIN.splitlines()
    twice = "\n".join(f"{line},{line}" for line in lines)
    for run in read_all(file(twice)):
        np.testing.assert_array_equal(run.force, FORCE)
    numbered = "Time 1,Ext 1,Load 1,Time 2,Ext 2,Load 2\ns,mm,N,s,mm,N\n" + twice.split("\n", 1)[1]
    runs = read_all(file(numbered))
    assert [run.card.part for run in runs] == ["1", "2"]
    np.testing.assert_allclose(runs[1].depth, DEPTH, rtol=1e-14, atol=1e-18)


def test_a_pattern_of_headers_is_a_recording_each(file):
    columns = {"time_s": TIME, "depth_mm": 1e3 * DEPTH} | {f"cell {k}": (1 + k) * FORCE for k in range(3)}
    path = file(text(columns))
    runs = read_all(path, columns={"force": "cell *"}, units={"force": "N"})
    assert [run.card.part for run in runs] == ["0", "1", "2"]
    for k, run in enumerate(runs):
        np.testing.assert_allclose(run.force, (1 + k) * FORCE, rtol=1e-15)


def test_rows_above_the_samples_are_left_out_on_request(file):
    lines = PLAIN.splitlines()
    path = file("\n".join([lines[0], "0,0,99", *lines[1:]]))
    np.testing.assert_array_equal(read(path, first_row=3).force, FORCE)


@pytest.mark.parametrize("word", ["#N/A", "N/A", "--", "NaN", "null", "#DIV/0!"])
def test_words_for_no_value(file, word):
    lines = PLAIN.splitlines()
    cells = lines[400].split(",")
    lines[400] = ",".join([*cells[:2], word])
    run = read(file("\n".join(lines)))
    assert len(run) == len(TIME) - 1
    assert any("line 401" in note.message for note in run.notes if note.kind == "missing")


@pytest.mark.parametrize("word", ["OVER", "Broken", "overload"])
def test_text_in_a_column_of_numbers_is_named(file, word):
    lines = PLAIN.splitlines()
    lines[400] = ",".join([*lines[400].split(",")[:2], word])
    with pytest.raises(InputError, match=rf"line 401: force \(column 'Load \(N\)'\) is '{word}', a number is needed"):
        read(file("\n".join(lines)))


SUMMARIES = {
    "labels in place of a time": "Mean,1.5,0.3\nSD,0.1,0.2\n",
    "labels after a blank row": "\nMaximum,20,0.8\n",
    "a peak alone": "\n\nPeak Load,148.57,N\n",
}


@pytest.mark.parametrize("name", SUMMARIES)
def test_a_summary_below_the_table_is_no_sample(file, name):
    run = read(file(PLAIN + SUMMARIES[name]))
    np.testing.assert_array_equal(run.force, FORCE)
    (note,) = [note for note in run.notes if note.kind == "left_out"]
    assert SUMMARIES[name].split()[0].split(",")[0] in note.message


def test_a_summary_with_another_name_in_place_of_the_specimen(file):
    lines = PLAIN.splitlines()
    named = ["Specimen," + lines[0], *("A," + line for line in lines[1:]), "", "Mean,1,2,3", "SD,4,5,6"]
    run = read(file("\n".join(named)))
    np.testing.assert_array_equal(run.force, FORCE)
    assert any("2 rows below the table" in note.message for note in run.notes)


def test_rows_after_a_blank_one_are_samples(file):
    lines = PLAIN.splitlines()
    np.testing.assert_array_equal(read(file("\n".join([*lines[:-5], "", *lines[-5:]]))).force, FORCE)


@pytest.mark.parametrize("other", ["°C", "V", "rpm", "Cycles"])
def test_a_row_of_units_with_one_that_is_unknown(file, other):
    rows = "\n".join(f"{line},25" for line in ROWS.splitlines())
    run = read(file(f"Time,Position,Force,Extra\ns,mm,mN,{other}\n{rows}\n"))
    np.testing.assert_allclose(run.force, 1e-3 * FORCE, rtol=1e-14)
    np.testing.assert_allclose(run.depth, DEPTH, rtol=1e-14, atol=1e-18)


def test_a_row_of_units_that_begins_with_a_number_sign(file):
    rows = "\n".join(f"{k},{line}" for k, line in enumerate(ROWS.splitlines(), 1))
    run = read(file(f"Reading,Time,Position,Load\n#,s,mm,lbF\n{rows}\n"))
    np.testing.assert_allclose(run.force, 4.4482216152605 * FORCE, rtol=1e-14)


def test_groups_of_columns_with_headers_of_any_language(file):
    lines = [f"{line},{line},{line}" for line in PLAIN.splitlines()]
    lines[0] = ",".join(["時間", "ストローク", "試験力"] * 3)
    path = file("\n".join(lines))
    options = {"columns": {"time": 1, "depth": 2, "force": 3}, "units": {"depth": "mm", "force": "N"}}
    with pytest.raises(InputError, match=r"number of recordings is 3, the file has 'columns 1 to 3'"):
        read(path, **options)
    for run in read_all(path, **options):
        np.testing.assert_array_equal(run.force, FORCE)


def test_a_withdrawal_alone_keeps_its_signs(file):
    """Out of tissue at constant speed, with the sign of depth reversed: nothing shows an insertion."""
    depth = np.linspace(20.0, 12.0, 400)  # mm, measured against the direction of insertion
    force = np.where(depth > 19.5, 0.3 - 1.2 * (20.0 - depth), -0.3 * (depth - 11.0) / 8.5)
    table = text({"Time (s)": 0.01 * np.arange(400), "Depth (mm)": -depth, "Force (N)": force})
    run = read(file(table), baseline=False)
    np.testing.assert_allclose(run.force, force)


def test_an_insertion_alone_with_a_tare(file):
    depth, force = DEPTH[:625], FORCE[:625] - 0.7
    table = text({"Time (s)": TIME[:625], "Depth (mm)": -1e3 * depth, "Force (N)": force})
    run = read(file(table), baseline=False)
    np.testing.assert_allclose(run.depth, depth, rtol=1e-14, atol=1e-18)
    np.testing.assert_array_equal(run.force, force)


def test_a_row_of_devices_with_fewer_cells_is_no_header(file):
    """As where the columns of a device have its name above them, and that of the time has none."""
    rows = "\n".join(f"{line},21.5" for line in ROWS.splitlines())
    names = "Zeit,Weg,Kraft,Feuchte\ns,mm,N,°C\namplifier CH 1,amplifier CH 2,amplifier CH 3\n"
    run = read(file(names + rows + "\n"), baseline=False)
    np.testing.assert_array_equal(run.time, TIME)
    np.testing.assert_allclose(run.force, FORCE, rtol=1e-14)


def test_results_and_headings_between_tables_are_no_samples(file):
    """With numbers in them, as a peak below a table and the settings above the next one."""
    block = f"Run,1,2\n{UNITS}{ROWS}Peak,,1.5\nAverage,0.7,0.2\n"
    found = read_all(file(f"Test,7\n{block}Data acquisition:,2,9\n{block}"), baseline=False)
    assert len(found) == 2
    for run in found:
        np.testing.assert_array_equal(run.time, TIME)
        np.testing.assert_allclose(run.force, FORCE, rtol=1e-14)


def test_raw_volts_next_to_the_data_are_no_recording(file):
    volts = text(COLUMNS | {"Extension (V)": DEPTH, "Load (V)": FORCE})
    np.testing.assert_allclose(read(file(volts)).force, FORCE, rtol=1e-14)


@pytest.mark.parametrize(
    ("header", "delimiter"),
    [
        ("Sample #,Time (s),Position #1 (mm),Load #1 [kN]", ","),
        ("Sample #;Time #1 (s);Position #1 (mm);Load #2 [kN]", ";"),
        ("#,Time (s),Position #1 (mm),Load #1 [kN]", ","),
    ],
)
def test_a_number_sign_in_a_header_is_no_comment(file, header, delimiter):
    rows = [f"{k},{t:.2f},{1e3 * z:.5f},{1e-3 * f:.8f}" for k, (t, z, f) in enumerate(zip(TIME, DEPTH, FORCE))]
    rows[7] += " # looked at"
    table = "\n".join([header, *(row.replace(",", delimiter) for row in rows)]) + "\n"
    run = read(file(table))
    np.testing.assert_allclose(run.force, FORCE, atol=1e-5)
    np.testing.assert_allclose(run.depth, DEPTH, atol=1e-8)


def test_a_number_sign_in_a_cell_of_text_is_no_comment(file):
    rows = [f"needle #3,{t:.2f},{1e3 * z:.5f},{f:.6f}" for t, z, f in zip(TIME, DEPTH, FORCE)]
    run = read(file("Needle,Time (s),Depth (mm),Force (N)\n" + "\n".join(rows) + "\n"))
    np.testing.assert_allclose(run.force, FORCE, atol=1e-6)


@pytest.mark.parametrize("sep, quote", [(" ", '"'), (" ", ""), ("\t", '"'), (",", '"')])
def test_row_numbers_without_a_header(file, sep, quote):
    """As R writes a data frame: the header has one cell less than the rows."""
    header = sep.join(f"{quote}{name}{quote}" for name in ("time_s", "depth_mm", "force_N"))
    rows = [sep.join([f"{quote}{k}{quote}", f"{t:.2f}", f"{1e3 * z:.5f}", f"{f:.6f}"])
            for k, (t, z, f) in enumerate(zip(TIME, DEPTH, FORCE), 1)]  # fmt: skip
    run = read(file("\n".join([header, *rows]) + "\n"))
    np.testing.assert_allclose(run.depth, DEPTH, atol=1e-8)
    np.testing.assert_allclose(run.force, FORCE, atol=1e-6)


@pytest.mark.parametrize(
    ("header", "row"),
    [
        ("Time [ms],Depth [um],Force [N]", "{k},{z:.0f},0,{f:03.0f}"),  # commas between cells and in numbers
        ("depth_mm,force_N", "{t:.3f},{z:.3f},{f:.3f}"),  # a time without a header
    ],
)
def test_rows_with_one_cell_more_than_the_header_are_not_shifted(file, header, row):
    rows = [row.format(k=k, t=7.0 + t, z=1e3 * z, f=1e3 * f) for k, (t, z, f) in enumerate(zip(TIME, DEPTH, FORCE), 1)]
    with pytest.raises(InputError, match="the file has no header"):
        read(file("\n".join([header, *rows]) + "\n"), rate=50.0)


def test_a_comment_of_as_many_words_as_columns_is_no_header(file):
    rows = [f"{t:.2f} {1e3 * z:.4f} {f:.6f}" for t, z, f in zip(TIME, DEPTH, FORCE)]
    for comment in ("# force vs position", "# Column 3: Force"):
        with pytest.raises(InputError, match="the file has no header"):
            read(file(f"{comment}\n" + "\n".join(rows) + "\n"))
    run = read(file("# time depth force\n# s mm N\n" + "\n".join(rows) + "\n"))
    np.testing.assert_allclose(run.force, FORCE, atol=1e-6)
