# SPDX-License-Identifier: Apache-2.0
"""The loading curve alone: stiffness and contact depth from what was recorded up to the puncture."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...errors import InputError
from ..statistics.noise import Noise, noise_of
from ..statistics.regression import Search, criterion, inverse
from .loading_curves import CURVES, LoadingCurve

LEAST_SAMPLES = 20
SIGN = "Force is positive against insertion: flip its sign if it is not."


@dataclass(frozen=True, eq=False)
class DeformationFit:
    """The numbers of one loading curve with ``contact_depth`` [m], SI: ``values``, and the covariance of those sought.

    ``order`` names the rows of ``covariance``; as many numbers are counted, also where one is ``held`` at the edge of
    what is allowed, which the sentences say.
    """

    law: str
    values: dict[str, float]
    order: tuple[str, ...]
    covariance: np.ndarray
    noise: Noise
    """Of the residual: ``sse`` [N^2] over ``count`` samples, and how far neighbours are alike."""
    peak: float
    """Largest force [N] of the samples."""
    held: tuple[str, ...]

    @property
    def curve(self) -> LoadingCurve:
        """The curve of the law."""
        return CURVES[self.law]

    @property
    def bic(self) -> float:
        """Schwarz's criterion, each sample counting as one."""
        return criterion(self.noise, len(self.order), self.noise.count)

    @property
    def nrmse(self) -> float:
        """Residual rms over the largest force."""
        return (self.noise.sse / self.noise.count) ** 0.5 / self.peak


def fit_deformation(
    depth: np.ndarray,
    force: np.ndarray,
    contact: float,
    law: str,
    known: Mapping[str, float | None] = {},
    filter_length: int = 1,
) -> DeformationFit:
    """Least squares of a loading curve F(z - z0) to the samples (n,) of free travel and loading, in the order of time.

    ``contact`` [m] is where to start. z0 and the shape numbers that are not ``known`` are sought from several starts,
    the amplitudes, none below 0, are projected out. Raises InputError with too few samples, or where no curve rises.
    """
    if len(depth) < LEAST_SAMPLES or not depth.max() > contact:
        raise InputError("samples before the puncture", len(depth), f"fewer than {LEAST_SAMPLES}, or none in contact")
    curve = CURVES[law]
    given = tuple(known[name] for name in curve.shape if known.get(name) is not None)
    sought = Search(curve, depth, force, contact, given if given or not curve.shape else None)
    best = sought.best()
    values = sought.values(best)
    if not any(values[name] for name in curve.amplitudes):
        raise InputError("force before the puncture", "does not rise with depth", "no loading curve", next_step=SIGN)
    order = (*curve.amplitudes, "contact_depth", *(() if given else curve.shape))
    h = depth - values["contact_depth"]
    gradient = curve.gradient(h, values)
    noise = noise_of(force - curve.force(h, values), len(force), filter_length, len(order))
    told = [values[name] > 0.0 or name not in curve.amplitudes for name in order]
    covariance = noise.long_run * _inverse(np.array([gradient[name] for name in order]), np.array(told))
    held = tuple(_held(name, values[name], curve) for name in sought.held(best))
    return DeformationFit(law, values, order, covariance, noise, float(np.abs(force).max()), held)


def _held(name: str, value: float, curve: LoadingCurve) -> str:
    unit = f" {curve.units.get(name, 'm')}".removesuffix(" 1")
    return (
        f"The number {name} of the law {curve.law.name} is held at {value:.4g}{unit}, the edge of what is "
        "allowed: the data would take it further."
    )


def _inverse(jacobian: np.ndarray, told: np.ndarray) -> np.ndarray:
    """Inverse of J'J for a jacobian (p, n); infinite variance for a number held at 0 or that the samples do not feel.

    Without its linear part a polynomial feels a shift of its contact and a linear part alike.
    """
    felt = np.flatnonzero(told & (np.einsum("pn,pn->p", jacobian, jacobian) > 0.0))
    found = np.diag(np.full(len(jacobian), np.inf))
    found[np.ix_(felt, felt)] = inverse(jacobian[felt] @ jacobian[felt].T)
    return found
