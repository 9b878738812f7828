# SPDX-License-Identifier: Apache-2.0
"""What is left over, and every recording beside the others."""

import math

import numpy as np

from .canvas import INK, MEASURED, MEDIUM, MODEL, QUIET, SECOND, TEXT, THIN, axis_names, panels
from .curves import binned, columns_for
from .figures import DEPTH, FORCE, TIME, line, repeat_style
from .markup import visible
from .words import file_name

_OFFSET = {"textcoords": "offset points", "va": "bottom"}
RESIDUAL = "measured − model [N]"


def residuals(figure, sheet, drawn, rmse: float) -> None:
    """Measured minus modelled force over indentation, one panel a stroke, with the band of ± the rms residual."""
    rows, columns = (2, 1) if sheet.narrow else (1, 2)
    both = panels(figure, sheet, rows, columns, sharex=True, sharey=True).ravel()
    edges = np.linspace(0.0, max(one.indentation.max() for one in drawn), 141)
    for axes, name, stroke in zip(both, ("insertion", "withdrawal"), ("inward", "outward")):
        axes.axhspan(-rmse, rmse, color=MODEL, alpha=0.2, lw=0)
        _bins(axes, drawn, stroke, edges)
        axes.axhline(0.0, color=MODEL, lw=1.0)
        axes.tick_params(labelbottom=True, labelleft=True)
        axis_names(axes, DEPTH, RESIDUAL)
        axes.annotate(name, (1.0, 1.0), (0, 8), xycoords="axes fraction", ha="right", color=QUIET, **_OFFSET)
    place = {"xycoords": both[-1].get_yaxis_transform(), **_OFFSET}
    both[-1].annotate("± rms", (1.0, rmse), (-2, 1), ha="right", color=MODEL, fontsize=TEXT - 1, **place)


def _bins(axes, drawn, stroke: str, edges: np.ndarray) -> None:
    """Each repeat's mean residual along depth as a line, over the grey range of all samples of all repeats."""
    found = [binned(one.indentation[getattr(one, stroke)], one.residual[getattr(one, stroke)], edges) for one in drawn]
    middle = 0.5 * (edges[1:] + edges[:-1])
    usual = [bins for one, bins in zip(drawn, found) if not one.odd] or found
    low, high = np.fmin.reduce([low for _, low, _ in usual]), np.fmax.reduce([high for _, _, high in usual])
    axes.fill_between(middle, low, high, color="#d9dcdf", lw=0)
    for one, (mean, _, _) in zip(drawn, found):
        line(axes, middle, mean, len(middle), **repeat_style(one, len(drawn)))


def across(count: int, narrow: bool) -> int:
    """Small panels in a row."""
    return 2 if narrow else count if count <= 4 else 3 if count <= 6 else 4


def multiples(figure, sheet, drawn) -> None:
    """Every recording over time, measured and modelled, on the same axes; the odd one out in its own colour."""
    row = across(len(drawn), sheet.narrow)
    margins = {"top": 32.0, "across": 18.0, "down": 32.0}
    grid = panels(figure, sheet, math.ceil(len(drawn) / row), row, margins, sharex=True, sharey=True).ravel()
    budget = min(columns_for(len(drawn), sheet.columns), sheet.columns // row)
    for k, (axes, one) in enumerate(zip(grid, drawn)):
        line(axes, one.time, one.measured, budget, color=SECOND if one.odd else MEASURED, lw=THIN)
        if one.has_model:
            line(axes, one.time, one.model, budget, color=MODEL, lw=MEDIUM, alpha=0.9)
        _heading(axes, one, 16 if sheet.narrow else 24)
        axes.tick_params(labelbottom=k + row >= len(drawn))
    grid[0].set_xlim(0.0, max(one.time[-1] for one in drawn))
    for axes in grid[len(drawn) :]:
        axes.set_visible(False)
    grid[len(drawn) - 1].set_xlabel(TIME, loc="right")
    grid[0].annotate(FORCE, (0.0, 1.0), (-32.0, 18.0), xycoords="axes fraction", **_OFFSET)


def multiples_height(count: int, narrow: bool) -> float:
    """Height [points] of a drawing of that many small panels."""
    row = across(count, narrow)
    return 40.0 + (100.0 if narrow else 105.0 + 60.0 * (row < 4)) * math.ceil(count / row)


def _heading(axes, one, longest: int) -> None:
    name = file_name(one.fit.file).removesuffix(".csv")
    name = name if len(name) <= longest else f"…{name[1 - longest :]}"
    style = {"xycoords": "axes fraction", "fontsize": TEXT - 1, "color": SECOND if one.odd else INK}
    axes.annotate(f"{one.number}  {visible(name)}", (0.0, 1.0), (0, 4), **style, **_OFFSET)
    if one.odd:
        axes.annotate("odd one out", (1.0, 1.0), (0, -11), ha="right", **style, **_OFFSET)
