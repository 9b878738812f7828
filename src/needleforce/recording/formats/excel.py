# SPDX-License-Identifier: Apache-2.0
"""Tables of an Excel workbook (xlsx, xlsm, xls): the stored values of its sheets; formulas and macros are never run."""

import hashlib
import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import date, datetime, time, timedelta
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...errors import InputError
from ...files import MAX_RECORDING_BYTES, check_count, read_bytes, unpacked_limit
from ..recording import Note
from ..stated import stating_lines
from ..table import Table
from .arrays import MAX_COLUMNS
from .clock_times import seconds_of
from .number_texts import NoNumber, UnclearSign, numbers_of
from .rows import Block, blocks, is_missing, is_number

if TYPE_CHECKING:
    import zipfile

_STATING_ROWS = 256  # above a table, that may state a rate, a speed or a unit
_MAX_CELLS = 8_000_000  # of a sheet, empty ones included: a million rows of 8 columns
_CELL = re.compile(rb'<c r="([A-Z]{1,3})(\d{1,7})"')
_OVERLAP = 64  # bytes of a block that are looked at again with the next
_COMPOUND = b"\xd0\xcf\x11\xe0"
_ENTRY_BYTES = 128  # of the directory of a compound file, at a multiple of it
_ENCRYPTED = re.compile(re.escape("EncryptedPackage\0".encode("utf-16-le")))
# of an xls: the record FilePass after the first of the workbook, with one between them if it is write-protected
_PASSWORD = re.compile(rb"\x09\x08(?:\x10\x00.{16}|\x08\x00.{8})(?:\x86\x00\x00\x00)?\x2f\x00", re.DOTALL)
_FORMULA_WITHOUT_VALUE = re.compile(rb"</f>\s*(?:<v\s*/>|<v>\s*</v>)?\s*</c>")
_SAVE = "Open it in a spreadsheet program and save it again as xlsx, or export the sheet as CSV."


def tables(path: Path) -> list[Table]:
    """The tables of all sheets. Raises InputError for a workbook that is damaged, encrypted or has no table."""
    from python_calamine import CalamineWorkbook, SheetTypeEnum

    content = read_bytes(path, "file", MAX_RECORDING_BYTES)
    if _is_encrypted(content):
        step = "Open it with its password and save it without one."
        raise InputError("Excel workbook", "encrypted", "its values can be read with a password only", str(path), step)
    without_value = _formulas_without_value(content, path) if content.startswith(b"PK") else 0
    try:
        book = CalamineWorkbook.from_filelike(BytesIO(content))
        names = [each.name for each in book.sheets_metadata if each.typ == SheetTypeEnum.WorkSheet]
        sheets = [(name, _cells(book.get_sheet_by_name(name), path, name)) for name in names]
    except (InputError, MemoryError):
        raise
    except Exception as error:  # the library has its own exceptions, and those of zip and XML
        reason = " ".join(str(error).split())[:200]
        raise InputError("Excel workbook", "not readable", reason, str(path), _SAVE) from None
    sha256 = hashlib.sha256(content).hexdigest()
    found = [table for name, rows in sheets for table in _tables_of_sheet(path, name, rows, sha256)]
    if not found:
        shown = ", ".join(repr(name[:40]) for name in names[:12]) or "none"
        limit = f"rows of numbers are needed; its sheets are {shown}"
        raise InputError("Excel workbook", "without a table", limit, str(path), _formula_step(without_value))
    if without_value:
        message = f"{without_value} cells hold formulas without stored values and are read as missing"
        for table in found:
            table.notes.append(Note("missing", message, without_value))
    return found


def _is_encrypted(content: bytes) -> bool:
    """Whether a compound file has an encrypted workbook of either kind, xlsx or xls."""
    if not content.startswith(_COMPOUND):
        return False
    named = any(found.start() % _ENTRY_BYTES == 0 for found in _ENCRYPTED.finditer(content))
    return named or _PASSWORD.search(content) is not None


def _formula_step(count: int) -> str:
    return (
        f"{count} cells hold formulas without stored values. {_SAVE}" if count else "Check that it is the right file."
    )


