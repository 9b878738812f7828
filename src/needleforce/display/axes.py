# SPDX-License-Identifier: Apache-2.0
"""Matplotlib axes with units on both axes; matplotlib is loaded when something is drawn."""

from typing import Any

from ..errors import InputError

MEASURED = "#5b6b7b"
MODEL = "#d9480f"
TIME, DEPTH, INDENTATION, FORCE = "time [s]", "depth [mm]", "indentation [mm]", "force [N]"


def axes_for(axes: Any = None) -> Any:
    """Return ``axes``, or the axes of a new figure.

    Parameters
    ----------
    axes : matplotlib.axes.Axes, optional
        Where to draw; None makes a new figure.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    InputError
        If ``axes`` is not one matplotlib Axes, such as an array of several.
    """
    if axes is None:
        from matplotlib import pyplot

        return pyplot.subplots(layout="constrained")[1]
    if not hasattr(axes, "plot"):
        step = "Give one matplotlib Axes, or none for a new figure."
        raise InputError("axes", type(axes).__name__, "not matplotlib axes", next_step=step)
    return axes


def finish(axes: Any, x: str, y: str, title: str = "") -> Any:
    """Set axis labels, grid and title, and add a legend if a curve has a label.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Axes with everything drawn.
    x, y : str
        Axis labels: quantity and unit.
    title : str
        Title; none if empty.

    Returns
    -------
    matplotlib.axes.Axes
        ``axes``.
    """
    axes.set(xlabel=x, ylabel=y)
    if title:
        axes.set_title(title)
    axes.grid(True, alpha=0.3)
    if axes.get_legend_handles_labels()[1]:
        axes.legend()
    return axes
