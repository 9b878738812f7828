# SPDX-License-Identifier: Apache-2.0
"""The report of tissue as a solid: displacement and stress, the surface, force over depth, what was solved."""

from functools import partial

import numpy as np
from matplotlib.figure import Figure as Drawing

from ..display.axes import DEPTH, FORCE
from ..display.canvas import MODEL, QUIET, THICK, Sheet, axis_names, envelope, panels
from ..display.markup import Markup, table
from ..display.page import Figure, Page, section
from ..display.quantities import plain, span_scale
from .picture import NAMES, draw_field
from .section import Field
from .solid_report import SolidFacts

_PANELS = (("displacement", "von_mises"), ("magnitude", "stress"))
_COLOURS = (
    "Colours reach to the extremes of all cells that are shown. Stress is that of each cell; its scale is logarithmic"
)
_SCALES = {
    "von_mises": " over three decades, and the colour bar ends in an arrow where values are below.",
    "stress": ", and linear below a hundredth of the largest. Positive stress pulls.",
}
_SURFACE = "How far the surface is displaced inwards, over the distance from the needle's entry."
_CURVE = "Force at the base of the needle over the depth of its tip, + opposes insertion."
_MAX_HEIGHT = 560.0  # of a drawing [points]


def solid_page(facts: SolidFacts, title: str) -> Page:
    """The report."""
    return Page(
        title=title,
        kind="tissue as a solid",
        outcome=_outcome(facts),
        sections=[
            section("Displacement and stress", *_pictures(facts), name="pictures"),
            section("The surface", *_surface(facts), name="surface"),
            section("Force over depth", *_curve(facts), name="force"),
            section("What was solved", table(("quantity", "value"), facts.solid, class_="small"), name="solid"),
            section("Materials and supports", *_tables(facts), name="materials"),
        ],
    )


def _outcome(facts: SolidFacts) -> str:
    moved, stress = facts.displacement, facts.von_mises
    size, at = max((moved.high, moved.high_at), (moved.low, moved.low_at), key=lambda each: abs(each[0]))
    if not size:
        return "The tissue is not displaced."
    largest, stressed = plain(size, "m", 0.01 * size), plain(stress.high, "Pa", 0.01 * stress.high)
    first = (
        f"In the plane that is shown, the tissue is displaced along the needle by up to {largest}, {_place(facts, at)}"
    )
    second = f"; the largest von Mises stress is {stressed}, {_place(facts, stress.high_at)}. "
    return f"{first}{second}The force on the tissue along the depth is {plain(facts.force, 'N')}."


def _place(facts: SolidFacts, at: tuple[float, float]) -> str:
    across = (
        f"{1e3 * abs(at[0]):.3g} mm from the needle's line" if facts.path is not None else f"x {1e3 * at[0]:.3g} mm"
    )
    return f"{across} at a depth of {1e3 * at[1]:.3g} mm"


def _pictures(facts: SolidFacts) -> list[Figure]:
    shown = facts.shown
    ratio = 1.05 * np.ptp(shown.depth) / np.ptp(shown.across)
    lines = " Lines are the limits of materials." if len(np.unique(shown.label)) > 1 else ""
    made = []
    for quantities in _PANELS:
        what = " and ".join(NAMES[each] for each in quantities)
        what = what[0].upper() + what[1:]
        caption = f"{what}. {_COLOURS}{_SCALES[quantities[1]]}{lines}"
        alt = f"{what} around the needle: {', '.join(_range(shown.field(each), each) for each in quantities)}."
        wide, narrow = (min(ratio * width + 80.0, _MAX_HEIGHT) for width in (275.0, 225.0))
        draw = partial(fields_figure, facts=facts, quantities=quantities)
        name = "-".join(quantities)
        made.append(Figure(name=name, draw=draw, heights=(wide, 2.0 * narrow), caption=caption, alt=alt))
    return made


def _range(field: Field, quantity: str) -> str:
    unit = "Pa" if quantity in ("von_mises", "stress") else "m"
    return f"{NAMES[quantity]} {plain(field.low, unit)} to {plain(field.high, unit)}"


def fields_figure(figure: Drawing, sheet: Sheet, *, facts: SolidFacts, quantities: tuple[str, ...]) -> None:
    """A panel for each quantity, next to each other on a wide sheet."""
    figure.set_layout_engine("constrained", w_pad=0.08, h_pad=0.06)
    made = figure.subplots(*((2, 1) if sheet.narrow else (1, 2)))
    for axes, quantity in zip(made, quantities):
        draw_field(axes, facts.shown, quantity, facts.path, facts.tip)


def _surface(facts: SolidFacts) -> list[Figure]:
    distance, moved = facts.shown.surface
    if len(distance) < 2:
        return []
    deepest = int(np.argmax(np.abs(moved)))
    text = f"{_SURFACE} Largest: {plain(moved[deepest], 'm')} at {1e3 * distance[deepest]:.3g} mm."
    draw = partial(surface_figure, facts=facts)
    return [Figure(name="surface", draw=draw, heights=(210.0, 200.0), caption=text, alt=text)]


def surface_figure(figure: Drawing, sheet: Sheet, *, facts: SolidFacts) -> None:
    """Displacement of the surface over distance, downwards as the tissue goes, with the needle's width as a band."""
    axes = panels(figure, sheet, margins={"left": 46.0})[0, 0]
    distance, moved = facts.shown.surface
    factor, unit = span_scale(0.0, float(np.abs(moved).max()), "m")
    axes.plot(1e3 * distance, factor * moved, color=MODEL, lw=THICK)
    axes.axhline(0.0, color=QUIET, lw=0.6)
    if facts.path is not None:
        half = 1e3 * facts.path.radius
        axes.axvspan(-half, half, color="#d9dcdf", lw=0, zorder=0)
    axes.set_xlim(1e3 * facts.shown.across[0], 1e3 * facts.shown.across[-1])
    axes.invert_yaxis()
    name = "distance from the needle [mm]" if facts.path is not None else "x [mm]"
    axis_names(axes, name, f"displacement of the surface inwards [{unit}]")


def _curve(facts: SolidFacts) -> list[Figure]:
    if facts.depth is None:
        return []
    peak = int(np.nanargmax(np.abs(facts.base_force)))
    largest = f"{plain(facts.base_force[peak], 'N')} at {1e3 * facts.depth[peak]:.3g} mm"
    text = f"{_CURVE} Largest: {largest}; at the end {plain(facts.base_force[-1], 'N')}."
    draw = partial(curve_figure, facts=facts)
    return [Figure(name="force", draw=draw, heights=(240.0, 220.0), caption=text, alt=text)]


def curve_figure(figure: Drawing, sheet: Sheet, *, facts: SolidFacts) -> None:
    """Force over depth."""
    axes = panels(figure, sheet, margins={"left": 46.0})[0, 0]
    axes.plot(*envelope(1e3 * facts.depth, facts.base_force, sheet.columns), color=MODEL, lw=THICK)
    axes.axhline(0.0, color=QUIET, lw=0.6)
    axis_names(axes, DEPTH, FORCE)


def _tables(facts: SolidFacts) -> list[Markup]:
    head = ("label", "Young modulus", "Poisson ratio", "density", "cells")
    return [
        table(head, facts.materials, class_="numbers dense"),
        table(("boundary", "support"), facts.supports, class_="small dense"),
    ]
