# SPDX-License-Identifier: Apache-2.0
"""How well each model foretells repeats that it has not seen, a dot a repeat."""

import numpy as np

from .canvas import INK, MEASURED, MODEL, QUIET, SECOND, SLATE, TEXT, panels
from .models_table import best_possible

_APART = 0.17  # of a row, from its middle to predictions above and replays below
_OFFSET = {"textcoords": "offset points"}
FLOOR = "mean of the others"


def over_floor(unseen) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Whole-cycle errors of prediction, replay and floor over the rms of the floor, each one for every repeat that has
    all; the rms of the first two are the numbers in the table."""
    errors = np.stack([unseen.prediction[:, 0], unseen.replay[:, 0], unseen.floor[:, 0]])
    errors = errors[:, np.isfinite(errors).all(axis=0)]
    prediction, replay, floor = errors / np.sqrt(np.mean(errors[2] ** 2)) if errors.size else errors
    return prediction, replay, floor


def unseen_figure(figure, sheet, rows) -> None:
    """A row a model and one for the floor itself: prediction filled, replay hollow, a bar at the rms of either."""
    left = 8.0 if sheet.narrow else 128.0
    axes = panels(figure, sheet, margins={"top": 22.0, "left": left, "right": 12.0})[0, 0]
    _lines(axes, rows)
    _row(axes, sheet, 0, FLOOR, (over_floor(rows[0].unseen)[2], MEASURED, MEASURED, 0.0))
    for k, row in enumerate(rows, 1):
        prediction, replay, _ = over_floor(row.unseen)
        mark = " (best)" if k == 1 else " (ties)" if row.ties else ""
        kinds = (prediction, MODEL, MODEL, _APART), (replay, SECOND, "white", -_APART)
        _row(axes, sheet, k, f"{row.model}{mark}", *kinds)
    axes.set_xlim(left=0.0)
    axes.set_ylim(-len(rows) - 0.6, 0.7)
    axes.set_yticks([])
    axes.grid(True, axis="x")
    axes.spines["left"].set_visible(False)
    axes.set_xlabel("error / floor", loc="right")


def figure_heights(rows) -> tuple[float, float]:
    """Heights [points], wide and narrow, for so many models."""
    return 64.0 + 26.0 * (len(rows) + 1), 64.0 + 40.0 * (len(rows) + 1)


def _lines(axes, rows) -> None:
    """At 1 the experiment itself, lighter what the best of models could reach."""
    least, place = best_possible(rows), axes.get_xaxis_transform()
    axes.axvline(1.0, color=QUIET, lw=1.0)
    axes.axvline(least, color=QUIET, lw=0.7, ls=(0, (2, 2)))
    style = {"xycoords": place, "va": "bottom", "fontsize": TEXT - 1, "color": SLATE, **_OFFSET}
    axes.annotate("1, the repeats themselves", (1.0, 1.0), (3, 3), ha="left", **style)
    axes.annotate(f"{least:.2f}", (least, 1.0), (-3, 3), ha="right", **style)


def _row(axes, sheet, place: int, name: str, *kinds: tuple) -> None:
    at = {"xycoords": axes.get_yaxis_transform(), **_OFFSET}
    axes.annotate(name, (0.0, -place), (0, 9) if sheet.narrow else (-128, -3), color=INK, **at)
    for values, edge, face, shift in kinds:
        height = np.full(len(values), shift - place - 0.15 * sheet.narrow)  # below the name
        axes.plot(values, height, "o", ms=4.5, mec=edge, mfc=face, mew=1.1, alpha=0.9)
        rms = float(np.sqrt(np.mean(values**2))) if len(values) else np.nan
        axes.plot([rms, rms], [height[0] - 0.2, height[0] + 0.2] if len(values) else [np.nan] * 2, color=edge, lw=1.6)
