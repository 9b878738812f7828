# SPDX-License-Identifier: Apache-2.0
"""Tables of text with more than plain numbers, by pandas: comments, times of a clock, signs of thousands, and files so
large that only the used columns are kept."""

import codecs
import re
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...errors import InputError
from ...files import MAX_SAMPLES, check_count, open_regular
from .clock_times import seconds_of
from .number_texts import NoNumber, UnclearSign, may_be_grouped, numbers_of
from .rows import NO_VALUE, WHITESPACE
from .text_rows import Encoding, TextRows, ambiguous_sign, split_cells

_CHUNK_ROWS, _CHUNK_CELLS = 500_000, 8_000_000  # the fewer rows of the two
_SPREADSHEET_SIGN = re.compile(rb"#(N/A|DIV|VALUE|NUM|REF|NULL|NAME)")


def mixed_columns(rows: TextRows, columns: Sequence[int]) -> tuple[list[np.ndarray], bool]:
    """The values of columns, and whether every row certainly has as many cells as the header.

    Raises InputError, with the line of the fault if there is one.
    """
    try:
        values = _in_chunks(rows, columns)
    except InputError:
        raise
    except (ValueError, OverflowError, IndexError) as error:  # pandas' IndexError: no row is left without comments
        rows = _of_one_byte(rows)
        rows.fault(columns)
        width = max((len(split_cells(line, rows.delimiter)) for _, _, line in rows.lines()), default=0)
        values = _from_texts(rows, columns, error, max(width, len(rows.headers)))
    else:
        for column, found in values.items():
            if _may_be_grouped(found) and may_be_grouped(rows.texts(column)):
                raise ambiguous_sign(rows.headers[column], rows.decimal, rows.path)
    found = [values[column] for column in columns]
    return found, _delimiters(rows) == len(found[0]) * (len(rows.headers) - 1)


def _of_one_byte(rows: TextRows) -> TextRows:
    """A table that begins as UTF-8 and is none: one byte a character, of which the first lines have plain ones only."""
    if rows.encoding.name != "utf-8":
        return rows
    decoder = codecs.getincrementaldecoder("utf-8")()
    try:
        for block in _blocks(rows):
            decoder.decode(block)
    except UnicodeDecodeError:
        return replace(rows, encoding=Encoding(name="latin-1", mark=rows.encoding.mark))
    return rows


def _from_texts(rows: TextRows, columns: Sequence[int], error: Exception, width: int) -> dict[int, np.ndarray]:
    """The values of a table whose cells are numbers, but not as pandas reads them: with signs of thousands, exponents
    of Fortran, decimal signs that differ between columns, or rows of up to ``width`` cells. Raises InputError."""
    step = "Look at the table in an editor, or export it again."
    try:
        texts = _in_chunks(rows, columns, width)
        found = numbers_of({k: texts[k] for k in columns if k not in rows.clock_columns}, rows.decimal)
    except UnclearSign as unclear:
        raise ambiguous_sign(rows.headers[unclear.index], rows.decimal, rows.path) from None
    except NoNumber as fault:
        limit = "a number with the decimal sign of the other rows is needed"
        name, text = f"column {rows.headers[fault.index]!r}", texts[fault.index][fault.row]
        place, step = rows.place(fault.row), "Correct or remove the line."
        raise InputError(name, repr(text[:40]), limit, place, step) from None
    except (ValueError, OverflowError, IndexError):
        why = "it has no rows of numbers" if isinstance(error, IndexError) else str(error)
        raise InputError("table", "not readable", why, str(rows.path), step) from error
    return {k: found.get(k, texts[k]) for k in columns}


def _may_be_grouped(values: np.ndarray) -> bool:
    """Whether (n,) numbers may be whole ones whose sign of thousands was read as a decimal sign."""
    found = np.abs(values[np.isfinite(values)])
    whole = found == np.round(found)
    parts = 1e3 * found[~whole]
    three = (np.abs(parts - np.round(parts)) < 1e-6).all() and (parts >= 1e3).all()
    return bool(whole.any() and len(parts) and three and (found < 1e3).all())


def _in_chunks(rows: TextRows, columns: Sequence[int], width: int = 0) -> dict[int, np.ndarray]:
    """The values of the columns by pandas, or the texts in rows of up to ``width`` cells; times of a clock in
    seconds."""
    as_text = width > 0
    used = sorted(set(columns))
    kinds = {k: str if as_text or k in rows.clock_columns else np.float64 for k in used}
    options = {"dtype": kinds, "usecols": used, "chunksize": min(_CHUNK_ROWS, _CHUNK_CELLS // len(rows.headers))}
    options |= {"names": range(width or len(rows.headers))} | ({"comment": "#"} if _has_comments(rows) else {})
    chunks, done = [], 0
    with _Rows(rows) as file:
        for frame in _parsed(rows, file, options):
            chunks.append({k: frame[k].to_numpy() for k in used})
            done += len(frame)
            check_count("samples", done, MAX_SAMPLES, rows.path)
    found = {k: np.concatenate([chunk[k] for chunk in chunks]) for k in used}
    found |= {k: seconds_of(found[k], str(rows.path)) for k in used if k in rows.clock_columns}
    texts = {k for k in used if as_text and k not in rows.clock_columns}
    found |= {k: ["" if each is np.nan else each for each in found[k]] for k in texts}
    return {k: found[k] if k in texts else found[k].astype(float) for k in columns}


def _has_comments(rows: TextRows) -> bool:
    """Whether ``#`` begins a comment: no sign of a spreadsheet such as ``#N/A`` is in the file, and no cell of text has
    one."""
    if any(_SPREADSHEET_SIGN.search(block) for block in _blocks(rows)):
        return False
    return not any("#" in cell for k in rows.text_columns for cell in rows.texts(k))


def _parsed(rows: TextRows, file: "_Rows", options: Mapping[str, Any]) -> Any:
    import pandas  # late: it takes longer than reading most files

    with warnings.catch_warnings():
        warnings.simplefilter("error", pandas.errors.ParserWarning)  # surplus cells would be lost
        try:
            return pandas.read_csv(file, **_read_options(rows), **options)
        except pandas.errors.ParserWarning as error:
            raise ValueError(str(error)) from None


def _read_options(rows: TextRows) -> dict[str, Any]:
    return {
        "sep": rows.delimiter,
        "decimal": rows.decimal,
        "compression": None,
        "encoding": "utf-8",
        "encoding_errors": "replace",
        "header": None,
        "index_col": False,
        "skipinitialspace": rows.delimiter != WHITESPACE,
        "na_values": NO_VALUE,
    }


def _delimiters(rows: TextRows) -> int:
    """How often the delimiter occurs in the rows: with usecols, pandas accepts surplus cells."""
    if rows.delimiter == WHITESPACE or rows.end is not None:
        return -1
    return sum(block.count(rows.delimiter.encode(rows.encoding.name)) for block in _blocks(rows))


def _blocks(rows: TextRows) -> Iterator[bytes]:
    with open_regular(rows.path) as file:
        file.seek(rows.begin)
        yield from iter(lambda: file.read(1 << 20), b"")


class _Rows:
    """The rows of a table as a binary file for pandas, which takes any for UTF-8."""

    def __init__(self, rows: TextRows):
        name = rows.encoding.name
        self._decoder = codecs.getincrementaldecoder(name)("replace") if name != "utf-8" else None
        self._file = open_regular(rows.path)
        self._file.seek(rows.begin)
        self._left = rows.path.stat().st_size if rows.end is None else max(0, rows.end - rows.begin)

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
