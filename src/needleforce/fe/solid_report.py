# SPDX-License-Identifier: Apache-2.0
"""The report of a solid: what was solved, extremes, displacement and stress, the surface, force over depth."""

import os
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from .. import checks
from ..display.axes import DEPTH, FORCE
from ..display.canvas import MODEL, QUIET, THICK, Sheet, axis_names, envelope, panels
from ..display.markup import Markup, table
from ..display.page import Figure, Page
from ..display.page import section as page_section
from ..display.quantities import plain, span_scale
from ..errors import InputError
from .elastic.needle_path import NeedlePath
from .elastic.supports import unknowns_of
from .elastic.tissue import Tissue
from .picture import NAMES, draw_field
from .section import Field, Section, section

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawing

Rows = list[tuple[str, ...]]
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


@dataclass(frozen=True, eq=False)
class SolidFacts:
    """Of one solved solid: what the pictures show, the needle that is drawn and how far it is along its path, rows of
    tables, and the loads."""

    shown: Section
    path: NeedlePath | None
    tip: float | None  # [m]
    solid: Rows  # name and value
    materials: Rows  # label, modulus, Poisson ratio, density and cells
    supports: Rows  # boundary and support
    force: float  # [N] of all loads on the tissue, along the depth
    depth: np.ndarray | None  # [m] of an insertion
    base_force: np.ndarray | None  # [N]

    @property
    def displacement(self) -> Field:
        """Along the needle."""
        return self.shown.field("displacement")

    @property
    def von_mises(self) -> Field:
        """Von Mises stress."""
        return self.shown.field("von_mises")


def report(
    file: str | os.PathLike,
    tissue: Tissue,
    solution: ArrayLike,
    path: NeedlePath | None = None,
    *,
    tip: float | None = None,
    depth: ArrayLike | None = None,
    force: ArrayLike | None = None,
    title: str = "Tissue around a needle",
) -> None:
    """Write a solved solid as one HTML file that opens offline.

    It has pictures of displacement and stress, the surface around the needle, force over depth of an insertion, and
    tables of mesh, materials, supports and path.

    Parameters
    ----------
    file : str or os.PathLike
        The file to write; nothing is written if the page cannot be made.
    tissue : Tissue
        What was solved.
    solution : array_like, shape (n,)
        Displacement of all unknowns [m], of ``tissue.solve``.
    path : NeedlePath, optional
        The needle that is drawn.
    tip : float, optional
        How far the needle is along its path [m]; to its end by default.
    depth, force : array_like, shape (n,), optional
        Of an insertion, such as that of ``CondensedInsertion`` [m], [N]; both or none.
    title : str
        Title of the page.

    Raises
    ------
    InputError
        If the solution does not fit, depth and force are not of one length, or the file cannot be written.
    """
    found = facts(tissue, solution, path, tip=tip, depth=depth, force=force)
    solid_page(found, title).write(file)


def facts(
    tissue: Tissue,
    solution: ArrayLike,
    path: NeedlePath | None = None,
    *,
    tip: float | None = None,
    depth: ArrayLike | None = None,
    force: ArrayLike | None = None,
) -> SolidFacts:
    """What ``report`` shows; parameters as there."""
    depths, forces = _insertion(depth, force)
    shown = section(tissue, solution, path)
    return SolidFacts(
        shown=shown, path=path, tip=tip, solid=[*_solid(tissue), *_path(tissue, path, tip)],
        materials=_materials(tissue), supports=_supports(tissue), force=_force(tissue, np.asarray(solution)),
        depth=depths, base_force=forces,
    )  # fmt: skip


def _insertion(depth: ArrayLike | None, force: ArrayLike | None) -> tuple[np.ndarray | None, np.ndarray | None]:
    if depth is None and force is None:
        return None, None
    if depth is None or force is None:
        missing = "depth" if depth is None else "force"
        raise InputError(missing, "missing", "of the insertion", next_step="Give both, or none.")
    given = {"depth": (depth, checks.TRAVEL), "force": (force, checks.FORCE)}
    arrays = tuple(checks.in_range(name, *each, f"Give it in {each[1].unit}.") for name, each in given.items())
    if arrays[0].ndim != 1 or arrays[0].shape != arrays[1].shape or len(arrays[0]) < 2:
        limit = f"must be as long as depth, {arrays[0].shape}, and have one row of two values or more"
        raise InputError("force of the insertion", f"of shape {arrays[1].shape}", limit, next_step="Give both (n,).")
    return arrays


