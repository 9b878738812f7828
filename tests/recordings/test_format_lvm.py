# SPDX-License-Identifier: Apache-2.0
"""LabVIEW measurement files, written by hand after the published description of the format."""

import numpy as np
import pytest
from plain_insertion import insertion

from needleforce.errors import InputError
from needleforce.recording import read, read_all

TIME, DEPTH, FORCE = insertion(rate=50.0)


def lvm(segments=1, *, x="One", separator="\t", decimal=".", comment=True, units=("N", "mm")):
    """A file of two channels, load and stage."""
    name = {"\t": "Tab", ",": "Comma"}[separator]
    lines = ["LabVIEW Measurement", "Writer_Version\t2", "Reader_Version\t2", f"Separator\t{name}",
             f"Decimal_Separator\t{decimal}", "Multi_Headings\tYes", f"X_Columns\t{x}", "Time_Pref\tRelative",
             "Operator\tN. N.", "Date\t2026/01/02", "Time\t17:38:03.63", "***End_of_Header***", ""]  # fmt: skip
    for _ in range(segments):
        lines += ["Channels\t2", f"Samples\t{len(TIME)}\t{len(TIME)}", "Date\t2026/01/02\t2026/01/02",
                  "Time\t17:38:03.63\t17:38:03.63", f"Y_Unit_Label\t{units[0]}\t{units[1]}",
                  "X_Dimension\tTime\tTime", "X0\t0.0E+0\t0.0E+0", "Delta_X\t0.020000\t0.020000",
                  "***End_of_Header***", "X_Value\tLoad Cell\tStage" + "\tComment" * comment]  # fmt: skip
        if x == "Multi":
            lines[-1] = "X_Value\tLoad Cell\tX_Value\tStage" + "\tComment" * comment
        for t, d, f in zip(TIME.tolist(), (1e3 * DEPTH).tolist(), FORCE.tolist(), strict=True):
            cells = {"One": (t, f, d), "Multi": (t, f, t, d), "No": ("", f, d)}[x]
            lines.append("\t".join(str(cell).replace(".", decimal) for cell in cells))
        lines.append("")
    return "\n".join(lines).replace("\t", separator)


def check(run, factor=1.0):
    np.testing.assert_allclose(run.time, TIME, atol=1e-12)
    np.testing.assert_allclose(run.depth, DEPTH, rtol=1e-14, atol=1e-18)
    np.testing.assert_allclose(run.force, factor * FORCE, rtol=1e-14)


STAGE = {"columns": {"depth": "Stage"}}


@pytest.mark.parametrize(
    "options",
    [{}, {"x": "No"}, {"x": "Multi"}, {"separator": ","}, {"decimal": ","}, {"comment": False},
     {"x": "No", "comment": False}, {"x": "No", "decimal": ","}],
)  # fmt: skip
def test_one_segment(file, options):
    columns = {"depth": "Stage", "time": "1"} if options.get("x") == "Multi" else STAGE["columns"]
    check(read(file(lvm(**options)), columns=columns, baseline=False))


def test_units_of_the_channels_are_used(file):
    check(read(file(lvm(units=("mN", "mm"))), **STAGE), 1e-3)


def test_every_segment_is_a_recording(file):
    path = file(lvm(3))
    with pytest.raises(InputError, match=r"number of recordings is 3, the file has 'segment 1', 'segment 2'"):
        read(path, **STAGE)
    runs = read_all(path, **STAGE)
    assert len(runs) == 3
    for run in runs:
        check(run)


def test_text_among_the_numbers_is_named_by_its_line(file):
    lines = lvm().splitlines()
    lines[400] = "7.0\tOVER\t1.0"
    with pytest.raises(InputError, match=r"line 401: force .*is 'OVER', a number is needed"):
        read(file("\n".join(lines)), **STAGE)


def test_truncated_files(file):
    content = lvm(2)
    for size in range(20, len(content), len(content) // 60):
        try:
            read(file(content[:size]), **STAGE)
        except InputError:
            continue


def test_another_decimal_sign_and_more_segments_than_are_read_are_refused(file):
    with pytest.raises(InputError, match=r"Decimal_Separator is '\.,', a point or a comma is needed"):
        read(file(lvm().replace("Decimal_Separator\t.", "Decimal_Separator\t.,")), **STAGE)
    end = "***End_of_Header***\n"
    with pytest.raises(InputError, match=r"number of segments is 4999, at most 4096"):
        read(file("LabVIEW Measurement\n" + end * 5000), **STAGE)


def test_a_name_without_a_value_states_nothing(tmp_path):
    path = tmp_path / "x.lvm"
    rows = "".join(f"{0.01 * k:g}\t{0.1 * k:g}\t{0.2 * k:g}\n" for k in range(50))
    head = "LabVIEW Measurement\nSeparator\tTab\nDecimal_Separator\nX_Columns\n***End_of_Header***\n"
    path.write_text(f"{head}Channels\t2\nY_Unit_Label\n***End_of_Header***\nX_Value\tForce\tDepth\n{rows}")
    run = read(path, units={"force": "N", "depth": "mm"}, baseline=False)
    np.testing.assert_allclose(run.force, 0.1 * np.arange(50), rtol=1e-5)