def _formulas_without_value(content: bytes, path: Path) -> int:
    """How many cells have a formula whose value was not stored.

    Raises InputError for an archive that is damaged, or unpacks to more than any workbook of its size, and for a sheet
    whose cells are so far apart that the library would take all memory for those between them.
    """
    import zipfile
    import zlib

    limit, count = unpacked_limit(len(content)), 0
    try:
        with zipfile.ZipFile(BytesIO(content)) as archive:
            for member in archive.infolist():
                formulas, limit = _looked_through(archive, member, limit, path)
                count += formulas
    except (zipfile.BadZipFile, NotImplementedError, RuntimeError, OSError, EOFError, ValueError, zlib.error) as error:
        if isinstance(error, InputError):
            raise
        reason = " ".join(str(error).split())[:200]
        raise InputError("Excel workbook", "not readable", reason, str(path), _SAVE) from None
    return count


def _looked_through(archive: "zipfile.ZipFile", member: "zipfile.ZipInfo", limit: int, path: Path) -> tuple[int, int]:
    """Formulas without value in a member of the archive, and the bytes that the others may have."""
    count, rest, rows, columns = 0, b"", 0, 0
    with archive.open(member) as file:
        for block in iter(lambda: file.read(1 << 20), b""):
            limit -= len(block)
            if limit < 0:
                step = "Check that it is a recording."
                raise InputError("unpacked size", "too large for a file of this size", "", str(path), step)
            if "worksheets/" in member.filename:
                count += len(_FORMULA_WITHOUT_VALUE.findall(block))
                cells = _CELL.findall(rest + block)
                rest = block[-_OVERLAP:]
                rows = max([rows, *(int(row) for _, row in cells)])
                columns = max([columns, *(_column_number(letters) for letters in {letters for letters, _ in cells})])
    _check_cells(rows, columns, f"{path}, {member.filename}")
    return count, limit


def _column_number(letters: bytes) -> int:
    """The number of a column named as spreadsheets have it: A is 1, AA is 27."""
    number = 0
    for letter in letters:
        number = 26 * number + letter - ord("A") + 1
    return number


def _check_cells(rows: int, columns: int, place: str) -> None:
    """Raise InputError for a sheet that is larger than any recording."""
    if rows * columns > _MAX_CELLS:
        limit, step = f"at most {_MAX_CELLS} cells are read", "Delete the empty rows and columns, or split the sheet."
        raise InputError("size of the sheet", f"{rows} rows of {columns} columns", limit, place, step)


def _cells(sheet: Any, path: Path, name: str) -> list[list]:
    """The rows of a sheet from its first cell on. Raises InputError for a sheet that is larger than any recording."""
    if sheet.end is None:
        return []
    _check_cells(sheet.end[0] + 1, sheet.end[1] + 1, f"{path}, {name}")
    return sheet.to_python(skip_empty_area=False)


class _Texts(Sequence):
    """Rows of cells as text, made when they are used."""

    def __init__(self, rows: list[list]):
        self._rows = rows

    def __len__(self) -> int:
        return len(self._rows)

    def __getitem__(self, index: Any) -> list[str]:
        return [_text(cell) for cell in self._rows[index]]


def _text(cell: Any) -> str:
    if isinstance(cell, float) and cell.is_integer() and abs(cell) < 1e15:
        return str(int(cell))
    return str(cell).strip()


def _kind(cell: Any) -> str:
    """``n`` for a number or a time, ``e`` for no value, ``t`` for text, of which truth values are."""
    if isinstance(cell, str):
        return "e" if is_missing(cell.strip()) else "n" if is_number(cell.strip()) else "t"
    return "t" if isinstance(cell, bool) else "n"


def _tables_of_sheet(path: Path, sheet: str, rows: list[list], sha256: str) -> list[Table]:
    shapes = ["".join(map(_kind, row)) for row in rows]
    shapes = ["" if not shape.strip("e") else shape for shape in shapes]
    found = [_without_empty_columns(block, shapes) for block in blocks(_Texts(rows), shapes)]
    check_count("columns", max((block.width for block in found), default=0), MAX_COLUMNS, path)
    names = [sheet] if len(found) == 1 else [f"{sheet}: table {k}" for k in range(1, len(found) + 1)]
    return [_table(path, name, rows, block, sha256) for name, block in zip(names, found)]


