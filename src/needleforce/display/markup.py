# SPDX-License-Identifier: Apache-2.0
"""HTML that cannot carry foreign text: whatever is not already markup is escaped."""

import html
import unicodedata
from collections.abc import Iterable
from typing import NamedTuple


class Markup(str):
    """Text that is HTML already and is not escaped again."""

    __slots__ = ()


def escape(content: object) -> str:
    """``content`` as HTML text, unless it is Markup already."""
    return content if isinstance(content, Markup) else html.escape(visible(str(content)))


def visible(text: str) -> str:
    """``text`` with control and direction characters, which can hide what a file is called, made visible."""
    hidden = (c for c in set(text) - {"\n", "\t"} if unicodedata.category(c).startswith("C"))
    return text.translate(dict.fromkeys(map(ord, hidden), "\N{REPLACEMENT CHARACTER}"))


def join(contents: Iterable[object], between: str = "") -> Markup:
    """Several pieces after each other."""
    return Markup(between.join(escape(content) for content in contents))


def element(name: str, *contents: object, **attributes: object) -> Markup:
    """``<name …>contents</name>``; ``class_`` gives the class, ``_`` in an attribute a hyphen; None leaves it out."""
    pairs = ((key.rstrip("_").replace("_", "-"), value) for key, value in attributes.items() if value is not None)
    opening = "".join(f' {key}="{escape(value)}"' for key, value in pairs)
    return Markup(f"<{name}{opening}>{join(contents)}</{name}>")


def listing(items: Iterable[object], **attributes: object) -> Markup:
    """An unordered list, one point an item."""
    return element("ul", *(element("li", item) for item in items), **attributes)


def table(head: tuple[str, ...], rows: Iterable[Iterable[object]], class_: str = "") -> Markup:
    """A table; each cell carries its column's name, for narrow screens. Empty columns are left out."""
    rows = [tuple(row) for row in rows]
    keep = [k for k in range(len(head)) if any(str(row[k]) for row in rows)]
    heads = (element("th", head[k], scope="col") for k in keep)
    body = (element("tr", *(_cell(head[k], row[k]) for k in keep)) for row in rows)
    content = element("thead", element("tr", *heads)) + element("tbody", *body)
    return element("div", element("table", Markup(content), class_=class_ or None), class_="scroll")


def _cell(head: str, content: object) -> Markup:
    """The content is one child, so that a narrow screen can set it beside its column's name."""
    return element("td", element("div", content) if str(content) else "", data_label=head)


class Section(NamedTuple):
    """A part of a page: the ``name`` that links lead to, its heading, and its contents."""

    name: str
    title: str
    contents: Markup

    @property
    def markup(self) -> Markup:
        """The section with its heading."""
        return element("section", element("h2", self.title), self.contents, id=self.name)


def section(title: str, *contents: object, name: str) -> Section | None:
    """A section; None without any contents."""
    found = join(contents)
    return Section(name, title, found) if found else None
