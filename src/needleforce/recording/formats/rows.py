# SPDX-License-Identifier: Apache-2.0
"""Tables in rows of cells, of a text file or of a sheet: where each begins and ends, its headers and its units."""

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace

from ...units import DIMENSIONS, find

Row = Sequence[str]
"""The cells of one line without surrounding blanks; empty for a blank line."""

WHITESPACE = r"\s+"  # a delimiter
NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eEdD][+-]?\d+)?|[+-]?(nan|inf|infinity)", re.IGNORECASE)
CLOCK = re.compile(r"(\d{4}-\d\d?-\d\d?|\d\d?[./]\d\d?[./]\d{2,4})?[ T]?\d{1,3}:\d\d?(:\d\d?([.,]\d+)?|\.\d+)?"
                   r" ?([AaPp][Mm]|Z|[+-]\d\d:?\d\d)?")  # fmt: skip
NOT_FINITE = re.compile(r"[+-]?(?:nan|inf|infinity)", re.IGNORECASE)
SIGNS = (".", ",")  # of decimals
GROUP_SIGNS = "'\u0092\u2019\u00a0\u202f\u2009"  # of thousands, too: apostrophes and narrow blanks


def _number_with(decimal: str) -> re.Pattern[str]:
    other = "." if decimal == "," else ","
    grouped = rf"[1-9]\d{{0,2}}([{other}{GROUP_SIGNS}])\d{{3}}(?:\1\d{{3}})*"
    return re.compile(rf"[+-]?(?:(?:{grouped}|\d+)(?:\{decimal}\d*)?|\{decimal}\d+)(?:[eEdD][+-]?\d+)?")


def _plain(decimal: str) -> dict[int, str | None]:
    """What replaces the signs of a number: a decimal point, no signs of thousands, ``e`` before an exponent."""
    removed = dict.fromkeys(map(ord, (*SIGNS, *GROUP_SIGNS)))
    return removed | {ord(decimal): ".", ord("d"): "e", ord("D"): "e"}


NUMBER_WITH = {sign: _number_with(sign) for sign in SIGNS}
"""A number with this decimal sign, with signs of thousands or not."""
_PLAIN = {sign: _plain(sign) for sign in SIGNS}
MISSING = frozenset(("", "na", "n/a", "null", "none", "<na>", "-", "--", "---", "*", "#n/a", "#div/0!", "#value!",
                     "#num!", "#ref!", "#null!", "#name?"))  # fmt: skip
NO_VALUE = sorted({word for each in MISSING for word in (each, each.upper(), each.capitalize())} - {""})
_HEADER_LINES = 8  # above a table, in which its headers are
_MAX_WORDS = 4  # of the name of a value
_SEARCHED = 64  # lines above a table, of which some are keywords
MIN_ROWS = 20  # shorter runs of numbers are settings or results, if there is a longer one
_RATIOS = ("", "1", "-", "mm/mm", "m/m", "in/in", "%", "percent")
_BRACKETS = {"(": ")", "[": "]", "<": ">", "{": "}"}


@dataclass(frozen=True, kw_only=True)
class Block:
    """A table within rows: first row and the one after the last, headers (empty without), units of their row,
    which columns hold text, and how many of the last are beyond an empty one and have no header; ``short_header`` are
    headers that lack one for a column of values."""

    first: int
    stop: int
    headers: list[str] = field(default_factory=list)
    units: list[str] = field(default_factory=list)
    width: int = 0
    short_header: list[str] = field(default_factory=list)
    text_columns: frozenset[int] = frozenset()
    stray: int = 0

    @property
    def numeric(self) -> int:
        """The number of columns with numbers."""
        return self.width - len(self.text_columns)


def is_number(cell: str) -> bool:
    """Whether a cell is a number with any decimal sign, with thousands in groups of three or not, or a time of a
    clock."""
    if NUMBER.fullmatch(cell) or any(form.fullmatch(cell) for form in NUMBER_WITH.values()):
        return True
    return ":" in cell and CLOCK.fullmatch(cell) is not None


def number_of(cell: str, decimal: str) -> float:
    """A number with this decimal sign, NaN for any other text."""
    if NUMBER_WITH[decimal].fullmatch(cell):
        return float(cell.translate(_PLAIN[decimal]))
    return float(cell) if NOT_FINITE.fullmatch(cell) else float("nan")


def is_missing(cell: str) -> bool:
    """Whether a cell states that there is no value."""
    return cell.casefold() in MISSING


def kinds(row: Row) -> str:
    """A letter a cell: ``n`` number, ``e`` no value, ``t`` text."""
    return "".join(["n" if is_number(c) else "e" if is_missing(c) else "t" for c in row])


