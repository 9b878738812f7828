# SPDX-License-Identifier: Apache-2.0
"""The tissue's Young modulus from a uniaxial tension curve: nominal stress over stretch, incompressible laws.

Incompressibility is assumed, so tension cannot give the Poisson ratio. Laws: Treloar 1975; Mooney 1940; Yeoh 1993;
Ogden 1972.
"""

from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from .statistics.regression import least_squares

# law -> the columns whose weighted sum is the nominal stress, and the weights that make E of the coefficients
_BASES = {
    "linear": (lambda s: [s - 1.0], (1.0,)),
    "neo_hookean": (lambda s: [s - s**-2], (3.0,)),
    "mooney": (lambda s: [2.0 * (s - s**-2), 2.0 * (s - s**-2) / s], (6.0, 6.0)),
    "yeoh": (lambda s: [2.0 * (s - s**-2) * k * (s**2 + 2.0 / s - 3.0) ** (k - 1) for k in (1, 2, 3)], (6.0, 0.0, 0.0)),
}
LAWS = tuple(_BASES)


@dataclass(frozen=True, eq=False)
class Tension:
    """E [Pa] at no strain with its 95 % interval, the law and its coefficients [Pa], and the readings used."""

    young_modulus: float
    low: float
    high: float
    law: str
    coefficients: np.ndarray
    used: np.ndarray


def nominal_stress(law: str, stretch, coefficients) -> np.ndarray:
    """Nominal stress [Pa] at ``stretch`` (any shape, > 0) for the coefficients [Pa] of one of ``LAWS``, or of "ogden".

    Coefficients: linear E; neo_hookean mu; mooney C10, C01; yeoh C10, C20, C30; ogden mu_1, alpha_1, mu_2, alpha_2, …
    in the convention W = sum mu_p/alpha_p (sum lambda^alpha_p - 3), whose E is 3/2 sum mu_p alpha_p.
    """
    stretch = np.asarray(stretch, float)
    if law == "ogden":
        pairs = zip(coefficients[::2], coefficients[1::2])
        return sum(mu * (stretch ** (alpha - 1.0) - stretch ** (-0.5 * alpha - 1.0)) for mu, alpha in pairs)
    basis, _ = _BASES[_known(law)]
    return sum(c * column for c, column in zip(coefficients, basis(stretch), strict=True))


def tissue_modulus(stretch, stress, *, law: str = "neo_hookean", largest_strain: float = 0.3) -> Tension:
    """Least squares of one law to the readings (n,) with |stretch - 1| <= ``largest_strain``; E is its initial slope.

    ``stress`` is nominal, [Pa]. Raises InputError with too few readings or a law that softens on the data (dP/dstretch
    <= 0).
    """
    basis, weights = _BASES[_known(law)]
    stretch, stress = np.asarray(stretch, float), np.asarray(stress, float)
    used = np.abs(stretch - 1.0) <= largest_strain
    if used.sum() <= len(weights) + 1:
        raise InputError(
            "tension readings",
            int(used.sum()),
            f"too few with a strain below {largest_strain:g}",
            next_step="Give more readings at small strain.",
        )
    coefficients, covariance, t = least_squares(np.column_stack(basis(stretch[used])), stress[used])
    _stable(law, coefficients, stretch[used])
    weights = np.array(weights)
    modulus, error = float(weights @ coefficients), t * float(np.sqrt(weights @ covariance @ weights))
    return Tension(modulus, modulus - error, modulus + error, law, coefficients, used)


def _known(law: str) -> str:
    if law not in _BASES:
        raise InputError("tension law", repr(law), "not known", next_step=f"Give one of {', '.join(LAWS)}.")
    return law


def _stable(law: str, coefficients: np.ndarray, stretch: np.ndarray) -> None:
    """Drucker: a law that softens where it was fitted cannot be this material."""
    fine = np.linspace(stretch.min(), stretch.max(), 200)
    if (np.diff(nominal_stress(law, fine, coefficients)) <= 0).any():
        raise InputError("tension law", law, "softens within the readings", next_step="Choose a law with fewer terms.")
