# SPDX-License-Identifier: Apache-2.0
"""Force over time and over depth, measured against model: the paper's figures 2, 4 and 8."""

import numpy as np

from ..models.model import Insertion
from .canvas import (
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
    axis_names,
    panels,
)
from .curves import columns_for, envelope, loading, loading_speed
from .words import phase_name

FORCE, DEPTH, TIME = "force [N]", "indentation [mm]", "time [s]"
_STEPS = 200  # of a loading: what relaxes meanwhile is of first order in them


def line(axes, x, y, columns: int, shift: float = 0.0, **style):
    """Draws (x, y) with no more points than can be seen; gives back what was drawn."""
    x, y = envelope(np.asarray(x), np.asarray(y), columns, shift)
    axes.plot(x, y, **style)
    return x, y


def over_time(figure, sheet, one) -> None:
    """Force over time with phases shaded and events marked (fig. 2)."""
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


def over_depth(figure, sheet, drawn, chosen, population=None) -> None:
    """The complete force over indentation, in and out (fig. 8): every repeat, the chosen one's model, and along its
    motion the force (n,) [N] of the law for insertions not seen yet, if there is one."""
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
    _headroom(axes, curves, 0.06)
    axis_names(axes, DEPTH, FORCE)
    labels = Labels(axes, curves)
    if chosen.has_model:
        labels.on("model", *curves[len(drawn)], MODEL)
    if population is not None:
        labels.on("not seen yet", *curves[-1], INK)
    _name_repeats(labels, drawn, curves)
    _name_strokes(labels, chosen)


def _loading_force(model, depth: np.ndarray, speed: float) -> np.ndarray:
    """Force [N] of the first loading at depths (n,) [m], evenly spaced, at a speed [m/s]."""
    return Insertion(model, max_speed=np.inf).run(depth, None, np.full(len(depth), depth[1] / speed))["force"]


def _puncture_near(model, indentation: float) -> float:
    """Depth [m] where that layer gives way which does so nearest to an indentation [mm]; the first, if that is NaN."""
    depths = sorted(layer.top + layer.laws.puncture_depth for layer in model.layers)
    return min(depths, key=lambda depth: 0.0 if np.isnan(indentation) else abs(1e3 * depth - indentation))


def before_puncture(figure, sheet, drawn, model) -> None:
    """The force up to the first puncture over indentation: every repeat against the identified model (fig. 4)."""
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
    axis_names(axes, DEPTH, FORCE)
    labels = Labels(axes, curves)
    if len(peaks):
        labels.at("puncture" if len(peaks) == 1 else "punctures", *np.median(peaks, axis=0), INK)
    if model is not None:
        what = f"{len(model.layers)} layers" if model.deeper else model.stiffness.name.replace("_", " ")
        labels.on(f"model: {what}", *curves[-1], MODEL)
    _name_repeats(labels, drawn, curves)


def repeat_style(one, among: int) -> dict:
    """The line of one repeat: fainter the more there are; the odd one out dashed in a colour of its own."""
    shift = 0.618 * one.number  # the golden ratio: no two repeats have the same columns
    if one.odd:
        return {"color": SECOND, "lw": MEDIUM, "ls": (0, (4, 1.5)), "zorder": 3, "shift": shift}
    return {"color": MEASURED, "lw": THIN, "alpha": 1.0 if among == 1 else 0.85 if among <= 6 else 0.6, "shift": shift}


def _name_repeats(labels: Labels, drawn, curves) -> None:
    plain = [k for k, one in enumerate(drawn) if not one.odd]
    if plain:
        labels.on("measured" if len(drawn) == 1 else f"measured, {len(plain)} repeats", *curves[plain[0]], SLATE)
    for k, one in enumerate(drawn):
        if one.odd:
            labels.on(f"no. {one.number}", *curves[k], SECOND)


def _name_strokes(labels: Labels, one) -> None:
    for name, inside in (("insertion →", one.inward), ("← withdrawal", one.outward)):
        inside = inside & (one.indentation > 0.0)
        if inside.any():
            labels.on(name, *envelope(one.indentation[inside], one.measured[inside], 60), QUIET)


def _phases(axes, one) -> None:
    """Bands over the phases, named at the top in the first of three rows where no other name is in the way."""
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


def _events(axes, one, labels: Labels) -> None:
    """Contact, punctures and exit as points on the measured curve, named."""
    events, start = one.fit.events, one.fit.recording.time[0]
    punctures = ((f"puncture {p.force:.3g} N", p) for p in events.punctures)
    named = [("contact", events.contact), *punctures, ("exit", events.exit)]
    named = [(name, event) for name, event in named if event is not None]
    for _, event in named:
        axes.plot([event.time - start], [event.force], "o", mfc="white", mec=INK, ms=4.5, mew=1.0, zorder=5)
    for name, event in named:
        labels.at(name, event.time - start, event.force, INK)


def _headroom(axes, curves, share: float, floor: float | None = None) -> None:
    """Vertical limits around what was drawn, with room above for names."""
    values = np.concatenate([y[np.isfinite(y)] for _, y in curves] + [np.zeros(1)])
    low, high = values.min(), values.max()
    spread = (high - low) or 1.0
    axes.set_ylim(low - 0.05 * spread if floor is None else min(floor, low), high + share * spread)
    axes.set_yticks([tick for tick in axes.get_yticks() if axes.get_ylim()[0] <= tick <= high + 0.04 * spread])
