# SPDX-License-Identifier: Apache-2.0
"""Loading curves F(h) = sum of a_k phi_k(h; s), zero without contact, that can be fitted; a new one is a value here
and an entry in the list at the end."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ... import core
from ...mechanics.foundation import LAWS

MIN_SATURATION = 0.05  # [of the indentation] a contact that saturates before is a straight line
MIN_EXPONENT = 0.1  # [1] rate times indentation; below, the curve departs from its chord by less than 1 %
POWER, TERMS = ({row["name"]: row for row in law.table()} for law in (core.laws.PowerLaw, core.laws.Polynomial))
UNIT_DEPTH = POWER["reference_depth"]["default"]
RUPTURE = ("rupture_onset", "rupture_length", "rupture_exponent")
"""What a gradual rupture has: the indentation where it begins, and its course, see ``yielding_coulomb``."""


@dataclass(frozen=True, kw_only=True)
class ShapeParameter:
    """A fitted shape parameter: starts, lower and upper limit, all times indentation ** ``power``."""

    power: int
    starts: tuple[float, ...]
    low: float
    high: float


@dataclass(frozen=True, kw_only=True)
class LoadingCurve:
    """A stiffness law in the form of a fit. Functions take h (n,) [m], none below 0, and the shape parameters, SI.

    No amplitude is negative, so that the curve rises. ``basis`` returns phi, one (n,) per amplitude, ``by_depth`` its
    derivatives by h, ``by_shape`` a list of its derivatives for each shape parameter.
    ``stiffness(values, half_angle)`` makes the law; a law with a tip uses the tip's half angle [rad]. ``complete``
    names the law of the complete fit that finds the puncture: its own, or one that approximates most curves.
    ``gives_modulus``: the reduced modulus follows from the parameters and the tip. ``not_distinguishable(values)``
    names the parameters of which only the product is identified at these values, with ``puncture_indentation``.
    ``foundation`` is the form of the foundation along the shaft after the puncture, one of
    ``mechanics.foundation.FORMS``. ``gradual``: the contact ruptures gradually, from an onset on.
    """

    law: type
    amplitudes: tuple[str, ...]
    basis: Callable[..., Sequence]
    by_depth: Callable[..., Sequence]
    stiffness: Callable
    shape: Mapping[str, ShapeParameter] = field(default_factory=dict)
    by_shape: Callable[..., Sequence] = lambda h, *shape: ()
    complete: str = "cone_cylinder"
    gives_modulus: bool = False
    not_distinguishable: Callable[[Mapping[str, float]], tuple[str, ...]] = lambda values: ()
    foundation: str = "linear"
    gradual: bool = False

    @property
    def parameters(self) -> tuple[str, ...]:
        """The names of all parameters."""
        return (*self.amplitudes, *self.shape, *(RUPTURE if self.gradual else ()))

    def force(self, h: np.ndarray, values: Mapping[str, float]) -> np.ndarray:
        """F [N], shaped as h [m]; 0 below 0."""
        return self._sum(values, self.basis(np.maximum(h, 0.0), *self._shape(values)))

    def gradient(self, h: np.ndarray, values: Mapping[str, float]) -> dict[str, np.ndarray]:
        """Derivatives of F(z - z0) by each parameter and by ``contact_depth`` z0, each shaped as h; 0 below 0."""
        h, shape = np.maximum(h, 0.0), self._shape(values)
        found = dict(zip(self.amplitudes, self.basis(h, *shape)))
        found["contact_depth"] = -self._sum(values, self.by_depth(h, *shape))
        return found | {name: self._sum(values, each) for name, each in zip(self.shape, self.by_shape(h, *shape))}

    def _shape(self, values: Mapping[str, float]) -> list[float]:
        return [values[name] for name in self.shape]

    def _sum(self, values: Mapping[str, float], parts: Sequence) -> np.ndarray:
        return sum(values[name] * part for name, part in zip(self.amplitudes, parts))


def _modulus(values: Mapping[str, float], half_angle: float) -> float:
    """Reduced modulus [Pa] of a cone."""
    return 0.5 * math.pi * values["stiffness_coefficient"] / math.tan(half_angle)


def _cone(values: Mapping[str, float], half_angle: float) -> Any:
    return core.laws.Cone(_modulus(values, half_angle), half_angle)


def _cone_cylinder(values: Mapping[str, float], half_angle: float) -> Any:
    saturation = values["saturation_depth"]
    if not math.isfinite(saturation):
        return _cone(values, half_angle)
    radius = 2.0 * saturation * math.tan(half_angle) / math.pi
    return core.laws.ConeCylinder(_modulus(values, half_angle), half_angle, radius)


CONE = LoadingCurve(
    law=core.laws.Cone,
    amplitudes=("stiffness_coefficient",),
    basis=lambda h: (h * h,),
    by_depth=lambda h: (2.0 * h,),
    stiffness=_cone,
    complete="cone",
    gives_modulus=True,
)
"""c h^2: a quadratic with its vertex at the contact, the paper's."""

