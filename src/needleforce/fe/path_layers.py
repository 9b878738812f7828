# SPDX-License-Identifier: Apache-2.0
"""Layers along a needle's path: the labels of the cells it passes, and where each begins."""

from itertools import pairwise

import numpy as np

from ..errors import InputError
from .needle_path import Body, NeedlePath

_PER_SPACING = 50  # points of the path that are looked at, between two nodes
_ASIDE = 0.1  # of the needle's radius: not on the faces between cells on both sides


def check_thickness(tissue: Body, path: NeedlePath) -> None:
    """Raise InputError for a layer on the path that is thinner than the needle, around which loads are spread."""
    if len(np.unique(tissue.mesh.labels.astype(str))) == 1:
        return
    layers = layers_along(tissue, path)
    for (label, top), (_, end) in pairwise(layers):
        if end - top < 2.0 * path.radius:
            limit = f"{1e3 * (end - top):.3g} mm thick, is thinner than the needle, {2e3 * path.radius:.3g} mm"
            step = "Give it the label of its neighbour, or use a thinner needle."
            raise InputError(f"layer {label!r}", f"at {1e3 * top:.3g} mm", limit, next_step=step)


def layers_along(tissue: Body, path: NeedlePath) -> list[tuple[str, float]]:
    """Labels along the path and the distances at which they begin [m], the first at 0."""
    count = _PER_SPACING * (len(path.nodes) - 1)
    at = (np.arange(count) + 0.5) * path.depth / count
    names = labels_along(tissue, path, at)
    changes = np.flatnonzero(names[1:] != names[:-1])
    return [(str(names[0]), 0.0), *((str(names[k + 1]), float(0.5 * (at[k] + at[k + 1]))) for k in changes)]


def labels_along(tissue: Body, path: NeedlePath, distances: np.ndarray) -> np.ndarray:
    """Labels of the cells at distances along the path (n,) [m], (n,) of str.

    Raises
    ------
    InputError
        If the path leaves the mesh.
    """
    dimension = tissue.mesh.dimension
    points = path.start(dimension) + distances[:, None] * path.along(dimension)
    points[:, 0] += _ASIDE * path.radius
    try:
        cells = tissue.mesh.skfem.element_finder(mapping=tissue.elements.mapping)(*points.T)
    except ValueError:
        tissue.values_at(points)  # names the point
        raise
    return tissue.mesh.labels[cells].astype(str)
