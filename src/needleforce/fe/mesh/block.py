# SPDX-License-Identifier: Apache-2.0
"""Meshes of blocks and cylinders, fine along the needle and coarser away from it, with layers."""

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from ...checks import within
from ...errors import InputError
from .mesh import Mesh

Layers = Sequence[tuple[str, float]]


def block(
    size: Sequence[float], cell: float, *, needle_depth: float = 0.0, growth: float = 0.25, layers: Layers = ()
) -> Mesh:
    """A block whose surface has its centre at the origin: in the plane, or in space.

    Parameters
    ----------
    size : (float, float) or (float, float, float)
        Width and depth, or width along x, along y, and depth [m].
    cell : float
        Size of the cells along the needle [m]; about its diameter for forces, its radius for stresses.
    needle_depth : float
        Depth to which cells are fine along the axis of depth [m].
    growth : float
        By how much a cell is larger per its distance from the needle.
    layers : sequence of (str, float)
        Labels and thicknesses from the surface [m]; the last extends to the bottom.

    Returns
    -------
    Mesh
        Of quadrilaterals or hexahedra.

    Raises
    ------
    InputError
        If a length is not above 0, or the layers are thicker than the block.
    """
    sizes = _lengths(size, (2, 3))
    across = [_across(-0.5 * width, 0.5 * width, cell, growth) for width in sizes[:-1]]
    return grid([*across, _downwards(sizes[-1], cell, needle_depth, growth, layers)], layers)


def axisymmetric_block(
    radius: float, depth: float, cell: float, *, needle_depth: float = 0.0, growth: float = 0.25, layers: Layers = ()
) -> Mesh:
    """A cylinder whose axis is the needle's, as a mesh of (r, z); parameters as of ``block``."""
    radius, depth = _lengths((radius, depth), (2,))
    return grid(
        [_across(0.0, radius, cell, growth), _downwards(depth, cell, needle_depth, growth, layers)],
        layers,
    )


def grid(lines: Sequence[np.ndarray], layers: Layers = ()) -> Mesh:
    """Quadrilaterals or hexahedra between lines of coordinates, each increasing [m]; the last are depths."""
    for each in lines:
        if np.ndim(each) != 1 or len(each) < 2 or not np.all(np.diff(each) > 0.0) or not np.all(np.isfinite(each)):
            raise InputError("lines of a grid", "not increasing", "each needs two coordinates or more [m]")
    counts = [len(each) for each in lines]
    points = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, len(lines))
    numbers = np.arange(len(points)).reshape(counts)
    if len(lines) == 2:
        corners = [(0, 0), (1, 0), (1, 1), (0, 1)]
    else:
        corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    cells = np.stack([_shifted(numbers, corner).ravel() for corner in corners], axis=1)
    labels = _labels_of(points[cells].mean(axis=1)[:, -1], layers)
    return Mesh(points, cells, "quad" if len(lines) == 2 else "hexahedron", labels)


def graded_lines(stops: Sequence[float], size_at: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Coordinates through all stops, as far apart as ``size_at`` of a coordinate, or a little less [m]."""
    lines = [np.array([stops[0]])]
    for low, high in pairwise(stops):
        fine = np.linspace(low, high, 2001)
        count = np.concatenate([[0.0], np.cumsum(np.diff(fine) / size_at(0.5 * (fine[1:] + fine[:-1])))])
        steps = max(int(np.ceil(count[-1] - 1e-9)), 1)
        lines.append(np.interp(np.linspace(0.0, count[-1], steps + 1)[1:], count, fine))
    return np.concatenate(lines)


def _across(low: float, high: float, cell: float, growth: float) -> np.ndarray:
    _lengths((cell,), (1,))
    within("growth", growth, 0.0, 10.0, next_step="Use 0.25.")
    stops = [low, 0.0, high] if low < 0.0 else [0.0, high]
    return graded_lines(stops, lambda x: cell + growth * np.maximum(np.abs(x) - cell, 0.0))


def _downwards(depth: float, cell: float, needle_depth: float, growth: float, layers: Layers) -> np.ndarray:
    _check_layers(layers)
    if not 0.0 <= needle_depth <= depth:
        raise InputError("needle_depth", f"{1e3 * needle_depth:g} mm", f"must be 0 to {1e3 * depth:g} mm")
    ends = np.cumsum([0.0, *_lengths([thickness for _, thickness in layers[:-1]], range(len(layers) + 1))])
    if ends[-1] >= depth:
        step = "Give a deeper block, or thinner layers."
        raise InputError(
            "layers", f"{1e3 * ends[-1]:g} mm thick", f"the block is {1e3 * depth:g} mm deep", next_step=step
        )
    stops = np.unique(np.concatenate([ends, [needle_depth, depth]]))
    return graded_lines(list(stops), lambda z: cell + growth * np.maximum(z - needle_depth - cell, 0.0))


def _check_layers(layers: Layers) -> None:
    for each in layers:
        if isinstance(each, str) or not isinstance(each, Sequence) or len(each) != 2 or not isinstance(each[0], str):
            step = 'Give layers=[("skin", 2e-3), ("fat", 1.0)].'
            raise InputError("layers", repr(each)[:60], "must be pairs of label and thickness", next_step=step)


def _lengths(values: Sequence[float], counts: Sequence[int]) -> np.ndarray:
    try:
        array = np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        array = np.array(np.nan)
    if array.ndim != 1 or len(array) not in counts or not np.all(np.isfinite(array)) or not np.all(array > 0.0):
        raise InputError("length", repr(values)[:60], f"must be {' or '.join(map(str, counts))} numbers above 0 [m]")
    return array


def _shifted(numbers: np.ndarray, corner: tuple[int, ...]) -> np.ndarray:
    return numbers[tuple(slice(1, None) if shift else slice(None, -1) for shift in corner)]


def _labels_of(depths: np.ndarray, layers: Layers) -> np.ndarray | None:
    if not layers:
        return None
    ends = np.cumsum([thickness for _, thickness in layers[:-1]])
    names = np.array([name for name, _ in layers], dtype=object)
    return names[np.searchsorted(ends, depths, side="right")]
