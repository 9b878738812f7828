# SPDX-License-Identifier: Apache-2.0
"""The layout of a text file: delimiter, decimal sign, header, and the comment lines above it."""

import csv
import io
import re
from collections.abc import Generator, Iterator
from dataclasses import dataclass, replace
from itertools import count, islice
from pathlib import Path

from ..errors import InputError
from ..files import open_regular

_NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?|[+-]?(nan|inf|infinity)", re.IGNORECASE)
_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")
_MISSING_VALUES = ("", "na", "n/a", "null", "none", "<na>")  # cells that pandas reads as missing values
_MAX_LINE_CHARS = 1 << 16  # of one line, and of the header and all comments together 16 times as many
_MAX_COLUMNS = 1024  # a recorder of all channels of a lab writes some hundred
_MAX_HEADER_CHARS = 256  # of one column
WHITESPACE = r"\s+"


@dataclass(frozen=True, kw_only=True)
class Layout:
    """The layout of a text file, found before its values are read.

    ``skip`` is the number of lines up to and including the header, ``above`` the number of delimiters in them, and
    ``comments`` the comment lines above the header as (line number, text without ``#``). ``header_commented`` is True
    if the header is a comment line.
    """

    path: Path
    encoding: str
    delimiter: str
    decimal: str
    headers: list[str]
    skip: int
    above: int
    comments: list[tuple[int, str]]
    header_commented: bool = False

    def cells(self, line: str) -> list[str]:
        """The cells of one line without comment and surrounding blanks."""
        return _cells(line.partition("#")[0], self.delimiter)

    def is_number(self, cell: str) -> bool:
        """Whether a cell contains a number or a missing value."""
        return cell.casefold() in _MISSING_VALUES or _is_number(cell.replace(self.decimal, "."))

    def place(self, row: int) -> str:
        """The place of a row of data: file and line."""
        number = next(number for at, (number, _) in enumerate(self.data_lines()) if at == row)
        return f"{self.path}, line {number}"

    def data_lines(self) -> Iterator[tuple[int, list[str]]]:
        """Each line of data as its number in the file, from 1, and its cells. Slow; used to locate a fault."""
        for number, line in islice(_lines(self.path, self.encoding), self.skip, None):
            if line.partition("#")[0].strip():
                yield number, self.cells(line)


def find_layout(path: Path) -> Layout:
    """Find the layout in the first lines of a text file. Raises InputError if there is no table with a header."""
    encoding = _encoding(path)
    comments, skip, above, header = [], 0, "", None
    lines = _lines(path, encoding)
    for skip, line in lines:
        above += line
        if len(above) > 16 * _MAX_LINE_CHARS:
            limit = f"at most {16 * _MAX_LINE_CHARS} characters are read above it"
            raise InputError("header", "missing", limit, str(path), "Remove what is above the header.")
        if line.lstrip().startswith("#"):
            comments.append((skip, line.lstrip()[1:].removeprefix(" ").rstrip("\r\n")))
        elif line.strip():
            header = line
            break
    if header is None:
        raise InputError("file", "empty", "a header and rows of numbers are needed", str(path))
    data = [line for _, line in islice(lines, 100) if line.partition("#")[0].strip()]
    lines.close()
    delimiter = _delimiter(header)
    if all(_is_number(cell.replace(",", ".")) for cell in _cells(header, delimiter)):
        return _commented_header(
            path=path, encoding=encoding, comments=comments, skip=skip, above=above, data=[header, *data]
        )
    if not data:
        raise InputError(
            "number of samples",
            0,
            "the file ends after its header",
            str(path),
            "Record again, or check that the export was complete.",
        )
    return _layout(path=path, encoding=encoding, comments=comments, skip=skip, above=above, header=header, data=data)


def _layout(
    *,
    path: Path,
    encoding: str,
    comments: list[tuple[int, str]],
    skip: int,
    above: str,
    header: str,
    data: list[str],
) -> Layout:
    delimiter = _delimiter(header)
    headers = _cells(header, delimiter)
    _check_columns(headers, path)
    if len(headers) == 1:
        raise InputError(
            "number of columns",
            1,
            "time, depth and force are needed",
            str(path),
            "Separate the columns by commas, semicolons, tabs or blanks.",
        )
    decimal = "," if delimiter != "," and _any_decimal_comma(data, delimiter) else "."
    return Layout(
        path=path,
        encoding=encoding,
        delimiter=delimiter,
        decimal=decimal,
        headers=headers,
        skip=skip,
        above=above.count(delimiter),
        comments=comments,
    )


