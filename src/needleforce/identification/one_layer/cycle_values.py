# SPDX-License-Identifier: Apache-2.0
"""The fit of one cycle as values: parameters with intervals, samples of the puncture, residuals; and its estimates."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from ...models.parameter_units import UNITS
from ..estimates import Estimate, is_meaningful
from ..motion import depths_between
from ..statistics.noise import TWO_SIDED, DriftEffect, Noise, likely_punctures, noise_of, sandwich
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
HELD_EXPONENT = "held fixed: a free exponent has no lower BIC"
UNKNOWNS = (
    "stiffness_coefficient",
    "contact_depth",
    "friction_per_length",
    "cutting_force",
    "saturation_depth",
    "force_offset",
)
"""Order of the unknowns in the compiled core: c [N/m²], z0 [m], f' [N/m], f_c [N], h_s [m], b [N]."""

RAMP_QUARTERS = 3
"""[quarters of the filter's length] on each side of a step, which contain its ramp wherever the scan puts it."""


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
    jumps: bool = False
    """At the puncture the tip jumps, as behind a machine that yields: it is punctured where the jump begins."""


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
    systematic: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """How much farther than by noise an interval reaches below and above the value, because the model is in error."""
    causes: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    """By each error of the model that is in the intervals, how far the values move together, at the level of the
    intervals; see ``model_errors``."""
    strokes_alone: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    """By each stroke, how far the values move if it alone decides on friction, also where that is within the noise of
    one recording; so too by the ``bends`` of strokes."""
    bends: Mapping[str, float] = field(default_factory=dict)
    """By each bend of strokes, its size in standard errors."""


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

    def systematic_part(self, name: str) -> tuple[float, float]:
        """The part of the interval below and above the value that repeats share; no more than there is on that side."""
        value, (below, above) = self.values[name], self.systematic.get(name, (0.0, 0.0))
        return min(below, max(value - self.low[name], 0.0)), min(above, max(self.high[name] - value, 0.0))


def estimates_of(fit: CycleFit, has_withdrawal: bool) -> dict[str, Estimate]:
    """The estimates of one cycle; without a withdrawal, friction and cutting force come from the insertion only."""
    staged = fit.by_stages and not FITS[fit.law].gradual
    source = f"{'staged fit' if staged else 'complete fit'}, {fit.law}" + ("" if has_withdrawal else ", insertion only")
    names = [name for name in (*FITS[fit.law].parameters, *ALSO_ESTIMATED) if name in fit.values]
    return {name: _estimate(name, fit, source) for name in names}


def _estimate(name: str, fit: CycleFit, source: str) -> Estimate:
    limits = fit.values[name], UNITS[name], fit.low[name], fit.high[name]
    held = name not in fit.order and fit.low[name] == fit.high[name]
    return Estimate(
        name,
        *limits,
        systematic=fit.systematic_part(name),
        identifiable=not held and _is_identifiable(name, fit),
        source=HELD_EXPONENT if held and name == "rupture_exponent" else source,
    )


def _is_identifiable(name: str, fit: CycleFit) -> bool:
    """False for parameters of which only the product is identified, and for an interval that has no meaning."""
    if name in FITS[fit.law].not_distinguishable(fit.values):
        return False
    scales = {"force": fit.values["puncture_force"], "depth": fit.values["puncture_indentation"]}
    return is_meaningful(name, fit.low[name], fit.high[name], **scales)


def cycle_jacobian(
    x: Mapping[str, float], strokes: Sequence[np.ndarray], before: int, order: Sequence[str]
) -> np.ndarray:
    """Derivatives (p, n_in + n_out) of the force of both ``strokes`` by the parameters in ``order`` at their values
    ``x``; so many samples lie ``before`` the puncture."""
    depth_in, _, depth_out, _ = strokes
    h, out = depth_in - x["contact_depth"], depth_out - x["contact_depth"]
    slopes, cut = CURVES["cone_cylinder"].gradient(h, x), np.arange(len(h)) >= before
    none, friction = np.zeros_like(h), x["friction_per_length"]
    slopes |= {"friction_per_length": none, "cutting_force": none, "force_offset": np.ones_like(h)}
    after = {"friction_per_length": h, "contact_depth": none - friction, "cutting_force": none + 1.0}
    slopes = {
        name: np.where(cut, after.get(name, float(name == "force_offset")), each) for name, each in slopes.items()
    }
    back = {"friction_per_length": -np.maximum(out, 0.0), "contact_depth": friction * (out > 0.0)}
    back["force_offset"] = np.ones_like(out)
    return np.array([np.concatenate([slopes[name], back.get(name, np.zeros_like(out))]) for name in order])