def _without_empty_columns(block: Block, shapes: Sequence[str]) -> Block:
    """The block without the empty columns on its right, which one cell far away makes in all rows."""
    named = max((k + 1 for k, each in enumerate(block.headers) if each), default=0)
    width = max([named, *(len(shape.rstrip("e")) for shape in shapes[block.first : block.stop])])
    text = frozenset(k for k in block.text_columns if k < width)
    return replace(block, width=width, headers=block.headers[:width], units=block.units[:width], text_columns=text)


def _table(path: Path, name: str, rows: list[list], block: Block, sha256: str) -> Table:
    headers = block.headers or [str(k + 1) for k in range(block.width)]

    def read_from(index: int, first: int) -> np.ndarray:
        start = block.first + first
        cells = [row[index] if index < len(row) else "" for row in rows[start : block.stop]]
        if any(isinstance(cell, date | time | timedelta) for cell in cells):
            return _seconds(cells, f"{path}, {name}")
        values = _numbers(cells, headers[index], lambda k: f"{path}, {name}, cell {_letters(index)}{start + k + 1}")
        if np.isnan(values).all():
            limit = "its cells are empty, or hold formulas whose values were not stored"
            raise InputError(f"column {headers[index]!r}", "without values", limit, f"{path}, {name}", _SAVE)
        return values

    def read_texts(index: int) -> list[str]:
        return [_text(row[index]) if index < len(row) else "" for row in rows[block.first : block.stop]]

    units = ["s" if _is_clock(rows[block.first : block.stop], k) else unit
             for k, unit in enumerate(block.units or [""] * block.width)]  # fmt: skip
    return Table(path=path, name=name, headers=headers, units=units, read_column=lambda index: read_from(index, 0),
                     read_from=read_from, read_texts=read_texts, sha256=sha256, first_row=block.first + 1,
                     has_header=bool(block.headers), text_columns=block.text_columns,
                     preamble=(stating_lines(_lines_above(rows, block.first)),))  # fmt: skip


def _lines_above(rows: list[list], first: int) -> list[str]:
    """The rows above a table as lines of text."""
    return ["\t".join(filter(None, map(_text, row))) for row in rows[max(0, first - _STATING_ROWS) : first]]


def _is_clock(rows: list[list], index: int) -> bool:
    return any(isinstance(row[index], date | time | timedelta) for row in rows[:20] if index < len(row))


def _seconds(cells: list, place: str) -> np.ndarray:
    """Times of a clock or a calendar in seconds from the first."""
    if any(isinstance(cell, timedelta) for cell in cells):
        return np.array([cell.total_seconds() if isinstance(cell, timedelta) else np.nan for cell in cells])
    known = [cell if isinstance(cell, datetime | date | time) else None for cell in cells]
    return seconds_of(np.array([None if each is None else each.isoformat() for each in known], object), place)


def _numbers(cells: Sequence[Any], header: str, place: Callable[[int], str]) -> np.ndarray:
    """Cells as numbers, NaN for none; numbers as texts have the decimal sign that all of them show. Raises InputError
    for a text, at the place of its cell."""
    texts = {k: str(cell).strip() for k, cell in enumerate(cells) if isinstance(cell, str | bool)}
    values = np.array([np.nan if k in texts else float(cell) for k, cell in enumerate(cells)])
    for k, text in texts.items():
        if not is_missing(text) and (":" in text or not is_number(text)):
            raise _no_number(header, text, place(k))
    try:
        values[list(texts)] = numbers_of({0: list(texts.values())}, ".")[0]
    except NoNumber as fault:
        row = list(texts)[fault.row]
        raise _no_number(header, texts[row], place(row)) from None
    except UnclearSign:
        limit = "numbers such as 1,000 are in it, which may be one or one thousand"
        step = "Save its cells as numbers, not as texts."
        raise InputError(f"column {header!r}", "ambiguous", limit, place(next(iter(texts))), step) from None
    return values


def _no_number(header: str, text: str, place: str) -> InputError:
    limit, step = "a number is needed", "Correct or empty the cell."
    return InputError(f"column {header!r}", repr(text[:40]), limit, place, step)


def _letters(column: int) -> str:
    """The name of a column as spreadsheets have it: A, B … Z, AA …"""
    name = ""
    column += 1
    while column:
        column, rest = divmod(column - 1, 26)
        name = chr(ord("A") + rest) + name
    return name
