# SPDX-License-Identifier: Apache-2.0
"""What a needle must not touch: spheres, boxes, or any signed distance."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..checks import PLACE, above_zero, in_range
from ..errors import InputError

_METRES = "Give x, y, z and radius in m."
_CORNERS = ("low", "high")


@dataclass(frozen=True)
class Sphere:
    """A ball in the frame of the target.

    Parameters
    ----------
    center : (float, float, float)
        [m]
    radius : float
        [m], above 0.

    Raises
    ------
    InputError
        If a value is not finite or the radius is not above 0.
    """

    center: tuple[float, float, float]
    radius: float

    def __post_init__(self) -> None:
        in_range("center of a sphere", self.center, PLACE, _METRES, (3,))
        above_zero("radius of a sphere", self.radius, "m")
        in_range("radius of a sphere", self.radius, PLACE, _METRES, ())

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Signed distance of points (n, 3) from its surface, negative inside, (n,) [m]."""
        return np.linalg.norm(points - np.asarray(self.center), axis=-1) - self.radius


@dataclass(frozen=True)
class Box:
    """A box along the axes of the frame of the target.

    Parameters
    ----------
    low, high : (float, float, float)
        Opposite corners [m]; each of ``low`` is below that of ``high``.

    Raises
    ------
    InputError
        If a value is not finite or the corners are not ordered.
    """

    low: tuple[float, float, float]
    high: tuple[float, float, float]

    def __post_init__(self) -> None:
        low, high = (in_range(f"{end} corner of a box", getattr(self, end), PLACE, _METRES, (3,)) for end in _CORNERS)
        if not np.all(low < high):
            limit = "must be below the high corner along each axis"
            raise InputError("low corner of a box", str(tuple(self.low)), limit, next_step="Exchange the values.")

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Signed distance of points (n, 3) from its surface, negative inside, (n,) [m]."""
        outside = np.maximum(np.asarray(self.low) - points, points - np.asarray(self.high))
        beyond = np.linalg.norm(np.maximum(outside, 0.0), axis=-1)
        return beyond + np.minimum(outside.max(axis=-1), 0.0)


Obstacle = Sphere | Box | Callable[[np.ndarray], np.ndarray]
"""A sphere, a box, or a function of points (n, 3) [m] that returns their signed distance (n,) [m]."""


def distance_to(obstacles: Sequence[Obstacle], points: np.ndarray) -> np.ndarray:
    """Signed distance of points (n, 3) from the nearest obstacle, (n,) [m]; infinity if there is none. Raises
    InputError if a function returns another shape or a value that is not a number."""
    nearest = np.full(len(points), np.inf)
    for obstacle in obstacles:
        if isinstance(obstacle, Sphere | Box):
            nearest = np.minimum(nearest, obstacle.distance(points))
        else:
            nearest = np.minimum(nearest, _checked(obstacle(points), len(points)))
    return nearest


def _checked(found: np.ndarray, count: int) -> np.ndarray:
    values = np.asarray(found, dtype=float)
    if values.shape != (count,) or np.isnan(values).any():
        limit = f"must be {count} numbers for {count} points"
        raise InputError("signed distance", f"an array of shape {values.shape}", limit, next_step="Return (n,) [m].")
    return values
