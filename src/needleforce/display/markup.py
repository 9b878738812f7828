# SPDX-License-Identifier: Apache-2.0
"""HTML elements and tables; text that is not ``Markup`` is escaped."""

import html
import unicodedata
from collections.abc import Iterable
from typing import NamedTuple


class Markup(str):
    """Text that is already HTML and is not escaped again."""

    __slots__ = ()


def escape(content: object) -> str:
    """Return ``content`` as HTML text.

    Parameters
    ----------
    content : object
        Shown by ``str``; Markup is returned unchanged.

    Returns
    -------
    str
    """
    return content if isinstance(content, Markup) else html.escape(visible(str(content)))


def visible(text: str) -> str:
    """Replace control and text-direction characters, which can hide part of a file name.

    Parameters
    ----------
    text : str
        Any text; tabs and line breaks are kept.

    Returns
    -------
    str
    """
    hidden = (c for c in set(text) - {"\n", "\t"} if unicodedata.category(c).startswith("C"))
    return text.translate(dict.fromkeys(map(ord, hidden), "\N{REPLACEMENT CHARACTER}"))


def join(contents: Iterable[object], between: str = "") -> Markup:
    """Join pieces of HTML.

    Parameters
    ----------
    contents : iterable
        Pieces; those that are not Markup are escaped.
    between : str
        Separator, HTML.

    Returns
    -------
    Markup
    """
    return Markup(between.join(escape(content) for content in contents))


def element(name: str, *contents: object, **attributes: object) -> Markup:
    """Return the HTML element ``<name …>contents</name>``.

    Parameters
    ----------
    name : str
        Name of the element.
    *contents : object
        Pieces; those that are not Markup are escaped.
    **attributes : object
        Attributes; ``class_`` sets the class, ``_`` becomes a hyphen, None omits the attribute.

    Returns
    -------
    Markup
    """
    pairs = ((key.rstrip("_").replace("_", "-"), value) for key, value in attributes.items() if value is not None)
    opening = "".join(f' {key}="{escape(value)}"' for key, value in pairs)
    return Markup(f"<{name}{opening}>{join(contents)}</{name}>")


def listing(items: Iterable[object], **attributes: object) -> Markup:
    """Return an unordered list.

    Parameters
    ----------
    items : iterable
        One list item each.
    **attributes : object
        Attributes of the list, as for ``element``.

    Returns
    -------
    Markup
    """
    return element("ul", *(element("li", item) for item in items), **attributes)


def table(head: tuple[str, ...], rows: Iterable[Iterable[object]], class_: str = "") -> Markup:
    """Return an HTML table whose cells carry the name of their column, for narrow screens.

    Parameters
    ----------
    head : tuple of str
        Name of each column; columns without any content are omitted.
    rows : iterable of iterables
        Cells, as many as there are columns.
    class_ : str
        Class of the table, for the style sheet.

    Returns
    -------
    Markup
    """
    rows = [tuple(row) for row in rows]
    keep = [k for k in range(len(head)) if any(str(row[k]) for row in rows)]
    heads = (element("th", head[k], scope="col") for k in keep)
    body = (element("tr", *(_cell(head[k], row[k]) for k in keep)) for row in rows)
    content = element("thead", element("tr", *heads)) + element("tbody", *body)
    return element("div", element("table", Markup(content), class_=class_ or None), class_="scroll")


def _cell(head: str, content: object) -> Markup:
    """A cell with its content in one element: a narrow screen shows the column's name next to it."""
    return element("td", element("div", content) if str(content) else "", data_label=head)


class Section(NamedTuple):
    """A section of a page.

    Attributes
    ----------
    name : str
        Target of links to the section.
    title : str
        Heading.
    contents : Markup
        What follows the heading.
    """

    name: str
    title: str
    contents: Markup

    @property
    def markup(self) -> Markup:
        """The section with its heading."""
        return element("section", element("h2", self.title), self.contents, id=self.name)


def section(title: str, *contents: object, name: str) -> Section | None:
    """Return a section, or None if all contents are empty.

    Parameters
    ----------
    title : str
        Heading.
    *contents : object
        Pieces; those that are not Markup are escaped.
    name : str
        Target of links to the section.

    Returns
    -------
    Section or None
    """
    found = join(contents)
    return Section(name, title, found) if found else None
