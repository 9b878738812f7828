# SPDX-License-Identifier: Apache-2.0
"""The values of a table of text: parsed fast and hashed at the same time, and searched line by line only for a
fault."""

import codecs
import csv
import hashlib
import io
import re
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...errors import InputError
from ...files import MAX_SAMPLES, open_regular
from ..columns import Column
from ..recording import Note
from .clock_times import seconds_of
from .rows import MISSING, is_missing, is_number

if TYPE_CHECKING:
    import pandas

WHITESPACE = r"\s+"
MAX_LINE_CHARS = 1 << 16
_BLOCKS_PER_TASK = 4  # blocks hashed per task, because each change of thread costs time
_PARALLEL_BYTES = 5 << 20  # bytes: larger files are parsed faster with low_memory, which uses several cores
_CHUNKED_BYTES = 1 << 28  # larger files are parsed in chunks, so that memory holds little more than the used columns
_CHUNK_ROWS, _CHUNK_CELLS = 500_000, 8_000_000  # the fewer rows of the two
_NO_VALUE = sorted({word for each in MISSING for word in (each, each.upper(), each.capitalize())} - {""})


@dataclass(frozen=True)
class Encoding:
    """The encoding of a text file by Python's name, and the bytes of its mark."""

    name: str
    mark: int = 0

    @property
    def errors(self) -> str:
        """How undecodable bytes are kept, so that the text has as many bytes again."""
        return "surrogateescape" if self.name == "utf-8" else "replace"  # which has two bytes in UTF-16, too


