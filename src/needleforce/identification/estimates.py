# SPDX-License-Identifier: Apache-2.0
"""Identified quantities with their intervals, and the mean over repeats with the scatter between them."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import KW_ONLY, asdict, dataclass, replace
from itertools import combinations
from math import isfinite, isnan, nan, sqrt
from typing import Any

import numpy as np

from ..display.axes import draw_intervals
from ..display.quantities import percent, quantity, with_unit
from ..display.result import Printed, Result
from .statistics.noise import INTERVAL, TWO_SIDED, student_quantile

MEAN = "mean of {n} repeats"
MAX_DEPTH_SHARE = 0.5  # of the indentation at the puncture: a depth with a larger half width is not known
MAX_FORCE_SHARE = 0.1  # of the puncture force: a force of none is known to be small
MIN_SHOWN_SHARE = 0.1  # of the interval: a smaller systematic part is not mentioned
MIN_CORRELATION = 0.95  # from here on, less than a third of either standard error is left when the other is known
WITH_OWN_RULE = {"friction_bend", "presliding"}  # may be negative; identifiable where its travel is resolved
NOT_KNOWN = {"yes": "", "no": ", not identifiable", "fixed": ", fixed"}
WITHOUT_PRODUCT = {"contact_depth"}  # measured from an arbitrary zero: its products have no meaning


@dataclass(frozen=True, repr=False)
class Estimate:
    """One identified quantity with its interval, in SI units.

    Attributes
    ----------
    name : str
        Name of the parameter.
    value : float
        Its value [``unit``].
    unit : str
        SI unit, "1" for a ratio.
    low, high : float
        Interval [``unit``] at the confidence level of the package, 95 % (``statistics.noise.LEVEL``); infinite or NaN
        where it is not known.
    between_repeats_sd : float or None
        Standard deviation of the repeats' values [``unit``]; None with fewer than two repeats.
    identifiable : bool
        False where the recordings do not determine the value, as for one that is held fixed.
    source : str
        How the value was obtained.
    within_run_sd : float or None
        Root mean square of the repeats' own standard errors [``unit``], which are part of their scatter; None with
        fewer than two repeats.
    systematic : tuple of float
        How much farther [``unit``] the interval reaches below and above the value than by ``random`` errors, because
        the model is in error. Repeats share this part, and their mean has all of it.
    """

    name: str
    value: float
    unit: str
    low: float
    high: float
    _: KW_ONLY
    between_repeats_sd: float | None = None
    identifiable: bool = True
    source: str = ""
    within_run_sd: float | None = None
    systematic: tuple[float, float] = (0.0, 0.0)

    @property
    def random(self) -> float:
        """Half width [``unit``] of the interval from what differs between repeats: noise and, with two or more, their
        scatter. NaN where the interval has no end."""
        half = 0.5 * (self.high - self.low - sum(self.systematic))
        return max(half, 0.0) if isfinite(half) else nan

    @property
    def systematic_share(self) -> str:
        """How much of the interval is systematic, in a word: ``most``, ``part`` (a tenth or more), or none."""
        share = sum(self.systematic) / (self.high - self.low) if self.high > self.low else 0.0
        return "most" if share > 0.5 else "part" if share >= MIN_SHOWN_SHARE else ""

    def __str__(self) -> str:
        return f"{self.name}: {self.shown}{NOT_KNOWN[self.known]}"

    def __repr__(self) -> str:
        return f"<Estimate {self}>"

    def document(self) -> dict:
        """The fields, and ``random``, as tables and JSON have them."""
        return asdict(self) | {"random": self.random}

    @property
    def known(self) -> str:
        """``identifiable`` in a word: ``yes``, ``no``, or ``fixed`` for a value that was held and has no interval."""
        held = self.low == self.high and isfinite(self.value)
        return "yes" if self.identifiable else "fixed" if held else "no"

    @property
    def shown(self) -> Any:
        """Value and interval as text with a unit of sensible size, see ``display.quantities.Quantity``."""
        limits = (None, None) if self.known == "fixed" else (self.low, self.high)
        return quantity(self.value, *limits, self.unit)

    @property
    def doubt(self) -> str:
        """What is to be read before ``shown`` in a table without a column of ``known``; empty for ``yes``."""
        return {"yes": "", "no": "not identified: ", "fixed": "fixed: "}[self.known]

    @property
    def scatter(self) -> str:
        """``between_repeats_sd`` in the unit of the value as shown; empty with fewer than two repeats."""
        return self.spread(self.between_repeats_sd)

    def spread(self, sd: float | None) -> str:
        """A standard deviation [``unit``] in the unit of the value as shown; empty for None."""
        if sd is None:
            return ""
        shown = quantity(self.value, self.value - sd, self.value + sd, self.unit)
        return with_unit(shown.half_width or "0", shown.unit)

    @property
    def specimen_sd(self) -> float | None:
        """Scatter [``unit``] between repeats without that of their own errors (moments): of specimen and needle."""
        if self.between_repeats_sd is None or self.within_run_sd is None:
            return None
        return sqrt(max(self.between_repeats_sd**2 - self.within_run_sd**2, 0.0))


class Parameters(Printed, dict[str, Estimate]):
    """Estimates by name: ``parameters["cutting_force"]`` and ``parameters.cutting_force`` are the same.

    It prints as a table of values with their intervals; in a notebook as the same table in HTML.
    """

    __repr__ = Printed.__str__
    HEAD = ("quantity", f"value, {INTERVAL}", "systematic", "sd between repeats", "identifiable", "how obtained")

    def __getattr__(self, name: str) -> Estimate:
        try:
            return self[name]
        except KeyError:
            known = ", ".join(self) or "none"
            raise AttributeError(f"no parameter {name!r} was identified; there are: {known}") from None

    def __dir__(self) -> Iterable[str]:
        return [*super().__dir__(), *self]

    def _heading(self) -> str:
        return "" if self else "no parameters"

    def _cells(self) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
        shared = len({each.source for each in self.values()}) == 1
        rows = [
            (
                each.name,
                str(each.shown),
                each.systematic_share,
                each.scatter,
                each.known,
                "" if shared else each.source,
            )
            for each in self.values()
        ]
        return self.HEAD, rows

    def to_dataframe(self) -> Any:
        """A pandas DataFrame in SI, a row for each estimate, with its fields and ``random`` as columns."""
        import pandas

        columns = (*Estimate.__dataclass_fields__, "random")
        return pandas.DataFrame([each.document() for each in self.values()], columns=columns).set_index("name")


class EstimateResult(Result):
    """A result whose numbers are ``estimates``, in a table and as intervals over their values."""

    __slots__ = ()
    parameters: dict[str, Estimate]

    @property
    def estimates(self) -> Iterable[Estimate]:
        """What was identified: all ``parameters`` where a result has no others."""
        return tuple(self.parameters.values())

    def _found(self) -> Parameters:
        return Parameters({each.name: each for each in self.estimates})

    def _cells(self) -> tuple[Sequence[str], Sequence[Sequence[str]]]:
        return self._found().cells()

    def _remarks(self) -> Iterable[tuple[str, Iterable[str]]]:
        yield "Warnings", getattr(self, "warnings", ())
        yield "Notes", getattr(self, "notes", ())

    def _draw(self, axes: Any) -> tuple[str, ...]:
        return draw_intervals(axes, [(each.name, each.value, each.low, each.high) for each in self.estimates])

    def document(self) -> dict:
        """The estimates as dicts, as ``to_json`` writes them."""
        return {"parameters": [each.document() for each in self.estimates]}

    def to_dataframe(self) -> Any:
        """The estimates as a pandas DataFrame in SI, indexed by name."""
        return self._found().to_dataframe()


@dataclass(frozen=True)
class Quality:
    """Residual of the model over the strokes.

    Attributes
    ----------
    rmse_N : float
        Root mean square of the residual [N].
    nrmse : float
        The same over the peak force [1].
    r2 : float
        Coefficient of determination R² [1]; negative where the mean force fits better than the model.
    sliding_N, reversal_N : float
        Root mean square [N] where the needle slides, and where friction reverses at the start of the withdrawal; NaN
        for a model of layers and without a reversal.
    """

    rmse_N: float
    nrmse: float
    r2: float
    sliding_N: float = nan
    reversal_N: float = nan

    def __str__(self) -> str:
        parts = f" (sliding {1e3 * self.sliding_N:.3g}, reversal of friction {1e3 * self.reversal_N:.3g} mN)"
        shown = "" if isnan(self.reversal_N) else parts
        return f"{1e3 * self.rmse_N:.3g} mN rms{shown}, {percent(self.nrmse)} of the peak force, R² {self.r2:.3f}"


def is_meaningful(name: str, low: float, high: float, *, force: float, depth: float) -> bool:
    """Whether an interval excludes what would make its number meaningless, with the ``force`` [N] and the indentation
    ``depth`` [m] at the puncture as scales.

    A depth in the recording's zero is known within half the indentation; the sensor's zero, friction and cutting force,
    which may be none, are above 0 or known within a tenth of the puncture force; every other quantity is above 0. The
    interval is finite.
    """
    if not (isfinite(low) and isfinite(high)):
        return False
    half = 0.5 * (high - low)
    if name.endswith(("contact_depth", "puncture_depth")):
        return half < MAX_DEPTH_SHARE * depth
    if name == "friction_per_length":
        return low > 0.0 or half * depth < MAX_FORCE_SHARE * force
    if name in ("cutting_force", "force_offset"):
        return low > 0.0 or half < MAX_FORCE_SHARE * force
    return low > 0.0 or name in WITH_OWN_RULE


def not_identifiable(parameters: Mapping[str, Estimate], names: Iterable[str]) -> dict[str, Estimate]:
    """The parameters, those with these ``names`` as not identifiable."""
    return {
        **parameters,
        **{name: replace(parameters[name], identifiable=False) for name in names if name in parameters},
    }


def pool(own: list[dict[str, Estimate]]) -> dict[str, Estimate]:
    """The pooled estimate of every quantity that any repeat has; with one repeat its own.

    On tissue the scatter between repeats dominates and includes the random error within a run: the random part of the
    interval is Student's on the scatter, but not narrower than the mean random error within the runs over the root of
    their number. Errors of the model are common to repeats: the systematic part is the mean of theirs.
    """
    names = list(dict.fromkeys(name for estimates in own for name in estimates))
    pooled = {name: _pooled([estimates[name] for estimates in own if name in estimates]) for name in names}
    if not {"puncture_force", "puncture_indentation"} <= pooled.keys():
        return pooled
    scales = {"force": pooled["puncture_force"].value, "depth": pooled["puncture_indentation"].value}
    return {name: _if_meaningful(estimate, scales) for name, estimate in pooled.items()}


def _if_meaningful(estimate: Estimate, scales: dict[str, float]) -> Estimate:
    """The estimate, not identifiable where the scatter between repeats makes it meaningless."""
    known = is_meaningful(estimate.name, estimate.low, estimate.high, **scales)
    return estimate if known else replace(estimate, identifiable=False)


def mean_estimate(
    name: str, values: Sequence[float] | np.ndarray, unit: str, source: str, half: float = np.nan
) -> Estimate:
    """Mean of independent values (n,) with Student's interval and their standard deviation; a single value has the
    half width ``half``."""
    values = np.asarray(values, float)
    mean, n = float(values.mean()), len(values)
    if n < 2:
        return Estimate(name, mean, unit, mean - half, mean + half, source=source)
    sd = float(values.std(ddof=1))
    half = float(student_quantile(n - 1) * sd / np.sqrt(n))
    return Estimate(name, mean, unit, mean - half, mean + half, between_repeats_sd=sd, source=source)


def _pooled(repeats: list[Estimate]) -> Estimate:
    if len(repeats) == 1:
        return repeats[0]
    first, n = repeats[0], len(repeats)
    source = f"{first.source}; {MEAN.format(n=n)}"
    values = np.array([estimate.value for estimate in repeats])
    if not np.isfinite(values).all():
        mean, identifiable = float(values.mean()), first.identifiable
        return Estimate(first.name, mean, first.unit, np.nan, np.nan, identifiable=identifiable, source=source)
    halves = np.array([estimate.random for estimate in repeats])
    systematic = np.array([estimate.systematic for estimate in repeats])
    below, above = systematic.mean(axis=0).tolist()
    pooled = replace(mean_estimate(first.name, values, first.unit, source), within_run_sd=_root_mean_square(halves))
    if not all(estimate.identifiable for estimate in repeats):
        # a bound that all repeats share has no scatter: the mean has the uncertainty of a single repeat
        low, high = min(estimate.low for estimate in repeats), max(estimate.high for estimate in repeats)
        return replace(pooled, low=low, high=high, identifiable=False, systematic=(below, above))
    within = float(np.nan_to_num(np.nanmean(halves))) / np.sqrt(n)
    # each end is what another reading gives, whose mean has an error too; that of a bound needs no Student's t
    ends = values[:, None] + systematic * (-1.0, 1.0)
    errors = TWO_SIDED * ends.std(axis=0, ddof=1) / np.sqrt(n)
    low, high = ends.mean(axis=0) + np.maximum(errors, max(pooled.high - pooled.value, within)) * (-1.0, 1.0)
    low, high = float(low), float(high)
    if below > 0.0:  # not below 0 where no repeat is
        low = max(low, min(pooled.low, 0.0, *(estimate.low for estimate in repeats)))
    return replace(pooled, low=low, high=high, systematic=(min(below, pooled.value - low), above))


def _root_mean_square(halves: np.ndarray) -> float | None:
    """Root mean square of the standard errors with finite half widths (n,); None without one."""
    known = halves[np.isfinite(halves)] / TWO_SIDED
    return float(np.sqrt(np.mean(known**2))) if len(known) else None


@dataclass(frozen=True, eq=False)
class Correlations:
    """Correlations of the estimates within a recording.

    Attributes
    ----------
    names : tuple of str
        Names (p,) of the estimates.
    matrix : numpy.ndarray
        Their correlations (p, p) [1], -1 to 1, from the covariance of the fit.
    relative_errors : numpy.ndarray
        Their standard errors over their values (p,) [1], of one recording.
    """

    names: tuple[str, ...]
    matrix: np.ndarray
    relative_errors: np.ndarray

    def sentences(self) -> tuple[str, ...]:
        """One sentence for each pair of parameters that is identified only together.

        Returns
        -------
        tuple of str
            Empty where no correlation is 0.95 or more.
        """
        pairs = combinations(range(len(self.names)), 2)
        return tuple(self._sentence(i, k) for i, k in pairs if abs(self.matrix[i, k]) >= MIN_CORRELATION)

    def _sentence(self, i: int, k: int) -> str:
        r, (a, b) = float(self.matrix[i, k]), self.relative_errors[[i, k]]
        pair = f"{self.names[i]} and {self.names[k]} are identified only together, with a correlation of {r:.2f}"
        error = float(np.sqrt(max(a * a + b * b - 2.0 * abs(r) * a * b, 0.0)))
        if {self.names[i], self.names[k]} & WITHOUT_PRODUCT or not error < min(a, b):
            better = 1.0 / np.sqrt(max(1.0 - r * r, 1e-12))
            return f"{pair}: if one is known, the standard error of the other is {better:.2g} times smaller."
        form = "product" if r < 0.0 else "quotient"
        each = f"{percent(a)} and {percent(b)}"
        return f"{pair}: the standard error of their {form} is {percent(error)}, of each alone {each}."


def correlations_of(recordings: Sequence[Any]) -> Correlations | None:
    """The correlations of the recordings' cycles, their covariances averaged; None without a cycle that has one.

    They show what one recording cannot separate. The scatter between repeats has correlations too, but a few repeats
    do not determine them.
    """
    cycles = [each.cycle for each in recordings if each.cycle is not None]
    cycles = [cycle for cycle in cycles if np.isfinite(cycle.covariance).all()]
    cycles = [cycle for cycle in cycles if cycle.order == cycles[0].order]
    if not cycles:
        return None
    names = cycles[0].order
    covariance = np.mean([cycle.covariance for cycle in cycles], axis=0)
    sd = np.sqrt(covariance.diagonal())
    if not sd.all():
        return None
    values = np.mean([[cycle.values[name] for name in names] for cycle in cycles], axis=0)
    relative = np.divide(sd, np.abs(values), out=np.full(len(sd), np.nan), where=values != 0.0)
    return Correlations(names, covariance / np.outer(sd, sd), relative)


def identified_together(recordings: Sequence[Any]) -> tuple[str, ...]:
    """One sentence for each pair of parameters that these recordings identify only together."""
    found = correlations_of(recordings)
    return () if found is None else found.sentences()
