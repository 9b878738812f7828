# SPDX-License-Identifier: Apache-2.0
"""How results show themselves: printed, in a notebook, as a plot, a report, a table and JSON, each in one way."""

import json
import os
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from ..files import json_safe
from .axes import axes_for, finish
from .markup import Markup, element, join, listing, table, visible
from .tables import blocks, text_list, text_table

if TYPE_CHECKING:
    import pandas

    from .page import Page


class Printed:
    """What prints as a heading, a table and sentences; in a notebook as the same in HTML.

    A class states them by ``_heading``, ``_cells`` and ``_remarks``.
    """

    __slots__ = ()

    def _heading(self) -> str:
        raise NotImplementedError

    def _cells(self) -> tuple[Sequence[str], Sequence[Sequence[str]]]:
        return (), ()

    def heading(self) -> str:
        """What it is, in one line."""
        return self._heading()

    def cells(self) -> tuple[Sequence[str], Sequence[Sequence[str]]]:
        """Heads of columns, and rows of text under them."""
        return self._cells()

    def _remarks(self) -> Iterable[tuple[str, Iterable[str]]]:
        """Titles with their sentences; a title without sentences is not shown."""
        return ()

    def __str__(self) -> str:
        remarks = (text_list(title, sentences) for title, sentences in self._remarks())
        return blocks(self.heading(), text_table(*self.cells()), *remarks)

    def _repr_html_(self) -> Markup:
        heading = self.heading()
        remarks = ((title, listing(sentences)) for title, sentences in self._remarks())
        lists = (join([element("p", element("b", title)), listed]) for title, listed in remarks if listed)
        shown = join([element("p", heading) if heading else "", table(*self.cells()), *lists])
        return Markup(visible(shown))


def with_drawing(shown: Markup, draw: Callable) -> Markup:
    """What a notebook shows, and below it the drawing ``draw(figure, sheet)``."""
    from .canvas import WITH_SIDE_CAPTION, svg
    from .page import script

    drawing = svg("notebook", draw, WITH_SIDE_CAPTION, 230.0, "The values are in the table.")
    return join([shown, element("div", drawing, style="max-width: 36em; background: white"), script()])


class Result(Printed):
    """What an identification, a test, a plan or a campaign found.

    Next to what is printed a class states its curves by ``_draw``, its numbers by ``document`` and ``to_dataframe``,
    and by ``_page`` what its report has beyond heading, curves, table and sentences.
    """

    __slots__ = ()

    def _draw(self, axes: Any) -> tuple[str, ...]:
        """Draw the curves; returns the labels of both axes with units, and a title if there is one."""
        raise NotImplementedError

    def document(self) -> dict | list:
        """The numbers in SI as dicts and lists, as ``to_json`` writes them."""
        raise NotImplementedError

    def _page(self) -> "Page":
        """The report: heading, curves, table and sentences."""
        from .page import Figure, Page, section

        caption = "The values are in the table."
        figure = Figure(name="result", draw=self._draw_sheet, heights=(300.0, 260.0), caption=caption, alt=caption)
        remarks = [(title, list(sentences)) for title, sentences in self._remarks()]
        return Page(
            title=re.sub("(?<=[a-z])(?=[A-Z])", " ", type(self).__name__).capitalize(),
            kind="result",
            outcome=f"{self.heading()}.",
            sections=[
                section("Figure", figure, name="figure"),
                section("Values", table(*self.cells(), class_="cards numbers dense"), name="values"),
                *(section(title, listing(each), name=title.lower().replace(" ", "-")) for title, each in remarks),
            ],
        )

    def _draw_sheet(self, figure: Any, sheet: Any) -> None:
        """The curves of ``plot`` on a sheet of a report."""
        from .canvas import axis_names, panels

        axes = panels(figure, sheet, margins={"left": 110.0})[0, 0]
        axis_names(axes, *self._draw(axes)[:2])
        if axes.get_legend_handles_labels()[1]:
            axes.legend(frameon=False)

    def _repr_html_(self) -> Markup:
        return with_drawing(super()._repr_html_(), self._draw_sheet)

    def plot(self, axes: Any = None) -> Any:
        """Draw the result.

        Parameters
        ----------
        axes : matplotlib.axes.Axes, optional
            Where to draw; None makes a new figure.

        Returns
        -------
        matplotlib.axes.Axes
        """
        axes = axes_for(axes)
        return finish(axes, *self._draw(axes))

    def report(self, path: str | os.PathLike, title: str | None = None, **details: Any) -> None:
        """Write the report as one HTML file that opens offline; the same result gives the same bytes.

        Parameters
        ----------
        path : path-like
            File to write; nothing is written if the page cannot be made.
        title : str, optional
            Title of the page; None states what is shown.
        **details
            What the pages of some results show in addition: ``table`` of a fit, known true values; ``files`` of a
            comparison; ``assumptions`` and ``mode_assumed`` of a tension or compression test.

        Raises
        ------
        InputError
            The file cannot be written.
        """
        page = self._page(**details)
        (page if title is None else replace(page, title=title)).write(path)

    def to_dataframe(self) -> "pandas.DataFrame":
        """The numbers as a pandas DataFrame in SI."""
        raise NotImplementedError

    def to_json(self) -> str:
        """The numbers in SI as JSON text; values that are not finite are null."""
        return json.dumps(json_safe(self.document()), indent=2, allow_nan=False)

    def __repr__(self) -> str:
        return f"<{self.heading()}>"
