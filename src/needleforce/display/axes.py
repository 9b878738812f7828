# SPDX-License-Identifier: Apache-2.0
"""The names of axes, and matplotlib axes with units on both; matplotlib is loaded when something is drawn."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from ..errors import InputError
from .canvas import MEASURED, MODEL

# depth is in the zero of a recording or below the surface of a model, indentation from a contact
TIME, DEPTH, INDENTATION, TRAVEL = "time [s]", "depth [mm]", "indentation [mm]", "travel [mm]"
FORCE = "force [N]"


def axes_for(axes: Any = None) -> Any:
    """The axes given, or those of a new figure. Raises InputError if they are not one matplotlib Axes, such as an array
    of several."""
    if axes is None:
        from matplotlib import pyplot

        return pyplot.subplots(layout="constrained")[1]
    if not hasattr(axes, "plot"):
        step = "Give one matplotlib Axes, or none for a new figure."
        raise InputError("axes", type(axes).__name__, "not matplotlib axes", next_step=step)
    return axes


def finish(axes: Any, x: str, y: str, title: str = "") -> Any:
    """Set axis labels (quantity and unit), grid and title on axes with everything drawn, and add a legend if a curve
    has a label; the same axes."""
    axes.set(xlabel=x, ylabel=y)
    if title:
        axes.set_title(title)
    axes.grid(True, alpha=0.3)
    if axes.get_legend_handles_labels()[1]:
        axes.legend()
    return axes


def draw_intervals(axes: Any, estimates: Iterable[tuple[str, float, float, float]]) -> tuple[str, str]:
    """Draw a row for each (name, value, low, high): its interval as a share of the value; returns the axis labels."""
    rows = [(name, value or np.nan, low, high) for name, value, low, high in estimates]
    for k, (_, value, low, high) in enumerate(rows):
        axes.plot(np.divide([low, high], value), [k, k], color=MEASURED, lw=1.4)
        axes.plot([1.0], [k], "o", color=MODEL)
    axes.set_yticks(range(len(rows)), [row[0].replace("_", " ") for row in rows])
    axes.set_ylim(max(len(rows), 1) - 0.5, -0.5)
    return "interval / value [1]", ""
