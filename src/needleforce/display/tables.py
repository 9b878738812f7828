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
    """A table in aligned columns, a line for each row; empty without rows, and without columns that have no content."""
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
    """A title and a wrapped line for each sentence; empty without sentences."""
    wrapped = [
        textwrap.fill(visible(each), WIDTH, initial_indent="  - ", subsequent_indent="    ") for each in sentences
    ]
    return "\n".join([f"{title}:", *wrapped]) if wrapped else ""


def blocks(*parts: str) -> str:
    """The parts that are not empty, joined with line breaks."""
    return "\n".join(part for part in parts if part)


def _width(text: str) -> int:
    """Width of a text in columns; combining characters have no width."""
    return sum(not unicodedata.combining(letter) for letter in text)


def parameter_rows(value: Any) -> list[tuple[str, str, str, str]]:
    """Rows under ``PARAMETER_HEAD`` of a value of the core that has ``table()`` and ``parameters()``."""
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
    """A tip of nf.tips in one line, its name and its parameters with units; another value as ``str`` writes it."""
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
