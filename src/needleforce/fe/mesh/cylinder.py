# SPDX-License-Identifier: Apache-2.0
"""A mesh in space of a cylinder, such as a cup of gelatin: square core around the needle, rings out to a round side."""

from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Real

import numpy as np
from numpy.typing import ArrayLike

from ...checks import above_zero, within
from ...errors import InputError
from .block import Layers, axisymmetric_block, graded_lines
from .mesh import Mesh

_MAX_CELLS = 500_000
_MAX_OFF_CENTRE = 0.9  # of the radius: nearer to the side, rings would be flat between it and the needle
_MAX_CELL = 0.25  # of the distance from the needle's line to the side
_MIN_CELL = 1e-4  # of the radius
_MIN_AROUND = 16
_CORE = 0.6  # half-width of the core, in the radius of the first ring
_ROUNDING = 0.5  # of the core: 0 is a square, 1 a disc, whose corners are flat
_ALONG = 2.0  # length of a cell along the needle, in ``cell``: loads are spread over a spacing of the path there


def cylinder(
    radius: float,
    depth: float,
    cell: float,
    *,
    needle_depth: float = 0.0,
    growth: float = 0.4,
    layers: Layers = (),
    entry: Sequence[float] = (0.0, 0.0),
) -> Mesh:
    """A cylinder in space, whose surface has its centre at the origin, with cells that are fine along a needle.

    Parameters
    ----------
    radius, depth : float
        Of the cylinder [m].
    cell : float
        Size of the cells at the needle [m]: best its radius or half of it, because rings of nodes are at one and two
        times ``cell`` from its line. Cells there are half as wide, and twice as long down to ``needle_depth``.
    needle_depth : float
        Depth to which cells are fine along the needle's line [m].
    growth : float
        By how much a cell is larger per its distance from the needle, 0.05 to 2. It also sets the number of cells
        around, at least 16: the side is a polygon of that many flat faces.
    layers : sequence of (str, float)
        Labels and thicknesses from the surface [m]; the last extends to the bottom.
    entry : (float, float)
        x and y of the needle's line, which is parallel to the axis [m], at most 0.9 of the radius from it; the axis by
        default.

    Returns
    -------
    Mesh
        Of hexahedra, with the boundaries ``"top"``, ``"bottom"`` and ``"sides"``.

    Raises
    ------
    InputError
        If a length is not above 0, the cells are too large for the cylinder or more than 500 000, the needle's line is
        outside or near the side, or it or the layers are deeper than the cylinder.

    Notes
    -----
    Rings are circles whose centres move from the needle's line to the axis, so that they never touch. With m faces the
    volume is ``m sin(2 pi / m) / (2 pi)`` of the cylinder's: 2.6 % less for 16, 0.6 % for 32. A shaft that sticks on
    the axis of a cup is 4 % stiffer than in an axisymmetric mesh, 2 % with ``growth=0.25``, which has finer cells.
    """
    at = np.asarray(entry, dtype=float) if is_row(entry) else np.zeros(0)
    _check(radius, depth, cell, growth)
    _check_needle(radius, depth, needle_depth, at)
    _check_fit(radius, cell, at)
    section = _section(radius, cell, growth, at)
    _check_count(len(section.cells), needle_depth / (_ALONG * cell), cell)
    column = axisymmetric_block(cell, depth, _ALONG * cell, needle_depth=needle_depth, growth=growth, layers=layers)
    return _extruded(section, np.unique(column.points[:, 1]), column.labels)


@dataclass(frozen=True)
class _Section:
    """Points (n, 2) [m] and quadrilaterals (m, 4) of a cross-section; numbers of the points of its rim."""

    points: np.ndarray
    cells: np.ndarray
    rim: np.ndarray


