# SPDX-License-Identifier: Apache-2.0
"""Reduced modulus and hardness from the unloading of an indentation (Oliver & Pharr 1992), and whether the depth goes
back, without which the loading curve gives no elastic modulus."""

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..display.quantities import percent, plain
from ..display.tables import in_words
from ..errors import InputError
from ..models.parameter_units import UNITS
from .estimates import Estimate, EstimateResult
from .indentation import IndentationFit, checked_options
from .statistics.noise import TWO_SIDED, noise_of
from .statistics.regression import inverse

USED_SHARES, UPPER_SHARES = (0.25, 0.95), (0.5, 0.95)  # of the largest force: the unloading that is fitted
MIN_UNLOADING_SAMPLES = 10
MAX_EXPONENT = 10.0
STANDARD_EPSILON = 0.75  # of ISO 14577 for every tip but a flat one
REMARKABLE_SHARE, PLASTIC_SHARE = 0.1, 0.5  # of the depth that does not go back: noted, and no elastic loading


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class UnloadingFit(EstimateResult):
    """Fit of F = F_max (1 + S (depth - depth_max)/(m F_max))^m to the unloading.

    Attributes
    ----------
    tip : Tip
        The tip, one of ``nf.tips``, whose profile is the area function.
    parameters : dict of str to Estimate
        ``reduced_modulus`` = S sqrt(pi/A)/(2 beta) and ``hardness`` = F_max/A [Pa] at the contact area A of the contact
        height depth_max - epsilon F_max/S; ``unloading_stiffness`` S [N/m]; ``residual_depth`` [m] without force, from
        the contact; ``young_modulus`` [Pa] with a Poisson ratio.
    exponent : float
        m [1].
    contact_height : float
        Height of the contact's edge above the deepest point of the tip [m].
    residual : numpy.ndarray
        Measured minus fitted force (n,) [N] of the samples used.
    residual_share : float
        Residual depth over the largest one [1].
    """

    tip: Any
    parameters: dict[str, Estimate]
    exponent: float
    contact_height: float
    residual: np.ndarray = field(repr=False)
    residual_share: float

    def _heading(self) -> str:
        return f"UnloadingFit: {in_words(self.tip)}"

    def document(self) -> dict:
        """The numbers for JSON."""
        found = {"exponent": self.exponent, "contact_height_m": self.contact_height}
        return {**super().document(), **found, "residual_share": self.residual_share}


