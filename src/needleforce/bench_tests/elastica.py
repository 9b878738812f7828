# SPDX-License-Identifier: Apache-2.0
"""Bending of a needle: elastica of a cantilever with an elastic clamp and of three-point bending, and their limits for
small deflections."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..core import Needle
from ..errors import InputError

_MAX_STEPS = 100  # of a search for a zero: 53 halvings, and interpolations that gain nothing
_TINY = np.finfo(float).tiny


def elastica_deflection(
    force: ArrayLike, position: ArrayLike, needle: Needle, *, clamp_compliance: float = 0.0
) -> np.ndarray:
    """Deflection of the tip of a clamped needle, for any deflection.

    Parameters
    ----------
    force : array_like
        Force F (n,) [N], which keeps the direction perpendicular to the undeformed needle.
    position : array_like
        Its distance a (n,) [m] from the clamp along the needle.
    needle : Needle
        Section, length and Young modulus are used.
    clamp_compliance : float
        Rotation of the clamp per moment [rad/(N m)].

    Returns
    -------
    numpy.ndarray
        Deflection of the tip (n,) [m], with the sign of the force.

    Notes
    -----
    Between clamp and force EI theta'' = -F cos(theta); beyond it the needle is straight. With the slope theta_0 at the
    clamp and theta_a at the force, k^2 = (1 + sin theta_a)/2 and sin^2 phi = (1 + sin theta_0)/(2 k^2):
    a sqrt(F/EI) = K(k) - F(phi, k), deflection at the force a - 2 sqrt(EI/F) (E(k) - E(phi, k)): Bisshopp & Drucker
    1945, extended by theta_0 = clamp_compliance times the moment. For small deflections
    F a^2 (3 L - a)/(6 EI) + clamp_compliance F a L.
    """
    force, position = np.broadcast_arrays(np.asarray(force, float), np.asarray(position, float))
    return tip_of_cantilever(force, position, needle.length, needle.bending_stiffness, clamp_compliance)


def tip_of_cantilever(
    force: np.ndarray, position: np.ndarray, length: float, stiffness: float, compliance: float
) -> np.ndarray:
    """``elastica_deflection`` of a rod with the bending stiffness E I [N m^2]."""
    sag, slope = _cantilever(np.abs(force) * position**2 / stiffness, compliance * stiffness / position)
    return np.sign(force) * (position * sag + (length - position) * np.sin(slope))


def _cantilever(load: np.ndarray, softness: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Deflection over a and slope [rad] at the force, for the loads F a^2/EI (n,) [1] and the compliances of the clamp
    c EI/a (n,) [1].

    Search of the curvature at the clamp: the length that a rod under the force needs to come to no curvature grows with
    it, and no rod exists beyond a certain one.
    """
    from scipy.special import ellipe, ellipeinc, ellipk, ellipkinc

    def excess(curvature: np.ndarray) -> np.ndarray:
        possible, k2, phi = _end(curvature, load, softness)
        return np.where(possible, ellipk(k2) - ellipkinc(phi, k2) - np.sqrt(load), np.inf)

    load = np.maximum(load, 1e-12)
    high = np.minimum(np.sqrt(2.0 * load), load)  # no arm is longer than the rod
    _, k2, phi = _end(_zeros(excess, np.zeros_like(load), high), load, softness)
    sag = 1.0 - 2.0 * (ellipe(k2) - ellipeinc(phi, k2)) / np.sqrt(load)
    # where the closed form would lose digits, the expansion in the load: relative error 1e-8
    sag = np.where(load * (1.0 + softness) < 1e-4, load * (1.0 / 3.0 + softness), sag)
    return sag, np.arcsin(np.clip(2.0 * k2 - 1.0, -1.0, 1.0))


