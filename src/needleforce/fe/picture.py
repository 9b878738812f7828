# SPDX-License-Identifier: Apache-2.0
"""Pictures of a solved solid around the needle: displacement and stress in colour, needle and materials drawn in."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ..display.quantities import scale, span_scale
from ..errors import InputError
from .elastic.needle_path import NeedlePath
from .elastic.tissue import Tissue
from .section import Field, Section, section

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

NAMES = {
    "displacement": "displacement along the needle",
    "magnitude": "magnitude of displacement",
    "von_mises": "von Mises stress",
    "stress": "normal stress along the needle",
}
"""What each quantity is, on its colour bar."""
_DECADES = 3.0  # of a stress that are shown, down from the largest
_SIGNED = 0.1  # of the larger extreme: from which share on the other one gives zero the middle of the colours
_LINEAR = 0.01  # of the largest normal stress: below it the scale of a signed stress is linear
_ABOVE = 0.05  # of the height of a picture: how much of the needle is drawn above the surface
_MIN_NAMED = 0.02  # of the area of a picture: smaller regions get no name
_MAX_NAMES = 6
_INK = "#222222"


def picture(
    tissue: Tissue,
    solution: ArrayLike,
    path: NeedlePath | None = None,
    *,
    tip: float | None = None,
    quantities: tuple[str, ...] = ("displacement", "von_mises"),
) -> "Figure":
    """Displacement and stress around the needle, next to each other, as a figure of matplotlib.

    A plane mesh is shown itself, an axisymmetric one with its mirror, a solid in space as the vertical plane through
    the needle's line. Dark lines are the limits of materials. Stress is that of each cell.

    Parameters
    ----------
    tissue : Tissue
        What was solved.
    solution : array_like, shape (n,)
        Displacement of all unknowns [m], of ``tissue.solve``.
    path : NeedlePath, optional
        The needle that is drawn; without one there is none, and the plane is that of x and depth.
    tip : float, optional
        How far the needle is along its path [m]; to its end by default.
    quantities : tuple of str
        One panel each: ``"displacement"`` along the needle, its ``"magnitude"``, ``"von_mises"``, ``"stress"`` along
        the needle (normal, + pulls).

    Returns
    -------
    matplotlib.figure.Figure
        ``figure.savefig("picture.png")`` writes it.

    Raises
    ------
    InputError
        If the solution does not fit, the plane does not meet the mesh, or a quantity is another.

    Notes
    -----
    Colours reach to the extremes of the cells that are shown; nothing is clipped above. Stress has a logarithmic scale
    over three decades: what is below has the lowest colour, and the colour bar ends in an arrow.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    shown = section(tissue, solution, path)
    wide, deep = np.ptp(shown.across), np.ptp(shown.depth) * (1.0 + _ABOVE)
    height = float(np.clip(4.4 * deep / wide, 2.0, 7.0))
    width = float(np.clip(height * wide / deep + 0.8, 3.4, 5.2))
    figure = Figure(figsize=(width * len(quantities), height + 1.3), dpi=150, layout="constrained")
    FigureCanvasAgg(figure)
    for axes, quantity in zip(figure.subplots(1, len(quantities), squeeze=False)[0], quantities):
        draw_field(axes, shown, quantity, path, tip)
    return figure


def draw_field(
    axes: "Axes", shown: Section, quantity: str, path: NeedlePath | None = None, tip: float | None = None
) -> None:
    """One quantity of a section with its colour bar below; parameters as of ``picture``."""
    field = shown.field(quantity)
    colours = colours_of(field, quantity)
    left, right, top, bottom = _edges(shown)
    image = axes.imshow(
        colours.factor * field.values, extent=(left, right, bottom, top), cmap=colours.map, norm=colours.norm,
        interpolation="none", origin="upper", aspect="equal",
    )  # fmt: skip
    _draw_materials(axes, shown)
    if path is not None:
        _draw_needle(axes, shown, path, path.depth if tip is None else tip)
    axes.set(xlabel="distance from the needle [mm]" if path is not None else "x [mm]", ylabel="depth [mm]")
    axes.set(xlim=(left, right), ylim=(bottom, top - (_ABOVE if path is not None else 0.0) * (bottom - top)))
    axes.grid(False)
    bar = axes.figure.colorbar(
        image, ax=axes, location="bottom", label=colours.label, extend=colours.extend, shrink=0.9, aspect=30
    )
    bar.solids.set_edgecolor("face")  # no seams in a vector format
    bar.minorticks_off()
    if colours.ticks is not None:
        bar.set_ticks(colours.ticks, labels=[f"{tick:g}".replace("-", "\N{MINUS SIGN}") for tick in colours.ticks])


@dataclass(frozen=True)
class Colours:
    """How a field is coloured: factor to the unit shown, map, norm, label, ticks, and whether an end is clipped."""

    factor: float
    map: str
    norm: Any
    label: str
    ticks: np.ndarray | None = None
    extend: str = "neither"


