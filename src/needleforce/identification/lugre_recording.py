# SPDX-License-Identifier: Apache-2.0
"""LuGre friction along a whole recording, and which of its parameters the recording told."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from .estimates import Estimate
from .lugre_filter import LuGreFilter

SOURCE = "sequential extended Kalman filters, a reconstruction after Asadian, Kermani & Patel 2012"
TOLD = 0.5  # of the variance before: the recording then told at least as much as the start did
Z_95 = 1.959963984540054


@dataclass(frozen=True, eq=False)
class FilteredLuGre:
    """The friction over time: ``values`` (n, 6) in the order of ``parameters``, SI, and ``deflection`` (n,) [m].

    ``innovation`` (n,) [N/m] and its ``variance`` (n,) are NaN at the ``skipped`` samples. What is known stands in the
    others, from a second run with the parameters held at the outcome: ``relative_sd`` (n, 6), standard deviations of
    the logarithms of the values, and the last ``covariance`` (7, 7) of sigma_0 zeta and the logarithms of sigma_0,
    sigma_1, sigma_2, F_c, F_s - F_c, v_s. ``told`` of the combinations of these six are known from the recording; an
    estimate is identifiable where the others leave less of its variance than these do.
    """

    law: Any
    parameters: dict[str, Estimate]
    told: int
    values: np.ndarray
    relative_sd: np.ndarray
    deflection: np.ndarray
    covariance: np.ndarray
    innovation: np.ndarray
    variance: np.ndarray
    skipped: int


def filter_lugre(time, velocity, force, embedded, start, force_noise: float, **options) -> FilteredLuGre:
    """Runs a ``LuGreFilter`` from the law ``start`` along a recording; ``options`` are the filter's.

    ``time`` [s], ``velocity`` [m/s] over the step to each sample, friction ``force`` [N] and ``embedded`` length [m]
    are (n,); ``force_noise`` [N] is the standard deviation of the force. Samples without embedded length, or not
    finite, are skipped and counted. Raises InputError on other shapes, time that goes back, or nothing to use.
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
        raise InputError("samples", 0, "with a finite force, motion and embedded length", "LuGre filter")
    held = LuGreFilter(found.law, force_noise, **options, held=True)
    relative_sd = np.array([_relative_sd_after(held, *sample) for sample in samples])
    told, known = _told(held)
    parameters = _estimates(found.law, relative_sd[-1], known)
    return FilteredLuGre(found.law, parameters, told, values, relative_sd, deflection, held.covariance, innovation,
                         variance, skipped)  # fmt: skip


def _checked(**columns) -> list[np.ndarray]:
    """The columns as numbers of one length, in the order of time."""
    arrays = {name: np.asarray(column, float) for name, column in columns.items()}
    shape = arrays["time"].shape
    for name, array in arrays.items():
        if array.ndim != 1 or array.shape != shape or len(array) < 2:
            raise InputError(f"shape of {name}", array.shape, f"not that of time, {shape}, or not (n,) with n > 1")
    back = np.flatnonzero(np.diff(arrays["time"]) < 0.0)
    if len(back):
        raise InputError("time", arrays["time"][back[0] + 1], "goes back", f"sample {back[0] + 1}", "Sort the samples.")
    return list(arrays.values())


def _row(found: LuGreFilter, velocity: float, traction: float, dt: float, noise: float):
    """One step, and what is known after it."""
    step = found.step(velocity, traction, dt, noise)
    values = [*found.state[1:], *found.limits]
    return values, found.state[0], step.innovation, step.variance


def _relative_sd_after(held: LuGreFilter, *sample) -> np.ndarray:
    """Standard deviations (6,) of the logarithms of the law's own parameters, after one step."""
    held.step(*sample)
    by_logs, (coulomb, static, _) = np.eye(6), held.limits
    by_logs[4, 3:5] = coulomb / static, 1.0 - coulomb / static
    return np.sqrt(np.einsum("ij,jk,ik->i", by_logs, held.covariance[1:, 1:], by_logs))


def _told(held: LuGreFilter) -> tuple[int, np.ndarray]:
    """How many combinations of the logarithms the recording told, and whether these tell each parameter (6,)."""
    shares, directions = np.linalg.eigh(held.covariance[1:, 1:] / held.spread**2)
    left, told = shares * directions**2, shares < TOLD
    return int(told.sum()), left[:, told].sum(axis=1) > left[:, ~told].sum(axis=1)


def _estimates(law, relative_sd: np.ndarray, known: np.ndarray) -> dict[str, Estimate]:
    """The law's parameters but for the exponent, which is given."""
    estimates = {}
    for row, sd, told in zip(law.table(), relative_sd, known):
        name, value, factor = row["name"], getattr(law, row["name"]), float(np.exp(Z_95 * sd))
        limits = value, row["unit"], value / factor, value * factor
        estimates[name] = Estimate(name, *limits, identifiable=bool(told), source=SOURCE)
    return estimates