CONE_CYLINDER = LoadingCurve(
    law=core.laws.ConeCylinder,
    amplitudes=("stiffness_coefficient",),
    shape={
        "saturation_depth": ShapeParameter(
            power=1,
            starts=(0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.85, 1.0, 1.5),
            low=0.002,
            high=3.0,
        )
    },
    basis=lambda h, s: (np.minimum(h, s) * (2.0 * h - np.minimum(h, s)),),
    by_depth=lambda h, s: (2.0 * np.minimum(h, s),),
    by_shape=lambda h, s: ((2.0 * (h - np.minimum(h, s)),),),
    stiffness=_cone_cylinder,
    complete="cone_cylinder",
    gives_modulus=True,
    not_distinguishable=lambda values: (
        ("stiffness_coefficient", "saturation_depth")
        if values["saturation_depth"] < MIN_SATURATION * values["puncture_indentation"]
        else ()
    ),
)
"""c h^2 up to the saturation depth h_s, then c (2 h_s h - h_s^2); h_s may be infinite."""

POWER_LAW = LoadingCurve(
    law=core.laws.PowerLaw,
    amplitudes=("reference_force",),
    shape={
        "exponent": ShapeParameter(
            power=0,
            starts=(1.05, 1.3, 1.6, 2.0, 2.5, 3.5, 5.0),
            low=POWER["exponent"]["low"],
            high=POWER["exponent"]["high"],
        )
    },
    basis=lambda h, n: ((h / UNIT_DEPTH) ** n,),
    by_depth=lambda h, n: (np.where(h > 0.0, n * (h / UNIT_DEPTH) ** (n - 1.0), 0.0) / UNIT_DEPTH,),
    by_shape=lambda h, n: (((h / UNIT_DEPTH) ** n * np.log(np.where(h > 0.0, h / UNIT_DEPTH, 1.0)),),),
    stiffness=lambda values, _: core.laws.PowerLaw(values["reference_force"], values["exponent"], UNIT_DEPTH),
)
"""F_1 (h / 1 mm)^n."""

POLYNOMIAL = LoadingCurve(
    law=core.laws.Polynomial,
    amplitudes=("linear", "quadratic"),
    basis=lambda h: (h, h * h),
    by_depth=lambda h: (np.where(h > 0.0, 1.0, 0.0), 2.0 * h),
    # the law requires a slope at contact; its lower limit is far below the resolution of any sensor
    stiffness=lambda values, _: core.laws.Polynomial(
        max(values["linear"], TERMS["linear"]["low"]), values["quadratic"]
    ),
)
"""a_1 h + a_2 h^2."""

EXPONENTIAL = LoadingCurve(
    law=core.laws.Exponential,
    amplitudes=("scale",),
    shape={
        "rate": ShapeParameter(
            power=-1, starts=(0.03, 0.3, 1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0), low=1e-3, high=30.0
        )
    },
    basis=lambda h, a: (np.expm1(a * h),),
    by_depth=lambda h, a: (np.where(h > 0.0, a * np.exp(a * h), 0.0),),
    by_shape=lambda h, a: ((h * np.exp(a * h),),),
    stiffness=lambda values, _: core.laws.Exponential(values["rate"], values["scale"]),
    not_distinguishable=lambda values: (
        ("scale", "rate") if values["rate"] * values["puncture_indentation"] < MIN_EXPONENT else ()
    ),
)
"""b (exp(a h) - 1)."""

CURVES = {each.law.name: each for each in (CONE, CONE_CYLINDER, POWER_LAW, POLYNOMIAL, EXPONENTIAL)}
"""By the name of the law."""
GRADUAL = {f"gradual_{each.law.name}": replace(each, gradual=True) for each in (CONE, CONE_CYLINDER, POWER_LAW)}
"""The curves of one amplitude with a gradual rupture, by the name of what is fitted."""
FITS = CURVES | {law: replace(CONE_CYLINDER, foundation=form) for form, law in LAWS.items()} | GRADUAL
"""By the name of what is fitted: a law, with friction in proportion to the embedded length; the friction law of a
nonlinear foundation, which follows a cone + cylinder; or a law with a gradual rupture."""
