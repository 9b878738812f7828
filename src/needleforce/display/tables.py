# SPDX-License-Identifier: Apache-2.0
"""Results as tables: plain text for a terminal, and the parameters of a needle, a tip, a tissue or a law."""

import textwrap
import unicodedata
from collections.abc import Iterable, Sequence
from typing import Any

from .markup import Markup, element, join, table, visible
from .quantities import plain

WIDTH = 110  # columns of a terminal that a text may use
GAP = "  "  # between columns
PARAMETER_HEAD = ("parameter", "symbol", "value", "meaning")


def text_table(head: Sequence[str], rows: Iterable[Sequence[object]], indent: str = "  ") -> str:
    """Return a table in aligned columns, one line per row; columns without any content are omitted.

    Parameters
    ----------
    head : sequence of str
        Name of each column.
    rows : iterable of sequences
        Cells, as many as there are columns, shown by ``str``.
    indent : str
        Text before each line.

    Returns
    -------
    str
        Lines, without a line break at the end; empty without rows.
    """
    cells = [[visible(str(cell)) for cell in row] for row in rows]
    keep = [k for k in range(len(head)) if any(row[k] for row in cells)]
    if not cells or not keep:
        return ""
    lines = [[head[k] for k in keep], *([row[k] for k in keep] for row in cells)]
    widths = [max(_width(line[k]) for line in lines) for k in range(len(keep))]
    padded = [GAP.join(cell + " " * (width - _width(cell)) for cell, width in zip(line, widths)) for line in lines]
    rule = "-" * min(sum(widths) + len(GAP) * (len(widths) - 1), WIDTH)
    return "\n".join(f"{indent}{line}".rstrip() for line in (padded[0], rule, *padded[1:]))


def text_list(title: str, sentences: Iterable[str]) -> str:
    """Return a title and a wrapped line for each sentence.

    Parameters
    ----------
    title : str
        First line, without its colon.
    sentences : iterable of str
        One list item each.

    Returns
    -------
    str
        Empty without sentences.
    """
    wrapped = [
        textwrap.fill(visible(each), WIDTH, initial_indent="  - ", subsequent_indent="    ") for each in sentences
    ]
    return "\n".join([f"{title}:", *wrapped]) if wrapped else ""


def blocks(*parts: str) -> str:
    """Join the parts that are not empty with line breaks.

    Parameters
    ----------
    *parts : str
        Parts of a text.

    Returns
    -------
    str
    """
    return "\n".join(part for part in parts if part)


def _width(text: str) -> int:
    """Width of a text in columns; combining characters have no width."""
    return sum(not unicodedata.combining(letter) for letter in text)


def parameter_rows(value: Any) -> list[tuple[str, str, str, str]]:
    """The parameters of a value of the core, from its table.

    Parameters
    ----------
    value : nf.Needle, nf.Tissue, a tip of nf.tips or a law of nf.laws
        Has ``table()`` and ``parameters()``.

    Returns
    -------
    list of tuple
        Name, symbol, value with unit, and meaning, of each parameter, under ``PARAMETER_HEAD``.
    """
    numbers = value.parameters()
    rows = [
        (row["name"], row["symbol"], _each_plain(numbers[row["name"]], row["unit"]), row["meaning"])
        for row in value.table()
    ]
    parts = ((part, getattr(value, part)) for part in getattr(value, "parts", ()))
    return rows + [(part, "", in_words(found), "") for part, found in parts if found is not None]


def _each_plain(value: float | tuple[float, ...], unit: str) -> str:
    """One value, or the values of the knots of a profile."""
    return ", ".join(plain(each, unit) for each in (value if isinstance(value, tuple) else (value,)))


def in_words(value: Any) -> str:
    """A tip in one line.

    Parameters
    ----------
    value : a tip of nf.tips
        Another value is written as ``str`` writes it.

    Returns
    -------
    str
        Its name and its parameters with units.
    """
    if not hasattr(value, "table"):
        return str(value)
    named = ", ".join(f"{name.replace('_', ' ')} {text}" for name, _, text, _ in parameter_rows(value))
    return f"{type(value).__name__} ({named})" if named else type(value).__name__


def parameters_html(value: Any) -> Markup:
    """The name of a value of the core and its parameters as an HTML table, for a notebook."""
    return join([element("p", element("b", type(value).__name__)), table(PARAMETER_HEAD, parameter_rows(value))])


def named_rows(values: Iterable[tuple[str, Any]]) -> list[tuple[str, str, str, str]]:
    """Rows of several values, each parameter under the name of its owner, as ``stiffness.reduced_modulus``."""
    return [(f"{owner}.{row[0]}", *row[1:]) for owner, value in values for row in parameter_rows(value)]