def colours_of(field: Field, quantity: str) -> Colours:
    """From the extremes of all cells in view; zero is the middle where both signs matter."""
    from matplotlib.colors import Normalize

    stressed = quantity in ("von_mises", "stress")
    size = max(abs(field.low), abs(field.high))
    factor, unit = scale(size, "Pa") if stressed else span_scale(-size, size, "m")
    low, high = factor * field.low, factor * field.high
    label = f"{NAMES[quantity]} [{unit}]"
    if size == 0.0:
        return Colours(factor, "viridis", Normalize(0.0, 1.0), f"{label}\nzero everywhere")
    if quantity == "von_mises":
        return _logarithmic(factor, low, high, label)
    if quantity == "stress":
        return _signed_stress(factor, factor * size, f"{label}\n{_number(low)} to {_number(high)}")
    label = f"{label}\n{_number(low)} to {_number(high)}"
    if min(-low, high) > _SIGNED * factor * size:
        return Colours(factor, "RdBu_r", Normalize(-factor * size, factor * size), label)
    return Colours(factor, "viridis", Normalize(low, high), label)


def _logarithmic(factor: float, low: float, high: float, label: str) -> Colours:
    from matplotlib.colors import LogNorm

    start = max(low, high / 10.0**_DECADES)
    start = min(start, 0.1 * high)
    extend = "min" if low < start else "neither"
    ticks = 10.0 ** np.arange(np.ceil(np.log10(start)), np.floor(np.log10(high)) + 1.0)
    label = f"{label}\n{_number(low)} to {_number(high)}"
    return Colours(factor, "viridis", LogNorm(start, high), label, ticks=ticks, extend=extend)


def _signed_stress(factor: float, size: float, label: str) -> Colours:
    from matplotlib.colors import SymLogNorm

    powers = 10.0 ** np.arange(np.ceil(np.log10(_LINEAR * size)), np.floor(np.log10(size)) + 1.0)
    ticks = np.concatenate([-powers[::-1], [0.0], powers])
    norm = SymLogNorm(_LINEAR * size, vmin=-size, vmax=size)
    return Colours(factor, "RdBu_r", norm, label, ticks)


def _number(value: float) -> str:
    return f"{value:.3g}".replace("-", "\N{MINUS SIGN}")


def _edges(shown: Section) -> tuple[float, float, float, float]:
    """Left, right, top and bottom of the grid [mm]."""
    half = 0.5 * (shown.across[1] - shown.across[0])
    ends = (shown.across[0] - half, shown.across[-1] + half, shown.depth[0] - half, shown.depth[-1] + half)
    return tuple(1e3 * float(end) for end in ends)  # type: ignore[return-value]


def _draw_needle(axes: "Axes", shown: Section, path: NeedlePath, tip: float) -> None:
    """Its shaft from above the surface to the tip, in its true width."""
    if not np.isfinite(tip):
        raise InputError("tip", f"{tip} m", "must be finite", next_step="Give how far it is along the path, in m.")
    from matplotlib.patches import Polygon

    sideways = float(np.linalg.norm(shown.along[:-1])) * (1.0 if len(shown.along) == 3 else np.sign(shown.along[0]))
    along = np.array([sideways, shown.along[-1]])
    normal = path.radius * np.array([along[1], -along[0]])
    out = -1.5 * _ABOVE * np.ptp(shown.depth) / max(along[1], 0.1) * along
    corners = 1e3 * np.array([out - normal, tip * along - normal, tip * along + normal, out + normal])
    axes.add_patch(Polygon(corners, closed=True, facecolor="#e4e6e8", edgecolor=_INK, linewidth=0.8, zorder=4))


def _draw_materials(axes: "Axes", shown: Section) -> None:
    """Limits and names of the materials, if there are several."""
    if len(np.unique(shown.label)) < 2:
        return
    numbers = shown.on_grid(np.repeat(shown.label[:, None].astype(float), 3, axis=1))
    for number in np.unique(shown.label):
        inside = np.abs(numbers - number) < 0.5
        if inside.any() and not inside.all():
            for colour, width in (("white", 2.2), (_INK, 0.8)):  # readable on light and dark
                style = {"levels": [0.5], "colors": colour, "linewidths": width, "zorder": 3}
                axes.contour(1e3 * shown.across, 1e3 * shown.depth, inside, **style)
    sizes = {number: np.mean(np.abs(numbers - number) < 0.5) for number in np.unique(shown.label)}
    named = sorted((number for number in sizes if sizes[number] > _MIN_NAMED), key=lambda each: -sizes[each])
    for number in named[:_MAX_NAMES]:
        _name(axes, shown, np.abs(numbers - number) < 0.5, shown.names[number])


def _name(axes: "Axes", shown: Section, inside: np.ndarray, name: str) -> None:
    """At the right end of a layer, in the middle of what does not reach the right end, right of the needle."""
    style = {"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 0.5}
    rows = np.flatnonzero(inside[:, -1])
    if len(rows):
        place, side = (1e3 * shown.across[-1], 1e3 * np.mean(shown.depth[rows])), "right"
        offset = -4.0
    else:
        rows, columns = np.nonzero(inside & (shown.across > 0.0))
        if not len(rows):
            rows, columns = np.nonzero(inside)
        place, side = (1e3 * np.mean(shown.across[columns]), 1e3 * np.mean(shown.depth[rows])), "center"
        offset = 0.0
    axes.annotate(
        name, place, (offset, 0.0), textcoords="offset points", ha=side, va="center", color=_INK, fontsize=8,
        bbox=style, zorder=5,
    )  # fmt: skip