@dataclass(eq=False, kw_only=True)
class TextTable:
    """A table of text, with the interface of ``FileTable``.

    ``begin`` and ``end`` are the bytes of its rows, ``first_row`` is the line of the first; ``headers`` are numbers of
    columns where ``has_header`` is False. ``grouped`` is True if numbers have a sign of thousands.
    """

    path: Path
    encoding: Encoding
    delimiter: str
    decimal: str
    headers: list[str]
    units: list[str]
    has_header: bool = True
    grouped: bool = False
    comments: list[tuple[int, str]] = field(default_factory=list)
    title: list[str] = field(default_factory=list)
    name: str = ""
    first_row: int = 1
    begin: int = 0
    end: int | None = None
    notes: list[Note] = field(default_factory=list)
    text_columns: frozenset[int] = frozenset()
    clock_columns: frozenset[int] = frozenset()

    def __post_init__(self):
        """A column with times of a clock is in seconds."""
        self.units = ["s" if k in self.clock_columns else unit for k, unit in enumerate(self.units)]

    def cells(self, line: str) -> list[str]:
        """The cells of one line without comment and surrounding blanks."""
        return split_cells(line, self.delimiter)

    def is_number(self, cell: str) -> bool:
        """Whether a cell contains a number or a missing value."""
        return is_missing(cell) or is_number(cell, self.decimal)

    def place(self, row: int) -> str:
        """The place of a row of data: file and line."""
        number = next(number for at, (number, _) in enumerate(self.data_lines()) if at == row)
        return f"{self.path}, line {number}"

    def data_lines(self) -> Iterator[tuple[int, list[str]]]:
        """Each line of data as its number in the file, from 1, and its cells. Slow; used to locate a fault."""
        for number, _, line in self._lines(self.begin, self.first_row):
            if cells := self.cells(line):
                yield number, cells

    def all_lines(self) -> Iterator[tuple[int, int, str]]:
        """Each line of the file: number, first byte, text."""
        return self._lines(self.encoding.mark, 1, whole=True)

    def _lines(self, begin: int, first: int, whole: bool = False) -> Iterator[tuple[int, int, str]]:
        with open_regular(self.path) as binary:
            binary.seek(begin)
            text = io.TextIOWrapper(binary, encoding=self.encoding.name, errors=self.encoding.errors, newline="")
            for number in count(first):
                line = text.readline(MAX_LINE_CHARS + 1)
                if not line or (self.end is not None and begin >= self.end and not whole):
                    return
                if len(line) > MAX_LINE_CHARS:
                    raise long_line(self.path, number)
                yield number, begin, line
                begin += len(line.encode(self.encoding.name, self.encoding.errors))

    @property
    def is_large(self) -> bool:
        """Whether the values are read in chunks, only when they are used."""
        return self._size() >= _CHUNKED_BYTES

    def first_cells(self) -> list[str]:
        """The cells of the first row."""
        return next((cells for _, cells in self.data_lines()), [])

    def texts(self, index: int) -> list[str]:
        """The cells of a column."""
        return [cells[index] if index < len(cells) else "" for _, cells in self.data_lines()]

    def from_row(self, number: int) -> "TextTable | None":
        """The table without the lines above the one with this number; None if it ends before."""
        for line, offset, text in self._lines(self.begin, self.first_row):
            if line >= number and self.cells(text):
                return replace(self, begin=offset, first_row=line)
        return None

    def fault(self, columns: Mapping[str, Column]) -> bool:
        """Whether the last line is truncated. Raises InputError for the first line with text or other cells."""
        return search_fault(self, columns)

    def parses(self) -> bool:
        """Whether every line to the end is a row of numbers; a large file is not parsed for this."""
        return self.is_large or self._frame is not None

    def numbers(self, columns: Mapping[str, Column]) -> tuple[dict[str, np.ndarray], str, bool]:
        """The columns' values, the file's SHA-256, and whether every row certainly has as many cells as the header.

        The fast attempt assumes that the file contains only numbers: pandas then uses several cores and rejects surplus
        cells. If it fails, the slow attempt reads only the used columns and accepts comments. Raises InputError.
        """
        if not self.is_large and self._frame is not None:
            frame, sha256, complete = self._frame
            if all(column.index in frame for column in columns.values()):
                return {q: _writable(frame[column.index]) for q, column in columns.items()}, sha256, complete
        try:
            values, sha256 = self._slow(columns)
        except InputError:
            raise
        except (ValueError, OverflowError) as error:
            search_fault(self, columns)
            raise InputError("table", "not readable", str(error), str(self.path)) from error
        rows = len(next(iter(values.values())))
        return values, sha256, self._delimiters() == rows * (len(self.headers) - 1)

    def _size(self) -> int:
        return self.path.stat().st_size

    @cached_property
    def _frame(self) -> "tuple[pandas.DataFrame, str, bool] | None":
        """The columns of numbers, the file's SHA-256, and whether no row can have surplus cells; None if a line is not
        a row of numbers."""
        if self.clock_columns or self.grouped:
            return None
        used = [k for k in range(len(self.headers)) if k not in self.text_columns]
        options: dict[str, Any] = {"dtype": np.float64, "low_memory": self._size() >= _PARALLEL_BYTES}
        options |= {"usecols": used} if self.text_columns else {}
        try:
            with HashedFile(self.path, self.begin, self.end, self.encoding.name) as file:
                frame = self._parsed(file, options)
            check_samples(len(frame), self.path)
        except InputError:
            raise
        except (ValueError, OverflowError):  # pandas' own parsing errors are ValueErrors too
            return None
        complete = not self.text_columns or self._delimiters() == len(frame) * (len(self.headers) - 1)
        return frame, file.sha256(), complete

    def _slow(self, columns: Mapping[str, Column]) -> tuple[dict[str, np.ndarray], str]:
        used = sorted({column.index for column in columns.values()})
        kinds = {k: str if k in self.clock_columns else np.float64 for k in used}
        rows = min(_CHUNK_ROWS, _CHUNK_CELLS // len(self.headers))
        options = {"dtype": kinds, "usecols": used, "chunksize": rows}
        options |= {"comment": "#"} if self._has_comments() else {}
        chunks, done = [], 0
        with HashedFile(self.path, self.begin, self.end, self.encoding.name) as file:
            for frame in self._parsed(file, options):
                chunks.append({k: frame[k].to_numpy() for k in used})
                done += len(frame)
                check_samples(done, self.path)
        found = {k: np.concatenate([chunk[k] for chunk in chunks]) for k in used}
        found |= {k: seconds_of(found[k], str(self.path)) for k in used if k in self.clock_columns}
        return {q: found[column.index].astype(float) for q, column in columns.items()}, file.sha256()

    def _has_comments(self) -> bool:
        """Whether ``#`` begins a comment, and no sign of a spreadsheet such as ``#N/A`` is in the file."""
        with open_regular(self.path) as file:
            file.seek(self.begin)
            return not any(re.search(rb"#(N/A|DIV|VALUE|NUM|REF|NULL|NAME)", block) for block in _blocks(file))

    def _parsed(self, file: "HashedFile", options: dict) -> Any:
        import pandas  # late: importing needleforce stays fast

        with warnings.catch_warnings():
            warnings.simplefilter("error", pandas.errors.ParserWarning)  # surplus cells would be lost
            try:
                return self._parsed_by(pandas.read_csv, file, options)
            except pandas.errors.ParserWarning as error:
                raise ValueError(str(error)) from None

    def _parsed_by(self, read_csv: Callable, file: "HashedFile", options: dict) -> Any:
        return read_csv(
            file,
            sep=self.delimiter,
            decimal=self.decimal,
            thousands=("." if self.decimal == "," else ",") if self.grouped else None,
            compression=None,
            encoding="latin-1" if self.encoding.name == "latin-1" else "utf-8",
            encoding_errors="replace",
            header=None,
            names=range(len(self.headers)),
            index_col=False,
            skipinitialspace=self.delimiter != WHITESPACE,
            na_values=_NO_VALUE,
            **options,
        )

    def _delimiters(self) -> int:
        """How often the delimiter occurs in the rows: with usecols, pandas accepts surplus cells."""
        if self.delimiter == WHITESPACE or self.end is not None:
            return -1
        with open_regular(self.path) as file:
            file.seek(self.begin)
            return sum(block.count(self.delimiter.encode(self.encoding.name)) for block in _blocks(file))


def _blocks(file: Any) -> Iterator[bytes]:
    return iter(lambda: file.read(1 << 20), b"")


def _writable(column: Any) -> np.ndarray:
    return column.to_numpy(copy=True)


def split_cells(line: str, delimiter: str) -> list[str]:
    """The cells of a line without surrounding blanks and quotes; none of a blank line and of a comment."""
    text = line.strip("\r\n\x1a\0 ")
    if "#" in text:
        text = _without_comment(text)
    if not text:
        return []
    if delimiter == WHITESPACE:
        return [cell.strip('"') for cell in re.split(r"\s+(?![\[(])", text.strip())]
    if '"' not in text:
        return [cell.strip() for cell in text.split(delimiter)]
    return [cell.strip() for cell in next(csv.reader([text], delimiter=delimiter, skipinitialspace=True), [])]


def _without_comment(text: str) -> str:
    """A line without what follows ``#``, unless that begins a spreadsheet's ``#N/A`` or stands in a word."""
    found = re.search(r"(?<![^\s,;\t])#(?!N/A|DIV|VALUE|NUM|REF|NULL|NAME)", text)
    return text[: found.start()].rstrip() if found else text


def long_line(path: Path, number: int) -> InputError:
    """The error for a line that is too long to be of a table."""
    limit = f"at most {MAX_LINE_CHARS} can be read"
    place, step = f"{path}, line {number}", "Correct or remove the line."
    return InputError("characters in the line", f"over {MAX_LINE_CHARS}", limit, place, step)


def check_samples(count: int, path: Path) -> None:
    """Raise InputError for more samples than a recording can have."""
    if count > MAX_SAMPLES:
        limit = f"at most {MAX_SAMPLES} are read: nine hours at 1 kHz"
        raise InputError("number of samples", f"over {MAX_SAMPLES}", limit, str(path), "Split the file.")


def search_fault(table: TextTable, columns: Mapping[str, Column]) -> bool:
    """Raise InputError for the first line with text or a wrong number of cells; return whether the last line is
    truncated."""
    pending, cells = None, []
    for number, cells in table.data_lines():
        if pending:
            raise pending
        place = f"{table.path}, line {number}"
        if len(cells) != len(table.headers):
            pending = _wrong_count(table, cells, place)
        for column in columns.values():
            if column.index < len(cells) and not table.is_number(cells[column.index]):
                value, limit = repr(cells[column.index][:40]), "a number is needed"
                step = "Correct or remove the line."
                raise InputError(f"{column.quantity} (column {column.header!r})", value, limit, place, step)
    if pending and len(cells) > len(table.headers):
        raise pending
    return pending is not None


def _wrong_count(table: TextTable, cells: Sequence[str], place: str) -> InputError:
    advice = "With decimal commas, separate the columns by semicolons." if table.delimiter == "," else ""
    limit = f"the {'header' if table.has_header else 'first row'} has {len(table.headers)}"
    return InputError("number of cells", len(cells), limit, place, f"Correct or remove the line. {advice}".strip())


class HashedFile:
    """A binary file for pandas, used as a context manager, from byte ``begin`` to ``end``, UTF-16 as UTF-8; the SHA-256
    of the whole file is computed in another thread."""

    def __init__(self, path: Path, begin: int = 0, end: int | None = None, encoding: str = "utf-8"):
        self._path, self._digest, self._ended = path, hashlib.sha256(), False
        self._decoder = codecs.getincrementaldecoder(encoding)("replace") if encoding[:6] == "utf-16" else None
        self._begin, self._left = begin, None if end is None else max(0, end - begin)
        self._waiting: list[bytes] = []

    def __enter__(self):
        self._file = open_regular(self._path)
        self._digest.update(self._file.read(self._begin))
        self._executor = ThreadPoolExecutor(1)
        return self

    def __exit__(self, *_: object):
        self._file.close()
        self._executor.shutdown()

    def __iter__(self):
        return iter(lambda: self.read(1 << 18), b"")

    def read(self, size: int = -1) -> bytes:
        """The next bytes, empty at the end."""
        if self._left is not None:
            size = self._left if size < 0 else min(size, self._left)
        data = self._file.read(size)
        if self._left is not None:
            self._left -= len(data)
            return self._as_utf8(data)
        self._waiting += [data] if data else []
        if len(self._waiting) == _BLOCKS_PER_TASK or not data:
            self._executor.submit(self._update, self._waiting)
            self._waiting = []
        self._ended = not data
        return self._as_utf8(data)

    def _as_utf8(self, data: bytes) -> bytes:
        """The bytes as pandas takes them: UTF-16 as UTF-8, and the others as they are."""
        return data if self._decoder is None else self._decoder.decode(data, final=not data).encode()

    def _update(self, blocks: list[bytes]) -> None:
        for block in blocks:
            self._digest.update(block)

    def sha256(self) -> str:
        """The digest of the complete file, once it is closed; a file that was not read to its end is read again."""
        if self._ended:
            return self._digest.hexdigest()
        with open_regular(self._path) as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