def fit_unloading(
    depth: ArrayLike,
    force: ArrayLike,
    tip: Any,
    *,
    contact_depth: float = 0.0,
    poisson_ratio: float | None = None,
    shape_factor: float = 1.0,
) -> UnloadingFit:
    """Reduced modulus and hardness from the unloading of an indentation.

    Parameters
    ----------
    depth, force : array_like
        Depth (n,) [m] and force (n,) [N] above its baseline, in the order of time, from the largest depth on.
    tip : Tip
        One of ``nf.tips``.
    contact_depth : float
        Depth of the surface [m].
    poisson_ratio : float, optional
        Of the sample; with it ``young_modulus`` = E_r (1 - nu²) is given too, for a tip that is rigid.
    shape_factor : float
        beta [1] of the unloading slope: 1 for axial symmetry, 1.034 for a Berkovich pyramid.

    Returns
    -------
    UnloadingFit

    Raises
    ------
    InputError
        For an unloading that is too short, or whose force does not fall with the depth.

    Notes
    -----
    The power law is fitted to the forces from 25 to 95 % of the largest. epsilon is that of the elastic contact whose
    force has the exponent m: of a tip of height B r^n, m = 1 + 1/n and
    epsilon = m (1 - Gamma(n/2 + 1/2)/(sqrt(pi) Gamma(n/2 + 1))), 0.75 for a paraboloid, 0.727 for a cone and 1 for a
    flat end (Sneddon 1965). Intervals have the noise, by how much the upper half of the forces alone differs, and the
    difference to the usual epsilon of 0.75; pile-up at the edge of the contact, creep during the unloading, compliance
    of the machine and blunting of the tip are not in them.
    """
    tissue = checked_options(poisson_ratio, "none")
    h, f = np.asarray(depth, float) - contact_depth, np.asarray(force, float)
    if not shape_factor > 0.0:
        raise InputError(
            "shape_factor", shape_factor, "it must be above 0", next_step="Give 1, or 1.034 for Berkovich."
        )
    law = _power_law(h, f, USED_SHARES)
    upper = _power_law(h, f, UPPER_SHARES, needed=False) or law
    names = ("reduced_modulus", "hardness", "unloading_stiffness", "residual_depth")
    results = _results(law.values, law.deepest, tip, shape_factor)
    others = _results(upper.values, upper.deepest, tip, shape_factor)
    standard = _results(law.values, law.deepest, tip, shape_factor, epsilon=STANDARD_EPSILON)
    steps = 1e-4 * np.abs(law.values)
    slopes = [(_results(law.values + np.eye(3)[k] * steps[k], law.deepest, tip, shape_factor) - results) / steps[k]
              for k in range(3)]  # fmt: skip
    errors = np.sqrt(np.einsum("ki,kl,li->i", np.array(slopes), law.covariance, np.array(slopes)))
    halves = np.hypot(np.hypot(TWO_SIDED * errors, others - results), standard - results)
    found = {name: _estimate(name, *each, tip) for name, *each in zip(names, results, halves)}
    if tissue is not None:
        factor = 1.0 / tissue.plane_strain_modulus
        e = found["reduced_modulus"]
        scaled = {"value": factor * e.value, "low": factor * e.low, "high": factor * e.high, "identifiable": False}
        source = f"reduced modulus of the unloading and a Poisson ratio of {tissue.poisson_ratio:g}"
        found["young_modulus"] = replace(e, name="young_modulus", source=source, **scaled)
    height = law.deepest - _epsilon(law.values[2]) * law.values[0] / law.values[1]
    return UnloadingFit(tip=tip, parameters=found, exponent=float(law.values[2]), contact_height=float(height),
                        residual=law.residual, residual_share=float(results[3]) / law.deepest)  # fmt: skip


@dataclass(frozen=True, eq=False, kw_only=True)
class _PowerLaw:
    """Largest force [N], unloading stiffness [N/m] and exponent as ``values`` (3,) with their ``covariance``, the
    ``deepest`` depth from the surface [m], and the ``residual`` (n,) [N]."""

    values: np.ndarray
    covariance: np.ndarray
    deepest: float
    residual: np.ndarray


def _power_law(h: np.ndarray, f: np.ndarray, shares: tuple[float, float], *, needed: bool = True) -> _PowerLaw | None:
    """The least squares between two shares of the largest force; None for too few samples that are not ``needed``."""
    from scipy.optimize import least_squares

    top, deepest = float(f[:MIN_UNLOADING_SAMPLES].max()), float(h.max())
    begin, end = (int(np.argmax(f < share * top)) if (f < share * top).any() else len(f) for share in shares[::-1])
    x, y = h[begin:end] - deepest, f[begin:end]
    if len(x) < MIN_UNLOADING_SAMPLES or not (f < shares[0] * top).any():
        if not needed:
            return None
        limit = f"at least {MIN_UNLOADING_SAMPLES} from 95 to 25 % of the largest force are needed"
        raise InputError("samples of the unloading", len(x), limit, next_step="Record the complete unloading.")
    slope = float(np.polyfit(x, y, 1)[0])
    if not (slope > 0.0 and top > 0.0 and deepest > 0.0):
        raise InputError("force", "not falling with the depth in the unloading", next_step="Check the signs.")
    size = np.array([top, slope, 1.0])

    def residual(z: np.ndarray) -> np.ndarray:
        largest, stiffness, m = z * size
        return (largest * np.maximum(1.0 + stiffness * x / (m * largest), 1e-12) ** m - y) / top

    low, high = [0.1, 1e-2, 1.0], [10.0, 1e3, MAX_EXPONENT]
    fit = least_squares(
        residual, [1.0, 1.5, 1.5], bounds=(low, high), x_scale="jac", xtol=1e-12, ftol=1e-13, gtol=1e-13
    )
    noise = noise_of(-fit.fun, len(y), lost=3)  # of a share of the largest force: it may be nanonewtons
    covariance = noise.long_run * inverse(fit.jac.T @ fit.jac) * np.outer(size, size)
    return _PowerLaw(values=fit.x * size, covariance=covariance, deepest=deepest, residual=-top * fit.fun)


