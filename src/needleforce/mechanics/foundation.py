# SPDX-License-Identifier: Apache-2.0
"""The tissue along the shaft as a Winkler foundation, linear or not, and the friction that follows from it: source
paper eqs. (7)-(11), and its future work."""

import math

from .. import core
from ..checks import one_of
from ..errors import InputError

READINGS = ("A", "B", "C", "lame", "literal_mm")
FORMS = ("linear", "cubic", "hyperbolic", "tanh")
LAWS = {"cubic": "cubic_foundation", "hyperbolic": "hyperbolic_foundation", "tanh": "tanh_foundation"}
"""Nonlinear form of a foundation -> its friction law."""


def foundation_modulus(
    needle: core.Needle,
    tissue: core.Tissue,
    *,
    width: float | None = None,
    formula: str = "vesic",
    embedment_factor: float = 1.0,
) -> float:
    """Foundation modulus K: force per length over deflection of a beam on the tissue.

    Parameters
    ----------
    needle : Needle
        The beam; its outer diameter D and bending stiffness are used.
    tissue : Tissue
        Young's modulus [Pa] and Poisson ratio of the foundation.
    width : float, optional
        Full width of the beam [m]. Default: pi D for ``"vesic"``, as in the source paper; D for ``"biot"``.
    formula : str
        ``"vesic"`` (Vesic 1961, the source paper's eq. (9)) or ``"biot"`` (Biot 1937, constants unconfirmed).
    embedment_factor : float
        Factor on K; 2 is resistance on both sides of the beam.

    Returns
    -------
    float
        Foundation modulus [Pa]. The modulus of subgrade reaction is K / width [Pa/m].

    Raises
    ------
    InputError
        If the formula is unknown.
    """
    if formula == "vesic":
        return core.vesic_modulus(needle, tissue, width or math.pi * needle.outer_diameter, embedment_factor)
    if formula == "biot":
        return embedment_factor * core.biot_modulus(needle, tissue, 0.5 * (width or needle.outer_diameter))
    raise InputError("formula", repr(formula), "unknown", next_step="Give 'vesic' or 'biot'.")


def friction_per_length(
    needle: core.Needle,
    tissue: core.Tissue,
    coefficient: float,
    *,
    reading: str = "A",
    embedment_factor: float = 1.0,
    form: str = "linear",
    scale: float = math.inf,
) -> float:
    """Friction per embedded length f' of a straight shaft, for a friction coefficient.

    Parameters
    ----------
    needle : Needle
        Its outer diameter D [m] and bending stiffness are used.
    tissue : Tissue
        Young's modulus [Pa] and Poisson ratio.
    coefficient : float
        Friction coefficient [1].
    reading : str
        How eqs. (7)-(11), which are dimensionally inconsistent as printed, are interpreted: one of ``READINGS``.
    embedment_factor : float
        Factor on the foundation modulus.
    form : str
        Pressure of the foundation: one of ``FORMS``. The reading gives its slope at the origin; the hole is open by the
        settlement D/2.
    scale : float
        Settlement u_c [m]: sqrt(k_1 / k_3) of a cubic form, p_u / k_1 of the others; above 0, not used if linear.

    Returns
    -------
    float
        Friction per embedded length [N/m].

    Raises
    ------
    InputError
        If the reading or the form is unknown, or the scale not above 0.

    Notes
    -----
    Source paper eqs. (7)-(11), in which a factor 1/b is missing. ``"A"`` divides by the paper's own width b = pi D,
    ``"B"`` by the projected width D; ``"C"`` uses b = D everywhere; ``"lame"`` is the exact linear solution of a hole
    opened by its own radius; ``"literal_mm"`` evaluates the printed formula in N, mm and MPa: it depends on the units
    and is for comparison only.
    """
    linear = coefficient * core.friction_per_length(_reading(reading), needle, tissue, embedment_factor)
    return linear * foundation_pressure(needle.radius, 1.0, form=form, scale=scale) / needle.radius


