# SPDX-License-Identifier: Apache-2.0
"""Known truth beside what was identified: the demo's table, and the same as dots and intervals."""

import math
from numbers import Real

import numpy as np

from .canvas import INK, MODEL, QUIET, panels
from .markup import Markup, element, table
from .numbers import DASH, quantity
from .words import quantity_name

HEAD = ("quantity", "paper ± sd", "true", "identified", "95 % interval", "bias")


def comparison_table(rows: list[dict]) -> Markup:
    """Quantity, paper ± sd, true, identified with its interval, and the bias in per cent of the truth."""
    return table(HEAD, (_row(row) for row in rows), class_="cards numbers tight")


def ratios(rows: list[dict]) -> list[tuple[str, float, float, float]]:
    """Name and identified, low and high over true, of the rows that have both."""
    known = (row for row in rows if number(row.get("true")) and number(row.get("identified")))
    keys = ("identified", "low", "high")
    return [(quantity_name(row["quantity"]), *(_over(row, key) for key in keys)) for row in known]


def ratio_figure(figure, sheet, rows: list[tuple[str, float, float, float]]) -> None:
    """Identified over true, a dot with its 95 % interval a quantity; on the line is right."""
    margins = {"top": 4.0, "left": 8.0 if sheet.narrow else 190.0, "right": 44.0}
    axes = panels(figure, sheet, margins=margins)[0, 0]
    axes.axvline(1.0, color=QUIET, lw=0.9)
    for k, (name, value, low, high) in enumerate(rows):
        right = low <= 1.0 <= high
        axes.plot([low, high], [-k, -k], color=INK, lw=1.4, solid_capstyle="butt")
        axes.plot([value], [-k], "o", ms=5.5, mec=MODEL, mfc="white" if right else MODEL, mew=1.4)
        place = {"xycoords": axes.get_yaxis_transform(), "textcoords": "offset points"}
        axes.annotate(name, (0.0, -k), (0, 6) if sheet.narrow else (-190, -3), **place)
        axes.annotate(_percent(value), (1.0, -k), (40, -3), ha="right", color=INK if right else MODEL, **place)
    far = max((abs(x - 1.0) for _, *values in rows for x in values if math.isfinite(x)), default=0.1)
    axes.set_xlim(1.0 - 1.1 * far, 1.0 + 1.1 * far)
    axes.set_ylim(0.4 - len(rows), 0.9)
    axes.set_yticks([])
    axes.grid(True, axis="x")
    axes.spines["left"].set_visible(False)
    axes.set_xlabel("identified / true", loc="right")


def number(value: object) -> bool:
    """Whether a cell holds a number that can be shown as one; not None and not text such as "not yet"."""
    return isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(value)


def _row(row: dict) -> tuple:
    value, unit = row.get("identified"), row.get("unit", "")
    found = quantity(value, *_limits(row), unit) if number(value) else None
    like = _half(row)
    return (
        quantity_name(row["quantity"]), _paper(row), _cell(row.get("true"), unit, like),
        element("strong", found.text) if found else _cell(value, unit, None),
        found.interval if found else "", _bias(row),
    )  # fmt: skip


def _limits(row: dict) -> tuple:
    return tuple(row.get(key) if number(row.get(key)) else None for key in ("low", "high"))


def _half(row: dict) -> float | None:
    low, high = _limits(row)
    return None if low is None or high is None else 0.5 * (high - low)


def _cell(value: object, unit: str, half: float | None) -> str:
    """A number as far as the interval's digits go; text as it is; a dash for nothing."""
    if not number(value):
        return DASH if value is None or isinstance(value, float) else str(value)
    limits = (None, None) if half is None else (value - half, value + half)
    return quantity(value, *limits, unit).text


def _paper(row: dict) -> str:
    value, spread, unit = row.get("paper"), row.get("paper_sd"), row.get("unit", "")
    if number(value) and number(spread) and spread > 0:
        return str(quantity(value, value - spread, value + spread, unit))
    return _cell(value, unit, None)


def _bias(row: dict) -> str:
    true, value = row.get("true"), row.get("identified")
    if not (number(true) and number(value)) or true == 0.0:
        return ""
    return _percent(value / true)


def _percent(ratio: float) -> str:
    percent = round(100.0 * (ratio - 1.0), 1) or 0.0  # no minus before a zero
    return f"{percent:+.1f}\N{NO-BREAK SPACE}%".replace("-", "−")


def _over(row: dict, key: str) -> float:
    value = row.get(key)
    return value / row["true"] if number(value) and row["true"] else np.nan
