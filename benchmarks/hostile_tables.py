# SPDX-License-Identifier: Apache-2.0
# ruff: noqa: E501 - the content of hostile files has long lines
"""Valid tables for ``hostile_files.py``: text as instruments write it, LabVIEW measurement files, and workbooks."""

import datetime
import zipfile
from functools import cache
from io import BytesIO

import numpy as np

ENDINGS = {"forms": ".txt", "lvm": ".lvm", "excel": ".xlsx", "xlsm": ".xlsm", "xls": ".xls"}
ROWS = 60
TIME = 0.01 * np.arange(ROWS)
DEPTH = np.linspace(-5e-3, 20e-3, ROWS)
FORCE = 40.0 * DEPTH.clip(0.0)
N_FORMS = {"forms": 14, "lvm": 6, "excel": 6, "xlsm": 3, "xls": 6}


def content(kind: str, form: int) -> bytes:
    """A valid content of a format in one of ``N_FORMS[kind]`` forms."""
    return _MADE[kind](form)


def _joined(separator: str = "\t", *, time: bool = True) -> str:
    cells = (([f"{t:.3f}"] if time else []) + [f"{1e3 * d:.4f}", f"{f:.5f}"] for t, d, f in zip(TIME, DEPTH, FORCE))
    return "\n".join(map(separator.join, cells)) + "\n"


@cache
def _forms(form: int) -> bytes:
    """Text as instruments write it."""
    rows = _joined()
    block = "<INFO>\nDate:\t1.2.2026\n<DATA>\nTime, s\tPosition (z), mm\tFz, gf\n" + rows
    cycle = "\n".join(f"{k // 20 + 1},{row}" for k, row in enumerate(_joined(",").splitlines())) + "\n"
    forms = [
        block + "<END DATA>\n" + block,
        'Test : 1,"10.0",mm/min\n\nTime,Extension,Load\n(s),(mm),(N)\n"'
        + rows.replace("\t", '","').replace("\n", '"\n"')[:-1],
        rows,
        ("Zeit;Weg;Kraft\ns;mm;N\n" + rows.replace("\t", ";").replace(".", ",")),
        "Time\tPd\tFn\n" + "\n".join(f"12:00:{row}" for row in rows.splitlines()),
        "\n".join("\t".join([line] * 3) for line in ("Time (s)\tz (mm)\tF (N)\n" + rows).splitlines()),
        "Indentation\n\n   Max load :\t1000.00 \tµN\n\nTime (s)\tPd (µm)\tFn (µN)\n\n" + rows,
        "Date\t29/09/2021\tStatus\tOK\r\n\r\nk (N/m)\t4.640\r\nTime (s)\tLoad (uN)\tIndentation (nm)\r\n" + rows,
        '"Standardkraft";"Standardweg";"Prüfzeit"\n"N";"mm";"s"\n' + rows.replace("\t", ";").replace(".", ","),
        "Force\tDistance\tTime\n(g)\t(mm)\t(sec)\n" + rows + "\t\t\n" * 3,
        "\n".join(f"A1,{row}" for row in _joined(",", time=False).splitlines()) + "\n",
        "Cycle,Time (s),Position (mm),Force (N)\n" + cycle,
        "2026-01-02T03:04:05.678,0,0\n"
        + "".join(f"2026-01-02T03:{5 + k // 60:02d}:{k % 60:02d}.{k:03d},{k / 100},{k / 9:.3f}\n" for k in range(ROWS)),
        "# time depth force\n# s mm N\n" + _joined("  "),
    ]
    return forms[form].encode({3: "utf-16", 6: "latin-1", 8: "cp1252"}.get(form, "utf-8"))


@cache
def _lvm(form: int) -> bytes:
    """A LabVIEW measurement file; ``form`` has the decimal sign, the columns of X and the segments."""
    x = ("One", "No", "Multi")[form % 3]
    head = ["LabVIEW Measurement", "Writer_Version\t2", "Reader_Version\t2", "Separator\tTab", f"Decimal_Separator\t{'.,'[form % 2]}",
            "Multi_Headings\tYes", f"X_Columns\t{x}", "Time_Pref\tRelative", "Date\t2026/01/02", "***End_of_Header***", ""]  # fmt: skip
    part = ["Channels\t2", f"Samples\t{ROWS}\t{ROWS}", "Y_Unit_Label\tN\tmm", "X_Dimension\tTime\tTime", "X0\t0.0E+0\t0.0E+0",
            "Delta_X\t0.01\t0.01", "***End_of_Header***", "X_Value\tForce\tDepth\tComment"]  # fmt: skip
    part[-1] = "X_Value\tForce\tX_Value\tDepth" if x == "Multi" else part[-1]
    for t, d, f in zip(TIME, 1e3 * DEPTH, FORCE):
        cells = {"One": (t, f, d), "No": ("", f, d), "Multi": (t, f, t, d)}[x]
        part.append("\t".join(str(cell) for cell in cells).replace(".", ".,"[form % 2]))
    return "\r\n".join(head + ([*part, ""]) * (1 + form // 3 * 2)).encode()


@cache
def _excel(form: int) -> bytes:
    import openpyxl

    book = openpyxl.Workbook()
    rows = [("Time [s]", "Depth [mm]", "Force [N]"), *zip(TIME.tolist(), (1e3 * DEPTH).tolist(), FORCE.tolist())]
    for sheet in [book.active, *(book.create_sheet(f"s{k}") for k in range(form % 3))]:
        if form == 3:
            sheet.append(("Specimen", "x", datetime.datetime(2026, 1, 2)))
        for k, row in enumerate(rows):
            sheet.append((row[0], row[1], f"=B{k}*2") if form == 4 and k else row)
    if form == 5:
        book.active.merge_cells("A1:C1")
        book.create_chartsheet("c")
    made = BytesIO()
    book.save(made)
    return made.getvalue()


@cache
def _xlsm(form: int) -> bytes:
    """A workbook with a project of macros, whose bytes are none that a program could run."""
    made = BytesIO()
    with zipfile.ZipFile(BytesIO(_excel(form))) as old, zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            part = old.read(name)
            if name == "[Content_Types].xml":
                kind = b"application/vnd.ms-excel.sheet.macroEnabled.main+xml"
                part = part.replace(b"application/vnd.openxmlformats-officedocument.spreadsheetml.sheet.main+xml", kind)
            new.writestr(name, part)
        new.writestr("xl/vbaProject.bin", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(504) + b"Attribute VB_Name" * 20)
    return made.getvalue()


@cache
def _xls(form: int) -> bytes:
    import xlwt

    book = xlwt.Workbook()
    for number in range(1 + form % 3):
        sheet = book.add_sheet(f"s{number}")
        sheet.write_merge(0, 0, 0, 2, "Specimen") if form > 3 else None
        for column, (name, values) in enumerate(
            (("Time [s]", TIME), ("Depth [mm]", 1e3 * DEPTH), ("Force [N]", FORCE))
        ):
            sheet.write(1, column, name)
            for row, value in enumerate(values.tolist(), 2):
                formula = form == 3 and column == 2
                sheet.write(row, column, xlwt.Formula(f"B{row}*2") if formula else value)
    made = BytesIO()
    book.save(made)
    return made.getvalue()


_MADE = {"forms": _forms, "lvm": _lvm, "excel": _excel, "xlsm": _xlsm, "xls": _xls}
