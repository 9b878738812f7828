# SPDX-License-Identifier: Apache-2.0
"""The loading curve alone: stiffness and contact depth from what was recorded up to the puncture."""

import math
from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from .covariance import noise_of
from .loading_curve import gradient, shape
from .regression import inverse

STARTS = (0.2, 0.5, 0.9)  # saturation depths to start from, as shares of the indentation
LEAST_SAMPLES = 20
LEAST_SHARE = 0.002  # of the indentation: the least saturation depth sought


@dataclass(frozen=True, eq=False)
class DeformationFit:
    """c [N/m^2], contact depth [m] and, for a cone on a shank, saturation depth [m] (else inf), with their covariance.

    ``order`` names the rows of ``covariance``;"""

    stiffness_coefficient: float
    contact_depth: float
    saturation_depth: float
    order: tuple[str, ...]
    covariance: np.ndarray
    bic: float


def fit_deformation(
    depth: np.ndarray, force: np.ndarray, contact: float, law: str, saturation: float | None, filter_length: int = 1
) -> DeformationFit:
    """Least squares of F = c g(z - z0) to the samples (n,) of free travel and loading, in the order of time.

    ``contact`` [m] is where to start. c is linear and projected out (Golub & Pereyra 1973); z0, and the saturation
    depth of a ``cone_cylinder`` unless given, are sought from several starts. Raises InputError with too few samples.
    """
    if len(depth) < LEAST_SAMPLES or not depth.max() > contact:
        raise InputError("samples before the puncture", len(depth), f"fewer than {LEAST_SAMPLES}, or none in contact")
    free = law == "cone_cylinder" and saturation is None
    fixed = math.inf if law == "cone" else saturation
    found = min(
        (_from(depth, force, contact, share, fixed, free) for share in (STARTS if free else STARTS[:1])),
        key=lambda result: result.cost,
    )
    return _told(depth, force, found.x, fixed, free, filter_length)


def _from(depth, force, contact, share, fixed, free):
    """One local search; lengths in units of the indentation, so that the unknowns are of order one."""
    from scipy.optimize import OptimizeResult, least_squares

    span = float(depth.max() - contact)
    scale = float(np.abs(force).max()) or 1.0

    def residual(x):
        basis = shape(depth - contact - span * x[0], span * x[1] if free else fixed)
        return (force - basis * (basis @ force) / max(float(basis @ basis), 1e-300)) / scale

    start, low, high = ([0.0, share], [-1.0, LEAST_SHARE], [0.9, 3.0]) if free else ([0.0], [-1.0], [0.9])
    result = least_squares(residual, start, bounds=(low, high), x_scale=0.1)
    x = contact + span * result.x[0], (span * result.x[1] if free else fixed)
    return OptimizeResult(x=x, cost=result.cost)


def _told(depth, force, x, fixed, free, filter_length) -> DeformationFit:
    contact, saturation = x
    h = depth - contact
    basis = shape(h, saturation)
    c = float(basis @ force) / float(basis @ basis)
    residual = force - c * basis
    jacobian = np.column_stack(gradient(h, c, saturation)[: 3 if free else 2])
    order = ("stiffness_coefficient", "contact_depth", "saturation_depth")[: jacobian.shape[1]]
    gram = jacobian.T @ jacobian
    noise = noise_of(residual, len(residual), filter_length, len(order))
    covariance = noise.long_run * inverse(gram)
    n, variance = len(force), max(float(residual @ residual) / len(force), 1e-300)
    bic = n * math.log(variance) + len(order) * math.log(n)
    return DeformationFit(c, contact, saturation, order, covariance, bic)
