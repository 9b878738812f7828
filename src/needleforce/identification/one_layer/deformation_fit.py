# SPDX-License-Identifier: Apache-2.0
"""Fit of the loading curve: stiffness and contact depth from the samples up to the puncture."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from ... import core
from ...errors import InputError
from ...models.parameter_units import UNITS
from ..statistics.noise import DriftEffect, Noise, noise_of
from ..statistics.regression import criterion, inverse
from .loading_curves import FITS, LoadingCurve

MIN_LOADING_SAMPLES = 20
CONTACT_STARTS = np.linspace(-0.95, 0.85, 19)  # [indentations] from the contact given
CONTACT_RANGE = (-1.0, 0.9)  # [indentations] from the contact given
EDGE_SHARE = 1e-3  # [of the range of a parameter] nearer to its limit, a parameter is held there
FLIP_SIGN = "Force is positive against insertion: flip its sign if it is not."


@dataclass(frozen=True, eq=False, kw_only=True)
class DeformationFit:
    """Parameters of one loading curve with ``contact_depth`` [m] and the sensor's zero ``force_offset`` [N], SI:
    ``values``, and covariance of the fitted ones.

    ``order`` names the rows of ``covariance``; so many parameters are counted, also if some are at a limit of their
    range. ``held`` has a sentence for each of these.
    """

    law: str
    values: dict[str, float]
    order: tuple[str, ...]
    covariance: np.ndarray
    noise: Noise
    """Of the residual: ``sse`` [N^2] over ``count`` samples, and its autocorrelation."""
    peak: float
    """Largest force [N] of the samples."""
    held: tuple[str, ...]
    by_drift: np.ndarray
    """Change of the fitted parameters (p,) by one standard error of the zero's drift; ``covariance`` contains it."""

    @property
    def curve(self) -> LoadingCurve:
        """The curve of the law."""
        return FITS[self.law]

    @property
    def bic(self) -> float:
        """Schwarz's criterion, each sample counted as independent."""
        return criterion(self.noise.mean_square, len(self.order), self.noise.count)

    @property
    def nrmse(self) -> float:
        """Residual rms over the largest force."""
        return self.noise.mean_square**0.5 / self.peak


def fit_deformation(
    depth: np.ndarray,
    force: np.ndarray,
    contact: float,
    law: str,
    known: Mapping[str, float | None] = {},
    filter_length: int = 1,
    drift: DriftEffect | None = None,
) -> DeformationFit:
    """Least squares of a loading curve F(z - z0) + b to the samples (n,) of free travel and loading, in order of time.

    ``contact`` [m] is where to start. z0 and the shape parameters that are not ``known`` are fitted from several
    starts; the amplitudes, none below 0, are projected out. Raises InputError for too few samples, and for a force that
    does not rise.
    """
    if len(depth) < MIN_LOADING_SAMPLES or not depth.max() > contact:
        limit = f"at least {MIN_LOADING_SAMPLES} are needed, some of them in contact"
        step = "Record at a higher rate, or begin above the surface."
        raise InputError("number of samples before the puncture", len(depth), limit, next_step=step)
    curve = FITS[law]
    given = tuple(known[name] for name in curve.shape if known.get(name) is not None)
    indentation = float(depth.max()) - contact
    values, squares = fitted_curve(curve, depth, force, contact=contact, indentation=indentation, given=given)
    if not np.isfinite(squares):
        limit = "no loading curve can be fitted"
        raise InputError("depth or force before the puncture", "not finite", limit, next_step="Remove such samples.")
    if not any(values[name] for name in curve.amplitudes):
        limit = "no loading curve can be fitted"
        raise InputError("force before the puncture", "not rising with depth", limit, next_step=FLIP_SIGN)
    order = (*curve.amplitudes, "contact_depth", *(() if given else curve.shape), "force_offset")
    h = depth - values["contact_depth"]
    inside = np.flatnonzero(h > 0.0)  # elsewhere only the zero acts
    gradient = curve.gradient(h[inside], values) | {"force_offset": np.ones(len(inside))}
    residual = force - values["force_offset"]
    residual[inside] -= sum(values[name] * gradient[name] for name in curve.amplitudes)
    noise = noise_of(residual, len(force), filter_length, len(order))
    above_zero = np.array([values[name] > 0.0 or name not in curve.amplitudes for name in order])
    jacobian = np.array([gradient[name] for name in order])
    bread = _inverse(jacobian, len(force), above_zero)
    by_drift = np.zeros(len(order))
    if drift is not None:
        known, complete = np.isfinite(bread.diagonal()), np.zeros((len(order), len(force)))
        complete[:, inside], complete[-1] = jacobian, 1.0
        by_drift[known] = drift.change(bread[np.ix_(known, known)], complete[known])
    held = _at_limit(curve, values, contact, indentation, () if given else curve.shape)
    return DeformationFit(
        law=law,
        values=values,
        order=order,
        covariance=noise.long_run * bread + np.outer(by_drift, by_drift),
        by_drift=by_drift,
        noise=noise,
        peak=float(max(force.max() - values["force_offset"], values["force_offset"] - force.min())),
        held=tuple(_held(name, values[name], curve) for name in held),
    )