class CycleEstimates:
    """Noise, covariance, estimates and warnings from the result of the core, for a CycleFit."""

    def __init__(self, found: dict, strokes: list[np.ndarray], options: CycleOptions, left_out: int):
        self.found, self.strokes, self.options, self.left_out = found, strokes, options, left_out
        self.filter_length, self.depth_noise = options.filter_length, options.depth_noise
        self.x, self.before = dict(zip(UNKNOWNS, found["unknowns"])), found["puncture"]
        self.order = tuple(name for k, name in enumerate(UNKNOWNS) if found["free"][k] or name != "saturation_depth")
        rows = [UNKNOWNS.index(name) for name in self.order]
        *grams, bread = found["matrices"][:, rows][:, :, rows]
        if not bread.diagonal().all():
            bread = np.full_like(bread, np.nan)  # the data do not determine every parameter: no intervals
        lost = [float(np.vdot(bread, gram)) for gram in grams]
        self.noises = self._noises([0.0 if math.isnan(each) else each for each in lost])
        self.covariance = sandwich(bread, grams, self.noises)
        if options.drift is not None:
            change = options.drift.change(bread, cycle_jacobian(self.x, strokes, self.before, self.order))
            self.covariance = self.covariance + np.outer(change, change)
        sse, count = (self.noises[0][k] + self.noises[1][k] for k in (0, 1))
        self.variance = sse / count
        self.depth = strokes[0].copy()  # in which a jump is no travel
        if options.jumps:
            self.depth[self.before] = self.depth[self.before - 1] + float(np.median(np.diff(self.depth)))

    def _noises(self, lost: list[float]) -> list[Noise]:
        """Noise of each stroke; ``lost`` are the effective numbers of parameters estimated from each, tr(B G)."""
        w, before, residuals = self.left_out, self.before, [self.found["residual_in"], self.found["residual_out"]]
        counts = [max(len(residuals[0]) - 3 * w, 0), max(len(residuals[1]) - w, 0)]
        if w:
            residuals = [residual.copy() for residual in residuals]
            residuals[0][before - w : before + w] = residuals[0][-w:] = residuals[1][:w] = 0.0
        return [noise_of(r, n, self.filter_length, p) for r, n, p in zip(residuals, counts, lost)]

    def fit(self, free: bool, profile: dict) -> CycleFit:
        """The complete result; ``profile`` has the gain of each possible puncture."""
        rows, weights = likely_punctures(profile["gain"], self.noises[0].long_run)
        rows += profile["first_gain"]
        values, low, high = self._estimates(rows, weights)
        low["saturation_depth"] = min(low["saturation_depth"], self.found["unknowns"][4])
        smear, depth = self.filter_length // 2, self.depth
        first, last = max(int(rows.min()) - 1 - smear, 0), min(int(rows.max()) + smear, len(depth) - 1)
        margin = TWO_SIDED * self.depth_noise
        ends = depths_between(depth, first, last)
        low["puncture_depth"], high["puncture_depth"] = ends[0] - margin, ends[1] + margin
        between = 2 * (0.5 * abs(float(depth[self.before] - depth[self.before - 1])),)
        return CycleFit(
            law=self.options.law,
            options=self.options,
            values=values,
            low=low,
            high=high,
            order=self.order,
            covariance=self.covariance,
            systematic={"puncture_depth": between, "puncture_indentation": between},
            puncture=PunctureSamples(self.before, first, last, self.left_out),
            residuals=CycleResiduals(
                insertion=self.found["residual_in"],
                withdrawal=self.found["residual_out"],
                noises=tuple(self.noises),
            ),
            warnings=tuple(self._warnings(values, low, high, free)),
            saturation_sought=free,
        )

    def _estimates(self, rows: np.ndarray, weights: np.ndarray) -> tuple[dict, dict, dict]:
        """Values and limits (delta method) of all quantities; those of the puncture depth are samples, see ``fit``."""
        x, puncture = self.x, self._puncture_depth()
        h, c = puncture - x["contact_depth"], x["stiffness_coefficient"]
        slopes = CURVES["cone_cylinder"].gradient(np.float64(h), x)
        values = x | {
            "puncture_depth": puncture,
            "puncture_indentation": h,
            "puncture_force": c * float(slopes["stiffness_coefficient"]),
        }
        force_by = np.array([float(slopes.get(name, 0.0)) for name in self.order])
        by_contact = float(slopes["contact_depth"])
        by_law = float(force_by @ self.covariance @ force_by)
        spread = self._puncture_variance(rows, weights, self._drop(puncture), by_law) + self.depth_noise**2
        variance = self.covariance.diagonal().tolist()
        variances = dict(zip(self.order, variance))
        variances["puncture_indentation"] = variance[1] + spread
        variances["puncture_force"] = by_law + by_contact**2 * spread
        half = {name: TWO_SIDED * math.sqrt(max(value, 0.0)) for name, value in variances.items()}
        low, high = limits(values, half)
        if "saturation_depth" in half and high["saturation_depth"] > h:
            high["saturation_depth"] = math.inf  # beyond the puncture, the saturation depth has no effect
        if not self.found["free"][2]:
            low["friction_per_length"] = 0.0
        return values, low, high

    def _puncture_depth(self) -> float:
        """The middle of the two samples around the puncture [m]; behind a filter, the place of the smeared step.

        The scan assumes a step, and the ramp of a filter biases it. But an average filter conserves area: the area
        between force and model around the step is the drop times the error of the place of the step, minus the change
        of slope times length² / 24 at the ends.
        """
        depth, before, length = self.depth, self.before, self.filter_length
        middle, gap = 0.5 * float(depth[before - 1] + depth[before]), float(depth[before] - depth[before - 1])
        drop = self._drop(middle)
        if length == 1 or not drop > 0.0:
            return middle
        half = RAMP_QUARTERS * length // 4
        area = float(self.found["residual_in"][before - half : before + half].sum())
        slope = CURVES["cone_cylinder"].gradient(np.float64(middle - self.x["contact_depth"]), self.x)["contact_depth"]
        slope_change = (-float(slope) - self.x["friction_per_length"]) * gap
        error = (area + slope_change * length**2 / 24.0) / drop
        return middle + gap * min(max(error, -0.5 * length), 0.5 * length)

    def _drop(self, depth: float) -> float:
        """The drop of the force [N] at a puncture at ``depth`` [m]."""
        x, embedded_length = self.x, np.float64(depth - self.x["contact_depth"])
        loaded = CURVES["cone_cylinder"].force(embedded_length, x)
        return float(loaded - x["friction_per_length"] * embedded_length - x["cutting_force"])

    def _puncture_variance(self, rows: np.ndarray, weights: np.ndarray, drop: float, by_law: float) -> float:
        """Variance [m²] of the puncture depth: between the candidate gaps, and of a uniform distribution in each gap.

        Behind a filter: from the noise of the area around the step, over the summed samples minus a third of the
        filter's length, and from the loading curve there, whose force has the variance ``by_law`` [N²].
        """
        depth, length = self.depth, self.filter_length
        before, after = depth[rows - 1], depth[rows]
        if length > 1 and drop > 0.0:
            gap = float(after[0] - before[0])
            summed = (RAMP_QUARTERS / 2.0 - 1.0 / 3.0) * length * self.noises[0].long_run
            return gap**2 * (1.0 / 12.0 + (summed + (RAMP_QUARTERS * length / 4.0) ** 2 * by_law) / drop**2)
        middle = 0.5 * (before + after)
        return float(weights @ ((middle - weights @ middle) ** 2 + (after - before) ** 2 / 12.0))

    def _warnings(self, values: dict, low: dict, high: dict, free: bool) -> Iterator[str]:
        """Sentences on what limits the validity of the values."""
        found, depth, v = self.found, self.strokes[0], values
        if not low["stiffness_coefficient"] > 0.0:
            yield "The stiffness is not significantly above 0: there may be no contact."
        embedded_length = v["puncture_indentation"]  # at the puncture
        after = v["friction_per_length"] * embedded_length + v["cutting_force"]
        if not v["puncture_force"] - after > high["puncture_force"] - v["puncture_force"]:
            yield "The force does not drop significantly at the fitted puncture: there may be no puncture."
        if self.before in found["admitted"]:
            yield "The fitted puncture is at an end of the range of the search: the true one may be beyond it."
        if v["contact_depth"] <= depth[0]:
            yield "The recording starts in contact: the contact depth is extrapolated."
        if not found["free"][2]:
            best = found["unconstrained_friction"]
            yield f"The friction per length is held at 0: least squares give {best:.4g} N/m, which is unphysical."
        if free and not found["free"][4]:
            yield "A cone without saturation fits best: the contact does not saturate before the puncture."
        if not len(self.strokes[2]):
            yield "There is no withdrawal: friction and cutting force are identified from the insertion only."
        last_lag = max(noise.last_lag for noise in self.noises)
        if last_lag > 1.5 * self.filter_length and self.variance > (1e-9 * v["puncture_force"]) ** 2:
            yield (
                f"The residuals are correlated over {last_lag} samples: the model does not describe the recording "
                "within its noise."
            )
