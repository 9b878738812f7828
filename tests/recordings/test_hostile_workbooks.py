# SPDX-License-Identifier: Apache-2.0
"""Workbooks that laboratories have and no reader wants: old, encrypted, with macros, merged or stray cells, formulas
without values, text among numbers."""

import io
import struct
import zipfile

import numpy as np
import pytest
from plain_insertion import insertion, text

from needleforce.errors import InputError
from needleforce.recording import read, read_all

openpyxl = pytest.importorskip("openpyxl")
pytest.importorskip("python_calamine")

TIME, DEPTH, FORCE = insertion(rate=50.0)
COLUMNS = {"Time [s]": TIME, "Weg [mm]": 1e3 * DEPTH, "Kraft [N]": FORCE}


def same(run):
    for found, value in ((run.time, TIME), (run.depth, DEPTH), (run.force, FORCE)):
        np.testing.assert_allclose(found, value, rtol=1e-14, atol=1e-17)


def old_book(fill):
    """An xls by its own library, as bytes of the workbook's stream and as a file."""
    xlwt = pytest.importorskip("xlwt")
    book = xlwt.Workbook()
    fill(book)
    made = io.BytesIO()
    book.save(made)
    return made.getvalue()


def fill_old(book, name="Run", formula=None):
    sheet = book.add_sheet(name)
    for column, (header, values) in enumerate(COLUMNS.items()):
        sheet.write(0, column, header)
        for row, value in enumerate(values.tolist(), 1):
            sheet.write(row, column, formula(row) if formula and column == 2 else value)
    return sheet


def rows():
    return [tuple(COLUMNS), *zip(*(values.tolist() for values in COLUMNS.values()), strict=True)]


def new_book(change=None, cells=None):
    """An xlsx; ``cells`` are replaced, and ``change`` may do more."""
    book = openpyxl.Workbook()
    for row in rows():
        book.active.append(row)
    for place, value in (cells or {}).items():
        book.active[place] = value
    if change:
        change(book.active)
    made = io.BytesIO()
    book.save(made)
    return made.getvalue()


def test_an_xls_of_two_sheets(file):
    def fill(book):
        fill_old(book)
        fill_old(book, "Zweiter Lauf")
        book.add_sheet("Empty")

    path = file(old_book(fill), "run.xls")
    runs = read_all(path)
    assert [run.card.part for run in runs] == ["Run", "Zweiter Lauf"]
    for run in runs:
        same(run)


def test_an_empty_xls_and_one_with_text_among_the_numbers(file):
    with pytest.raises(InputError, match=r"without a table.*its sheets are 'Empty'"):
        read(file(old_book(lambda book: book.add_sheet("Empty")), "run.xls"))

    def fill(book):
        book.add_sheet("Run", cell_overwrite_ok=True)
        sheet = book.get_sheet(0)
        for row, cells in enumerate(rows()):
            for column, cell in enumerate(cells):
                sheet.write(row, column, "Broken" if (row, column) == (301, 2) else cell)

    with pytest.raises(InputError, match=r"Run, cell C302: force .*is 'Broken', a number is needed"):
        read(file(old_book(fill), "run.xls"))


def test_formulas_of_an_xls_without_values_are_named(file):
    xlwt = pytest.importorskip("xlwt")
    content = old_book(lambda book: fill_old(book, formula=lambda row: xlwt.Formula(f"B{row + 1}*2")))
    with pytest.raises(InputError, match=r"force .*is without values.*hold formulas.*save it again as xlsx"):
        read(file(content, "run.xls"))


def test_a_really_encrypted_xlsx(file):
    ooxml = pytest.importorskip("msoffcrypto.format.ooxml")
    for padding in (
        None,
        {f"F{k}": "abcdefgh" * 3 + str(k * k) for k in range(1, 4000)},
    ):  # small, and with a large directory
        made = io.BytesIO()
        ooxml.OOXMLFile(io.BytesIO(new_book(cells=padding))).encrypt("secret", made)
        with pytest.raises(InputError, match=r"Excel workbook is encrypted, .*with a password.*save it without one"):
            read(file(made.getvalue(), "secret.xlsx"))


