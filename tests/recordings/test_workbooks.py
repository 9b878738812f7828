# SPDX-License-Identifier: Apache-2.0
"""Excel workbooks: sheets and columns as recordings, times, formulas, and what is refused."""

import datetime
import io
import zipfile

import numpy as np
import pytest
from plain_insertion import insertion

from needleforce.errors import InputError
from needleforce.recording import read, read_all

openpyxl = pytest.importorskip("openpyxl")
pytest.importorskip("python_calamine")

TIME, DEPTH, FORCE = insertion(rate=50.0)
ROWS = list(zip(TIME.tolist(), (1e3 * DEPTH).tolist(), FORCE.tolist(), strict=True))
HEADERS = ("Time [s]", "Weg [mm]", "Kraft [N]")


@pytest.fixture
def saved(tmp_path):
    def save(fill, name="run.xlsx"):
        book = openpyxl.Workbook()
        fill(book)
        book.save(tmp_path / name)
        return tmp_path / name

    return save


def sheet_of(sheet, rows=ROWS, headers=HEADERS, above=()):
    for row in (*above, headers, *rows):
        sheet.append(row)


def same(run):
    for found, value in ((run.time, TIME), (run.depth, DEPTH), (run.force, FORCE)):
        np.testing.assert_allclose(found, value, rtol=1e-14, atol=1e-17)  # a sheet stores 16 digits


@pytest.mark.parametrize(
    "form", ["plain", "preamble", "units", "merged title", "empty first column", "numbers as text"]
)
def test_a_sheet_in_many_forms(saved, form):
    def fill(book):
        sheet = book.active
        match form:
            case "plain":
                sheet_of(sheet)
            case "preamble":
                sheet_of(sheet, above=[("Specimen", 3), ("Operator", "N. N."), ()])
            case "units":
                sheet_of(sheet, [("s", "mm", "N"), *ROWS], ("Time", "Weg", "Kraft"))
            case "merged title":
                sheet_of(sheet, above=[("Specimen 3",)])
                sheet.merge_cells("A1:C1")
            case "empty first column":
                sheet_of(sheet, [(None, *row) for row in ROWS], (None, *HEADERS))
            case "numbers as text":
                sheet_of(sheet, [tuple(repr(cell).replace(".", ",") for cell in row) for row in ROWS])

    same(read(saved(fill)))


def test_each_sheet_is_a_recording_and_others_are_none(saved):
    def fill(book):
        sheet_of(book.active)
        sheet_of(book.create_sheet("Second"))
        notes = book.create_sheet("Remarks")
        notes.append(("Date", datetime.date(2026, 1, 2)))
        settings = book.create_sheet("Settings")
        sheet_of(settings, [(k, 2 * k) for k in range(40)], ("Layer", "Angle"))
        book.create_chartsheet("Figure")

    path = saved(fill)
    with pytest.raises(InputError, match="number of recordings is 2, the file has 'Sheet', 'Second'"):
        read(path)
    same(read(path, part="second"))
    runs = read_all(path)
    assert [run.card.part for run in runs] == ["Sheet", "Second"]
    for run in runs:
        same(run)
        assert "not read, without columns of a recording: 'Settings'" in [note.message for note in run.notes]
    with pytest.raises(
        InputError, match=r"no column holds the time.*none has a known name or unit; inspect shows its columns"
    ):
        read(path, part="Settings")


def test_a_sheet_whose_force_only_its_unit_shows_is_a_recording_too(saved):
    def fill(book):
        sheet_of(book.active)
        sheet_of(book.create_sheet("Second"), headers=("t_s", "z_mm", "Fax_N"))

    for run in read_all(saved(fill)):
        same(run)
    with pytest.raises(InputError, match="number of recordings is 2, the file has 'Sheet', 'Second'"):
        read(saved(fill))


@pytest.mark.parametrize("kind", ["datetime", "time", "timedelta"])
def test_times_as_spreadsheets_keep_them(saved, kind):
    start = datetime.datetime(2026, 1, 2, 3, 4, 5)
    times = [start + datetime.timedelta(seconds=k) for k in range(len(TIME))]
    cells = {"datetime": times, "time": [each.time() for each in times], "timedelta": [each - start for each in times]}
    rows = [(cell, *row[1:]) for cell, row in zip(cells[kind], ROWS)]
    run = read(saved(lambda book: sheet_of(book.active, rows, ("Time", *HEADERS[1:]))))
    np.testing.assert_allclose(run.time, np.arange(len(TIME)), atol=1e-3)


