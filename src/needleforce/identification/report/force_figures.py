# SPDX-License-Identifier: Apache-2.0
"""Measured and modelled force over time and over depth, the paper's figures 2, 4 and 8, with titles and captions."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

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
from ...display.markup import element, join
from ...display.page import Figure
from ...models.model import Insertion, Model
from ..models import run_model, with_ruptures
from .curves import DrawnRepeat, loading, loading_speed
from .words import IN_TABLES, phase_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Drawing

LAYER_COLOURS = (SECOND, "#a3428a", "#00735c")
_STEPS = 200  # of a loading curve: the error of a relaxation is of first order in the step
_FREE_SHARE = 0.25  # of the deepest indentation: free travel shown in the figure of force over depth
_POPULATION = "Dashed: prediction for a new insertion, its ruptures distributed over their scatter between repeats. "
_MEASURED = element("b", "Measured", class_="measured")
KEY = join([_MEASURED, " thin and grey, ", element("b", "model", class_="model"), " thick and orange. "])


def titled(
    name: str, title: str, caption: object, draw: Callable, heights: tuple[float, float], side_caption: bool = False
) -> Figure:
    """A figure with its title."""
    shown = {"title": title, "caption": caption, "alt": f"{title}. {IN_TABLES}", "side_caption": side_caption}
    return Figure(name=name, draw=draw, heights=heights, **shown)


def touching(drawn: Sequence[DrawnRepeat]) -> tuple[DrawnRepeat, ...]:
    """The recordings in which the needle touches the tissue."""
    return tuple(one for one in drawn if one.fit.events.contact is not None)


def over_depth(
    drawn: Sequence[DrawnRepeat], one: DrawnRepeat, shared_contact: float | None, population: np.ndarray | None
) -> Figure:
    """Force over depth of every repeat, and of the model along ``one``; ``population`` (n,) [N] is the prediction for a
    new insertion along the same motion, if there is one."""
    shown = touching(drawn) or (one,)
    model = f"The model follows the motion of recording {one.number}. " if len(shown) > 1 and one.has_model else ""
    shared = shared_contact is not None
    identified = shared or "contact_depth" in one.fit.parameters
    contact = f"the {'identified' if identified else 'detected'} contact"
    contact += "" if shared or len(shown) == 1 else " of each recording"
    dashed = "" if population is None else _POPULATION
    words = [KEY if one.has_model else "", model, dashed, f"Indentation is measured from {contact}."]
    draw = partial(draw_over_depth, drawn=shown, chosen=one, population=population)
    return titled("depth", "Force over depth, insertion and withdrawal", join(words), draw, (300, 260))


def draw_over_depth(
    figure: "Drawing",
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


def cut_free_travel(axes: "Axes", drawn: Sequence[DrawnRepeat]) -> None:
    """Show only the last part of a long free travel, which would take most of the axis."""
    left, right = axes.get_xlim()
    start = -_FREE_SHARE * max(one.indentation.max() for one in drawn)
    if left < start < 0.0:
        axes.set_xlim(start, right)


def zero_line(axes: "Axes") -> tuple[np.ndarray, np.ndarray]:
    """The line of zero force, which labels avoid."""
    return np.array(axes.get_xlim()), np.zeros(2)


def over_time(one: DrawnRepeat, among: int) -> Figure:
    """Force over time of the recording with the median residual."""
    which = f"Recording {one.number}, the one with the median residual. " if among > 1 and one.has_model else ""
    bands = "Bands are phases; circles are the detected events with their measured force."
    caption = join([which, KEY if one.has_model else "", bands])
    return titled("time", "Force over time", caption, partial(draw_over_time, one=one), (280, 240))


def draw_over_time(figure: "Drawing", sheet: Sheet, one: DrawnRepeat) -> None:
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


def _phases(axes: "Axes", one: DrawnRepeat) -> None:
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


def _events(axes: "Axes", one: DrawnRepeat, labels: Labels) -> None:
    """Contact, punctures and exit as labelled points on the measured curve."""
    events, start = one.fit.events, one.fit.recording.time[0]
    for _, event in events.named:
        axes.plot([event.time - start], [event.force], "o", mfc="white", mec=INK, ms=4.5, mew=1.0, zorder=5)
    for name, event in events.named:
        label = f"puncture {event.force:.3g} N" if name == "puncture" else name
        labels.at(label, event.time - start, event.force, INK)


def before_puncture(shown: Sequence[DrawnRepeat], model: Model | None, shared: bool, title: str) -> Figure:
    """Force before the puncture of the repeats that touch the tissue, and of the model; ``shared`` is whether they have
    one contact."""
    contact = "the identified" if shared else "its own"
    start = f"Every repeat from {contact} contact; circles are" if len(shown) > 1 else "From contact; the circle is"
    caption = f"{start} the first puncture as measured. {_law(model)}"
    caption += " The identified zero of the force is subtracted." if any(one.zero for one in shown) else ""
    draw = partial(draw_before_puncture, drawn=shown, model=model)
    return titled("stiffness", title, caption, draw, (250, 230), side_caption=True)


def _law(model: Model | None) -> str:
    """What the model's curve before the puncture is."""
    if model is None:
        return ""
    layers_sum = "The model is the sum of the layers that the tip has reached, at the mean speed."
    summary = layers_sum if model.deeper else model.stiffness.summary
    return f"{summary} The model's curve ends at the identified puncture."


