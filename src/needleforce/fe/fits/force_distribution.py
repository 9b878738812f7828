# SPDX-License-Identifier: Apache-2.0
"""Force along a needle's shaft from the motion of markers in the tissue around it (DiMaio & Salcudean 2003).

Displacements are linear in the forces. A profile has few parameters and is written as a linear model for each value of
one more number (the length of the peak, the smoothness), whose evidence weighs the models: intervals hold that number's
uncertainty, too.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ...checks import above_zero
from ...errors import InputError
from ...vocabulary import SMALLEST
from ..elastic.needle_path import NeedlePath
from ..elastic.tissue import Tissue

PROFILES = ("smooth", "peak")
# values that are tried of what a profile has beyond its linear numbers
_PEAKS, _SMOOTHNESSES = 12, 22
_MIN_NODES = 4


@dataclass(frozen=True, eq=False)
class ForceDistribution:
    """Force per length along a shaft, with 95 % intervals.

    Attributes
    ----------
    nodes : ndarray, shape (n,)
        Distances along the path [m]; the last is the tip.
    density, density_low, density_high : ndarray, shape (n,)
        Force on the tissue along the path per length of it [N/m], + inwards. The last contains the force at the tip.
    base_force, base_low, base_high : float
        Their sum, what the needle's base feels [N].
    tip_force, tip_low, tip_high : float
        Of the last node beyond what the profile continues to [N].
    noise : float
        Standard deviation of one coordinate of a marker [m], found or given.
    profile : str
        ``"smooth"`` or ``"peak"``.
    residuals : ndarray, shape (m, d)
        Measured minus explained displacements [m]; NaN for markers that were left out.
    """

    nodes: np.ndarray
    density: np.ndarray
    density_low: np.ndarray
    density_high: np.ndarray
    base_force: float
    base_low: float
    base_high: float
    tip_force: float
    tip_low: float
    tip_high: float
    noise: float
    profile: str
    residuals: np.ndarray


@dataclass(frozen=True)
class _Linear:
    """Nodal forces as ``basis @ numbers``, numbers with a Gaussian prior of a precision in units of the noise."""

    basis: np.ndarray
    precision: np.ndarray  # (k, k), zero where nothing is known before


def force_distribution(
    tissue: Tissue,
    path: NeedlePath,
    markers: ArrayLike,
    displacements: ArrayLike,
    *,
    profile: str = "smooth",
    noise: float | None = None,
) -> ForceDistribution:
    """Force per length along a shaft from displacements of markers.

    Parameters
    ----------
    tissue : Tissue
        The solid, with its modulus; forces are proportional to it.
    path : NeedlePath
        From the surface to the tip.
    markers : array_like, shape (m, d)
        Where the markers were in the undeformed tissue [m].
    displacements : array_like, shape (m, d)
        By how much they moved [m]; NaN where one was not seen.
    profile : str
        ``"smooth"``: any density whose second differences are small, how small is found, and a peak at the tip.
        ``"peak"``: a constant density, and a peak that falls linearly from the tip over a length that is found.
    noise : float, optional
        Standard deviation of one coordinate of a displacement [m]; found from the residuals by default.

    Returns
    -------
    ForceDistribution
        Density and base force with intervals.

    Raises
    ------
    InputError
        If a marker is outside the mesh, arrays do not fit, or there are too few markers.
    """
    at, moved, seen = _checked(tissue, markers, displacements, noise)
    if len(path.nodes) < _MIN_NODES:
        step = "Use a smaller spacing."
        raise InputError("nodes of the path", len(path.nodes), f"must be at least {_MIN_NODES}", next_step=step)
    if profile not in PROFILES:
        raise InputError("profile", profile, f"must be {' or '.join(PROFILES)}")
    observed = moved.T.ravel()[np.tile(seen, at.shape[1])]
    unit = tissue.solve(path.loads(tissue).toarray())  # for unit forces at the nodes of the path
    response = np.asarray(tissue.values_at(at) @ unit)[np.tile(seen, at.shape[1])]
    models = list(_smooth(path) if profile == "smooth" else _peaks(path))
    _check_count(len(observed), models[0].basis.shape[1], profile)
    forces, covariance, sigma = _averaged(response, observed, models, noise)
    residuals = np.full(moved.shape[::-1], np.nan)
    residuals[:, seen] = (observed - response @ forces).reshape(at.shape[1], -1)
    return _result(path, forces, covariance, noise=sigma, profile=profile, residuals=residuals.T)


def _checked(
    tissue: Tissue, markers: ArrayLike, displacements: ArrayLike, noise: float | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    at, moved = np.atleast_2d(np.asarray(markers, float)), np.atleast_2d(np.asarray(displacements, float))
    if at.shape != moved.shape or at.shape[1] != tissue.mesh.dimension:
        limit = f"must be two arrays of shape (m, {tissue.mesh.dimension})"
        step = "Give a row for each marker, with the coordinates of the mesh."
        raise InputError("markers and displacements", f"of shapes {at.shape} and {moved.shape}", limit, next_step=step)
    if not at.size:
        raise InputError("markers", "none", "some are needed", next_step="Give where they were and how they moved.")
    if len(np.unique(at, axis=0)) < len(at):
        raise InputError("markers", "at one place", "more than once", next_step="Average the motion of each.")
    reach = float(np.ptp(tissue.mesh.points, axis=0).max())
    if np.nanmax(np.abs(moved), initial=0.0) > 0.5 * reach:
        size = f"up to {np.nanmax(np.abs(moved)):.3g} m"
        raise InputError("displacements", size, f"the body is {reach:.3g} m large", next_step="Give them in m.")
    if not np.all(np.isfinite(at)):
        raise InputError("place of a marker", "not finite", "every marker has one")
    if noise is not None:
        above_zero("noise", noise, "m", "Leave it out to have it found.")
    return at, moved, np.all(np.isfinite(moved), axis=1)


def _check_count(observed: int, numbers: int, profile: str) -> None:
    if observed >= numbers + 2:
        return
    step = 'Use profile="peak", a larger spacing of the path, or more markers.'
    if profile == "peak":
        step = "Use more markers."
    raise InputError("markers", f"{observed} coordinates", f"{numbers} numbers are to be found", next_step=step)


def _smooth(path: NeedlePath) -> Iterator[_Linear]:
    """Densities at the nodes with second differences of a size, and a peak at the tip over a length."""
    lengths, n = path.lengths, len(path.nodes)
    second = np.zeros((max(n - 2, 0), n + 1))
    for k in range(n - 2):
        second[k, k : k + 3] = 1.0, -2.0, 1.0
    for peak in np.geomspace(path.nodes[1], 0.5 * path.depth + path.nodes[1], _PEAKS):
        basis = np.column_stack([np.diag(lengths), _peak(path, peak)])
        for choice in np.logspace(-10.0, 4.0, _SMOOTHNESSES):
            yield _Linear(basis, choice * second.T @ second)


def _peaks(path: NeedlePath) -> Iterator[_Linear]:
    """A constant density and a peak at the tip that falls over a length."""
    for peak in np.geomspace(path.nodes[1], path.depth, _PEAKS * 4):
        basis = np.column_stack([path.lengths / path.depth, _peak(path, peak)])
        yield _Linear(basis, np.zeros((2, 2)))


def _peak(path: NeedlePath, length: float) -> np.ndarray:
    """Nodal forces, of one newton in all, whose density falls linearly from the tip over a length [m]."""
    forces = path.lengths * np.maximum(0.0, 1.0 - (path.depth - path.nodes) / length)
    return forces / forces.sum()


def _averaged(
    response: np.ndarray, observed: np.ndarray, models: list[_Linear], noise: float | None
) -> tuple[np.ndarray, np.ndarray, float]:
    """Nodal forces with their covariance, averaged over models by their evidence; standard deviation of noise."""
    scale = np.abs(response).max() ** 2
    fits = [_fit(response, observed, model, noise, scale) for model in models]
    evidence = np.array([each[0] for each in fits])
    weights = np.exp(evidence - evidence.max())
    weights /= weights.sum()
    mean = sum(weight * each[1] for weight, each in zip(weights, fits))
    spread = [each[2] + np.outer(each[1] - mean, each[1] - mean) for each in fits]
    covariance = sum(weight * each for weight, each in zip(weights, spread))
    sigma = float(np.sqrt(sum(weight * each[3] for weight, each in zip(weights, fits))))
    return np.asarray(mean), np.asarray(covariance), sigma


def _fit(response, observed, model, noise, scale):  # type: ignore[no-untyped-def]
    """Log evidence, nodal forces, their covariance and the variance of noise for one model."""
    design = response @ model.basis
    inverse = design.T @ design + scale * model.precision
    numbers = np.linalg.solve(inverse, design.T @ observed)
    misfit = observed @ (observed - design @ numbers)  # with the prior's part
    free = len(observed) - design.shape[1] + np.linalg.matrix_rank(model.precision)
    variance = noise**2 if noise else max(misfit, 0.0) / free
    log_prior = _log_determinant(scale * model.precision)
    log_posterior = np.linalg.slogdet(inverse)[1]
    fitted = -0.5 * misfit / variance if noise else -0.5 * free * np.log(max(misfit, SMALLEST))
    covariance = variance * model.basis @ np.linalg.solve(inverse, model.basis.T)
    return fitted + 0.5 * (log_prior - log_posterior), model.basis @ numbers, covariance, variance


def _log_determinant(precision: np.ndarray) -> float:
    """Of the part that is not zero."""
    sizes = np.linalg.eigvalsh(precision)
    return float(np.log(sizes[sizes > 1e-10 * max(sizes.max(), SMALLEST)]).sum())


def _result(path: NeedlePath, forces: np.ndarray, covariance: np.ndarray, **more) -> ForceDistribution:  # type: ignore[no-untyped-def]
    density, half = forces / path.lengths, 1.96 * np.sqrt(np.diag(covariance)) / path.lengths
    base, base_half = _interval(np.ones(len(forces)), forces, covariance)
    beyond = np.eye(len(forces))[-1]
    if len(forces) > 2:  # the density of the node before the last, continued
        beyond[-2] = -path.lengths[-1] / path.lengths[-2]
    tip, tip_half = _interval(beyond, forces, covariance)
    return ForceDistribution(
        nodes=path.nodes, density=density, density_low=density - half, density_high=density + half,
        base_force=base, base_low=base - base_half, base_high=base + base_half,
        tip_force=tip, tip_low=tip - tip_half, tip_high=tip + tip_half, **more,
    )  # fmt: skip


def _interval(weights: np.ndarray, forces: np.ndarray, covariance: np.ndarray) -> tuple[float, float]:
    return float(weights @ forces), 1.96 * float(np.sqrt(weights @ covariance @ weights))
