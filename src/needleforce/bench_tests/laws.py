# SPDX-License-Identifier: Apache-2.0
"""Stress-stretch laws of incompressible tissue in three loading modes, and the stretches over which they are stable.

All modes are one family of paths: the stretches along the three axes are lambda, lambda^t and lambda^(-1-t), with t of
``MODES``. For an energy W(I1, I2) the nominal stress is then P = 2 (lambda - lambda^(-3-2t)) (W1 + lambda^(2t) W2).
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError

MODES = {"uniaxial": -0.5, "equibiaxial": 1.0, "planar": 0.0}
"""Loading mode -> t; planar is pure shear: the width is held."""

_HESSIAN_STEP = 1e-3  # of the logarithmic strain: rounding 1e-10 and truncation 1e-6 of the second derivative
_SCAN_POINTS = 400  # at which stability is tested: an unstable stretch of 1/400 of the range may be missed
_SCAN_MARGIN = 1.0  # [of the logarithmic range of the readings] tested beyond them
_SMALL_EXPONENT = 1e-6  # an Ogden exponent nearer to 0 is taken as so large: the limit is a logarithm


class Law(NamedTuple):
    """A law whose stress is a sum of columns: ``columns(stretch, t)`` with a coefficient each.

    ``weights`` give the initial Young modulus as the sum of weights times coefficients; ``names`` are those of the
    coefficients.
    """

    names: tuple[str, ...]
    weights: tuple[float, ...]
    columns: Callable[[np.ndarray, np.ndarray], list[np.ndarray]]


def _linear(stretch: np.ndarray, t: np.ndarray) -> list[np.ndarray]:
    return [initial_stiffness(t) * (stretch - 1.0)]


def _neo_hookean(stretch: np.ndarray, t: np.ndarray) -> list[np.ndarray]:
    return [_shape(stretch, t)]


def _mooney_rivlin(stretch: np.ndarray, t: np.ndarray) -> list[np.ndarray]:
    return [2.0 * _shape(stretch, t), 2.0 * _shape(stretch, t) * stretch ** (2.0 * t)]


def _yeoh(stretch: np.ndarray, t: np.ndarray) -> list[np.ndarray]:
    excess = stretch**2 + stretch ** (2.0 * t) + stretch ** (-2.0 - 2.0 * t) - 3.0
    return [2.0 * k * _shape(stretch, t) * excess ** (k - 1) for k in (1, 2, 3)]


def _shape(stretch: np.ndarray, t: np.ndarray) -> np.ndarray:
    return stretch - stretch ** (-3.0 - 2.0 * t)


SUMS = {
    "linear": Law(("E",), (1.0,), _linear),
    "neo_hookean": Law(("mu",), (3.0,), _neo_hookean),
    "mooney_rivlin": Law(("C10", "C01"), (6.0, 6.0), _mooney_rivlin),
    "yeoh": Law(("C10", "C20", "C30"), (6.0, 0.0, 0.0), _yeoh),
}
OGDEN = {"ogden_1": 1, "ogden_2": 2, "ogden_3": 3}
"""Law -> number of terms."""
LAWS = (*SUMS, *OGDEN)
ALIASES = {"mooney": ("mooney_rivlin",), "ogden": tuple(OGDEN)}


SOURCES = {
    "linear": "by definition: Hooke's law with the Poisson ratio 1/2",
    "neo_hookean": "Rivlin 1948",
    "mooney_rivlin": "Mooney 1940; Rivlin 1948",
    "yeoh": "Yeoh 1993",
    "ogden": "Ogden 1972",
    "tests of rubber": "Treloar 1944",
    "fit of Ogden's law": "Golub & Pereyra 1973",
    "choice": "Hurvich & Tsai 1989; Burnham & Anderson 2002",
    "elastica": "Bisshopp & Drucker 1945",
    "unloading of an indentation": "Oliver & Pharr 1992",
}
"""What the laws, the choice between them, bending and unloading follow, by the keys of the bibliography."""


def initial_stiffness(t: ArrayLike) -> np.ndarray:
    """dP/dlambda at lambda = 1 over the Young modulus [1] of an incompressible tissue: 1, 2 and 4/3 in ``MODES``."""
    return 2.0 / 3.0 * (2.0 + np.asarray(t, float))


def mode_number(mode: str) -> float:
    """t of a loading mode. Raises InputError for one that is not in ``MODES``."""
    if mode not in MODES:
        raise InputError("loading mode", repr(mode), "unknown", next_step=f"Give one of {', '.join(MODES)}.")
    return MODES[mode]


def laws_named(law: str | Sequence[str] | None) -> tuple[str, ...]:
    """The laws of ``LAWS`` that a name, or several, stand for; all for None. Raises InputError for an unknown one."""
    if law is None:
        return LAWS
    names = [law] if isinstance(law, str) else list(law)
    for name in names:
        if name not in LAWS and name not in ALIASES:
            step = f"Give one of {', '.join((*LAWS, *ALIASES))}."
            raise InputError("law of stress and stretch", repr(name), "unknown", next_step=step)
    return tuple(dict.fromkeys(each for name in names for each in ALIASES.get(name, (name,))))


def coefficient_names(law: str) -> tuple[str, ...]:
    """The names of the coefficients of one of ``LAWS``."""
    if law in SUMS:
        return SUMS[law].names
    return tuple(f"{name}_{k}" for k in range(1, OGDEN[law] + 1) for name in ("mu", "alpha"))


def nominal_stress(
    law: str, stretch: ArrayLike, coefficients: Sequence[float] | np.ndarray, mode: str = "uniaxial"
) -> np.ndarray:
    """Nominal stress, force over undeformed area, of an incompressible tissue.

    Parameters
    ----------
    law : str
        One of ``LAWS``, or "ogden" with any number of terms.
    stretch : array_like
        Length over undeformed length [1], above 0, any shape.
    coefficients : sequence of float
        linear: E; neo_hookean: mu; mooney_rivlin: C10, C01; yeoh: C10, C20, C30; all [Pa]. ogden: mu_1, alpha_1, mu_2,
        alpha_2, … in [Pa] and [1].
    mode : str
        "uniaxial", "equibiaxial" or "planar" (pure shear).

    Returns
    -------
    numpy.ndarray
        Stress [Pa], positive in tension.

    Raises
    ------
    InputError
        For an unknown law or mode.

    Notes
    -----
    W = mu/2 (I1 - 3); C10 (I1 - 3) + C01 (I2 - 3), Mooney 1940, Rivlin 1948; sum Ci0 (I1 - 3)^i, Yeoh 1993;
    sum mu_k/alpha_k (lambda_1^alpha_k + lambda_2^alpha_k + lambda_3^alpha_k - 3), Ogden 1972, eqs. (5) and (14).
    E = 3 mu, 6 (C10 + C01), 6 C10, 3/2 sum mu_k alpha_k. "linear" is Hooke's law with the Poisson ratio 1/2.
    """
    stretch, t = np.asarray(stretch, float), np.float64(mode_number(mode))
    if law == "ogden" or law in OGDEN:
        pairs = zip(coefficients[::2], coefficients[1::2], strict=True)
        return sum(mu * alpha * ogden_column(stretch, t, alpha) for mu, alpha in pairs)
    (law,) = laws_named(law)
    return sum(c * column for c, column in zip(coefficients, SUMS[law].columns(stretch, t), strict=True))


def ogden_column(stretch: np.ndarray, t: np.ndarray, alpha: ArrayLike) -> np.ndarray:
    """Stress of one Ogden term over mu alpha: (lambda^alpha - lambda^(-(1+t) alpha)) / (alpha lambda), smooth in
    alpha."""
    alpha = np.where(np.abs(alpha) < _SMALL_EXPONENT, _SMALL_EXPONENT, alpha)
    logarithm = alpha * np.log(stretch)
    return (np.expm1(logarithm) - np.expm1(-(1.0 + t) * logarithm)) / (alpha * stretch)


def ogden_slope(stretch: np.ndarray, t: np.ndarray, alpha: np.ndarray) -> np.ndarray:
    """Derivative of ``ogden_column`` by alpha."""
    logarithm, other = np.log(stretch), (1.0 + t) * np.log(stretch)
    # d/dx of expm1(x b)/x is b^2 g(x b), g(y) = (y e^y - expm1(y))/y^2
    return (logarithm**2 * _curvature(alpha * logarithm) - other**2 * _curvature(-alpha * other)) / stretch


def _curvature(y: np.ndarray) -> np.ndarray:
    """(y e^y - expm1(y))/y^2, by its series where that loses digits; relative error 1e-12."""
    small = np.abs(y) < 1e-2
    safe = np.where(small, 1.0, y)
    series = 0.5 + y * (1 / 3 + y * (1 / 8 + y * (1 / 30 + y * (1 / 144 + y / 840))))
    growth = np.expm1(safe)
    return np.where(small, series, (safe * (growth + 1.0) - growth) / (safe * safe))


def initial_modulus(law: str, coefficients: Sequence[float] | np.ndarray) -> float:
    """Initial Young modulus E = 3 mu_0 [Pa] of one of ``LAWS`` with its coefficients."""
    if law in SUMS:
        return float(np.dot(SUMS[law].weights, coefficients))
    return 1.5 * float(np.dot(coefficients[::2], coefficients[1::2]))


def strain_energy(
    law: str, first: ArrayLike, second: ArrayLike, coefficients: Sequence[float] | np.ndarray
) -> np.ndarray:
    """Strain energy [J/m^3] of an incompressible tissue at two principal stretches; not for "linear", which has none
    at large strain."""
    stretches = np.stack(np.broadcast_arrays(first, second, 1.0 / np.multiply(first, second)))
    if law in OGDEN:
        pairs = zip(coefficients[::2], coefficients[1::2], strict=True)
        # the logarithms sum to 0: without them no digits are lost for a small alpha
        powers = ((mu / alpha, alpha * np.log(stretches)) for mu, alpha in pairs)
        return sum(factor * np.sum(np.expm1(power) - power, axis=0) for factor, power in powers)
    excess = np.sum(stretches**2, axis=0) - 3.0
    if law == "mooney_rivlin":
        return coefficients[0] * excess + coefficients[1] * (np.sum(stretches**-2.0, axis=0) - 3.0)
    if law == "neo_hookean":
        return 0.5 * coefficients[0] * excess
    return sum(c * excess**k for k, c in enumerate(coefficients, 1))


def is_stable(law: str, stretch: ArrayLike, coefficients: Sequence[float] | np.ndarray, mode: str) -> np.ndarray:
    """Whether a law is stable at each stretch (n,): nominal stress that rises, and Drucker's postulate.

    Drucker's postulate for an incompressible material: the second derivatives of the energy by two logarithmic strains
    are positive definite, so that any further strain takes work.
    """
    stretch = np.asarray(stretch, float)
    step = 1e-6 * stretch
    ends = [nominal_stress(law, stretch + sign * step, coefficients, mode) for sign in (1.0, -1.0)]
    rising = ends[0] > ends[1]
    if law == "linear":
        return rising
    strain, h = np.log(stretch), _HESSIAN_STEP
    across = mode_number(mode) * strain

    def energy(one: float, two: float) -> np.ndarray:
        return strain_energy(law, np.exp(strain + one * h), np.exp(across + two * h), coefficients)

    along, other = (energy(1, 0) - 2 * energy(0, 0) + energy(-1, 0)), (energy(0, 1) - 2 * energy(0, 0) + energy(0, -1))
    mixed = 0.25 * (energy(1, 1) - energy(1, -1) - energy(-1, 1) + energy(-1, -1))
    return rising & (along > 0.0) & (along * other > mixed**2)


def stable_range(
    law: str, stretch: np.ndarray, coefficients: Sequence[float] | np.ndarray, mode: str
) -> tuple[float, float]:
    """The stretches around 1 between which a law is stable; 0 or infinity where no end was found.

    Searched over the range of ``stretch`` (n,) and as far again beyond it, in logarithmic strain.
    """
    low, high = min(float(np.log(stretch.min())), 0.0), max(float(np.log(stretch.max())), 0.0)
    reach = _SCAN_MARGIN * (high - low)
    ends = []
    for limit, none in ((low - reach, 0.0), (high + reach, np.inf)):
        path = np.exp(np.linspace(0.0, limit, _SCAN_POINTS))
        stable = is_stable(law, path, coefficients, mode)
        ends.append(none if stable.all() else float(path[max(int(np.argmin(stable)) - 1, 0)]))
    return ends[0], ends[1]
