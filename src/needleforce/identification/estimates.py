# SPDX-License-Identifier: Apache-2.0
"""Identified quantities with their intervals, and the mean over repeats with the scatter between them."""

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import combinations
from math import inf, isfinite, sqrt
from typing import Any

import numpy as np

from ..display.markup import Markup, table
from ..display.quantities import quantity, with_unit
from ..display.tables import text_table
from .one_layer.cycle_estimates import CycleFit
from .one_layer.loading_curves import CURVES
from .statistics.noise import Z_95

UNITS = {name: unit for curve in CURVES.values() for name, unit in curve.units.items()} | {
    "contact_depth": "m",
    "puncture_depth": "m",
    "puncture_indentation": "m",
    "puncture_force": "N",
    "friction_per_length": "N/m",
    "cutting_force": "N",
}
MEAN = "mean of {n} repeats"
TOGETHER = 0.95  # a third of either's error is left when the other is known
PLACES = {"contact_depth"}  # counted from an arbitrary zero: no product of it means anything


@dataclass(frozen=True)
class Estimate:
    """One quantity [SI ``unit``] with its 95 % interval ``low`` to ``high``; ``source`` says how it was obtained.

    ``between_repeats_sd`` is the scatter of the repeats' values, ``within_run_sd`` the root mean square of their own
    standard errors, which is part of it; both are None with fewer than two repeats. ``identifiable`` is False where a
    log alone cannot tell it.
    """

    name: str
    value: float
    unit: str
    low: float
    high: float
    between_repeats_sd: float | None = None
    identifiable: bool = True
    source: str = ""
    within_run_sd: float | None = None

    @property
    def shown(self) -> Any:
        """Value and interval as text with a unit of sensible size, see ``display.quantities.Quantity``."""
        return quantity(self.value, self.low, self.high, self.unit)

    @property
    def scatter(self) -> str:
        """``between_repeats_sd`` in the unit of the value as shown; empty with fewer than two repeats."""
        if self.between_repeats_sd is None:
            return ""
        sd = quantity(self.value, self.value - self.between_repeats_sd, self.value + self.between_repeats_sd, self.unit)
        return with_unit(sd.half_width, sd.unit)

    @property
    def specimen_sd(self) -> float | None:
        """Scatter between repeats beyond what their own errors make of it (moments): that of specimen and needle."""
        if self.between_repeats_sd is None or self.within_run_sd is None:
            return None
        return sqrt(max(self.between_repeats_sd**2 - self.within_run_sd**2, 0.0))


class Parameters(dict[str, Estimate]):
    """Estimates by name: ``parameters["cutting_force"]`` and ``parameters.cutting_force`` are the same.

    Printed, it is a table of values with their intervals; in a notebook the same as HTML.
    """

    HEAD = ("quantity", "value, 95 % interval", "sd between repeats", "identifiable", "how obtained")

    def __getattr__(self, name: str) -> Estimate:
        try:
            return self[name]
        except KeyError:
            known = ", ".join(self) or "none"
            raise AttributeError(f"no parameter {name!r} was identified; there are: {known}") from None

    def __dir__(self) -> Iterable[str]:
        return [*super().__dir__(), *self]

    def rows(self) -> list[tuple[str, ...]]:
        """One row of text for each estimate, under ``HEAD``; what all share in "how obtained" is left empty."""
        shared = len({each.source for each in self.values()}) == 1
        return [
            (
                each.name,
                str(each.shown),
                each.scatter,
                "yes" if each.identifiable else "no",
                "" if shared else each.source,
            )
            for each in self.values()
        ]

    def text(self) -> str:
        """The table as plain text; empty without estimates."""
        return text_table(self.HEAD, self.rows())

    def to_dataframe(self) -> Any:
        """A pandas DataFrame in SI, a row for each estimate, with the fields of ``Estimate`` as columns."""
        import pandas

        columns = [field for field in Estimate.__dataclass_fields__ if field != "name"]
        return pandas.DataFrame([asdict(each) for each in self.values()], columns=["name", *columns]).set_index("name")

    def __str__(self) -> str:
        return self.text() or "no parameters"

    def _repr_html_(self) -> Markup:
        return table(self.HEAD, self.rows())


@dataclass(frozen=True)
class Quality:
    """Residual of the model over the strokes: rms [N], rms over the peak force, and R squared."""

    rmse_N: float
    nrmse: float
    r2: float


def estimates_of(fit: CycleFit, has_withdrawal: bool) -> dict[str, Estimate]:
    """The estimates of one cycle; without a withdrawal, friction and cutting rest on the insertion's slope alone."""
    source = f"{'fit by stages' if fit.by_stages else 'complete fit'}, {fit.law}" + (
        "" if has_withdrawal else ", insertion only"
    )
    names = [name for name in UNITS if name in fit.values and not _absent(name, fit)]
    return {name: _estimate(name, fit, source) for name in names}


def _estimate(name: str, fit: CycleFit, source: str) -> Estimate:
    limits = fit.values[name], UNITS[name], fit.low[name], fit.high[name]
    return Estimate(name, *limits, identifiable=_known(name, fit), source=source)


def _absent(name: str, fit: CycleFit) -> bool:
    """The complete fit gives an infinite saturation depth for a bare cone, which has none."""
    return any(name in curve.units for curve in CURVES.values()) and name not in CURVES[fit.law].units


