# SPDX-License-Identifier: Apache-2.0
"""The shape of a needle from its base and tip alone, and tissue and tip force from shapes."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .. import core
from ..checks import one_of
from ..errors import InputError
from ..models.flexible_insertion import FlexibleInsertion
from .needle_shapes import NeedleShape
from .path_errors import OFFSET_SPREAD, POSITION_NOISE, TILT_SPREAD, UNEVENNESS, integrated_wiener
from .path_simulation import bevel_length_of
from .result import SteeringResult
from .steering_model import identified_model
from .steering_parameters import ALIGNED, SHAPE_MODELS, Progress, search, within_reach

_POINTS = 20  # of a shape that are compared
_ELEMENTS = 40


class ShapeFit(SteeringResult):
    """A needle identified from shapes, which alone give forces and stiffnesses over its bending stiffness; ``rms`` is
    the distance across of each shape from that of its base and tip [m]."""

    measured = "shapes"

    def by_insertion(self) -> dict[str, dict[str, Any]]:
        """Shape -> distance from that of its base and tip [m]."""
        return {name: {"rms_m": value} for name, value in self.rms.items()}

    def predict(self, shape: NeedleShape) -> np.ndarray:
        """The shape that follows from base and tip of a measured one, at its points, (n, 3) [m]."""
        base, slope = _base(shape)
        tip = shape.tip - np.append(base, 0.0)
        points = needle_shape(self.model.needle, self.model.values["modulus"], tip, slope=(slope[0], slope[1]))
        along = shape.points[:, 2]
        across = np.column_stack([np.interp(along, points[:, 2], column) for column in points[:, :2].T])
        return np.column_stack([across + base, along])


def needle_shape(
    needle: core.Needle,
    modulus: float,
    tip: ArrayLike,
    *,
    slope: tuple[float, float] = (0.0, 0.0),
    guide_distance: float = 0.0,
) -> np.ndarray:
    """The shape of a needle that was pushed in with a fixed bevel, from its base and its tip.

    Parameters
    ----------
    needle : Needle
        Its bending stiffness over the modulus decides how the curvature begins and ends.
    modulus : float
        Foundation modulus of the tissue [Pa].
    tip : array_like, shape (3,)
        From the place of the base at the surface: across, and along the insertion [m].
    slope : (float, float)
        Of the base [1].
    guide_distance : float
        From the guide to the surface [m].

    Returns
    -------
    ndarray, shape (n, 3)
        From the surface to the tip [m].

    Raises
    ------
    InputError
        If the tip is not in the tissue, or a value is outside its range.
    """
    end = np.asarray(tip, dtype=float)
    if end.shape != (3,) or not (np.all(np.isfinite(end)) and end[2] > 0.0):
        raise InputError("tip", repr(tip), "must be three numbers with z above 0", next_step="Give x, y, z in m.")
    reach = needle.length - guide_distance
    if not 1e-4 <= end[2] <= 0.99 * reach:
        limit = f"must be from 0.1 mm to what the needle reaches, {1e3 * reach:g} mm, less 1 %"
        step = "Give a longer needle, or a guide nearer to the surface."
        raise InputError("depth of the tip", f"{1e3 * end[2]:g} mm", limit, next_step=step)
    force, depth = 0.0 + 0.0j, float(end[2])
    points = _pushed(needle, modulus, force, depth, guide_distance=guide_distance, slope=slope)
    per_force = _pushed(needle, modulus, 1e-2, depth, guide_distance=guide_distance)[-1, 0] / 1e-2
    for _ in range(4):  # linear but for the arc: what is missing across is force, along is travel
        missing = end - points[-1]
        force += complex(missing[0], missing[1]) / per_force
        depth += float(missing[2])
        points = _pushed(needle, modulus, force, depth, guide_distance=guide_distance, slope=slope)
    return points


def _pushed(
    needle: core.Needle,
    modulus: float,
    force: complex,
    depth: float,
    *,
    guide_distance: float,
    slope: tuple[float, float] = (0.0, 0.0),
) -> np.ndarray:
    layer = core.LateralLayer(modulus=modulus, tip_force=abs(force))
    flex = FlexibleInsertion(
        None, needle, lateral=[layer], guide_distance=guide_distance, elements=_ELEMENTS, path_spacing=5e-4,
        bevel_length=bevel_length_of(needle), max_speed=math.inf, max_travel=0.3,
    )  # fmt: skip
    tilt, roll = tuple(float(each) for each in slope), float(np.angle(force))
    place = tuple(-guide_distance * each for each in tilt)
    flex.run(np.array([0.0, depth]), np.array(place), roll=roll, tilt=np.array(tilt))
    points = flex.shape()
    entry = [np.interp(0.0, points[:, 2], column) for column in points[:, :2].T]
    return np.vstack([[*entry, 0.0], points[points[:, 2] > 1e-9]])


def _base(shape: NeedleShape) -> tuple[np.ndarray, np.ndarray]:
    """Place (2,) [m] and slope (2,) at the first point, of a parabola that fits the first half of the points."""
    first = shape.points[: max(4, len(shape) // 2)]
    found = np.polynomial.polynomial.polyfit(first[:, 2] - first[0, 2], first[:, :2], 2)
    return found[0], found[1]


def identify_shapes(
    shapes: Sequence[NeedleShape], needle: core.Needle, *, model: str = "linear", progress: Progress | None = None
) -> ShapeFit:
    """Identify tissue and tip force from shapes: ``nf.steering.identify`` for ``NeedleShape``.

    Each shape has a pose of its own and a direction of its own in which it bends, as the roll of a needle is seldom
    known; the size of the tip's force and the tissue are common. Raises InputError if the model is unknown or there is
    no shape.
    """
    one_of("model", model, SHAPE_MODELS)
    if not shapes:
        raise InputError("shapes", 0, "needed", next_step="Give nf.steering.read_shapes(file).")
    places = [np.linspace(each.points[0, 2], each.points[-1, 2], _POINTS) for each in shapes]
    factors = [np.linalg.cholesky(_covariance(along)) for along in places]
    planes = [_in_plane(each, along) for each, along in zip(shapes, places)]

    def misfit(values: dict[str, float]) -> np.ndarray:
        parts = []
        for each, along, factor, measured in zip(shapes, places, factors, planes):
            travel, guide = each.depth - values["surface"], values["guide_distance"]
            simulated = _pushed(needle, values["modulus"], values["tip_force"], travel, guide_distance=guide)
            residuals = measured - np.interp(along, simulated[:, 2], simulated[:, 0])
            parts.append(np.linalg.solve(factor, residuals))
        return np.concatenate(parts)

    parameters = within_reach(SHAPE_MODELS[model], needle.length, shapes)
    found = search(parameters, misfit, progress)
    values = found.values | ALIGNED
    fitted = identified_model(model, needle, values, parameters=parameters, covariance=found.spread.covariance)
    fit = ShapeFit(fitted, found.estimates, found.trade_offs, {})
    off = {each.name: fit.predict(each)[:, :2] - each.points[:, :2] for each in shapes}
    rms = {name: float(np.sqrt(np.mean(np.sum(apart**2, axis=1)))) for name, apart in off.items()}
    return replace(fit, rms=rms)


def _in_plane(shape: NeedleShape, along: np.ndarray) -> np.ndarray:
    """Position in the plane in which the shape bends, at places along it."""
    points = shape.at(along) - shape.points[0, :2]
    chord = points[0] + np.outer((along - along[0]) / (along[-1] - along[0]), points[-1] - points[0])
    bend = (points - chord)[1:-1]
    direction = np.linalg.svd(bend, full_matrices=False)[2][0]
    towards = -np.sign(np.sum(bend @ direction))  # a shape that curves away from its chord
    return points @ (direction * (towards or 1.0))


def _covariance(along: np.ndarray) -> np.ndarray:
    """Pose, uneven tissue and noise of one shape."""
    s, t = np.meshgrid(along - along[0], along - along[0], indexing="ij")
    pose = OFFSET_SPREAD**2 + TILT_SPREAD**2 * s * t
    return pose + UNEVENNESS * integrated_wiener(s, t) + POSITION_NOISE**2 * np.eye(len(along))
