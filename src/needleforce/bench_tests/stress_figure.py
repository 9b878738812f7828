# SPDX-License-Identifier: Apache-2.0
"""The figure of a tension or compression test: readings and all laws, residuals below."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..display.canvas import MEASURED, MODEL, QUIET, SECOND, SLATE, THICK, THIN, Labels, Sheet, axis_names, panels
from .law_fit import LawFit, StressCurve
from .laws import nominal_stress
from .stress_result import MIN_WEIGHT, STRETCH, law_name, stress_scale

HEIGHTS = 380.0, 380.0
MAX_MARKS = 80  # readings of a curve; more are drawn as a line
_POINTS = 200  # of a drawn curve
_MARKS = "os^Dv"  # of several curves


def stress_figure(figure: Figure, sheet: Sheet, laws: Sequence[LawFit], curves: Sequence[StressCurve]) -> None:
    """Nominal stress over stretch with the curves of all laws, and their residuals below."""
    margins = {"left": 46.0, "down": 44.0}
    upper, lower = panels(figure, sheet, 2, 1, margins, sharex=True, height_ratios=(2.2, 1.0)).ravel()
    factor, unit = stress_scale(curves)
    drawn = draw_curves(upper, laws, curves, factor)
    axis_names(upper, "", f"nominal stress [{unit}]")
    measured = [(curve.stretch, factor * curve.stress) for curve in curves]
    labels = Labels(upper, [*measured, *(line for _, line in drawn)])
    for law, line in _labelled(drawn, laws, curves):
        labels.on(law_name(law), *line, _style(law, laws, len(curves))["color"])
    for curve in curves if len(curves) > 1 else ():
        labels.at(curve.mode, float(curve.stretch[-1]), factor * float(curve.stress[-1]), SLATE)
    _draw_residuals(lower, laws, curves)
    axis_names(lower, STRETCH, "residual [% of the largest stress]")


def draw_curves(
    axes: Axes, laws: Sequence[LawFit], curves: Sequence[StressCurve], factor: float
) -> list[tuple[LawFit, tuple[np.ndarray, np.ndarray]]]:
    """Draw readings and laws; each law with its line, curve by curve, the best law first."""
    drawn = []
    for k, curve in enumerate(curves):
        mark = _MARKS[k % len(_MARKS)]
        readings = {"color": SLATE, "mfc": "white", "mec": SLATE, "mew": 0.9, "ms": 3.5, "zorder": 3}
        dense = len(curve.stretch) > MAX_MARKS
        style = {"marker": "" if dense else mark, "ls": "-" if dense else "", "lw": 1.2}
        axes.plot(curve.stretch, factor * curve.stress, **readings, **style)
        stretch = np.linspace(min(curve.stretch.min(), 1.0), max(curve.stretch.max(), 1.0), _POINTS)
        for law in laws:
            stress = factor * nominal_stress(law.law, stretch, law.coefficients, curve.mode)
            axes.plot(stretch, stress, **_style(law, laws, len(curves)))
            drawn.append((law, (stretch, stress)))
    stresses = np.concatenate([factor * curve.stress for curve in curves] + [np.zeros(1)])
    axes.set_ylim(stresses.min() - 0.1 * np.ptp(stresses), stresses.max() + 0.12 * np.ptp(stresses))
    return drawn


def _labelled(
    drawn: list[tuple[LawFit, tuple]], laws: Sequence[LawFit], curves: Sequence[StressCurve]
) -> list[tuple[LawFit, tuple]]:
    """The laws to label, on their line of the first curve: the best, comparable ones, and of a single curve those that
    differ visibly."""
    first = drawn[: len(laws)]
    clear = 2.0 * max(laws[0].misfit, 0.005)
    return [
        (law, line)
        for law, line in first
        if law is laws[0] or law.weight >= MIN_WEIGHT or (len(curves) == 1 and law.misfit > clear)
    ]


def _style(law: LawFit, laws: Sequence[LawFit], curves: int) -> dict:
    """The line of a law: the best one strong, those that fit comparably in a second colour, the others grey."""
    if law is laws[0]:
        return {"color": MODEL, "lw": THICK, "zorder": 4}
    if law.weight >= MIN_WEIGHT:
        return {"color": SECOND, "lw": 1.1, "ls": (0, (5, 2)), "zorder": 3.5}
    faint = 1.0 if curves == 1 else 0.4
    return {
        "color": QUIET if not law.excluded else MEASURED,
        "lw": THIN,
        "ls": (0, (2, 2)),
        "alpha": faint,
        "zorder": 2,
    }


def _draw_residuals(axes: Axes, laws: Sequence[LawFit], curves: Sequence[StressCurve]) -> None:
    """Residuals of the laws that fit comparably, in per cent of the largest stress."""
    peak = max(float(np.abs(curve.stress).max()) for curve in curves)
    axes.axhline(0.0, color=QUIET, lw=0.6)
    ends = np.cumsum([len(curve.stretch) for curve in curves])[:-1]
    for law in reversed([law for law in laws if law is laws[0] or law.weight >= MIN_WEIGHT]):
        for k, (curve, part) in enumerate(zip(curves, np.split(100.0 * law.residual / peak, ends))):
            mark = _MARKS[k % len(_MARKS)] if len(part) <= MAX_MARKS else ""
            axes.plot(curve.stretch, part, marker=mark, ms=2.5, **_style(law, laws, len(curves)) | {"lw": 0.8})
