# SPDX-License-Identifier: Apache-2.0
"""Tables of text with more than plain numbers, by pandas: comments, times of a clock, signs of thousands, and files so
large that only the used columns are kept."""

import codecs
import re
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ...errors import InputError
from ...files import digest, open_regular
from ..columns import Column
from .clock_times import seconds_of
from .number_texts import NoNumber, UnclearSign, may_be_grouped, numbers_of
from .plain_numbers import NO_VALUE
from .text_lines import WHITESPACE, Encoding, TextRows, ambiguous_sign, check_samples, search_fault

_CHUNK_ROWS, _CHUNK_CELLS = 500_000, 8_000_000  # the fewer rows of the two
_SPREADSHEET_SIGN = re.compile(rb"#(N/A|DIV|VALUE|NUM|REF|NULL|NAME)")


def mixed_columns(table: TextRows, columns: Mapping[str, Column]) -> tuple[dict[str, np.ndarray], str, bool]:
    """The columns' values, the file's SHA-256, and whether every row certainly has as many cells as the header.

    Raises InputError, with the line of the fault if there is one.
    """
    try:
        values = _in_chunks(table, columns)
    except InputError:
        raise
    except (ValueError, OverflowError, IndexError) as error:  # pandas' IndexError: no row is left without comments
        table = _of_one_byte(table)
        search_fault(table, columns)
        values = _from_texts(table, columns, error)
    else:
        for quantity, column in columns.items():
            if _may_be_grouped(values[quantity]) and may_be_grouped(table.texts(column.index)):
                raise ambiguous_sign(column, table.decimal, table.path)
    rows = len(next(iter(values.values())))
    return values, digest(table.path), _delimiters(table) == rows * (len(table.headers) - 1)


def _of_one_byte(table: Any) -> Any:
    """A table that begins as UTF-8 and is none: one byte a character, of which the first lines have plain ones only."""
    if table.encoding.name != "utf-8":
        return table
    decoder = codecs.getincrementaldecoder("utf-8")()
    try:
        for block in _blocks(table):
            decoder.decode(block)
    except UnicodeDecodeError:
        return replace(table, encoding=Encoding(name="latin-1", mark=table.encoding.mark))
    return table


def _from_texts(table: TextRows, columns: Mapping[str, Column], error: Exception) -> dict[str, np.ndarray]:
    """The values of a table whose cells are numbers, but not as pandas reads them: with signs of thousands, exponents
    of Fortran, or decimal signs that differ between columns. Raises InputError."""
    used = {column.index: column for column in columns.values()}
    step = "Look at the table in an editor, or export it again."
    try:
        texts = _in_chunks(table, columns, as_text=True)
        found = numbers_of({c.index: texts[q] for q, c in columns.items() if c.index not in table.clock_columns},
                           table.decimal)  # fmt: skip
    except UnclearSign as unclear:
        raise ambiguous_sign(used[unclear.index], table.decimal, table.path) from None
    except NoNumber as fault:
        column, text = used[fault.index], texts[used[fault.index].quantity][fault.row]
        limit = "a number with the decimal sign of the other rows is needed"
        name, place = f"{column.quantity} (column {column.header!r})", table.place(fault.row)
        raise InputError(name, repr(text[:40]), limit, place, "Correct or remove the line.") from None
    except (ValueError, OverflowError, IndexError):
        why = "it has no rows of numbers" if isinstance(error, IndexError) else str(error)
        raise InputError("table", "not readable", why, str(table.path), step) from error
    return {q: found.get(c.index, texts[q]) for q, c in columns.items()}


def _may_be_grouped(values: np.ndarray) -> bool:
    """Whether (n,) numbers may be whole ones whose sign of thousands was read as a decimal sign."""
    found = np.abs(values[np.isfinite(values)])
    whole = found == np.round(found)
    parts = 1e3 * found[~whole]
    three = (np.abs(parts - np.round(parts)) < 1e-6).all() and (parts >= 1e3).all()
    return bool(whole.any() and len(parts) and three and (found < 1e3).all())


