# SPDX-License-Identifier: Apache-2.0
"""A needle as a beam on a foundation: closed forms, and the path that its tip cuts."""

import math

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError


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
