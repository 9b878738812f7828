# SPDX-License-Identifier: Apache-2.0
"""Exact solutions of elasticity that finite elements are compared with."""

import numpy as np
from numpy.typing import ArrayLike

from needleforce.fe.materials import Elastic


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
