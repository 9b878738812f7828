# SPDX-License-Identifier: Apache-2.0
"""A needle as a beam on a foundation: closed forms, the path that its tip cuts, and the exact numerical solution."""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from ..checks import one_of
from ..errors import InputError
from .foundation import FORMS


def beam_wavenumber(stiffness: float, modulus: float) -> float:
    """Wavenumber beta of a beam on a linear foundation; 1/beta is the length over which a lateral load decays.

    Parameters
    ----------
    stiffness : float
        Bending stiffness E I [N m^2], above 0.
    modulus : float
        Foundation modulus K [Pa]: lateral force per length over offset, at least 0.

    Returns
    -------
    float
        beta = (K / 4 E I)^(1/4) [1/m].

    Raises
    ------
    InputError
        If a value is outside its range.
    """
    _check("stiffness", stiffness, "N m^2", above=True)
    _check("modulus", modulus, "Pa", above=False)
    return (0.25 * modulus / stiffness) ** 0.25


def tip_deflection(stiffness: float, modulus: float, force: float, length: float = math.inf) -> float:
    """Deflection of the tip of a beam on a linear foundation under a lateral force at the tip.

    Parameters
    ----------
    stiffness, modulus : float
        Bending stiffness E I [N m^2] and foundation modulus K [Pa], both above 0.
    force : float
        Lateral force P on the tip [N].
    length : float
        Length L [m] to the end that is clamped; infinite is a long needle.

    Returns
    -------
    float
        2 P beta / K [m] for a long needle, otherwise that times
        (sinh l cosh l - sin l cos l) / (cosh^2 l + cos^2 l) with l = beta L.
    """
    beta = _positive_wavenumber(stiffness, modulus)
    _check("length", length, "m", above=True)
    angle = beta * length
    if angle > 20.0:  # the rest is below rounding
        return 2.0 * force * beta / modulus
    sinh, cosh, sine, cosine = math.sinh(angle), math.cosh(angle), math.sin(angle), math.cos(angle)
    return 2.0 * force * beta / modulus * (sinh * cosh - sine * cosine) / (cosh**2 + cosine**2)


def clamp_force(stiffness: float, modulus: float, force: float, length: float) -> float:
    """Lateral force that reaches the clamped end of a beam on a linear foundation with a force at its tip.

    Parameters
    ----------
    stiffness, modulus, force, length : float
        As for ``tip_deflection``; the length is finite.

    Returns
    -------
    float
        P minus the integral of K y along the beam [N]:
        2 P cosh l cos l / (cosh^2 l + cos^2 l) with l = beta L.
    """
    angle = _positive_wavenumber(stiffness, modulus) * length
    _check("length", length, "m", above=True)
    if angle > 700.0:
        return 0.0
    cosh, cosine = math.cosh(angle), math.cos(angle)
    return 2.0 * force * cosh * cosine / (cosh**2 + cosine**2)


def steady_curvature(stiffness: float, modulus: float, force: float) -> float:
    """Curvature of the path that a long needle cuts under a constant lateral force on its tip.

    Parameters
    ----------
    stiffness, modulus : float
        Bending stiffness E I [N m^2] and foundation modulus K [Pa], both above 0.
    force : float
        Lateral force P on the tip [N].

    Returns
    -------
    float
        Curvature P / (E I beta) [1/m]: that of the unicycle model, from the mechanics.

    Notes
    -----
    The shaft feels the path that the tip has cut, E I y'''' + K (y - Y) = 0; small slopes, linear foundation, a needle
    much longer than 1/beta. Far from the tip the needle bends as its path, with the moment E I times this curvature.
    """
    return force / (stiffness * _positive_wavenumber(stiffness, modulus))


def steady_tip_lag(stiffness: float, modulus: float, force: float) -> float:
    """Angle between the path and the needle at its tip in steady steering, P / sqrt(K E I) [rad].

    Parameters
    ----------
    stiffness, modulus, force : float
        As for ``steady_curvature``.

    Returns
    -------
    float
        Angle [rad]: the tip points out of the curve that it cuts.
    """
    _positive_wavenumber(stiffness, modulus)
    return force / math.sqrt(modulus * stiffness)


def switch_on_path(travel: ArrayLike, stiffness: float, modulus: float, force: float) -> np.ndarray:
    """Path of the tip after a lateral force is switched on in a long straight channel.

    Parameters
    ----------
    travel : array_like, shape (n,)
        Travel s of the tip since then [m], at least 0.
    stiffness, modulus, force : float
        As for ``steady_curvature``.

    Returns
    -------
    ndarray, shape (n,)
        Y(s) = (2 P beta / K) (1 + 2 beta s + beta^2 s^2) [m].
    """
    beta = _positive_wavenumber(stiffness, modulus)
    s = _travels(travel)
    return 2.0 * force * beta / modulus * (1.0 + beta * s * (2.0 + beta * s))


