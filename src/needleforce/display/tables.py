# SPDX-License-Identifier: Apache-2.0
"""Results as plain text for a terminal: aligned tables and wrapped lists of sentences."""

import textwrap
import unicodedata
from collections.abc import Iterable, Sequence

from .markup import visible

WIDTH = 110  # columns of a terminal that a text may use
GAP = "  "  # between columns


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