def draw_before_puncture(figure: "Drawing", sheet: Sheet, drawn: Sequence[DrawnRepeat], model: Model | None) -> None:
    """The force over indentation up to the first puncture: every repeat and the identified model (fig. 4)."""
    axes = panels(figure, sheet)[0, 0]
    columns = min(columns_for(len(drawn), sheet.columns), sheet.columns)
    curves = []
    for one in drawn:
        part = loading(one)
        force = one.measured[part] - one.zero
        curves.append(line(axes, one.indentation[part], force, columns, **repeat_style(one, len(drawn))))
    peaks = np.array([np.subtract(one.puncture, (0.0, one.zero)) for one in drawn if one.puncture is not None])
    if model is not None:
        end = _puncture_near(model, np.median(peaks[:, 0]) if len(peaks) else np.nan)
        depth = np.linspace(0.0, end * (1.0 - 1e-9), _STEPS)
        times = np.full(_STEPS, depth[1] / float(np.median([loading_speed(one) for one in drawn])))
        force = Insertion(model, max_speed=np.inf).run(depth, None, times)["force"]
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


def _puncture_near(model: Model, indentation: float) -> float:
    """Puncture depth [m] of the layer that punctures nearest to an indentation [mm]; the first if that is NaN."""
    depths = sorted(layer.top + layer.laws.puncture_depth for layer in model.layers)
    return min(depths, key=lambda depth: 0.0 if np.isnan(indentation) else abs(1e3 * depth - indentation))


def layers(model: Model, contact: float, one: DrawnRepeat) -> Figure:
    """The force of each of several layers along one recording."""
    caption = f"Force of each layer along the motion of recording {one.number}; their sum is the model. Grey: measured."
    draw = partial(draw_layers, one=one, forces=layer_forces(model, contact, one))
    return titled("layers", "Force of each layer", caption, draw, (260, 240))


def layer_forces(model: Model, contact: float, one: DrawnRepeat) -> list[np.ndarray]:
    """Force (n,) [N] of each layer along the recording of ``one``, with its own ruptures; their sum is its model.

    ``contact`` is the depth of the surface [m]. All forces may scale with one power of the speed: this factor between
    the layers' sum and the model is applied.
    """
    own = [e.value - contact for name, e in one.fit.parameters.items() if name.endswith("puncture_depth")]
    layers = with_ruptures(model, own).layers
    alone = [Model(*layer.parts[:-1], relaxation=layer.relaxation) for layer in layers]
    forces = np.array([run_model(each, one.fit.recording, contact + layer.top) for each, layer in zip(alone, layers)])
    total = forces.sum(axis=0)
    factor = total @ one.model / (total @ total) if total.any() else 1.0
    return list(factor * forces)


def draw_layers(figure: "Drawing", sheet: Sheet, one: DrawnRepeat, forces: Sequence[np.ndarray]) -> None:
    """The force of each layer and the measured force over indentation, in both strokes."""
    axes = panels(figure, sheet)[0, 0]
    curves = [line(axes, one.indentation, one.measured, sheet.columns, color=MEASURED, lw=THIN)]
    for force, colour in zip(forces, LAYER_COLOURS):
        curves.append(line(axes, one.indentation, force, sheet.columns, color=colour, lw=MEDIUM))
    axes.axhline(0.0, color=QUIET, lw=0.6)
    axes.margins(x=0.01, y=0.06)
    cut_free_travel(axes, [one])
    axis_names(axes, INDENTATION, FORCE)
    labels = Labels(axes, [*curves, zero_line(axes)])
    labels.on("measured", *curves[0], SLATE)
    for k, (curve, colour) in enumerate(zip(curves[1:], LAYER_COLOURS), 1):
        labels.on(f"layer {k}", *curve, colour)


def repeat_style(one: DrawnRepeat, among: int) -> dict[str, Any]:
    """The line of one repeat: fainter the more there are; an anomalous one is dashed in another colour."""
    own = {"shift": 0.618 * one.number}  # the golden ratio: no two repeats have the same columns
    own["label"] = f"no. {one.number}" if among > 1 else "measured"
    if one.anomalous:
        return {"color": SECOND, "lw": MEDIUM, "ls": (0, (4, 1.5)), "zorder": 3, **own}
    return {"color": MEASURED, "lw": THIN, "alpha": 1.0 if among == 1 else 0.85 if among <= 6 else 0.6, **own}


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


def _headroom(axes: "Axes", curves: Sequence[tuple], share: float, floor: float | None = None) -> None:
    """Vertical limits around the curves, with space above for labels."""
    values = np.concatenate([y[np.isfinite(y)] for _, y in curves] + [np.zeros(1)])
    low, high = values.min(), values.max()
    spread = (high - low) or 1.0
    axes.set_ylim(low - 0.05 * spread if floor is None else min(floor, low), high + share * spread)
    axes.set_yticks([tick for tick in axes.get_yticks() if axes.get_ylim()[0] <= tick <= high + 0.04 * spread])
