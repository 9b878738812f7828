# SPDX-License-Identifier: Apache-2.0
"""The frame of every report: title, summary, links to the sections and style, in one file."""

from collections.abc import Iterable
from pathlib import Path
from string import Template

from ..display.markup import Markup, Section, element, escape, join

HERE = Path(__file__).parent


def framed(
    title: str,
    kicker: str,
    summary: Markup,
    sections: Iterable[Section | None],
    *,
    note: str = "",
    links: bool = True,
    styles: tuple[str, ...] = (),
) -> str:
    """A page as HTML text.

    Parameters
    ----------
    title, kicker : str
        Heading, and the small line above it.
    summary : Markup
        The result in a sentence or two, under the heading.
    sections : iterable of Section or None
        In their order; None is omitted.
    note : str
        A smaller sentence under the summary; none if empty.
    links : bool
        Whether the header has links to the sections.
    styles : tuple of str
        Style sheets of this folder to add to ``page.css``.
    """
    shown = [each for each in sections if each is not None]
    style = "".join((HERE / name).read_text(encoding="utf-8") for name in ("page.css", *styles))
    contents = element("nav", *(element("a", each.title, href=f"#{each.name}") for each in shown))
    return Template((HERE / "page.html").read_text(encoding="utf-8")).substitute(
        title=escape(title),
        style=style,
        kicker=escape(kicker),
        outcome=summary,
        note=element("p", note, class_="which note") if note else "",
        contents=contents if links else "",
        sections=join(each.markup for each in shown),
    )