def test_formulas_are_not_run_and_their_stored_values_are_read(saved, tmp_path):
    """openpyxl stores formulas without values; a spreadsheet program stores both."""
    rows = [(t, d, f"=C{k}*1") for k, (t, d, f) in enumerate(ROWS, 2)]
    path = saved(lambda book: sheet_of(book.active, rows))
    with pytest.raises(InputError) as caught:
        read(path)
    assert "force (column 'Kraft [N]') is without values" in str(caught.value)
    assert "formulas whose values were not stored" in str(caught.value)
    stored = tmp_path / "stored.xlsx"
    with zipfile.ZipFile(path) as source, zipfile.ZipFile(stored, "w") as target:
        for member in source.infolist():
            content = source.read(member)
            if member.filename.startswith("xl/worksheets/sheet"):
                for k, (_, _, force) in enumerate(ROWS, 2):
                    old = f"<f>C{k}*1</f><v></v>".encode()
                    assert old in content or f"<f>C{k}*1</f><v />".encode() in content
                    new = f"<f>C{k}*1</f><v>{force!r}</v>".encode()
                    content = content.replace(old, new).replace(f"<f>C{k}*1</f><v />".encode(), new)
            target.writestr(member, content)
    same(read(stored))


def test_few_formulas_without_values_are_noted(saved):
    rows = [*ROWS[:300], (ROWS[300][0], ROWS[300][1], "=1+1"), *ROWS[301:]]
    run = read(saved(lambda book: sheet_of(book.active, rows)))
    assert len(run) == len(TIME) - 1
    assert any("1 cells hold formulas without stored values" in note.message for note in run.notes)


@pytest.mark.parametrize("text", ["Broken", "OVER", "1.2.3"])
def test_text_in_a_column_is_named_by_its_cell(saved, text):
    rows = [*ROWS[:300], (*ROWS[300][:2], text), *ROWS[301:]]
    with pytest.raises(InputError, match=rf"Sheet, cell C302: force .*is '{text}', a number is needed"):
        read(saved(lambda book: sheet_of(book.active, rows)))


def test_errors_of_a_sheet_are_missing_values(saved):
    rows = [*ROWS[:300], (*ROWS[300][:2], "#N/A"), *ROWS[301:]]
    assert len(read(saved(lambda book: sheet_of(book.active, rows)))) == len(TIME) - 1


def test_an_empty_workbook_and_one_of_charts(saved):
    with pytest.raises(InputError, match=r"Excel workbook is without a table.*its sheets are 'Sheet'"):
        read(saved(lambda book: None))
    with pytest.raises(InputError, match="Excel workbook is without a table"):
        read(saved(lambda book: book.create_chartsheet("Figure")))


def test_a_workbook_that_unpacks_without_end(tmp_path):
    path = tmp_path / "bomb.xlsx"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("xl/workbook.xml", "<workbook/>")
        with archive.open("xl/worksheets/sheet1.xml", "w", force_zip64=True) as member:
            for _ in range(400):
                member.write(bytes(1 << 20))
    with pytest.raises(InputError, match=r"unpacked size is too large for a file of this size"):
        read(path)


def test_two_cells_far_apart_take_no_memory(saved):
    def fill(book):
        book.active["A1"] = 1.0
        book.active["XFD1048576"] = 2.0

    with pytest.raises(InputError, match=r"size of the sheet is 1048576 rows of 16384 columns, at most 8000000 cells"):
        read(saved(fill))


def test_a_path_that_climbs_out_of_the_archive_is_written_nowhere(tmp_path):
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w") as archive:
        archive.writestr("../../escaped.txt", "x")
        archive.writestr("xl/workbook.xml", "<workbook/>")
    folder = tmp_path / "a" / "b"
    folder.mkdir(parents=True)
    (folder / "x.xlsx").write_bytes(data.getvalue())
    with pytest.raises(InputError):
        read(folder / "x.xlsx")
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["a", "b", "x.xlsx"]


def test_truncated_workbooks(saved, tmp_path):
    content = saved(lambda book: sheet_of(book.active)).read_bytes()
    for size in range(4, len(content), len(content) // 40):
        (tmp_path / "cut.xlsx").write_bytes(content[:size])
        with pytest.raises(InputError):
            read(tmp_path / "cut.xlsx")


def test_without_its_package_the_message_says_how_to_install_it(saved, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "python_calamine", None)
    with pytest.raises(
        InputError, match=r"Excel workbook \(xlsx\) needs the package.* -m pip install python_calamine\."
    ):
        read(saved(lambda book: sheet_of(book.active)))
