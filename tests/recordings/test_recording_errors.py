# SPDX-License-Identifier: Apache-2.0
"""Every error states quantity, value, limit, place and next step."""

import os

import numpy as np
import pytest
from plain_insertion import insertion, text

from needleforce.errors import InputError
from needleforce.recording import read

TIME, DEPTH, FORCE = insertion(rate=50.0)
COLUMNS = {"time_s": TIME, "depth_m": DEPTH, "force_N": FORCE}
GOOD = text(COLUMNS).splitlines()  # line 1 is the header


def changed(line, content):
    """The good file with one line changed; the first line is number 1."""
    return "\n".join([*GOOD[: line - 1], content, *GOOD[line:]]) + "\n"


def with_values(**values):
    return text(COLUMNS | values)


@pytest.mark.parametrize(
    "content, message",
    [
        ("", "run.csv: file is empty"),
        ("\n\n# nothing\n", "run.csv: file is empty"),
        (GOOD[0] + "\n", "run.csv: number of samples is 0, the file ends after its header"),
        (GOOD[0] + "\n" + GOOD[1] + "\n", "number of samples is 1, at least 2 are needed"),
        (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "run.csv: file is binary.*Export the recording as CSV"),
        (GOOD[0].encode("utf-16"), "run.csv: number of samples is 0, the file ends after its header"),
        ("\n".join(GOOD[1:]), "no column holds the time and the force and the depth, the file has no header; inspect "
                              "shows its columns.*or number.*--column time=1 --column force=3 --column depth=2"),
        ("force_N\n1\n2\n", "no column holds the time and the depth, the columns are 'force_N'.*--rate-hz.*--step-um"),
        (changed(7, "0.1,abc,0.0"), r"run.csv, line 7: depth \(column 'depth_m'\) is 'abc', a number is needed"),
        (changed(7, "0.1,-0.005"), "run.csv, line 7: number of cells is 2, the header has 3.*Correct or remove"),
        (changed(7, "0.1,-0.005,0.0,5"), "run.csv, line 7: number of cells is 4, the header has 3"),
        (changed(7, "0,1,-0,005,0,0"), "line 7: number of cells is 6.*With decimal commas"),
        (changed(7, "0.1,-0.005,inf"), r"line 7: force \(column 'force_N'\) is infinite, in 1 rows"),
        (changed(4, "-3.0,-0.005,0"), "line 4: time is -3 after 0.02, it must not decrease.*1 times"),
        (with_values(depth_m=0 * DEPTH + 2), r"depth \(column 'depth_m'\) is constant at 2, the needle must move"),
        (text({"time_s": TIME, "depth_m": DEPTH}), "no column holds the force.*'depth_m'.*--column force=NAME"),
        (text({"time_s": TIME, "stage [mm]": DEPTH}), "no column holds the force.*--column force=NAME"),
        (with_values().replace("force_N", "force [kPa]"), "'kPa', known.*kPa is a unit of stress: choose the column"),
        (text({"time_s": TIME, "fz": FORCE}), "no column holds the depth.*--column depth=NAME, or .*--motion FILE"),
        (with_values(fz=FORCE), "force is ambiguous, 'force_N' and 'fz' match.*--column force=force_N"),
        (with_values().replace("depth_m", "force_N", 1), "column 'force_N' is present 2 times, each used header must"),
        (text({"time_s": 0 * TIME, "depth_m": DEPTH, "force_N": FORCE}), "number of samples is 1, at least 2"),
        (text({"time_s": TIME, "speed_m_s": DEPTH, "force_N": FORCE}), "depth at the first sample is unknown.*start_d"),
        ("# start_depth_m: deep\n" + text({"time_s": TIME, "velocity_m_s": DEPTH, "force_N": FORCE}),
         "start_depth_m in the file's card is 'deep', a number is needed"),
    ],
)  # fmt: skip
def test_message(file, content, message):
    with pytest.raises(InputError, match=message):
        read(file(content))


def test_too_many_missing_values_are_refused_with_the_first_line(file):
    force = np.where(np.arange(len(FORCE)) % 50 == 20, np.nan, FORCE)
    with pytest.raises(InputError, match=r"line 22: force.* is missing or not a number, 25 of 1250 rows, at most 1 %"):
        read(file(with_values(force_N=force)))


def test_few_missing_values_are_left_out_with_a_note(file):
    run = read(file(changed(7, "0.1,-0.005,")))
    assert len(run) == len(TIME) - 1
    (note,) = [note for note in run.notes if note.kind == "missing"]
    assert note.count == 1 and "line 7" in note.message


