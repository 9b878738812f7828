# SPDX-License-Identifier: Apache-2.0
"""Pieces of HTML; text that is not ``Markup`` is escaped."""

import unicodedata
from collections.abc import Iterable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from markupsafe import Markup

FOLDER = Path(__file__).parent
"""Of the templates and style sheets."""


@cache
def templates() -> Any:
    """The templates of ``FOLDER``; loads jinja2, which importing needleforce must not do."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    options = {"autoescape": True, "trim_blocks": True, "lstrip_blocks": True, "undefined": StrictUndefined}
    return Environment(loader=FileSystemLoader(FOLDER), **options)


def visible(text: str) -> str:
    """Replace control and text-direction characters, which can hide part of a file name; keep tabs and line breaks."""
    hidden = (c for c in set(text) - {"\n", "\t"} if unicodedata.category(c).startswith("C"))
    return text.translate(dict.fromkeys(map(ord, hidden), "\N{REPLACEMENT CHARACTER}"))


def join(contents: Iterable[object], between: str = "") -> Markup:
    """Join pieces of HTML with ``between``, which is HTML, too."""
    return Markup(between).join(contents)


def element(name: str, *contents: object, **attributes: object) -> Markup:
    """The HTML element ``<name …>contents</name>``; contents and attributes that are not Markup are escaped.

    ``class_`` sets the class, ``_`` becomes a hyphen, None omits the attribute.
    """
    pairs = ((key.rstrip("_").replace("_", "-"), value) for key, value in attributes.items() if value is not None)
    opening = join(Markup(' {}="{}"').format(*pair) for pair in pairs)
    return Markup("<{0}{1}>{2}</{0}>").format(name, opening, join(contents))


def listing(items: Iterable[object], class_: str | None = None) -> Markup:
    """Return an unordered list of the items; empty without any."""
    found = [element("li", item) for item in items]
    return element("ul", *found, class_=class_) if found else Markup("")


def table(head: Sequence[str], rows: Iterable[Iterable[object]], class_: str = "") -> Markup:
    """An HTML table whose cells carry the name of their column, for narrow screens; empty without rows.

    Columns without any content are omitted; ``class_`` is for the style sheet.
    """
    cells = [tuple(row) for row in rows]
    keep = [k for k in range(len(head)) if any(str(row[k]) for row in cells)]
    kept = [[row[k] for k in keep] for row in cells]
    made = templates().get_template("parts.html").module.table([head[k] for k in keep], kept, class_)
    return made if cells else Markup("")
