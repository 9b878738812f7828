# SPDX-License-Identifier: Apache-2.0
"""The comparison of a fit with known true values: a table, and a figure of identified over true values."""

import math
from functools import partial
from numbers import Real

from matplotlib.figure import Figure as Drawing

from ...display.canvas import INK, MODEL, ON_WHITE, QUIET, Sheet, panels
from ...display.markup import Markup, element, table
from ...display.page import Figure
from ...display.quantities import DASH, quantity
from ..statistics.noise import INTERVAL
from .words import IN_TABLES, quantity_name

COMPARISON = ("quantity", "paper ± sd", "true", "identified", INTERVAL, "bias")


def comparison(rows: list[dict]) -> list[object]:
    """The table, and the figure if true values are known."""
    found = ratios(rows)
    caption = f"Lines are {INTERVAL}s. Filled dots: the interval excludes the true value, a bias of the method."
    title = "Identified value over true value"
    heights = 44.0 + 22.0 * len(found), 44.0 + 34.0 * len(found)
    draw = partial(ratio_figure, rows=found)
    alt = f"{title}. {IN_TABLES}"
    shown = Figure(name="ratio", title=title, caption=caption, alt=alt, draw=draw, heights=heights)
    return [comparison_table(rows), shown if found else ""]


def comparison_table(rows: list[dict]) -> Markup:
    """Quantity, paper ± sd, true value, identified value with its interval, and bias in per cent of the true value."""
    return table(COMPARISON, (_row(row) for row in rows), class_="cards numbers tight")


def ratios(rows: list[dict]) -> list[tuple[str, float, float, float]]:
    """Name, and identified value with its limits over the true value, of the rows that have both."""
    known = (row for row in rows if number(row.get("true")) and number(row.get("identified")))
    keys = ("identified", "low", "high")
    return [(quantity_name(row["quantity"]), *(_over(row, key) for key in keys)) for row in known]


def ratio_figure(figure: Drawing, sheet: Sheet, rows: list[tuple[str, float, float, float]]) -> None:
    """Identified over true value, a dot with its interval for each quantity; 1 is the true value."""
    margins = {"top": 4.0, "left": 8.0 if sheet.narrow else 190.0, "right": 44.0}
    axes = panels(figure, sheet, margins=margins)[0, 0]
    axes.axvline(1.0, color=QUIET, lw=0.9)
    for k, (name, value, low, high) in enumerate(rows):
        includes_true = low <= 1.0 <= high
        axes.plot([low, high], [-k, -k], color=INK, lw=1.4, solid_capstyle="butt")
        axes.plot([value], [-k], "o", ms=5.5, mec=MODEL, mfc="white" if includes_true else MODEL, mew=1.4)
        place = {"xycoords": axes.get_yaxis_transform(), "textcoords": "offset points"}
        on_white = ON_WHITE if sheet.narrow else None
        axes.annotate(name, (0.0, -k), (0, 7) if sheet.narrow else (-190, -3), bbox=on_white, **place)
        axes.annotate(_percent(value), (1.0, -k), (40, -3), ha="right", color=INK if includes_true else MODEL, **place)
    far = max((abs(x - 1.0) for _, *values in rows for x in values if math.isfinite(x)), default=0.1)
    axes.set_xlim(1.0 - 1.1 * far, 1.0 + 1.1 * far)
    axes.set_ylim(0.4 - len(rows), 0.9)
    axes.set_yticks([])
    axes.grid(True, axis="x")
    axes.spines["left"].set_visible(False)
    axes.set_xlabel("identified / true [1]", loc="right")


def number(value: object) -> bool:
    """Whether a cell has a finite number, neither None nor text such as "not yet"."""
    return isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(value)


def _row(row: dict) -> tuple:
    """One row of the comparison with known true values."""
    value, unit = row.get("identified"), row.get("unit", "")
    found = quantity(value, *_limits(row), unit) if number(value) else None
    like = _half(row)
    return (
        quantity_name(row["quantity"]), _paper(row), _cell(row.get("true"), unit, like),
        element("strong", found.text) if found else _cell(value, unit, None),
        found.interval if found else "", _bias(row),
    )  # fmt: skip


def _limits(row: dict) -> tuple:
    """Limits of the interval; None if unknown."""
    return tuple(row.get(key) if number(row.get(key)) else None for key in ("low", "high"))


def _half(row: dict) -> float | None:
    """Half width of the interval, or None without one."""
    low, high = _limits(row)
    return None if low is None or high is None else 0.5 * (high - low)


def _cell(value: object, unit: str, half: float | None) -> str:
    """A number with the digits that the interval supports; text unchanged; a dash for None."""
    if not number(value):
        return DASH if value is None or isinstance(value, float) else str(value)
    limits = (None, None) if half is None else (value - half, value + half)
    return quantity(value, *limits, unit).text


def _paper(row: dict) -> str:
    """The paper's value and its standard deviation."""
    value, spread, unit = row.get("paper"), row.get("paper_sd"), row.get("unit", "")
    if number(value) and number(spread) and spread > 0:
        return str(quantity(value, value - spread, value + spread, unit))
    return _cell(value, unit, None)


def _bias(row: dict) -> str:
    """Identified minus true value in per cent of the true value; empty without both."""
    true, value = row.get("true"), row.get("identified")
    if not (number(true) and number(value)) or true == 0.0:
        return ""
    return _percent(value / true)


def _percent(ratio: float) -> str:
    """A ratio as its signed difference from 1 in per cent."""
    percent = round(100.0 * (ratio - 1.0), 1) or 0.0  # no minus before a zero
    return f"{percent:+.1f}\N{NO-BREAK SPACE}%".replace("-", "−")


def _over(row: dict, key: str) -> float:
    """A value of the row over the true value."""
    value = row.get(key)
    return value / row["true"] if number(value) and row["true"] else math.nan
