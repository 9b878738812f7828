# SPDX-License-Identifier: Apache-2.0
"""Materials of a solid: linear elastic, neo-Hookean, Mooney-Rivlin."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..checks import DENSITY, MODULUS, above_zero, in_range
from ..errors import InputError

_MAX_RATIO = 0.49999
BULK_RATIO = 1000.0
"""Bulk modulus per shear modulus where none is given: a Poisson's ratio of 0.4995."""
_MIN_BULK_RATIO, _MAX_BULK_RATIO = 2.0 / 3.0, 1e6  # a Poisson's ratio of 0; rounding


def check_labels(labels: object, known: Collection[str] | None = None) -> None:
    """Raise InputError for what are no names of layers, each once, or not known ones."""
    if isinstance(labels, str) or not isinstance(labels, Sequence) or len(set(labels)) < len(labels):
        step = 'Give labels=("skin", "fat").'
        raise InputError("labels", repr(labels)[:60], "must be names, each once", next_step=step)
    for label in labels if known is not None else ():
        if label not in known:
            raise InputError("label", label, f"the mesh has {list(known)}")


def by_label(labels: np.ndarray, materials: Any, kind: Any, example: str) -> dict[str, Any]:
    """A material for each label of cells (m,): one of all, or of a mapping. Raises InputError for a label without one,
    or what is of another kind."""
    names = [str(label) for label in np.unique(labels.astype(str))]
    given = materials if isinstance(materials, Mapping) else dict.fromkeys(names, materials)
    for name in (*names, *given):
        quantity, step = f"material of label {name!r}", f"Give one in materials={{{name!r}: {example}}}."
        if name not in given:
            raise InputError(quantity, "missing", f"the mesh has {names}", next_step=step)
        if not isinstance(given[name], kind):
            raise InputError(quantity, type(given[name]).__name__, f"must be {example}", next_step=step)
    return {name: given[name] for name in names}


def _ratio(value: float) -> None:
    if 0.0 <= value <= _MAX_RATIO:
        return
    step = "Use 0.4999: displacements differ by less than 0.1 %."
    if value != value or value > 0.5 or value < 0.0:
        step = "Soft tissue is at 0.45 to 0.4999."
    raise InputError("poisson_ratio", value, f"must be 0 to {_MAX_RATIO}", next_step=step)


@dataclass(frozen=True)
class Elastic:
    """Linear elastic, isotropic.

    Parameters
    ----------
    young_modulus : float
        [Pa], above 0.
    poisson_ratio : float
        0 to 0.49999; elements do not lock there.
    density : float, optional
        [kg/m^3], for dynamics.

    Raises
    ------
    InputError
        If a value is out of its range.
    """

    young_modulus: float
    poisson_ratio: float = 0.49
    density: float = 1000.0

    def __post_init__(self) -> None:
        in_range("young_modulus", above_zero("young_modulus", self.young_modulus, "Pa"), MODULUS, "Give it in Pa.")
        in_range("density", above_zero("density", self.density, "kg/m^3"), DENSITY, "Give it in kg/m^3.")
        _ratio(self.poisson_ratio)

    @property
    def shear_modulus(self) -> float:
        """[Pa]"""
        return self.young_modulus / (2.0 * (1.0 + self.poisson_ratio))

    @property
    def lame_modulus(self) -> float:
        """Lamé's first constant [Pa]."""
        nu = self.poisson_ratio
        return self.young_modulus * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))


@dataclass(frozen=True)
class NeoHookean:
    """Energy ``G / 2 (I1 - 3)``: stretch without a stiffening of the chains.

    Parameters
    ----------
    shear_modulus : float
        G [Pa], above 0: a third of Young's modulus at small strain.
    bulk_modulus : float, optional
        K [Pa], 2/3 to 1e6 times G. Default: 1000 G.

    Raises
    ------
    InputError
        If a value is out of its range.
    """

    shear_modulus: float
    bulk_modulus: float | None = None

    def __post_init__(self) -> None:
        in_range("shear_modulus", above_zero("shear_modulus", self.shear_modulus, "Pa"), MODULUS, "Give it in Pa.")
        object.__setattr__(self, "bulk_modulus", _bulk(self.bulk_modulus, self.shear_modulus))

    @property
    def coefficients(self) -> tuple[float, float]:
        """c10 and c01 [Pa]."""
        return 0.5 * self.shear_modulus, 0.0

    @classmethod
    def of(cls, material: Elastic) -> "NeoHookean":
        """The material that is linear elastic ``material`` at small strain."""
        return cls(material.shear_modulus, material.lame_modulus + 2.0 / 3.0 * material.shear_modulus)


@dataclass(frozen=True)
class MooneyRivlin:
    """Energy ``c10 (I1 - 3) + c01 (I2 - 3)``.

    Parameters
    ----------
    c10, c01 : float
        [Pa]; their sum, half of the shear modulus, is above 0. One below 0 makes the material unstable at some stretch.
    bulk_modulus : float, optional
        K [Pa], 2/3 to 1e6 times the shear modulus. Default: 1000 times.

    Raises
    ------
    InputError
        If a value is out of its range.
    """

    c10: float
    c01: float
    bulk_modulus: float | None = None

    def __post_init__(self) -> None:
        in_range("c10 + c01", above_zero("c10 + c01", self.c10 + self.c01, "Pa"), MODULUS, "Give them in Pa.")
        object.__setattr__(self, "bulk_modulus", _bulk(self.bulk_modulus, self.shear_modulus))

    @property
    def shear_modulus(self) -> float:
        """At small strain [Pa]."""
        return 2.0 * (self.c10 + self.c01)

    @property
    def coefficients(self) -> tuple[float, float]:
        """c10 and c01 [Pa]."""
        return self.c10, self.c01