def test_a_truncated_last_line_is_left_out_with_a_note(file):
    run = read(file("\n".join([*GOOD[:-1], "9.9,0.01"])))
    assert len(run) == len(TIME) - 1
    assert "cut_off" in [note.kind for note in run.notes]


def test_an_axis_with_missing_values_is_left_out_with_a_note(file):
    run = read(file(with_values(fx_N=np.where(TIME > 1.0, np.nan, 0.0))))
    assert len(run) == len(TIME) and "fx" not in run.axes
    assert any(note.kind == "left_out" and "fx has" in note.message for note in run.notes)


def test_lines_are_counted_with_comments_and_left_out_rows(file):
    content = "# above\n" + changed(5, "0.06,,").replace(GOOD[8], "0.01,0,0")
    with pytest.raises(InputError, match=r"line 10: time is 0.01 after 0.12"):
        read(file(content))


def test_surplus_cells_are_found_among_unused_columns(file):
    lines = [line + ",a,b" for line in GOOD]
    lines[6] += ",c"
    with pytest.raises(InputError, match="line 7: number of cells is 6, the header has 5"):
        read(file("\n".join(lines)))


def test_missing_files_and_folders(tmp_path):
    with pytest.raises(InputError, match=r"none.csv: file is missing.*Check the name"):
        read(tmp_path / "none.csv")
    with pytest.raises(InputError, match=r"file is a folder.*Name a file"):
        read(tmp_path)


def test_unknown_names_are_refused(file):
    path = file(text(COLUMNS))
    with pytest.raises(InputError, match="column for the force is 'fq', the columns are 'time_s'"):
        read(path, columns={"force": "fq"})
    with pytest.raises(InputError, match=r"--column 'force=DMS_Kraft \[N\]'"):
        read(file("Zeit [s];Traverse [mm];DMS_Kraft [N]\n0;0;0\n1;1;2\n"), columns={"force": "Kraft"})
    with pytest.raises(InputError, match="quantity is 'strength', known are time, depth"):
        read(path, columns={"strength": "force_N"})
    with pytest.raises(InputError, match="quantity is 'strength'"):
        read(path, units={"strength": "N"})
    with pytest.raises(InputError, match="inwards is 'down', known are increasing and decreasing"):
        read(path, inwards="down")


def test_a_depth_that_decreases_inwards_is_reversed_on_request(file):
    run = read(file(with_values(depth_m=-DEPTH)), inwards="decreasing")
    np.testing.assert_array_equal(run.depth, DEPTH)
    assert run.velocity[100] == pytest.approx(2e-3)


def test_a_withdrawal_only_is_not_a_reversed_insertion(file):
    out = TIME >= 12.5
    run = read(file(text({"time_s": TIME[out], "depth_m": DEPTH[out], "force_N": FORCE[out]})))
    assert run.velocity[10] == pytest.approx(-2e-3)


@pytest.mark.parametrize("depth, force", [(1, -1), (-1, 1), (-1, -1), (1, 1)])
@pytest.mark.parametrize("rows", [slice(None), slice(625)], ids=["cycle", "insertion"])
def test_reversed_signs_are_recognised_and_reported(file, depth, force, rows):
    columns = {"time_s": TIME[rows], "depth_m": depth * DEPTH[rows], "force_N": force * FORCE[rows]}
    run = read(file(text(columns)))
    np.testing.assert_array_equal(run.depth, DEPTH[rows])
    np.testing.assert_array_equal(run.force, FORCE[rows])
    sentences = " ".join(run.card.assumptions)
    assert ("depth decreases while" in sentences, "the force falls while" in sentences) == (depth < 0, force < 0)


def test_a_given_sign_is_believed(file):
    path = file(with_values(force_N=-FORCE))
    np.testing.assert_array_equal(read(path, units={"force": "+N"}).force, -FORCE)
    np.testing.assert_array_equal(read(path, units={"force": "-N"}).force, FORCE)
    np.testing.assert_array_equal(read(file(with_values(depth_m=-DEPTH)), inwards="increasing").depth, -DEPTH)


def test_noise_shows_no_sign(file):
    """A needle in air: the work of noise alone is as often against the motion as with it."""
    for seed in range(100):
        force = np.random.default_rng(seed).normal(0.0, 4e-3, len(TIME))
        run = read(file(with_values(force_N=force)), baseline=False)
        np.testing.assert_array_equal(run.force, force)


def test_a_pipe_is_refused_without_blocking(tmp_path):
    os.mkfifo(tmp_path / "pipe.csv")
    with pytest.raises(InputError, match="a regular file is needed"):
        read(tmp_path / "pipe.csv")
    with pytest.raises(InputError, match="null"):
        read("a\0b.csv")