def _epsilon(exponent: float) -> float:
    """Depth of the surface's edge below its level in units of F_max/S, of an elastic contact with that exponent."""
    if exponent <= 1.0 + 1e-3:
        return 1.0
    n = 1.0 / (exponent - 1.0)
    return exponent * (1.0 - math.exp(math.lgamma(0.5 * n + 0.5) - math.lgamma(0.5 * n + 1.0)) / math.sqrt(math.pi))


def _results(
    values: np.ndarray, deepest: float, tip: Any, shape_factor: float, *, epsilon: float | None = None
) -> np.ndarray:
    """Reduced modulus, hardness, unloading stiffness and residual depth (4,)."""
    largest, stiffness, exponent = values
    share = _epsilon(exponent) if epsilon is None else epsilon
    area = math.pi * contact_radius(tip, deepest - share * largest / stiffness) ** 2
    reduced = stiffness * math.sqrt(math.pi / area) / (2.0 * shape_factor)
    return np.array([reduced, largest / area, stiffness, deepest - exponent * largest / stiffness])


def contact_radius(tip: Any, height: float) -> float:
    """The radius [m] at which the tip has the ``height`` [m] above its deepest point. Raises InputError beyond it."""
    from scipy.optimize import brentq

    flat = float(tip.flat) if tip.flat else 0.0
    if height <= 0.0 and flat == 0.0:
        limit = "the contact must be deeper than the surface bends down"
        raise InputError("contact height", height, limit, next_step="Check the contact depth and the tip.")
    if flat >= tip.end or height <= 0.0:
        return flat
    high = min(tip.end, max(flat, height))
    while high < tip.end and float(tip.height(high)) < height:
        high = min(2.0 * high, tip.end)
    if float(tip.height(high)) < height:
        return high
    return float(brentq(lambda radius: float(tip.height(radius)) - height, flat, high, xtol=1e-12 * high, rtol=1e-14))


def _estimate(name: str, value: float, half: float, tip: Any) -> Estimate:
    source = f"unloading (Oliver & Pharr), rigid tip {in_words(tip)}"
    low, high = float(value - half), float(value + half)
    positive = low > 0.0 or name == "residual_depth"
    return Estimate(name, float(value), UNITS[name], low, high, identifiable=positive, source=source)


def judged_by_unloading(fit: IndentationFit, unloading: UnloadingFit) -> IndentationFit:
    """The fit of the loading, with a note if a tenth of the depth does not go back, and without an identifiable modulus
    if half of it does not."""
    residual = unloading.parameters["residual_depth"]
    deepest = residual.value / unloading.residual_share if unloading.residual_share else math.inf
    if residual.low < REMARKABLE_SHARE * deepest:
        return fit
    note = (
        f"The unloading ends without force at {plain(residual.value, 'm')} of {plain(deepest, 'm')}: "
        f"{percent(unloading.residual_share)} of the depth does not go back, as of a plastic or slow material. The "
        "loading curve then does not give the elastic modulus; that of the unloading is given too."
    )
    parameters = dict(fit.parameters)
    if unloading.residual_share > PLASTIC_SHARE:
        parameters["reduced_modulus"] = replace(parameters["reduced_modulus"], identifiable=False)
    return replace(fit, parameters=parameters, notes=(note, *fit.notes))
