# SPDX-License-Identifier: Apache-2.0
"""LuGre friction identified along a recording of friction, sample by sample."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from .estimates import Estimate
from .lugre_filter import LuGreFilter
from .statistics.noise import TWO_SIDED

SOURCE = "sequential extended Kalman filters, a reconstruction after Asadian, Kermani & Patel 2012"
MAX_VARIANCE_RATIO = 0.5  # of the variance at the start; below, the recording informs at least as much as the start


@dataclass(frozen=True, eq=False, kw_only=True)
class FilteredLuGre:
    """LuGre friction over time, from ``filter_lugre``.

    Standard deviations and covariance are from a second run with the parameters held at the result.

    Attributes
    ----------
    law : needleforce.laws.Lugre
        The friction law at the end.
    parameters : dict of str to Estimate
        The estimates at the end with their intervals. One is identifiable if its variance is reduced mainly by
        identified combinations.
    identifiable : int
        How many combinations of the six logarithms the recording identifies, 0 to 6.
    values : numpy.ndarray
        Parameters (n, 6) over time in the order of ``parameters``, SI.
    relative_sd : numpy.ndarray
        Standard deviations (n, 6) [1] of their logarithms.
    deflection : numpy.ndarray
        Deflection of the bristles (n,) [m].
    covariance : numpy.ndarray
        Last covariance (7, 7) of sigma_0 zeta and the logarithms of sigma_0, sigma_1, sigma_2, F_c, F_s - F_c, v_s.
    innovation, variance : numpy.ndarray
        Innovation (n,) [N/m] and its variance (n,) [N²/m²]; NaN at skipped samples.
    skipped : int
        Number of skipped samples.
    """

    law: Any
    parameters: dict[str, Estimate]
    identifiable: int
    values: np.ndarray
    relative_sd: np.ndarray
    deflection: np.ndarray
    covariance: np.ndarray
    innovation: np.ndarray
    variance: np.ndarray
    skipped: int


def filter_lugre(
    time: ArrayLike,
    velocity: ArrayLike,
    force: ArrayLike,
    embedded: ArrayLike,
    start: Any,
    force_noise: float,
    **options: Any,
) -> FilteredLuGre:
    """Identify LuGre friction along a recording with a ``LuGreFilter``.

    Parameters
    ----------
    time : array_like
        Time (n,) [s], not decreasing.
    velocity : array_like
        Velocity (n,) [m/s] over the step to each sample.
    force : array_like
        Friction force (n,) [N].
    embedded : array_like
        Embedded length (n,) [m]. Samples without embedded length, or not finite, are skipped and counted.
    start : needleforce.laws.Lugre
        Friction law to start from.
    force_noise : float
        Standard deviation of the force [N].
    **options
        Keywords of ``LuGreFilter``.

    Returns
    -------
    FilteredLuGre

    Raises
    ------
    InputError
        For columns of different lengths, time that decreases, and no usable sample.

    Notes
    -----
    A reconstruction after Asadian, Kermani & Patel 2012.
    """
    time, velocity, force, embedded = _checked(time=time, velocity=velocity, force=force, embedded=embedded)
    usable = np.isfinite(force) & np.isfinite(embedded) & (embedded > 0.0)
    length = np.where(usable, embedded, 1.0)
    traction, noise = np.where(usable, force, np.nan) / length, force_noise / length
    found = LuGreFilter(start, force_noise, **options)
    samples = list(zip(velocity, traction, np.diff(time, prepend=time[0]), noise))
    values, deflection, innovation, variance = map(np.array, zip(*(_row(found, *sample) for sample in samples)))
    skipped = int(np.isnan(innovation).sum())
    if skipped == len(time):
        limit_text = "at least 1 with a finite force, motion and embedded length is needed"
        step = "Check the columns and their units."
        raise InputError("number of usable samples", 0, limit_text, "LuGre filter", step)
    held = LuGreFilter(found.law, force_noise, **options, held=True)
    relative_sd = np.array([_relative_sd_after(held, *sample) for sample in samples])
    identifiable, known = _identifiable(held)
    parameters = _estimates(found.law, relative_sd[-1], known)
    return FilteredLuGre(
        law=found.law,
        parameters=parameters,
        identifiable=identifiable,
        values=values,
        relative_sd=relative_sd,
        deflection=deflection,
        covariance=held.covariance,
        innovation=innovation,
        variance=variance,
        skipped=skipped,
    )


def _checked(**columns: ArrayLike) -> list[np.ndarray]:
    """The columns as numbers of one length, in the order of time."""
    arrays = {name: np.asarray(column, float) for name, column in columns.items()}
    shape = arrays["time"].shape
    for name, array in arrays.items():
        if array.ndim != 1 or array.shape != shape or len(array) < 2:
            limit_text = f"it must be that of time, {shape}, and (n,) with n > 1"
            raise InputError(f"shape of {name}", array.shape, limit_text, next_step="Give columns of the same length.")
    back = np.flatnonzero(np.diff(arrays["time"]) < 0.0)
    if len(back):
        sample = back[0] + 1
        limit_text = f"it goes back, from {arrays['time'][back[0]]:g} s"
        raise InputError("time", arrays["time"][sample], limit_text, f"sample {sample}", "Sort the samples.")
    return list(arrays.values())


def _row(
    found: LuGreFilter, velocity: float, traction: float, dt: float, noise: float
) -> tuple[list[float], float, float, float]:
    """One step; values, deflection, innovation and its variance after it."""
    step = found.step(velocity, traction, dt, noise)
    values = [*found.state[1:], *found.limits]
    return values, found.state[0], step.innovation, step.variance


def _relative_sd_after(held: LuGreFilter, *sample: float) -> np.ndarray:
    """Standard deviations (6,) of the logarithms of the law's own parameters, after one step."""
    held.step(*sample)
    by_logs, (coulomb, static, _) = np.eye(6), held.limits
    by_logs[4, 3:5] = coulomb / static, 1.0 - coulomb / static
    return np.sqrt(np.einsum("ij,jk,ik->i", by_logs, held.covariance[1:, 1:], by_logs))


def _identifiable(held: LuGreFilter) -> tuple[int, np.ndarray]:
    """How many combinations of the logarithms are identified, and whether these determine each parameter (6,)."""
    shares, directions = np.linalg.eigh(held.covariance[1:, 1:] / held.spread**2)
    left, identifiable = shares * directions**2, shares < MAX_VARIANCE_RATIO
    return int(identifiable.sum()), left[:, identifiable].sum(axis=1) > left[:, ~identifiable].sum(axis=1)


def _estimates(law: Any, relative_sd: np.ndarray, known: np.ndarray) -> dict[str, Estimate]:
    """The law's parameters except the exponent, which is given."""
    estimates = {}
    for row, sd, identifiable in zip(law.table(), relative_sd, known):
        name, value, factor = row["name"], getattr(law, row["name"]), float(np.exp(TWO_SIDED * sd))
        limits = value, row["unit"], value / factor, value * factor
        estimates[name] = Estimate(name, *limits, identifiable=bool(identifiable), source=SOURCE)
    return estimates