def _commented_header(
    *, path: Path, encoding: str, comments: list[tuple[int, str]], skip: int, above: str, data: list[str]
) -> Layout:
    """The layout with a header as NumPy writes it: the last comment line, with as many cells as the rows below."""
    columns = len(_cells(data[0], _delimiter(data[0])))
    header = comments[-1][1] if comments else ""
    if len(_cells(header, _delimiter(header))) != columns or columns < 2:
        raise InputError(
            "header",
            "missing",
            f"the first line contains numbers: {data[0].strip()[:60]!r}",
            str(path),
            "Add a first line that names each column and its unit, such as time_s,depth_mm,force_N.",
        )
    above = above[: above.rindex(data[0])]
    layout = _layout(
        path=path, encoding=encoding, comments=comments[:-1], skip=skip - 1, above=above, header=header, data=data
    )
    return replace(layout, header_commented=True)


def _any_decimal_comma(lines: list[str], delimiter: str) -> bool:
    return any(_DECIMAL_COMMA.fullmatch(cell) for line in lines for cell in _cells(line, delimiter))


def _delimiter(header: str) -> str:
    return next((mark for mark in "\t;," if mark in header), WHITESPACE)


def _cells(line: str, delimiter: str) -> list[str]:
    if delimiter == WHITESPACE:
        return re.split(r"\s+(?![\[(])", line.strip())  # "Force [N]" is one header
    return [cell.strip() for cell in next(csv.reader([line.strip("\r\n")], delimiter=delimiter), [])]


def _lines(path: Path, encoding: str) -> Generator[tuple[int, str], None, None]:
    """The lines of a file with their numbers from 1. Raises InputError for one that is too long to be of a table."""
    with io.TextIOWrapper(open_regular(path), encoding=encoding, errors="replace") as file:
        for number in count(1):
            line = file.readline(_MAX_LINE_CHARS + 1)
            if len(line) > _MAX_LINE_CHARS:
                limit = f"at most {_MAX_LINE_CHARS} can be read"
                place, step = f"{path}, line {number}", "Correct or remove the line."
                raise InputError("characters in the line", f"over {_MAX_LINE_CHARS}", limit, place, step)
            if not line:
                return
            yield number, line


def _check_columns(headers: list[str], path: Path) -> None:
    """Raise InputError for more or longer headers than any table has."""
    if len(headers) > _MAX_COLUMNS:
        limit, step = f"at most {_MAX_COLUMNS} can be read", "Save fewer columns."
        raise InputError("number of columns", len(headers), limit, str(path), step)
    longest = max(headers, key=len)
    if len(longest) > _MAX_HEADER_CHARS:
        limit, step = f"at most {_MAX_HEADER_CHARS} characters", "Rename the column."
        raise InputError("header", f"{longest[:40]!r}… of {len(longest)} characters", limit, str(path), step)


def _is_number(cell: str) -> bool:
    return _NUMBER.fullmatch(cell) is not None


def _encoding(path: Path) -> str:
    """UTF-8, with or without byte order mark, otherwise Latin-1. Raises InputError if it is not a readable text
    file."""
    start = _first_bytes(path)
    if b"\0" in start or start[:2] in (b"\xff\xfe", b"\xfe\xff"):
        raise InputError(
            "file", "binary", "a text file with columns is needed", str(path), "Export the recording as CSV, in UTF-8."
        )
    try:
        start.decode("utf-8") if len(start) < 65536 else start[: start.rfind(b"\n") + 1].decode("utf-8")
    except UnicodeDecodeError:
        return "latin-1"
    return "utf-8-sig"


def _first_bytes(path: Path) -> bytes:
    with open_regular(path) as file:
        try:
            return file.read(65536)
        except OSError as error:
            raise InputError("file", "not readable", error.strerror or "", str(path)) from None
