# SPDX-License-Identifier: Apache-2.0
"""Names and units of columns that stand above a table without a row of headers: in a line that begins with a key, or
one below the other with their numbers."""

import re
from collections.abc import Iterable, Iterator, Sequence

from ..quantities import plain_name
from .rows import is_missing, is_number, is_unit
from .text_rows import split_cells

_MAX_LINES = 256  # above a table
_MAX_CHARS = 2000  # of a line with the names of all columns
_EDGES = " \t\r\n#%*\"'"
_COMMENTS = ("#", "%")
_NAMES = frozenset(
    "channeltitle channeltitles channelname channelnames channels columnname columnnames columns headers names signals "
    "signalnames variables variablenames fields labels kanalname kanalnamen kanale spalten waves wavesd".split()
)
_UNITS = frozenset("unit units unitname unitnames channelunits columnunits einheit einheiten unites unidades".split())
_WORD = r"(?:name|column|col|channel|chan|ch|field|signal|variable|var|kanal|spalte|canal|colonne|columna)"
_NAMED = re.compile(
    rf"(?P<word>{_WORD}?)[ _#\[(]*(?P<number>\d{{1,3}})[\])]?[ _.]*(?:name|title|label)?[ ]*[:=][ ]*(?P<text>\S.*)",
    re.IGNORECASE,
)
_UNIT = re.compile(
    rf"(?:(?:unit|einheit)[ _]*(?P<after>\d{{1,3}})|{_WORD}[ _]*(?P<before>\d{{1,3}})[ _.]*(?:unit|einheit))"
    r"[ ]*[:=][ ]*(?P<text>\S.*)",
    re.IGNORECASE,
)


def named_columns(
    lines: Sequence[str], delimiter: str, width: int, *, first_rises: bool
) -> tuple[list[str], list[str]]:
    """The headers and units of a table's columns, as lines above it state them.

    Parameters
    ----------
    lines : sequence of str
        The lines above the table.
    delimiter : str
        Of the cells of the table.
    width : int
        Its number of columns.
    first_rises : bool
        Whether the first column increases in every row, as times do: then it may be the one without a name.

    Returns
    -------
    headers, units : list of str
        One for each column, both empty if the lines name none: ``ChannelTitle=  Force  Position`` with ``UnitName=  mN
        mm`` (if they name one less, the first column has its number), or ``NAME0 = Position (um)``, ``# Column 2: F
        [N]``.
    """
    near = [line for line in lines[-_MAX_LINES:] if len(line) <= _MAX_CHARS]
    headers = _of_key(near, delimiter, width, _NAMES)
    if headers and (first_rises or headers[0] != "1"):
        return headers, _of_key(near, delimiter, width, _UNITS, first="")
    headers = _numbered(_names(near), width)
    return (headers, _numbered(_units(near), width)) if headers else ([], [])


def _of_key(lines: Sequence[str], delimiter: str, width: int, keys: frozenset[str], first: str = "1") -> list[str]:
    """The cells after a key in the last such line; ``first`` is that of a first column without one."""
    for line in reversed(lines):
        cells = split_cells(line.strip().lstrip("#%* "), delimiter)
        while cells and not cells[-1]:
            cells.pop()
        named = cells[1:]
        if width - 1 <= len(named) <= width and named and plain_name(cells[0].rstrip("=: ")).replace("_", "") in keys:
            if not any(is_number(cell) for cell in named):
                return [*[first] * (width - len(named)), *named]
    return []


def _numbered(entries: Iterable[tuple[int, str]], width: int) -> list[str]:
    """The texts with the numbers of all columns, from 0 or 1; none if one is absent or stated twice."""
    found: dict[int, str] = {}
    for number, text in entries:
        if found.setdefault(number, text) != text:
            return []
    complete = sorted(found) in ([*range(width)], [*range(1, width + 1)])
    return [found[number] for number in sorted(found)] if complete else []


def _names(lines: Sequence[str]) -> Iterator[tuple[int, str]]:
    """Number and name of each column that a line names; a number without a word before it in comments only."""
    for line in lines:
        found = _NAMED.fullmatch(line.strip(_EDGES))
        if found and (found["word"] or line.lstrip()[:1] in _COMMENTS):
            text = found["text"].strip(_EDGES)
            if text and not is_number(text) and not is_missing(text):
                yield int(found["number"]), text


def _units(lines: Sequence[str]) -> Iterator[tuple[int, str]]:
    """Number and unit of each column whose unit a line states."""
    for line in lines:
        found = _UNIT.fullmatch(line.strip(_EDGES))
        if found and is_unit(text := found["text"].strip(_EDGES)):
            yield int(found["after"] or found["before"]), text