def _section(radius: float, cell: float, growth: float, entry: np.ndarray) -> _Section:
    """A rounded square of n x n cells within the needle, and 4 n cells in each ring around it."""
    off = float(np.hypot(*entry))
    # cells in a ring, a multiple of 8, so that at the side they are no longer than wide
    around = max(_MIN_AROUND, 8 * int(np.ceil(2.0 * np.pi * radius / _width(radius, cell, growth) / 8.0 - 1e-9)))
    core, outline = _core(around // 4)
    widest = 1.0 + off / (radius - cell)  # of a ring, in its mean width
    stops = np.unique([cell, 2.0 * cell, radius])  # one is the needle's radius, in a finer mesh too
    radii = graded_lines(list(stops), lambda r: _width(r, cell, growth) / widest)[:, None, None]
    angles = 2.0 * np.pi * np.arange(around) / around - 0.75 * np.pi
    circle = np.column_stack([np.cos(angles), np.sin(angles)])
    rings = radii * circle + (radius - radii) / (radius - cell) * entry
    points = np.concatenate([_CORE * cell * core + entry, rings.reshape(-1, 2)])
    numbers = np.concatenate([outline[None], len(core) + np.arange(rings.size // 2).reshape(len(radii), around)])
    return _Section(points, np.concatenate([_square_cells(around // 4), _ring_cells(numbers)]), numbers[-1])


def _width(distance: ArrayLike, cell: float, growth: float) -> np.ndarray:
    """Of a ring at a distance from the needle's line [m]."""
    return 0.5 * cell + growth * (np.asarray(distance) - cell)


def _core(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Points of a rounded square of half-width 1, ((n + 1)^2, 2), and those of its outline, anticlockwise."""
    x, y = np.meshgrid(*[np.linspace(-1.0, 1.0, n + 1)] * 2, indexing="ij")
    square = np.stack([x, y], axis=-1)
    disc = np.stack([x * np.sqrt(1.0 - 0.5 * y**2), y * np.sqrt(1.0 - 0.5 * x**2)], axis=-1)
    points = (1.0 - _ROUNDING) * square + _ROUNDING * disc
    number = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    outline = np.concatenate([number[:-1, 0], number[-1, :-1], number[:0:-1, -1], number[0, :0:-1]])
    return points.reshape(-1, 2), outline


def _square_cells(n: int) -> np.ndarray:
    number = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    return np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], axis=-1).reshape(-1, 4)


def _ring_cells(numbers: np.ndarray) -> np.ndarray:
    """Of points (rings, around): each ring is closed."""
    following = np.roll(numbers, -1, axis=1)
    corners = [numbers[:-1], numbers[1:], following[1:], following[:-1]]
    return np.stack(corners, axis=-1).reshape(-1, 4)


def _extruded(section: _Section, depths: np.ndarray, labels: np.ndarray) -> Mesh:
    """The cross-section along the depths, with a label for each step."""
    count, steps = len(section.points), len(depths) - 1
    across = np.tile(section.points, (steps + 1, 1))
    points = np.column_stack([across, np.repeat(depths, count)])
    first = section.cells + count * np.arange(steps)[:, None, None]
    cells = np.concatenate([first, first + count], axis=2).reshape(-1, 8)
    level = count * np.arange(steps + 1)
    boundaries = {
        "top": np.arange(count),
        "bottom": level[-1] + np.arange(count),
        "sides": (level[:, None] + section.rim).ravel(),
    }
    return Mesh(points, cells, "hexahedron", np.repeat(labels, len(section.cells)), boundaries)


def is_row(values: object) -> bool:
    """True for a row of numbers."""
    return isinstance(values, (Sequence, np.ndarray)) and all(isinstance(each, Real) for each in values)


def _check(radius: float, depth: float, cell: float, growth: float) -> None:
    for quantity, value in (("radius of the cylinder", radius), ("depth of the cylinder", depth), ("cell", cell)):
        above_zero(quantity, value, "m")
    within("growth", growth, 0.05, 2.0, next_step="Use 0.4.")


def _check_needle(radius: float, depth: float, needle_depth: float, entry: np.ndarray) -> None:
    if not 0.0 <= needle_depth <= depth:
        limit = f"must be 0 to {1e3 * depth:g} mm, the depth of the cylinder"
        raise InputError("needle_depth", f"{1e3 * needle_depth:g} mm", limit, next_step="Give a deeper cylinder.")
    if entry.shape != (2,) or not np.all(np.isfinite(entry)):
        raise InputError(
            "entry", entry.tolist(), "must be two numbers, x and y", next_step="Give where the needle's line is [m]."
        )
    off = np.hypot(*entry)
    if off > _MAX_OFF_CENTRE * radius:
        limit = f"must be at most {1e3 * _MAX_OFF_CENTRE * radius:g} mm, {_MAX_OFF_CENTRE:g} of the radius"
        step = "Move the needle inwards, or use a larger cylinder."
        raise InputError("entry", f"{1e3 * off:g} mm from the axis", limit, next_step=step)


def _check_fit(radius: float, cell: float, entry: np.ndarray) -> None:
    gap = radius - np.hypot(*entry)
    if cell > _MAX_CELL * gap:
        limit = f"must be at most a quarter of the {1e3 * gap:g} mm from the needle's line to the side"
        raise InputError("cell", f"{1e3 * cell:g} mm", limit, next_step="Give the radius of the needle.")
    if cell < _MIN_CELL * radius:
        limit = f"must be at least {1e3 * _MIN_CELL * radius:g} mm, {_MIN_CELL:g} of the radius of the cylinder"
        raise InputError("cell", f"{1e3 * cell:g} mm", limit, next_step="Give the radius of the needle, in m.")


def _check_count(across: int, steps: float, cell: float) -> None:
    """Before anything large is made; cells below the needle are few."""
    if across * steps > _MAX_CELLS:
        step = f"Use a cell of {1e3 * cell * across * steps / _MAX_CELLS:.2g} mm or more, or axisymmetric_block."
        limit = f"must have at most {_MAX_CELLS}"
        raise InputError("mesh", f"of about {across * steps:.0f} hexahedra", limit, next_step=step)