def blocks(rows: Sequence[Row], shapes: Sequence[str] | None = None) -> list[Block]:
    """The tables in ``rows``, in their order; ``shapes`` are the kinds of each row if they are known.

    Rows of which no cell is a number end a table, as do those such as ``RATE = 100 Hz``. A table is the longest run of
    rows of equal kinds between two of these, with the rows around it: a damaged cell within a table is reported when it
    is read, and is no end. Of several tables those with at least 20 rows are given, or the longest alone.
    """
    shapes = [kinds(row) for row in rows] if shapes is None else shapes
    shape, usual, _ = _longest_run(shapes, 0, len(shapes))
    if rows and not _states_value(rows[usual]):
        shapes = ["t" * len(s) if "n" in s and _states_value(row) else s for row, s in zip(rows, shapes)]
    rows, shapes, stray = _without_stray(rows, shapes, shape, usual)
    found = [block for part in _between_texts(shapes) if (block := _block(rows, shapes, *part))]
    found = [replace(each, stray=max(0, each.width - stray)) if stray else each for each in found]
    longest = max((_rows_of(shapes, each) for each in found), default=0)
    return [each for each in found if _rows_of(shapes, each) >= min(longest, MIN_ROWS)]


def _states_value(row: Row) -> bool:
    """Whether the cells of a row are the words of a name, ``=`` or a colon, and a value of one to three words."""
    at = next((k for k, cell in enumerate(row) if cell.endswith(("=", ":"))), len(row))
    name = [*row[:at], row[at].rstrip("=: ")] if at < len(row) else []
    return (
        0 < len(name) <= _MAX_WORDS and name[0] != "" and at < len(row) - 1 <= at + 3 and not any(map(is_number, name))
    )


def _without_stray(
    rows: Sequence[Row], shapes: Sequence[str], shape: str, first: int
) -> tuple[Sequence[Row], Sequence[str], int]:
    """Rows and their kinds without the cells beyond an empty column where the headers end, as notes to the right of a
    table are; and the number of that column, 0 without such cells. Most rows have ``shape``, from ``first`` on."""
    at = next((k for k in range(2, len(shape)) if shape[k] == "e"), len(shape))
    beyond = [len(row) for row in rows if len(row) > at and not row[at] and any(row[at:])]
    while first and (not shapes[first - 1] or _joint(shapes[first - 1][:at], shape[:at])):
        first -= 1
    names = [k for k in range(max(0, first - _HEADER_LINES), first) if shapes[k][:at].count("t") > 1]
    named = any("t" in shapes[k][at:] and "n" not in shapes[k][at:] for k in names)
    if not beyond or not names or (named and at < len(shape)):
        return rows, shapes, 0
    width = max(beyond)
    ends = [len(row) == at or (len(row) > at and not row[at]) for row in rows]
    cut = [[*row[:at], *[""] * (width - at)] if end else row for row, end in zip(rows, ends)]
    return cut, [each[:at] + "e" * (width - at) if end else each for each, end in zip(shapes, ends)], at


def _rows_of(shapes: Sequence[str], block: Block) -> int:
    return sum("n" in shape for shape in shapes[block.first : block.stop])


def _between_texts(shapes: Sequence[str]) -> Iterator[tuple[int, int]]:
    """First row and the one after the last of every stretch without a row of text."""
    start = 0
    for k, shape in enumerate([*shapes, "t"]):
        if "t" in shape and "n" not in shape:
            if any("n" in each for each in shapes[start:k]):
                yield start, k
            start = k + 1


def _block(rows: Sequence[Row], shapes: Sequence[str], start: int, stop: int) -> Block | None:
    """The table in a stretch of rows; None if no two neighbouring rows agree in their cells."""
    shape, first, last = _longest_run(shapes, start, stop)
    width = len(shape)
    headers, units = _header(rows, shapes, start, width)
    short = _names(headers) if len(_names(headers)) < len(shape) and shape[-1] != "e" else []
    if last - first < 2 and not headers:
        return None
    above = next((k for k in range(first - 1, start - 1, -1) if shapes[k]), start)
    if headers:
        first = next(k for k in range(start, stop) if len(shapes[k]) > (width > 1))
    elif above < first and _is_header(shapes[above], shape) and not has_key(rows[above]):
        headers = list(rows[above])
    else:
        first = _first_of_width(rows, shapes, start, first)
    while not shapes[stop - 1].strip("e"):
        stop -= 1
    text = frozenset(k for k, kind in enumerate(shape) if kind == "t")
    return Block(first=first, stop=stop, headers=_padded(headers, len(shape)), units=_padded(units, len(shape)),
                 width=len(shape), short_header=short, text_columns=text)  # fmt: skip


def has_key(row: Row) -> bool:
    """Whether the first cell of a row names the others, as in ``UnitName=, N, mm``."""
    return row[:1] != [] and row[0].endswith(("=", ":")) and not any(cell.endswith(("=", ":")) for cell in row[1:])


def _names(headers: Sequence[str]) -> list[str]:
    """The headers without empty cells at the end."""
    used = max((k + 1 for k, each in enumerate(headers) if each), default=0)
    return list(headers[:used])