def fitted_curve(
    curve: LoadingCurve,
    depth: np.ndarray,
    force: np.ndarray,
    *,
    contact: float,
    indentation: float,
    given: tuple[float, ...] = (),
    contacts: tuple[np.ndarray, tuple[float, float]] = (CONTACT_STARTS, CONTACT_RANGE),
) -> tuple[dict[str, float], float]:
    """The curve's parameters, ``contact_depth`` and ``force_offset`` of least squares, SI, and the sum of squares,
    infinite where none is finite; the compiled fit works in units of the indentation, from where the search of
    ``contacts`` starts and ends too."""
    starts, low, high = (0.0,), 0.0, 0.0
    for value, each in zip(given, curve.shape.values()):
        starts = (value / indentation**each.power,)
    for each in () if given else curve.shape.values():
        starts, low, high = each.starts, each.low, each.high
    amplitudes, place, shape, zero, sse = core.fit_loading(
        np.ascontiguousarray(depth, float),
        np.ascontiguousarray(force, float),
        law=curve.law.name,
        contact=contact,
        indentation=indentation,
        places=contacts[0],
        shapes=np.array(starts),
        place_range=contacts[1],
        shape_range=(low, high),
    )
    names = (*curve.amplitudes, *curve.shape)
    fitted = (*amplitudes[: len(curve.amplitudes)], *(given or (shape,)))
    return dict(zip(names, fitted)) | {"contact_depth": place, "force_offset": zero}, float(sse)


def _at_limit(
    curve: LoadingCurve, values: Mapping[str, float], contact: float, indentation: float, fitted: Iterable[str]
) -> list[str]:
    """Names of the parameters that are at a limit of their range."""
    place = (values["contact_depth"] - contact) / indentation
    found = {"contact_depth": (place, *CONTACT_RANGE)}
    for name in fitted:
        each = curve.shape[name]
        found[name] = (values[name] / indentation**each.power, each.low, each.high)
    edge = [name for name, (x, low, high) in found.items() if min(x - low, high - x) <= EDGE_SHARE * (high - low)]
    return [name for name in curve.amplitudes if values[name] == 0.0] + edge


def _held(name: str, value: float, curve: LoadingCurve) -> str:
    unit = f" {UNITS[name]}".removesuffix(" 1")
    return (
        f"The parameter {name} of the law {curve.law.name} is held at {value:.4g}{unit}, the limit of its range: the "
        "best fit is beyond it."
    )


def _inverse(jacobian: np.ndarray, count: int, above_zero: np.ndarray) -> np.ndarray:
    """Inverse of J'J for a jacobian (p, n) of the samples in contact, the last of its rows that of the zero, which
    ``count`` samples show; infinite variance for a parameter held at 0 or without effect on the force.

    In a polynomial without linear part, a shift of the contact and a linear part have the same effect.
    """
    gram = core.gram(jacobian)
    gram[-1, -1] = count
    known = np.flatnonzero(above_zero & (gram.diagonal() > 0.0))
    if len(known) == len(gram):
        return inverse(gram)
    found = np.diag(np.full(len(jacobian), np.inf))
    found[np.ix_(known, known)] = inverse(gram[np.ix_(known, known)])
    return found