def _zeros(function: Callable[[np.ndarray], np.ndarray], low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Zeros (n,) of an increasing function of (n,) values, each between its ``low`` and ``high``, or at the end next to
    which it is. The function may be infinite.

    Inverse quadratic interpolation where three points are on a smooth curve, halving elsewhere: Chandrupatla 1997.
    """
    x, other, share = low, high, np.full_like(low, 0.5)
    f, f_other = np.minimum(function(x), -_TINY), np.maximum(function(other), _TINY)
    tolerance = 2.0**-53 * np.abs(high)
    for _ in range(_MAX_STEPS):
        tried = x + share * (other - x)
        f_tried = function(tried)
        same = (f_tried < 0.0) == (f < 0.0)
        last, f_last = np.where(same, x, other), np.where(same, f, f_other)
        other, f_other = np.where(same, other, x), np.where(same, f_other, f)
        x, f = tried, f_tried
        width = np.maximum(np.abs(other - x), tolerance)
        if ((width <= 2.0 * tolerance) | (f == 0.0)).all():
            break
        share = np.clip(_share(x - last, other - last, f, f_other, f_last), tolerance / width, 1.0 - tolerance / width)
    return np.where(np.abs(f) <= np.abs(f_other), x, other)


def _share(x: np.ndarray, other: np.ndarray, f: np.ndarray, f_other: np.ndarray, f_last: np.ndarray) -> np.ndarray:
    """Share (n,) of the interval from ``x`` to ``other`` at which to try next, both relative to the last point."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        place, height = (x - other) / -other, (f - f_other) / (f_last - f_other)
        smooth = (1.0 - np.sqrt(1.0 - place) < height) & (height < np.sqrt(place))
        first = f / (f - f_other) * f_last / (f_last - f_other)
        second = x / (other - x) * f / (f_last - f) * f_other / (f_other - f_last)
    return np.where(smooth, first + second, 0.5)


def _end(curvature: np.ndarray, load: np.ndarray, softness: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Whether a rod with this curvature at the clamp exists, with k^2 and phi of ``elastica_deflection``."""
    start = np.minimum(softness * curvature, 0.5 * np.pi)
    end = np.sin(start) + curvature**2 / (2.0 * load)
    possible = (start < 0.5 * np.pi) & (end < 1.0)
    k2 = np.where(possible, 0.5 * (1.0 + end), 1.0 - 1e-15)
    return possible, k2, np.arcsin(np.minimum(np.sqrt(0.5 * (1.0 + np.sin(start)) / k2), 1.0))


def three_point_load(deflection: ArrayLike) -> np.ndarray:
    """Load F S^2/(E I) [1] of three-point bending at a midpoint deflection over the span S (n,) [1], for any
    deflection.

    Parameters
    ----------
    deflection : array_like
        Deflection of the midpoint over the span (n,) [1], 0 to 0.5.

    Returns
    -------
    numpy.ndarray
        F S^2/(E I) (n,) [1]; 48 times the deflection if that is small.

    Raises
    ------
    InputError
        For a deflection outside 0 to 0.5.

    Notes
    -----
    The needle slides on two supports of fixed span without friction: each pushes at right angles to the needle, F/2 in
    the direction of the force. In axes along the needle at a support, with psi the slope from there,
    EI psi'^2/2 = R sin(psi): half the span is sqrt(EI/R) X, X = sqrt(2 sin t) cos t + J sin(t)/sqrt 2, the deflection
    sqrt(EI/R) (sqrt(2 sin t) sin t - J cos(t)/sqrt 2), F = 2 R cos t, with the slope t at the support and
    J = integral of sqrt(sin) = B(sin^2 t; 3/4, 1/2)/2.
    """
    share = np.atleast_1d(np.asarray(deflection, float))
    if not ((share >= 0.0) & (share <= 0.5)).all():
        wrong = share[~((share >= 0.0) & (share <= 0.5))][0]
        step = "Check zero and direction of the deflection, and the span."
        raise InputError("deflection over span", f"{wrong:g}", "it must be 0 to 0.5", next_step=step)
    slope = _zeros(lambda each: _three_point(each)[0] - share, np.zeros_like(share), np.full_like(share, 0.5 * np.pi))
    load = np.where(share < 1e-5, 48.0 * share, _three_point(slope)[1])
    return load.reshape(np.shape(deflection))


def _three_point(slope: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Deflection over span and load at the slope (n,) [rad] at the supports."""
    from scipy.special import beta, betainc

    slope = np.maximum(slope, 1e-12)
    sine, cosine = np.sin(slope), np.cos(slope)
    j = 0.5 * beta(0.75, 0.5) * betainc(0.75, 0.5, sine**2)
    half_span = np.sqrt(2.0 * sine) * cosine + j * sine / np.sqrt(2.0)
    sag = np.sqrt(2.0 * sine) * sine - j * cosine / np.sqrt(2.0)
    return 0.5 * sag / half_span, 8.0 * cosine * half_span**2


def cantilever_deflection(force: ArrayLike, position: ArrayLike, needle: Needle) -> Any:
    """Tip deflection [m] under ``force`` [N] at ``position`` [m] from the clamp: F a^2 (3 L - a) / (6 E I), small
    slopes; ``elastica_deflection`` is that of any deflection."""
    return force * tip_compliance(position, needle) / needle.young_modulus


def cantilever_modulus(force: ArrayLike, position: ArrayLike, deflection: ArrayLike, needle: Needle) -> Any:
    """Young modulus [Pa] that one reading implies for small deflections; ``needle.young_modulus`` is not used."""
    return force * tip_compliance(position, needle) / deflection


def cantilever_sensitivities(position: float, needle: Needle) -> dict[str, float]:
    """d ln E / d ln x of one reading, for x = force, deflection, outer_diameter, position, length; solid needle."""
    length = needle.length
    return {
        "force": 1.0,
        "deflection": -1.0,
        "outer_diameter": -4.0,
        "position": 2.0 - position / (3.0 * length - position),
        "length": 3.0 * length / (3.0 * length - position),
    }


def tip_compliance(position: Any, needle: Needle) -> Any:
    """a^2 (3 L - a) / (6 I): small deflection times E over force [1/m]."""
    return position**2 * (3.0 * needle.length - position) / (6.0 * needle.second_moment)