def _in_chunks(table: TextRows, columns: Mapping[str, Column], as_text: bool = False) -> dict[str, np.ndarray]:
    """The values of the columns by pandas, or their texts; times of a clock in seconds."""
    used = sorted({column.index for column in columns.values()})
    kinds = {k: str if as_text or k in table.clock_columns else np.float64 for k in used}
    options = {"dtype": kinds, "usecols": used, "chunksize": min(_CHUNK_ROWS, _CHUNK_CELLS // len(table.headers))}
    options |= {"comment": "#"} if _has_comments(table) else {}
    chunks, done = [], 0
    with _Rows(table) as file:
        for frame in _parsed(table, file, options):
            chunks.append({k: frame[k].to_numpy() for k in used})
            done += len(frame)
            check_samples(done, table.path)
    found = {k: np.concatenate([chunk[k] for chunk in chunks]) for k in used}
    found |= {k: seconds_of(found[k], str(table.path)) for k in used if k in table.clock_columns}
    texts = {k for k in used if as_text and k not in table.clock_columns}
    found |= {k: ["" if each is np.nan else each for each in found[k]] for k in texts}
    return {q: found[c.index] if c.index in texts else found[c.index].astype(float) for q, c in columns.items()}


def _has_comments(table: TextRows) -> bool:
    """Whether ``#`` begins a comment: no sign of a spreadsheet such as ``#N/A`` is in the file, and no cell of text has
    one."""
    if any(_SPREADSHEET_SIGN.search(block) for block in _blocks(table)):
        return False
    return not any("#" in cell for k in table.text_columns for cell in table.texts(k))


def _parsed(table: TextRows, file: "_Rows", options: Mapping[str, Any]) -> Any:
    import pandas  # late: it takes longer than reading most files

    with warnings.catch_warnings():
        warnings.simplefilter("error", pandas.errors.ParserWarning)  # surplus cells would be lost
        try:
            return pandas.read_csv(file, **_read_options(table), **options)
        except pandas.errors.ParserWarning as error:
            raise ValueError(str(error)) from None


def _read_options(table: TextRows) -> dict[str, Any]:
    return {
        "sep": table.delimiter,
        "decimal": table.decimal,
        "compression": None,
        "encoding": "utf-8",
        "encoding_errors": "replace",
        "header": None,
        "names": range(len(table.headers)),
        "index_col": False,
        "skipinitialspace": table.delimiter != WHITESPACE,
        "na_values": NO_VALUE,
    }


def _delimiters(table: TextRows) -> int:
    """How often the delimiter occurs in the rows: with usecols, pandas accepts surplus cells."""
    if table.delimiter == WHITESPACE or table.end is not None:
        return -1
    return sum(block.count(table.delimiter.encode(table.encoding.name)) for block in _blocks(table))


def _blocks(table: TextRows) -> Iterator[bytes]:
    with open_regular(table.path) as file:
        file.seek(table.begin)
        yield from iter(lambda: file.read(1 << 20), b"")


class _Rows:
    """The rows of a table as a binary file for pandas, which takes any for UTF-8."""

    def __init__(self, table: TextRows):
        name = table.encoding.name
        self._decoder = codecs.getincrementaldecoder(name)("replace") if name != "utf-8" else None
        self._file = open_regular(table.path)
        self._file.seek(table.begin)
        self._left = table.path.stat().st_size if table.end is None else max(0, table.end - table.begin)

    def __enter__(self):
        return self

    def __exit__(self, *_: object):
        self._file.close()

    def __iter__(self):
        return iter(lambda: self.read(1 << 18), b"")

    def read(self, size: int = -1) -> bytes:
        """The next bytes, empty at the end."""
        data = self._file.read(self._left if size < 0 else min(size, self._left))
        self._left -= len(data)
        return data if self._decoder is None else self._decoder.decode(data, final=not data).encode()