def _known(name: str, fit: CycleFit) -> bool:
    """False without an interval, for a stiffness that may be none, and for factors of which only the product is
    known."""
    curve = CURVES[fit.law]
    if name in curve.not_distinguishable(fit.values):
        return False
    if [name] == list(curve.amplitudes) and not fit.low[name] > 0.0:
        return False
    anything = fit.low[name] == 0.0 and fit.high[name] == inf
    return isfinite(fit.low[name]) and not anything


def pool(own: list[dict[str, Estimate]]) -> dict[str, Estimate]:
    """The pooled estimate of every quantity that any repeat has; with one repeat its own.

    Between-repeat scatter dominates on tissue, and the within-run error is part of it: the interval is Student's t on
    the scatter, never below the mean within-run error.
    """
    names = list(dict.fromkeys(name for estimates in own for name in estimates))
    return {name: _pooled([estimates[name] for estimates in own if name in estimates]) for name in names}


def mean_estimate(name: str, values, unit: str, source: str, half: float = np.nan) -> Estimate:
    """Mean of independent values (n,) with Student's 95 % interval and their sd; a single one has its own half
    width."""
    values = np.asarray(values, float)
    mean, n = float(values.mean()), len(values)
    if n < 2:
        return Estimate(name, mean, unit, mean - half, mean + half, None, True, source)
    sd = float(values.std(ddof=1))
    half = student(n) * sd / np.sqrt(n)
    return Estimate(name, mean, unit, mean - half, mean + half, sd, True, source)


def student(n: int) -> float:
    """Student's t for 95 % and n values."""
    from scipy.stats import t

    return float(t.ppf(0.975, n - 1))


def _pooled(repeats: list[Estimate]) -> Estimate:
    if len(repeats) == 1:
        return repeats[0]
    first, n = repeats[0], len(repeats)
    source = f"{first.source}; {MEAN.format(n=n)}"
    values = np.array([estimate.value for estimate in repeats])
    if not np.isfinite(values).all():
        return Estimate(first.name, float(values.mean()), first.unit, np.nan, np.nan, None, first.identifiable, source)
    halves = np.array([0.5 * (estimate.high - estimate.low) for estimate in repeats])
    pooled = replace(mean_estimate(first.name, values, first.unit, source), within_run_sd=_root_mean_square(halves))
    if not all(estimate.identifiable for estimate in repeats):
        # a bound that all repeats share does not scatter: the mean is no better known than each
        low, high = min(estimate.low for estimate in repeats), max(estimate.high for estimate in repeats)
        return replace(pooled, low=low, high=high, identifiable=False)
    within = np.nanmean(halves) / np.sqrt(n)
    half = max(pooled.high - pooled.value, within if np.isfinite(within) else 0.0)
    return replace(pooled, low=pooled.value - half, high=pooled.value + half)


def _root_mean_square(halves: np.ndarray) -> float | None:
    """Of the standard errors whose 95 % half widths (n,) are finite; None where none is."""
    known = halves[np.isfinite(halves)] / Z_95
    return float(np.sqrt(np.mean(known**2))) if len(known) else None


@dataclass(frozen=True, eq=False)
class Correlations:
    """Correlations ``matrix`` (p, p) of the estimates ``names`` within a recording, from their covariance, and the
    relative standard errors (p,), of one recording."""

    names: tuple[str, ...]
    matrix: np.ndarray
    relative_errors: np.ndarray

    def sentences(self) -> tuple[str, ...]:
        """One plain sentence for each pair that is known only together."""
        pairs = combinations(range(len(self.names)), 2)
        return tuple(self._sentence(i, k) for i, k in pairs if abs(self.matrix[i, k]) >= TOGETHER)

    def _sentence(self, i: int, k: int) -> str:
        r, (a, b) = float(self.matrix[i, k]), self.relative_errors[[i, k]]
        said = f"{self.names[i]} and {self.names[k]} are known only together, with a correlation of {r:.2f}"
        error = float(np.sqrt(max(a * a + b * b - 2.0 * abs(r) * a * b, 0.0)))
        if {self.names[i], self.names[k]} & PLACES or not error < min(a, b):
            better = 1.0 / np.sqrt(max(1.0 - r * r, 1e-12))
            return f"{said}: if one were given, the other would be known {better:.2g} times as well."
        form, each = "product" if r < 0.0 else "quotient", f"{100.0 * a:.2g} % and {100.0 * b:.2g} %"
        return (
            f"{said}: a recording tells their {form} to {100.0 * error:.2g} %, by themselves {each} (standard errors)."
        )


def correlations_of(recordings: Sequence) -> Correlations | None:
    """The correlations of the recordings' cycles, their covariances averaged; None without a cycle that has one.

    They tell what one recording cannot separate. Repeats add scatter of their own, whose correlations few repeats do
    not show.
    """
    cycles = [each.cycle for each in recordings if each.cycle is not None]
    cycles = [cycle for cycle in cycles if np.isfinite(cycle.covariance).all()]
    cycles = [cycle for cycle in cycles if cycle.covariance_order == cycles[0].covariance_order]
    if not cycles:
        return None
    names = cycles[0].covariance_order
    covariance = np.mean([cycle.covariance for cycle in cycles], axis=0)
    sd = np.sqrt(covariance.diagonal())
    if not sd.all():
        return None
    values = np.mean([[cycle.values[name] for name in names] for cycle in cycles], axis=0)
    relative = np.divide(sd, np.abs(values), out=np.full(len(sd), np.nan), where=values != 0.0)
    return Correlations(names, covariance / np.outer(sd, sd), relative)


def known_together(recordings: Sequence) -> tuple[str, ...]:
    """What these recordings tell only together, one sentence a pair."""
    found = correlations_of(recordings)
    return () if found is None else found.sentences()
