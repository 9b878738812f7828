# SPDX-License-Identifier: Apache-2.0
"""A page of results as plain values: a headline, sections with tables and lists, figures; written as one HTML file."""

import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from ..files import atomic_write
from ..vocabulary import __version__
from .markup import FOLDER, Markup, element, join, templates, visible


@dataclass(frozen=True, kw_only=True)
class Figure:
    """A figure of a page."""

    name: str  # target of links to it
    draw: Callable  # ``draw(figure, sheet)`` on a figure of matplotlib and a sheet of ``canvas``
    heights: tuple[float, float]  # [points] on a wide and on a narrow sheet
    caption: object  # text or Markup under it
    alt: str  # what is seen, for a reader who does not see it
    title: str = ""  # heading above it; none if empty
    side_caption: bool = False  # whether the caption is next to the drawing on a wide page

    def __html__(self) -> Markup:
        from .canvas import FULL, WITH_SIDE_CAPTION, drawing

        wide = WITH_SIDE_CAPTION if self.side_caption else FULL
        drawn = drawing(self.name, self.draw, self.heights, self.alt, wide)
        return figure_html(self.name, [drawn], self.caption, self.title, "side-caption" if self.side_caption else "")


def script() -> Markup:
    """What lets a reader zoom the drawings before it and read their values; they are complete without it."""
    return element("script", Markup((FOLDER / "touch.js").read_text(encoding="utf-8")))


def figure_html(name: str, drawings: Sequence[Markup], caption: object, title: str = "", class_: str = "") -> Markup:
    """Drawings with a title and a caption."""
    return templates().get_template("parts.html").module.figure(name, drawings, caption, title, class_)


@dataclass(frozen=True)
class Section:
    """A section of a page: the target of links to it, its heading, and what follows."""

    name: str
    title: str
    contents: Markup


def section(title: str, *contents: object, name: str) -> Section | None:
    """Return a section, or None if all contents are empty.

    Parameters
    ----------
    title : str
        Heading.
    *contents : object
        Texts, Markup and figures; texts are escaped.
    name : str
        Target of links to the section.

    Returns
    -------
    Section or None
    """
    found = join(contents)
    return Section(name, title, found) if found else None


def note(text: object, class_: str = "note") -> Markup:
    """A paragraph in smaller letters; empty without text."""
    return element("p", text, class_=class_) if text else Markup("")


def definitions(pairs: Iterable[tuple[object, object]]) -> Markup:
    """Names with their meanings or values."""
    return templates().get_template("parts.html").module.definitions(list(pairs))


@dataclass(frozen=True, kw_only=True)
class Page:
    """A page of one result."""

    title: str  # heading
    kind: str  # what it is a page of, in the small line above the title
    outcome: object  # the result in a sentence or two, text or Markup
    sections: Iterable[Section | None]  # in their order; None is omitted
    note: str = ""  # a smaller sentence under the outcome; none if empty
    links: bool = True  # whether the header has links to the sections
    style: str = ""  # name of a style sheet to add to ``page.css``; none if empty

    def html(self) -> str:
        """The page as text; the same values give the same text."""
        names = ("page.css", self.style) if self.style else ("page.css",)
        style = Markup("".join((FOLDER / name).read_text(encoding="utf-8") for name in names))
        shown = [each for each in self.sections if each is not None]
        template = templates().get_template("page.html")
        touch = script() if any("data-panel" in each.contents for each in shown) else ""
        return visible(template.render(page=self, sections=shown, style=style, script=touch, version=__version__))

    def write(self, path: str | os.PathLike) -> None:
        """Write the page as one file that opens offline. Raises InputError if the file cannot be written."""
        text = self.html()
        with atomic_write(path) as file:
            file.write(text)