Hyperelastic = NeoHookean | MooneyRivlin


def _bulk(value: float | None, shear: float) -> float:
    ratio = BULK_RATIO if value is None else value / shear
    if not _MIN_BULK_RATIO <= ratio <= _MAX_BULK_RATIO:
        limit = f"must be {_MIN_BULK_RATIO * shear:.4g} to {_MAX_BULK_RATIO * shear:.4g} Pa for this shear modulus"
        step = "Use 1000 times the shear modulus: larger ones hardly change displacements."
        raise InputError("bulk_modulus", f"{value} Pa", limit, next_step=step)
    return ratio * shear


def isochoric_stress(deformation: np.ndarray, c10: np.ndarray, c01: np.ndarray) -> np.ndarray:
    """First Piola-Kirchhoff stress without the part of the bulk modulus, (n, 3, 3) [Pa]: the derivative of the energy
    with respect to the deformation gradient F (n, 3, 3), for moduli (n,) [Pa]."""
    first, second, volume = _invariants(deformation)
    inverse = np.linalg.inv(deformation).transpose(0, 2, 1)
    total = _scaled(2.0 * c10 * volume ** (-2.0 / 3.0), deformation - _scaled(first / 3.0, inverse))
    if np.any(c01):
        share = _of_second(deformation, first) - _scaled(4.0 / 3.0 * second, inverse)
        total += _scaled(c01 * volume ** (-4.0 / 3.0), share)
    return total


def isochoric_tangent(deformation: np.ndarray, c10: np.ndarray, c01: np.ndarray) -> np.ndarray:
    """Derivative of ``isochoric_stress`` with respect to F, (n, 3, 3, 3, 3) [Pa]; parameters likewise."""
    first, second, volume = _invariants(deformation)
    inverse = np.linalg.inv(deformation).transpose(0, 2, 1)
    turned = _turned(inverse, inverse)
    unit = np.broadcast_to(np.einsum("ik,jl->ijkl", np.eye(3), np.eye(3)), turned.shape)
    share = deformation - _scaled(first / 3.0, inverse)
    inner = unit + _scaled(first / 3.0, turned)
    inner = inner - 2.0 / 3.0 * (_outer(share, inverse) + _outer(inverse, deformation))
    total = _scaled(2.0 * c10 * volume ** (-2.0 / 3.0), inner)
    if np.any(c01):
        slope = _of_second(deformation, first)
        inner = _curvature_of_second(deformation, first, unit) + _scaled(4.0 / 3.0 * second, turned)
        share = slope - _scaled(4.0 / 3.0 * second, inverse)
        inner = inner - 4.0 / 3.0 * (_outer(share, inverse) + _outer(inverse, slope))
        total += _scaled(c01 * volume ** (-4.0 / 3.0), inner)
    return total


def cofactor(deformation: np.ndarray, volume: np.ndarray) -> np.ndarray:
    """Derivative of ``J = det F`` with respect to F, (n, 3, 3)."""
    return _scaled(volume, np.linalg.inv(deformation).transpose(0, 2, 1))


def cofactor_tangent(slope: np.ndarray, volume: np.ndarray) -> np.ndarray:
    """Derivative of ``slope``, the cofactor, with respect to F, (n, 3, 3, 3, 3)."""
    return _scaled(1.0 / volume, _outer(slope, slope) - _turned(slope, slope))


def _invariants(deformation: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """I1, I2 of F^T F, and det F."""
    cauchy = deformation.transpose(0, 2, 1) @ deformation
    first = np.trace(cauchy, axis1=1, axis2=2)
    return first, 0.5 * (first**2 - np.sum(cauchy**2, axis=(1, 2))), np.linalg.det(deformation)


def _of_second(deformation: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Derivative of I2 with respect to F."""
    cauchy = deformation.transpose(0, 2, 1) @ deformation
    return 2.0 * (_scaled(first, deformation) - deformation @ cauchy)


def _curvature_of_second(deformation: np.ndarray, first: np.ndarray, unit: np.ndarray) -> np.ndarray:
    """Second derivative of I2 with respect to F."""
    cauchy = deformation.transpose(0, 2, 1) @ deformation
    left = deformation @ deformation.transpose(0, 2, 1)
    inner = 2.0 * _outer(deformation, deformation) + _scaled(first, unit) - _turned(deformation, deformation)
    inner = inner - np.einsum("ik,nlj->nijkl", np.eye(3), cauchy)
    return 2.0 * (inner - np.einsum("nik,jl->nijkl", left, np.eye(3)))


def _scaled(factor: np.ndarray, tensors: np.ndarray) -> np.ndarray:
    return factor.reshape(-1, *[1] * (tensors.ndim - 1)) * tensors


def _outer(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """left_ij right_kl"""
    return left[:, :, :, None, None] * right[:, None, None]


def _turned(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """left_il right_kj"""
    return np.einsum("nil,nkj->nijkl", left, right)