@pytest.mark.parametrize(
    "record",
    [struct.pack("<5H", 0x2F, 6, 0, 0x1234, 0x5678), struct.pack("<5H", 0x2F, 54, 1, 1, 1) + bytes(48)],
    ids=["obfuscated", "RC4"],
)
@pytest.mark.parametrize("protected", [False, True])
def test_an_encrypted_xls(file, record, protected):
    """The record FilePass after the first one, [MS-XLS] 2.4.117; another library sees the file as encrypted, too."""
    xlwt, msoffcrypto = pytest.importorskip("xlwt"), pytest.importorskip("msoffcrypto")
    from xlwt import CompoundDoc

    book = xlwt.Workbook()
    fill_old(book)
    stream = book.get_biff_data()
    first = 4 + struct.unpack_from("<H", stream, 2)[0]
    for inserted, encrypted in ((b"", False), (struct.pack("<2H", 0x86, 0) * protected + record, True)):
        path = file(b"", "run.xls")
        with path.open("wb") as target:
            CompoundDoc.XlsDoc().save(target, stream[:first] + inserted + stream[first:])
        if not protected:
            with path.open("rb") as source:
                assert msoffcrypto.OfficeFile(source).is_encrypted() == encrypted
        if not encrypted:
            same(read(path))
            continue
        with pytest.raises(InputError, match=r"Excel workbook is encrypted.*save it without one"):
            read(path)


def test_text_that_names_the_encrypted_part_encrypts_nothing(file):
    def fill(book):
        fill_old(book).write(0, 5, "EncryptedPackageü")  # stored in UTF-16

    same(read(file(old_book(fill), "run.xls")))


def test_macros_are_carried_along_and_never_run(file, tmp_path):
    made = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(new_book())) as old, zipfile.ZipFile(made, "w") as new:
        for name in old.namelist():
            part = old.read(name).replace(b"spreadsheetml.sheet.main", b"ms-excel.sheet.macroEnabled.main")
            new.writestr(name, part)
        code = f'Sub Workbook_Open()\r\nOpen "{tmp_path}/escaped" For Output As #1\r\nEnd Sub\r\n'
        new.writestr("xl/vbaProject.bin", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(504) + code.encode())
    path = file(made.getvalue(), "run.xlsm")
    before = path.read_bytes()
    same(read(path))
    assert [each.name for each in tmp_path.iterdir()] == ["run.xlsm"] and path.read_bytes() == before


def test_merged_cells_of_a_title_are_read_and_of_headers_named(file):
    def titled(sheet):
        sheet.insert_rows(1)
        sheet["A1"] = "Specimen 3"
        sheet.merge_cells("A1:C1")

    same(read(file(new_book(titled), "run.xlsx")))
    with pytest.raises(InputError, match="no column holds the depth, the columns are 'Time"):
        read(file(new_book(lambda sheet: sheet.merge_cells("A1:B1")), "run.xlsx"))
    same(read(file(new_book(lambda sheet: sheet.merge_cells("A1:B1")), "run.xlsx"), columns={"depth": 2},
              units={"depth": "mm"}))  # fmt: skip


def test_merged_times_are_missing_values(file):
    def merged(sheet):
        for row in range(2, len(TIME), 2):
            sheet.merge_cells(f"A{row}:A{row + 1}")

    with pytest.raises(InputError, match=r"row 3: time .*is missing or not a number, 624 of 1250 rows"):
        read(file(new_book(merged), "run.xlsx"))


def test_a_cell_far_away_makes_no_columns(file):
    same(read(file(new_book(cells={"ABC1500": "x"}), "run.xlsx")))
    with pytest.raises(InputError, match=r"number of columns is 1459, at most 1024"):
        read(file(new_book(cells={"BDC30": 1.0}), "run.xlsx"))


@pytest.mark.parametrize("word", ["Broken", "OVER", "OL", "+OL", "Overload", "*****"])
def test_words_in_a_column_of_numbers_are_named_by_their_place(file, word):
    with pytest.raises(InputError) as caught:
        read(file(new_book(cells={"C302": word}), "run.xlsx"))
    assert f"Sheet, cell C302: force (column 'Kraft [N]') is '{word}', a number is needed" in str(caught.value)
    lines = text(COLUMNS).splitlines()
    lines[301] = f"{lines[301].rsplit(',', 1)[0]},{word}"
    with pytest.raises(InputError) as caught:
        read(file("\n".join(lines) + "\n"))
    assert f"line 302: force (column 'Kraft [N]') is '{word}', a number is needed" in str(caught.value)


@pytest.mark.parametrize("word", ["#N/A", "---", "--", "n/a", "NaN", ""])
def test_signs_for_no_value_are_missing_values(file, word):
    lines = text(COLUMNS).splitlines()
    lines[301] = f"{lines[301].rsplit(',', 1)[0]},{word}"
    for path in (file(new_book(cells={"C302": word}), "run.xlsx"), file("\n".join(lines) + "\n")):
        run = read(path)
        np.testing.assert_allclose(run.time, np.delete(TIME, 300), rtol=1e-14)
        assert any("1 of 1250 rows have a missing value" in note.message for note in run.notes)
