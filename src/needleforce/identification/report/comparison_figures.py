# SPDX-License-Identifier: Apache-2.0
"""The drawings of a comparison of models: errors of each on held-out repeats, and the curve of one such repeat."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ...display.axes import DEPTH, FORCE
from ...display.canvas import (
    INK,
    MEASURED,
    MODEL,
    ON_WHITE,
    QUIET,
    SECOND,
    SLATE,
    TEXT,
    THICK,
    THIN,
    Labels,
    Sheet,
    axis_names,
    line,
    panels,
)  # fmt: skip

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Drawing

    from ..cross_validation import HeldOut

FLOOR = "mean of the others"
_ROW_OFFSET = 0.17  # of a row: predictions are above its middle, replays below
_OFFSET = {"textcoords": "offset points"}


def draw_held_out(figure: "Drawing", sheet: Sheet, shown: "HeldOut", model: str) -> None:
    """Measured force over depth of a repeat, the mean of the others and the prediction of a model."""
    axes = panels(figure, sheet)[0, 0]
    kinds = ("measured", shown.measured, MEASURED, THIN), (FLOOR, shown.others, SECOND, THIN)
    curves = []
    for name, force, colour, width in (*kinds, (model, shown.predicted, MODEL, THICK)):
        curves.append(line(axes, 1e3 * shown.depth, force, sheet.columns // 2, color=colour, lw=width, label=name))
    axes.axhline(0.0, color=QUIET, lw=0.6)
    axis_names(axes, DEPTH, FORCE)
    labels = Labels(axes, curves)
    for name, curve, colour in zip(("measured", FLOOR, model), curves, (SLATE, SECOND, MODEL)):
        labels.on(name, *curve, colour)


def draw_cross_validation(
    figure: "Drawing",
    sheet: Sheet,
    models: Sequence[tuple[str, np.ndarray, np.ndarray]],
    floor: np.ndarray,
    lowest: float,
) -> None:
    """A row for each of ``models`` (name, predictions, replays) and one for the floor: prediction filled, replay
    hollow, a bar at the rms of each; ``lowest`` is the lowest error of any model."""
    left = 8.0 if sheet.narrow else 128.0
    axes = panels(figure, sheet, margins={"top": 22.0, "left": left, "right": 12.0})[0, 0]
    _lines(axes, lowest)
    _row(axes, sheet, 0, FLOOR, (floor, MEASURED, MEASURED, 0.0))
    for k, (name, prediction, replay) in enumerate(models, 1):
        kinds = (prediction, MODEL, MODEL, _ROW_OFFSET), (replay, SECOND, "white", -_ROW_OFFSET)
        _row(axes, sheet, k, name, *kinds)
    axes.set_xlim(left=0.0)
    axes.set_ylim(-len(models) - 0.6, 0.7)
    axes.set_yticks([])
    axes.grid(True, axis="x")
    axes.spines["left"].set_visible(False)
    axes.set_xlabel("error / floor [1]", loc="right")


def figure_heights(models: int) -> tuple[float, float]:
    """Heights [points], wide and narrow, for a number of models."""
    return 64.0 + 26.0 * (models + 1), 64.0 + 40.0 * (models + 1)


def _lines(axes: "Axes", lowest: float) -> None:
    """A line at 1, the floor, and a dashed line at the lowest error of any model."""
    place = axes.get_xaxis_transform()
    axes.axvline(1.0, color=QUIET, lw=1.0)
    axes.axvline(lowest, color=QUIET, lw=0.7, ls=(0, (2, 2)))
    style = {"xycoords": place, "va": "bottom", "fontsize": TEXT - 1, "color": SLATE, **_OFFSET}
    axes.annotate("1: floor", (1.0, 1.0), (3, 3), ha="left", **style)
    axes.annotate(f"{lowest:.2f}", (lowest, 1.0), (-3, 3), ha="right", **style)


def _row(axes: "Axes", sheet: Sheet, place: int, name: str, *kinds: tuple) -> None:
    """One row: its name, a dot for each repeat and a bar at the rms; ``kinds`` are (values, edge, face, offset)."""
    at = {"xycoords": axes.get_yaxis_transform(), "bbox": ON_WHITE if sheet.narrow else None, **_OFFSET}
    axes.annotate(name, (0.0, -place), (0, 9) if sheet.narrow else (-128, -3), color=INK, **at)
    for values, edge, face, shift in kinds:
        height = np.full(len(values), shift - place - 0.15 * sheet.narrow)  # below the name
        axes.plot(values, height, "o", ms=4.5, mec=edge, mfc=face, mew=1.1, alpha=0.9)
        rms = float(np.sqrt(np.mean(values**2))) if len(values) else np.nan
        axes.plot([rms, rms], [height[0] - 0.2, height[0] + 0.2] if len(values) else [np.nan] * 2, color=edge, lw=1.6)