def friction_coefficient(
    per_length: float,
    needle: core.Needle,
    tissue: core.Tissue,
    *,
    reading: str = "A",
    embedment_factor: float = 1.0,
) -> float:
    """Friction coefficient that a measured friction per length implies: the inverse of ``friction_per_length``.

    Parameters
    ----------
    per_length : float
        Friction per embedded length [N/m].
    needle, tissue, reading, embedment_factor
        As in ``friction_per_length``.

    Returns
    -------
    float
        Friction coefficient [1].

    Raises
    ------
    InputError
        If the reading is unknown.
    """
    return per_length / core.friction_per_length(_reading(reading), needle, tissue, embedment_factor)


def foundation_pressure(settlement: float, stiffness: float, *, form: str, scale: float = math.inf) -> float:
    """Pressure p of a foundation at a settlement u.

    Parameters
    ----------
    settlement : float
        Settlement u [m]; p is odd in it.
    stiffness : float
        Slope k_1 [Pa/m] at the origin: the modulus of subgrade reaction K / width.
    form : str
        ``"linear"`` k_1 u; ``"cubic"`` k_1 u + k_3 u^3; ``"hyperbolic"`` k_1 u / (1 + k_1 |u| / p_u); ``"tanh"``
        p_u tanh(k_1 u / p_u).
    scale : float
        Settlement u_c [m]: sqrt(k_1 / k_3), or p_u / k_1; above 0. Infinite is a linear foundation.

    Returns
    -------
    float
        Pressure [Pa].

    Raises
    ------
    InputError
        If the form is unknown or the scale not above 0.
    """
    form, scale = _form(form, scale)
    return core.foundation_pressure(form, settlement, stiffness, scale)


def foundation_energy(settlement: float, stiffness: float, *, form: str, scale: float = math.inf) -> float:
    """Energy per area [J/m^2] that a foundation stores at a settlement: the integral of ``foundation_pressure``, whose
    parameters it has."""
    form, scale = _form(form, scale)
    return core.foundation_energy(form, settlement, stiffness, scale)


def deflection_length(needle: core.Needle, modulus: float, lateral_force: float) -> float:
    """Length over which a shaft's offset from its cut path grows to the settlement D/2.

    Parameters
    ----------
    needle : Needle
        Its outer diameter D [m] and bending stiffness EI are used.
    modulus : float
        Foundation modulus K [Pa], as ``foundation_modulus`` returns it.
    lateral_force : float
        Lateral force P [N] at the tip, as ``LancetBevel.lateral_force`` returns it; above 0.

    Returns
    -------
    float
        The ``deflection_length`` of the laws in ``LAWS`` [m]: D sqrt(K EI) / 2 P.

    Raises
    ------
    InputError
        If the force is not above 0.

    Notes
    -----
    A long shaft on a linear foundation that is attached to its path lags it by the angle P / sqrt(K EI) while it steers
    steadily. A guide near the surface, a build-up of the force and a nonlinear foundation change that.
    """
    if not lateral_force > 0.0:
        raise InputError("lateral_force", f"{lateral_force} N", "must be above 0 N", next_step="Take coulomb instead.")
    return core.deflection_length(needle, modulus, lateral_force)


def bending_length(needle: core.Needle, modulus: float) -> float:
    """Length behind the tip over which a long shaft is off its cut path.

    Parameters
    ----------
    needle : Needle
        Its bending stiffness EI is used.
    modulus : float
        Foundation modulus K [Pa].

    Returns
    -------
    float
        The ``bending_length`` of the laws in ``LAWS`` [m]: (3/8)^(1/3) / beta, beta = (K / 4 EI)^(1/4), with which the
        integral of the squared offset is that of steady steering, w = (angle / beta) exp(-beta x) sin(beta x).
    """
    return core.bending_length(needle, modulus)


def _form(name: str, scale: float) -> tuple[core.FoundationForm, float]:
    """The core's form and scale; an infinite scale is a linear foundation."""
    one_of("form of the foundation", name, FORMS)
    if not scale > 0.0:
        raise InputError("scale", f"{scale} m", "must be above 0 m", next_step="Leave it out for a linear foundation.")
    linear = math.isinf(scale)
    return getattr(core.FoundationForm, "linear" if linear else name), 1.0 if linear else scale


def _reading(name: str) -> core.FrictionReading:
    one_of("friction reading", name, READINGS)
    return getattr(core.FrictionReading, name)