def tip_path(
    travel: ArrayLike, stiffness: float, modulus: float, force: Callable[[np.ndarray], np.ndarray], points: int = 200
) -> np.ndarray:
    """Path of the tip of a long needle under a lateral force that changes with the travel.

    Parameters
    ----------
    travel : array_like, shape (n,)
        Travel s of the tip in a long straight channel [m], at least 0.
    stiffness, modulus : float
        As for ``steady_curvature``.
    force : callable
        The lateral force P(s) [N] for an array of travels; complex for a force in space, real part along x, imaginary
        along y. It may begin with a step at 0 and must be continuous elsewhere.
    points : int
        Points of Gauss and Legendre for the integral; a smooth force needs 20.

    Returns
    -------
    ndarray, shape (n,)
        Y(s) [m], the superposition of ``switch_on_path`` over the increments of the force, by parts:
        Y = (2 beta / K) [P(s) + 2 beta times the integral of P(t) (1 + beta (s - t)) over t from 0 to s].
    """
    beta = _positive_wavenumber(stiffness, modulus)
    s = _travels(travel)
    nodes, weights = np.polynomial.legendre.leggauss(points)
    t = 0.5 * np.multiply.outer(s, nodes + 1.0)
    history = np.sum(0.5 * s[:, None] * weights * force(t) * (1.0 + beta * (s[:, None] - t)), axis=1)
    return 2.0 * beta / modulus * (force(s) + 2.0 * beta * history)


def beam_deflection(
    stiffness: float,
    modulus: float,
    force: float,
    length: float,
    *,
    form: str = "linear",
    scale: float = math.inf,
    compression: float = 0.0,
    tolerance: float = 1e-10,
) -> tuple[np.ndarray, np.ndarray]:
    """Deflection of a beam on a foundation that is clamped at one end and loaded at its tip, solved numerically.

    Parameters
    ----------
    stiffness, modulus, force, length : float
        Bending stiffness [N m^2], foundation modulus [Pa], lateral force on the tip [N], length [m].
    form : str
        Form of the foundation: ``"linear"``, ``"cubic"``, ``"hyperbolic"`` or ``"tanh"``.
    scale : float
        Offset at which a form departs from the linear one [m], as in ``foundation_pressure``.
    compression : float
        Axial force [N] that follows the tangent of the beam.
    tolerance : float
        Relative, of the collocation.

    Returns
    -------
    distance, deflection : ndarray, shape (n,)
        Distance from the tip [m] and deflection there [m].

    Raises
    ------
    InputError
        If a value is outside its range, or there is no solution.

    Notes
    -----
    E I y'''' + N y'' + p(y) = 0, y'' = 0 and E I y''' = P at the tip, y = y' = 0 at the clamp. Solved by SciPy's
    ``solve_bvp``, independently of ``FlexibleInsertion``.
    """
    from scipy.integrate import solve_bvp

    from .foundation import foundation_pressure

    beta = _positive_wavenumber(stiffness, modulus)
    _check("length", length, "m", above=True)
    one_of("form", form, FORMS)
    unit = 2.0 * abs(force) * beta / modulus or 1.0  # deflections and lengths of order 1
    pressure = np.vectorize(lambda u: foundation_pressure(u * unit, modulus, form=form, scale=scale) / unit)
    load = 4.0 / modulus
    axial = compression / (stiffness * beta**2)

    def slopes(_, y):
        return np.vstack([y[1], y[2], y[3], -load * pressure(y[0]) - axial * y[2]])

    shear = force / (stiffness * beta**3 * unit)
    ends = lambda tip, clamp: np.array([tip[2], tip[3] - shear, clamp[0], clamp[1]])  # noqa: E731
    x = np.linspace(0.0, beta * length, 201)
    first = np.vstack([np.exp(-x) * np.cos(x)] + [np.zeros_like(x)] * 3)
    solution = solve_bvp(slopes, ends, x, first, tol=tolerance, max_nodes=100_000)
    if not solution.success:
        raise InputError("beam", solution.message, "no solution", next_step="Reduce the compression or the force.")
    return solution.x / beta, unit * solution.y[0]


def _positive_wavenumber(stiffness: float, modulus: float) -> float:
    _check("modulus", modulus, "Pa", above=True)
    return beam_wavenumber(stiffness, modulus)


def _travels(travel: ArrayLike) -> np.ndarray:
    s = np.atleast_1d(np.asarray(travel, dtype=float))
    if not np.all(s >= 0.0):
        raise InputError("travel", f"{np.min(s)} m", "must be at least 0 m", next_step="Count it from the switch.")
    return s


def _check(quantity: str, value: float, unit: str, *, above: bool) -> None:
    if not (value > 0.0 if above else value >= 0.0):
        limit = f"must be {'above' if above else 'at least'} 0 {unit}"
        raise InputError(quantity, f"{value} {unit}", limit, next_step="Check the unit and the sign.")
