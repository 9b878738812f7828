# SPDX-License-Identifier: Apache-2.0
"""Results as plain text for a terminal: aligned tables, and wrapped lists of sentences."""

import textwrap
import unicodedata
from collections.abc import Iterable, Sequence

from .markup import visible

WIDTH = 110  # columns of a terminal that a text may use
GAP = "  "


def text_table(head: Sequence[str], rows: Iterable[Sequence[object]], indent: str = "  ") -> str:
    """A table in aligned columns, a line a row; columns without any content are left out.

    Parameters
    ----------
    head : sequence of str
        Name of each column.
    rows : iterable of sequences
        Cells, as many as there are columns; shown by ``str``.
    indent : str
        Put before each line.

    Returns
    -------
    str
        Lines without a line break at the end; empty without rows.
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
    """A title and a wrapped line for each sentence; empty without sentences."""
    wrapped = [
        textwrap.fill(visible(each), WIDTH, initial_indent="  - ", subsequent_indent="    ") for each in sentences
    ]
    return "\n".join([f"{title}:", *wrapped]) if wrapped else ""


def blocks(*parts: str) -> str:
    """Those parts of a text that are not empty, a line break between them."""
    return "\n".join(part for part in parts if part)


def _width(text: str) -> int:
    """Columns a text takes: characters that combine with the one before take none."""
    return sum(not unicodedata.combining(letter) for letter in text)
