# SPDX-License-Identifier: Apache-2.0
"""Exact solutions of elasticity: of solids, and of beams on a foundation."""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from needleforce.fe.materials import Elastic
from needleforce.mechanics.beam_on_foundation import beam_wavenumber
from needleforce.mechanics.foundation import foundation_pressure


def line_force_displacement(material: Elastic, load: float, near: float, far: float) -> float:
    """Difference of displacement at two distances from a line force in an infinite solid, along the force.

    Parameters
    ----------
    material : Elastic
        Of the solid, in plane strain.
    load : float
        Force per length [N/m].
    near, far : float
        Distances on the line of the force [m].

    Returns
    -------
    float
        u(near) - u(far) [m].

    Notes
    -----
    Kelvin: ``Q (3 - 4 nu) ln(r2 / r1) / (8 pi G (1 - nu))``.
    """
    nu = material.poisson_ratio
    return load * (3.0 - 4.0 * nu) * np.log(far / near) / (8.0 * np.pi * material.shear_modulus * (1.0 - nu))


def ring_displacement(material: Elastic, pressure: float, inner: float, outer: float) -> float:
    """Radial displacement [m] of the inner face of a thick ring in plane strain, under a pressure [Pa] from inside.

    Notes
    -----
    Lamé: ``(1 + nu) / E p a^2 / (b^2 - a^2) ((1 - 2 nu) a + b^2 / a)``.
    """
    nu, a, b = material.poisson_ratio, inner, outer
    share = pressure * a**2 / (b**2 - a**2)
    return (1.0 + nu) / material.young_modulus * share * ((1.0 - 2.0 * nu) * a + b**2 / a)


def punch_stiffness(material: Elastic, radius: float) -> float:
    """Force per depth [N/m] of a flat cylindrical punch without friction on a half-space: ``4 G R / (1 - nu)``."""
    return 4.0 * material.shear_modulus * radius / (1.0 - material.poisson_ratio)


def bonded_shaft_stiffness(material: Elastic, radius: float, length: ArrayLike) -> np.ndarray:
    """Force per displacement [N/m] of a rigid shaft that sticks to a half-space along its length, and of its base.

    Parameters
    ----------
    material : Elastic
        Of the half-space.
    radius : float
        Of the shaft [m].
    length : array_like
        Embedded [m], more than a few radii.

    Returns
    -------
    ndarray
        Approximate, within about a tenth.

    Notes
    -----
    Randolph & Wroth (1978): ``2 pi G L / ln(2.5 L (1 - nu) / R) + 4 G R / (1 - nu)``.
    """
    length = np.asarray(length, dtype=float)
    reach = 2.5 * length * (1.0 - material.poisson_ratio)
    shaft = 2.0 * np.pi * material.shear_modulus * length / np.log(reach / radius)
    return shaft + punch_stiffness(material, radius)


def clamp_force(stiffness: float, modulus: float, force: float, length: float) -> float:
    """Lateral force [N] that reaches the clamped end of a beam of a length [m] on a linear foundation: the force at its
    tip less the integral of K y, ``2 P cosh l cos l / (cosh^2 l + cos^2 l)`` with ``l = beta L``."""
    angle = beam_wavenumber(stiffness, modulus) * length
    cosh, cosine = math.cosh(angle), math.cos(angle)
    return 2.0 * force * cosh * cosine / (cosh**2 + cosine**2)


def steady_tip_lag(stiffness: float, modulus: float, force: float) -> float:
    """Angle [rad] between the path and the needle at its tip in steady steering, ``P / sqrt(K E I)``."""
    return force / math.sqrt(modulus * stiffness)


def tip_path(
    travel: float, stiffness: float, modulus: float, force: Callable[[np.ndarray], np.ndarray], points: int = 200
) -> float:
    """Place [m] of the tip of a long needle after a travel [m] in a straight channel, under a lateral force P(s) [N]
    that may begin with a step and is continuous elsewhere.

    The superposition of ``switch_on_path`` over the increments of the force, by parts:
    ``Y = (2 beta / K) [P(s) + 2 beta times the integral of P(t) (1 + beta (s - t)) over t from 0 to s]``.
    """
    beta = beam_wavenumber(stiffness, modulus)
    nodes, weights = np.polynomial.legendre.leggauss(points)
    t = 0.5 * travel * (nodes + 1.0)
    history = np.sum(0.5 * travel * weights * force(t) * (1.0 + beta * (travel - t)))
    return float(2.0 * beta / modulus * (force(np.array(travel)) + 2.0 * beta * history))


def cubic_deflection(stiffness: float, modulus: float, force: float, length: float, scale: float) -> float:
    """Deflection [m] of the tip of a beam of a length [m] that is clamped at its other end, on a foundation whose
    cubic part equals the linear one at ``scale`` [m].

    ``E I y'''' + p(y) = 0``, ``y'' = 0`` and ``E I y''' = P`` at the tip, ``y = y' = 0`` at the clamp, by SciPy's
    ``solve_bvp``.
    """
    from scipy.integrate import solve_bvp

    beta = beam_wavenumber(stiffness, modulus)
    unit = 2.0 * force * beta / modulus  # deflections and lengths of order 1
    pressure = np.vectorize(lambda u: foundation_pressure(u * unit, modulus, form="cubic", scale=scale) / unit)
    shear = force / (stiffness * beta**3 * unit)
    x = np.linspace(0.0, beta * length, 201)
    solution = solve_bvp(
        lambda _, y: np.vstack([*y[1:], -4.0 / modulus * pressure(y[0])]),
        lambda tip, clamp: np.array([tip[2], tip[3] - shear, *clamp[:2]]),
        x, np.vstack([np.exp(-x) * np.cos(x)] + [np.zeros_like(x)] * 3), tol=1e-10, max_nodes=100_000,
    )  # fmt: skip
    assert solution.success
    return float(unit * solution.y[0][0])
