# SPDX-License-Identifier: Apache-2.0
"""The fit of one cycle as values: parameters with intervals, samples of the puncture, residuals; and its estimates."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ...models.parameter_units import UNITS
from ..estimates import Estimate, is_meaningful
from ..statistics.noise import TWO_SIDED, DriftEffect, Noise
from .loading_curves import CURVES, FITS

ALSO_ESTIMATED = (
    "contact_depth",
    "puncture_depth",
    "puncture_indentation",
    "puncture_force",
    "friction_per_length",
    "cutting_force",
    "force_offset",
    "settlement_ratio",
    "deflection_length",
    "friction_bend",
)
"""Estimates of a cycle, in their order, after those of its loading curve."""


@dataclass(frozen=True, eq=False, kw_only=True)
class CycleOptions:
    """How a cycle is fitted.

    ``law`` is ``cone`` or ``cone_cylinder``, whose ``saturation_depth`` [m] is fitted if it is None.
    ``puncture_window`` [m] limits the puncture depth.

    ``filter_length`` is that of the average filter in samples, 1 if none. The filter smears both steps: as many samples
    on each side of them are left out. It also delays the force by (filter_length - 1) / 2 samples; depths must be
    shifted before. If they are not, with d the travel in that delay, z0 and z1 are too deep by d, and the withdrawal's
    force is 2 d too shallow compared with them: a misfit of 2 d f', which biases f' and f_c.

    ``depth_noise`` [m], a standard deviation, widens the interval of the puncture. The zero's ``drift`` was subtracted
    from the force; its error widens every interval.
    """

    law: str = "cone"
    saturation_depth: float | None = None
    filter_length: int = 1
    puncture_window: tuple[float, float] | None = None
    depth_noise: float = 0.0
    drift: DriftEffect | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class FittedValues:
    """``values`` and, by the same keys, limits ``low``, ``high`` of their intervals, SI."""

    values: dict[str, float]
    low: dict[str, float]
    high: dict[str, float]
    order: tuple[str, ...]
    """Names of the continuous parameters."""
    covariance: np.ndarray
    """(p, p) of these, in their order."""
    widened: bool = False
    """True if errors of the model are in the intervals too, not only noise; see ``model_errors``."""


def limits(values: Mapping[str, float], half: Mapping[str, float]) -> tuple[dict[str, float], dict[str, float]]:
    """The limits of intervals of so many half widths on each side; those without one are the value itself."""
    width = {name: float(half.get(name, 0.0)) for name in values}
    return (
        {name: value - width[name] for name, value in values.items()},
        {name: value + width[name] for name, value in values.items()},
    )


class PunctureSamples(NamedTuple):
    """The puncture as samples of the insertion: ``before`` of them lie before it; at ``LEVEL`` or more it is between
    ``low`` and ``high``. So many are ``left_out`` on each side, at the insertion's end and at the withdrawal's start.
    """

    before: int
    low: int
    high: int
    left_out: int = 0


@dataclass(frozen=True, eq=False, kw_only=True)
class CycleResiduals:
    """Measured minus modelled force [N] of ``insertion`` (n_in,) and ``withdrawal`` (n_out,), of every sample, left out
    or not, and the ``noises`` of both, from the samples used."""

    insertion: np.ndarray
    withdrawal: np.ndarray
    noises: tuple[Noise, Noise]

    @property
    def count(self) -> int:
        """Samples used."""
        return sum(noise.count for noise in self.noises)

    @property
    def sse(self) -> float:
        """The sum of their squared residuals [N²]."""
        return sum(noise.sse for noise in self.noises)

    @property
    def rmse(self) -> float:
        """Their root mean square [N]."""
        return math.sqrt(self.sse / self.count)

    @property
    def noise_correlation_length(self) -> float:
        """[samples] per independent one: long-run over plain variance. 1 is white noise."""
        plain = sum(noise.count * noise.variance for noise in self.noises)
        return sum(noise.count * noise.long_run for noise in self.noises) / plain if plain > 0.0 else 1.0


@dataclass(frozen=True, eq=False, kw_only=True)
class CycleFit(FittedValues):
    """One-layer model of a cycle, its values in SI.

    ``stiffness_coefficient`` c [N/m²], ``contact_depth`` z0 [m], ``saturation_depth`` h_s [m] (inf: bare cone),
    ``friction_per_length`` f' [N/m], ``cutting_force`` f_c [N], ``puncture_depth`` z1 [m],
    ``puncture_indentation`` z1 - z0 [m], ``puncture_force`` c g(z1 - z0) [N], ``force_offset`` b [N], what the sensor
    shows without contact. Depths are in the recording's own zero.
    """

    law: str
    puncture: PunctureSamples
    residuals: CycleResiduals
    warnings: tuple[str, ...]
    saturation_sought: bool = False
    by_stages: bool = False
    """True for a staged fit: first the loading curve, then friction and cutting. False for a complete fit."""
    options: CycleOptions | None = None
    """Of a complete fit, until ``limit_saturation`` has repeated it; None for a staged one."""

    def with_puncture(self, depth: float, half: float) -> "CycleFit":
        """The fit with the puncture at another ``depth`` [m], within ``half`` of it; indentation and force follow."""
        h = depth - self.values["contact_depth"]
        curve = CURVES[self.law]
        slopes = curve.gradient(np.float64(h), self.values)
        by = np.array([float(slopes.get(name, 0.0)) for name in self.order])
        contact = 0.5 * (self.high["contact_depth"] - self.low["contact_depth"])
        by_law = TWO_SIDED * math.sqrt(max(float(by @ self.covariance @ by), 0.0))
        middle = {"puncture_depth": depth, "puncture_indentation": h}
        middle["puncture_force"] = float(curve.force(np.float64(h), self.values))
        widths = {"puncture_depth": half, "puncture_indentation": math.hypot(half, contact)}
        widths["puncture_force"] = math.hypot(by_law, half * float(slopes["contact_depth"]))
        low, high = limits(middle, widths)
        return replace(self, values=self.values | middle, low=self.low | low, high=self.high | high)


def estimates_of(fit: CycleFit, has_withdrawal: bool) -> dict[str, Estimate]:
    """The estimates of one cycle; without a withdrawal, friction and cutting force come from the insertion only."""
    staged = fit.by_stages and not FITS[fit.law].gradual
    source = f"{'staged fit' if staged else 'complete fit'}, {fit.law}" + ("" if has_withdrawal else ", insertion only")
    names = [name for name in (*FITS[fit.law].parameters, *ALSO_ESTIMATED) if name in fit.values]
    return {name: _estimate(name, fit, source) for name in names}


def _estimate(name: str, fit: CycleFit, source: str) -> Estimate:
    limits = fit.values[name], UNITS[name], fit.low[name], fit.high[name]
    return Estimate(name, *limits, identifiable=_is_identifiable(name, fit), source=source)


def _is_identifiable(name: str, fit: CycleFit) -> bool:
    """False for parameters of which only the product is identified, and for an interval that has no meaning."""
    if name in FITS[fit.law].not_distinguishable(fit.values):
        return False
    scales = {"force": fit.values["puncture_force"], "depth": fit.values["puncture_indentation"]}
    return is_meaningful(name, fit.low[name], fit.high[name], **scales)
