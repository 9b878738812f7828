# SPDX-License-Identifier: Apache-2.0
"""Measured and modelled force over time and over depth, the paper's figures 2, 4 and 8, and what is left."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...display.axes import FORCE, INDENTATION, TIME
from ...display.canvas import (
    INK,
    MEASURED,
    MEDIUM,
    MODEL,
    QUIET,
    SECOND,
    SLATE,
    TEXT,
    THICK,
    THIN,
    TINTS,
    Labels,
    Sheet,
    axis_names,
    columns_for,
    envelope,
    line,
    panels,
)
from ...display.markup import visible
from ...models.model import Insertion, Model
from .curves import DrawnRepeat, binned, loading, loading_speed
from .words import file_name, phase_name

RESIDUAL = "measured − model [N]"
OFFSET = {"textcoords": "offset points", "va": "bottom"}
_STEPS = 200  # of a loading curve: the error of a relaxation is of first order in the step
_FREE_SHARE = 0.25  # of the deepest indentation: free travel shown in the figure of force over depth


def over_time(figure: Figure, sheet: Sheet, one: DrawnRepeat) -> None:
    """Force over time with shaded phases and marked events (fig. 2)."""
    axes = panels(figure, sheet)[0, 0]
    curves = [line(axes, one.time, one.measured, sheet.columns, color=MEASURED, lw=THIN)]
    if one.has_model:
        curves.append(line(axes, one.time, one.model, sheet.columns, color=MODEL, lw=THICK, alpha=0.9))
    axes.set_xlim(0.0, one.time[-1])
    _headroom(axes, curves, 0.2)
    _phases(axes, one)
    axis_names(axes, TIME, FORCE)
    labels = Labels(axes, curves)
    _events(axes, one, labels)
    labels.on("measured", *curves[0], SLATE)
    if one.has_model:
        labels.on("model", *curves[1], MODEL)


def over_depth(
    figure: Figure,
    sheet: Sheet,
    drawn: Sequence[DrawnRepeat],
    chosen: DrawnRepeat,
    population: np.ndarray | None = None,
) -> None:
    """The force over indentation in both strokes (fig. 8): every repeat, and the model along the chosen one.

    ``population`` (n,) [N] is the prediction for a new insertion along the same motion, if there is one.
    """
    axes = panels(figure, sheet)[0, 0]
    columns = min(columns_for(len(drawn), sheet.columns), sheet.columns)
    curves = [line(axes, one.indentation, one.measured, columns, **repeat_style(one, len(drawn))) for one in drawn]
    if chosen.has_model:
        curves.append(line(axes, chosen.indentation, chosen.model, sheet.columns, color=MODEL, lw=THICK, alpha=0.9))
    if population is not None:
        style = {"color": INK, "lw": THIN, "ls": (0, (4, 2)), "zorder": 4}
        curves.append(line(axes, chosen.indentation, population, sheet.columns, **style))
    axes.axhline(0.0, color=QUIET, lw=0.6)
    axes.margins(x=0.01)
    cut_free_travel(axes, drawn)
    _headroom(axes, curves, 0.06)
    axis_names(axes, INDENTATION, FORCE)
    labels = Labels(axes, [*curves, zero_line(axes)])
    if chosen.has_model:
        labels.on("model", *curves[len(drawn)], MODEL)
    if population is not None:
        labels.on("new insertion", *curves[-1], INK)
    _name_repeats(labels, drawn, curves)
    _name_strokes(labels, chosen)


def cut_free_travel(axes: Axes, drawn: Sequence[DrawnRepeat]) -> None:
    """Show only the last part of a long free travel, which would take most of the axis."""
    left, right = axes.get_xlim()
    start = -_FREE_SHARE * max(one.indentation.max() for one in drawn)
    if left < start < 0.0:
        axes.set_xlim(start, right)


def zero_line(axes: Axes) -> tuple[np.ndarray, np.ndarray]:
    """The line of zero force, which labels avoid."""
    return np.array(axes.get_xlim()), np.zeros(2)


def _loading_force(model: Model, depth: np.ndarray, speed: float) -> np.ndarray:
    """Force [N] of the first loading at evenly spaced depths (n,) [m], at a speed [m/s]."""
    return Insertion(model, max_speed=np.inf).run(depth, None, np.full(len(depth), depth[1] / speed))["force"]


def _puncture_near(model: Model, indentation: float) -> float:
    """Puncture depth [m] of the layer that punctures nearest to an indentation [mm]; the first if that is NaN."""
    depths = sorted(layer.top + layer.laws.puncture_depth for layer in model.layers)
    return min(depths, key=lambda depth: 0.0 if np.isnan(indentation) else abs(1e3 * depth - indentation))


def before_puncture(figure: Figure, sheet: Sheet, drawn: Sequence[DrawnRepeat], model: Model | None) -> None:
    """The force over indentation up to the first puncture: every repeat and the identified model (fig. 4)."""
    axes = panels(figure, sheet)[0, 0]
    columns = min(columns_for(len(drawn), sheet.columns), sheet.columns)
    curves = []
    for one in drawn:
        part = loading(one)
        curves.append(line(axes, one.indentation[part], one.measured[part], columns, **repeat_style(one, len(drawn))))
    peaks = np.array([one.puncture for one in drawn if one.puncture is not None])
    if model is not None:
        end = _puncture_near(model, np.median(peaks[:, 0]) if len(peaks) else np.nan)
        depth = np.linspace(0.0, end * (1.0 - 1e-9), _STEPS)
        force = _loading_force(model, depth, float(np.median([loading_speed(one) for one in drawn])))
        curves.append(line(axes, 1e3 * depth, force, _STEPS, color=MODEL, lw=THICK))
    if len(peaks):
        axes.plot(*peaks.T, "o", mfc="white", mec=INK, ms=4, mew=0.9)
    axes.set_xlim(left=0.0)
    axes.margins(x=0.08)
    _headroom(axes, curves, 0.12, floor=0.0)
    axis_names(axes, INDENTATION, FORCE)
    labels = Labels(axes, curves)
    if len(peaks):
        labels.at("puncture" if len(peaks) == 1 else "punctures", *np.median(peaks, axis=0), INK)
    if model is not None:
        name = f"{len(model.layers)} layers" if model.deeper else model.stiffness.name.replace("_", " ")
        labels.on(f"model: {name}", *curves[-1], MODEL)
    _name_repeats(labels, drawn, curves)


def panels_per_row(count: int, narrow: bool) -> int:
    """Number of small panels in a row."""
    return 2 if narrow else count if count <= 4 else 3 if count <= 6 else 4


def multiples(figure: Figure, sheet: Sheet, drawn: Sequence[DrawnRepeat]) -> None:
    """Every recording over time, measured and modelled, on the same axes; anomalous ones in another colour."""
    row = panels_per_row(len(drawn), sheet.narrow)
    margins = {"top": 32.0, "across": 18.0, "down": 32.0}
    grid = panels(figure, sheet, math.ceil(len(drawn) / row), row, margins, sharex=True, sharey=True).ravel()
    budget = min(columns_for(len(drawn), sheet.columns), sheet.columns // row)
    for k, (axes, one) in enumerate(zip(grid, drawn)):
        line(axes, one.time, one.measured, budget, color=SECOND if one.anomalous else MEASURED, lw=THIN)
        if one.has_model:
            line(axes, one.time, one.model, budget, color=MODEL, lw=MEDIUM, alpha=0.9)
        _heading(axes, one, 16 if sheet.narrow else 24)
        axes.tick_params(labelbottom=k + row >= len(drawn))
    grid[0].set_xlim(0.0, max(one.time[-1] for one in drawn))
    for axes in grid[len(drawn) :]:
        axes.set_visible(False)
    grid[len(drawn) - 1].set_xlabel(TIME, loc="right")
    grid[0].annotate(FORCE, (0.0, 1.0), (-32.0, 18.0), xycoords="axes fraction", **OFFSET)


def multiples_height(count: int, narrow: bool) -> float:
    """Height [points] of a drawing with ``count`` small panels."""
    row = panels_per_row(count, narrow)
    return 40.0 + (100.0 if narrow else 105.0 + 60.0 * (row < 4)) * math.ceil(count / row)


def _heading(axes: Axes, one: DrawnRepeat, longest: int) -> None:
    """Number and file name above a small panel, the name cut to its last ``longest`` characters."""
    name = file_name(one.fit.file).removesuffix(".csv")
    name = name if len(name) <= longest else f"…{name[1 - longest :]}"
    style = {"xycoords": "axes fraction", "fontsize": TEXT - 1, "color": SECOND if one.anomalous else INK}
    axes.annotate(f"{one.number}  {visible(name)}", (0.0, 1.0), (0, 4), **style, **OFFSET)
    if one.anomalous:
        axes.annotate("anomalous", (1.0, 1.0), (0, -11), ha="right", **style, **OFFSET)


def repeat_style(one: DrawnRepeat, among: int) -> dict[str, Any]:
    """The line of one repeat: fainter the more there are; an anomalous one is dashed in another colour."""
    shift = 0.618 * one.number  # the golden ratio: no two repeats have the same columns
    if one.anomalous:
        return {"color": SECOND, "lw": MEDIUM, "ls": (0, (4, 1.5)), "zorder": 3, "shift": shift}
    return {"color": MEASURED, "lw": THIN, "alpha": 1.0 if among == 1 else 0.85 if among <= 6 else 0.6, "shift": shift}


def _name_repeats(labels: Labels, drawn: Sequence[DrawnRepeat], curves: Sequence[tuple]) -> None:
    """Label the measured curves: one label for those without anomalies, one for each anomalous recording."""
    normal = [k for k, one in enumerate(drawn) if not one.anomalous]
    if normal:
        labels.on("measured" if len(drawn) == 1 else f"measured, {len(normal)} repeats", *curves[normal[0]], SLATE)
    for k, one in enumerate(drawn):
        if one.anomalous:
            labels.on(f"no. {one.number}", *curves[k], SECOND)


def _name_strokes(labels: Labels, one: DrawnRepeat) -> None:
    """Label the two strokes with their direction."""
    for name, inside in (("insertion →", one.inward), ("← withdrawal", one.outward)):
        inside = inside & (one.indentation > 0.0)
        if inside.any():
            labels.on(name, *envelope(one.indentation[inside], one.measured[inside], 60), QUIET)


def _phases(axes: Axes, one: DrawnRepeat) -> None:
    """A band for each phase, named at the top in the first of three rows in which no other name is in the way."""
    start, ends = one.fit.recording.time[0], [-np.inf] * 3
    width_of = 0.56 * (TEXT - 1) * np.ptp(axes.get_xlim()) / axes.bbox.width
    for span in one.fit.events.phases:
        axes.axvspan(span.start - start, span.end - start, color=TINTS.get(str(span.phase), "none"), lw=0, zorder=0)
        name, middle = phase_name(span.phase), 0.5 * (span.start + span.end) - start
        half = 0.5 * width_of * (len(name) + 1)
        middle = np.clip(middle, half, max(axes.get_xlim()[1] - half, half))
        row = next((k for k in range(3) if middle - half > ends[k]), None)
        if row is None or (str(span.phase) == "free" and span.end - span.start < 2 * half):
            continue
        ends[row] = middle + half
        axes.annotate(name, (middle, 1.0), (0, -2 - 11 * row), xycoords=axes.get_xaxis_transform(), fontsize=TEXT - 1,
                      textcoords="offset points", ha="center", va="top", color=QUIET)  # fmt: skip


def _events(axes: Axes, one: DrawnRepeat, labels: Labels) -> None:
    """Contact, punctures and exit as labelled points on the measured curve."""
    events, start = one.fit.events, one.fit.recording.time[0]
    punctures = ((f"puncture {p.force:.3g} N", p) for p in events.punctures)
    named = [("contact", events.contact), *punctures, ("exit", events.exit)]
    named = [(name, event) for name, event in named if event is not None]
    for _, event in named:
        axes.plot([event.time - start], [event.force], "o", mfc="white", mec=INK, ms=4.5, mew=1.0, zorder=5)
    for name, event in named:
        labels.at(name, event.time - start, event.force, INK)


def _headroom(axes: Axes, curves: Sequence[tuple], share: float, floor: float | None = None) -> None:
    """Vertical limits around the curves, with space above for labels."""
    values = np.concatenate([y[np.isfinite(y)] for _, y in curves] + [np.zeros(1)])
    low, high = values.min(), values.max()
    spread = (high - low) or 1.0
    axes.set_ylim(low - 0.05 * spread if floor is None else min(floor, low), high + share * spread)
    axes.set_yticks([tick for tick in axes.get_yticks() if axes.get_ylim()[0] <= tick <= high + 0.04 * spread])


def residuals(figure: Figure, sheet: Sheet, drawn: Sequence[DrawnRepeat], rmse: float) -> None:
    """Measured minus modelled force over indentation, a panel for each stroke, with a band of ± the rms residual."""
    rows, columns = (2, 1) if sheet.narrow else (1, 2)
    both = panels(figure, sheet, rows, columns, sharex=True, sharey=True).ravel()
    edges = np.linspace(0.0, max(one.indentation.max() for one in drawn), 141)
    for axes, name, stroke in zip(both, ("insertion", "withdrawal"), ("inward", "outward")):
        axes.axhspan(-rmse, rmse, color=MODEL, alpha=0.2, lw=0)
        _bins(axes, drawn, stroke, edges)
        axes.axhline(0.0, color=MODEL, lw=1.0)
        axes.tick_params(labelbottom=True, labelleft=True)
        axis_names(axes, INDENTATION, RESIDUAL)
        axes.annotate(name, (1.0, 1.0), (0, 8), xycoords="axes fraction", ha="right", color=QUIET, **OFFSET)
    place = {"xycoords": both[-1].get_yaxis_transform(), **OFFSET}
    both[-1].annotate("± rms", (1.0, rmse), (-2, 1), ha="right", color=MODEL, fontsize=TEXT - 1, **place)


def _bins(axes: Axes, drawn: Sequence[DrawnRepeat], stroke: str, edges: np.ndarray) -> None:
    """The mean residual of each repeat at each depth as a line, over the grey range of all samples of all repeats."""
    found = [binned(one.indentation[getattr(one, stroke)], one.residual[getattr(one, stroke)], edges) for one in drawn]
    middle = 0.5 * (edges[1:] + edges[:-1])
    normal = [bins for one, bins in zip(drawn, found) if not one.anomalous] or found
    low, high = np.fmin.reduce([low for _, low, _ in normal]), np.fmax.reduce([high for _, _, high in normal])
    axes.fill_between(middle, low, high, color="#d9dcdf", lw=0)
    for one, (mean, _, _) in zip(drawn, found):
        line(axes, middle, mean, len(middle), **repeat_style(one, len(drawn)))