def _first_of_width(rows: Sequence[Row], shapes: Sequence[str], start: int, first: int) -> int:
    """The first row of a table without headers: rows right above it with as many cells belong to it."""
    width = len(shapes[first])
    for k in range(first - 1, start - 1, -1):
        if shapes[k] and (len(shapes[k]) != width or "n" not in shapes[k] or has_key(rows[k])):
            break
        first = k if shapes[k] else first
    return first


def _is_header(above: str, shape: str) -> bool:
    """Whether a row above a table has text where the table has numbers, as the headers ``Time, 1, 2``."""
    pairs = zip(above, shape, strict=False)
    return len(above) == len(shape) and any(a == "t" and b == "n" for a, b in pairs)


def _padded(cells: Sequence[str], width: int) -> list[str]:
    return [*cells[:width], *[""] * (width - len(cells))] if cells else []


def _longest_run(shapes: Sequence[str], start: int, stop: int) -> tuple[str, int, int]:
    """The joint kinds, first and last + 1 of the longest run of rows with the same number of cells, none of them text
    in one row and a number in another; blank rows do not end it."""
    best, count, at, shape, rows = ("", 0, 0), (0, 0), start, "", 0
    for k in range(start, stop + 1):
        here = shapes[k] if k < stop else "?"
        if k < stop and not here.strip("e"):
            continue
        joint = _joint(shape, here) if shape else ""
        if joint and here != "?":
            shape, rows = joint, rows + 1
            continue
        if (rows, shape.count("n")) > count:
            best, count = (shape, at, k), (rows, shape.count("n"))
        at, shape, rows = k, here, 1
    return best


def _joint(one: str, other: str) -> str:
    """The kinds that two rows have in common, empty if they contradict each other."""
    if one == other:
        return one
    if len(one) != len(other) or any({a, b} == {"n", "t"} for a, b in zip(one, other)):
        return ""
    return "".join(b if a == "e" else a for a, b in zip(one, other))


def _header(rows: Sequence[Row], shapes: Sequence[str], start: int, width: int) -> tuple[list[str], list[str]]:
    """Headers and units, of the rows of text right above row ``start``."""
    above = [k for k in range(max(0, start - _SEARCHED), start) if shapes[k].strip("e")]
    while above and width > 1 and _is_keyword(rows[above[-1]]):
        above.pop()
    above = above[-_HEADER_LINES:]
    above = above[len(above) - _trailing(above, shapes) :]
    fitting = [k for k in above if _fits(rows[k], width) and not has_key(rows[k])]
    if not fitting or fitting[-1] != above[-1]:
        return [], []
    whole = [k for k in fitting if all(rows[k][:width]) and len(rows[k]) >= width] or fitting
    last = [k for k in dict.fromkeys((fitting[-1], whole[-1])) if len(fitting) > 1 and is_unit_row(rows[k])]
    units = list(rows[last[0]]) if last else []  # a column of texts has none
    names = max([k for k in whole if k not in last[:1]] or [k for k in fitting if k not in last[:1]])
    return [each.strip() for each in rows[names]], [bare(unit) for unit in units]


def _is_keyword(row: Row) -> bool:
    """Whether a row is one word or sentence, or states a value, and has no names of columns."""
    return sum(map(bool, row)) == 1 or _states_value(row)


def _trailing(above: Sequence[int], shapes: Sequence[str]) -> int:
    """How many of the last rows above hold text only."""
    count = 0
    for k in reversed(above):
        if "n" in shapes[k]:
            break
        count += 1
    return count


def _fits(row: Row, width: int) -> bool:
    """Whether a row has a cell a column, but for empty ones at its end, and more than one unless the table has one."""
    used = max((k + 1 for k, cell in enumerate(row) if cell), default=0)
    return used <= width <= len(row) + 1 and (used > 1 or width == 1)


def bare(cell: str) -> str:
    """A unit without the brackets around it."""
    text = cell.strip()
    return text[1:-1].strip() if text[:1] in _BRACKETS and text[-1:] == _BRACKETS[text[0]] else text


def is_unit_row(row: Row) -> bool:
    """Whether the cells of a row are units, in brackets or known, most of them: one may be of another quantity."""
    used = [cell for cell in row if cell and cell != "#"]
    known = sum(bare(cell) != cell or is_unit(cell) for cell in used)
    return 2 * known > len(used) > 0


def is_unit(text: str) -> bool:
    """Whether a text is a unit of any dimension, or of a ratio."""
    return text.casefold() in _RATIOS or any(find(text, dimension) for dimension in DIMENSIONS)


def decimal_sign(cells: Iterable[str]) -> str:
    """The decimal sign of cells that a comma does not separate: the one with which more of them are numbers. Of equal
    ones, such as in ``1,234``, it is the one that occurs more often."""
    commas, points = [0, 0], [0, 0]
    for cell in cells:
        if "," in cell or "." in cell:
            comma, point = (NUMBER_WITH[sign].fullmatch(cell) is not None for sign in ",.")
            commas = [commas[0] + comma, commas[1] + (comma and "," in cell)]
            points = [points[0] + point, points[1] + (point and "." in cell)]
    return "," if commas > points else "."