def _force(tissue: Tissue, solution: np.ndarray) -> float:
    """Of the loads on unknowns that are not held, along the depth."""
    loads = tissue.stiffness @ solution
    vertical = unknowns_of(tissue.elements).component == tissue.mesh.dimension - 1
    return float(loads[vertical & ~tissue.held].sum())


def _solid(tissue: Tissue) -> Rows:
    mesh, order = tissue.mesh, {1: "first", 2: "second"}[tissue.elements.order]
    sizes = " × ".join(f"{1e3 * size:.4g}" for size in np.ptp(mesh.points, axis=0))
    across = "r" if tissue.symmetry == "axisymmetric" else "x" if mesh.dimension == 2 else "x × y"
    edges = np.ptp(mesh.points[mesh.cells], axis=1)
    rows = [
        ("symmetry", str(tissue.symmetry).replace("_", " ")),
        ("size", f"{sizes} mm ({across} × depth)"),
        ("cells", f"{len(mesh.cells)} of shape {mesh.shape} and {order} order"),
        ("shortest and longest side of a cell", f"{1e3 * edges.min():.3g} mm, {1e3 * edges.max():.3g} mm"),
        ("unknown displacements", f"{tissue.unknowns}"),
    ]
    if tissue.symmetry in ("plane_strain", "plane_stress"):
        rows.append(("thickness", plain(tissue.elements.thickness, "m")))
    return rows


def _path(tissue: Tissue, path: NeedlePath | None, tip: float | None) -> Rows:
    if path is None:
        return []
    dimension = tissue.mesh.dimension
    entry = ", ".join(f"{1e3 * each:.4g}" for each in path.start(dimension)[:-1])
    along = ", ".join(f"{each:.3g}" for each in path.along(dimension))
    return [
        ("radius of the needle", plain(path.radius, "m")),
        ("path", f"{1e3 * path.depth:.4g} mm with {len(path.nodes)} nodes {1e3 * path.nodes[1]:.4g} mm apart"),
        ("entry and direction", f"({entry}) mm, ({along})"),
        ("tip", plain(path.depth if tip is None else tip, "m")),
    ]


def _materials(tissue: Tissue) -> Rows:
    labels = tissue.mesh.labels.astype(str)
    return [
        (
            label, plain(each.young_modulus, "Pa"), f"{each.poisson_ratio:g}", f"{each.density:g} kg/m³",
            str(int(np.sum(labels == label))),
        )
        for label, each in tissue.materials.items()
    ]  # fmt: skip


def _supports(tissue: Tissue) -> Rows:
    rows = [(name, str(kind)) for name, kind in tissue.supports.items()]
    free = [name for name in ("top", "bottom", "sides") if name not in tissue.supports]
    return rows + [(name, "free") for name in free]


def solid_page(facts: SolidFacts, title: str) -> Page:
    """The report."""
    return Page(
        title=title,
        kind="tissue as a solid",
        outcome=_outcome(facts),
        sections=[
            page_section("Displacement and stress", *_pictures(facts), name="pictures"),
            page_section("The surface", *_surface(facts), name="surface"),
            page_section("Force over depth", *_curve(facts), name="force"),
            page_section("What was solved", table(("quantity", "value"), facts.solid, class_="small"), name="solid"),
            page_section("Materials and supports", *_tables(facts), name="materials"),
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
        units = {each: "Pa" if each in ("von_mises", "stress") else "m" for each in quantities}
        fields = {each: shown.field(each) for each in quantities}
        ends = [f"{NAMES[n]} {plain(f.low, units[n])} to {plain(f.high, units[n])}" for n, f in fields.items()]
        alt = f"{what} around the needle: {', '.join(ends)}."
        wide, narrow = (min(ratio * width + 80.0, _MAX_HEIGHT) for width in (275.0, 225.0))
        draw = partial(fields_figure, facts=facts, quantities=quantities)
        name = "-".join(quantities)
        made.append(Figure(name=name, draw=draw, heights=(wide, 2.0 * narrow), caption=caption, alt=alt))
    return made


def fields_figure(figure: "Drawing", sheet: Sheet, *, facts: SolidFacts, quantities: tuple[str, ...]) -> None:
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


def surface_figure(figure: "Drawing", sheet: Sheet, *, facts: SolidFacts) -> None:
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


def curve_figure(figure: "Drawing", sheet: Sheet, *, facts: SolidFacts) -> None:
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
