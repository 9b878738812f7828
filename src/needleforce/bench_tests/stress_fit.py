# SPDX-License-Identifier: Apache-2.0
"""Fit of stress-stretch laws to tension and compression tests, the choice between them, and the initial modulus with an
interval that includes that choice."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np

from ..display.quantities import percent
from ..errors import InputError
from ..identification.estimates import Estimate
from ..identification.statistics.noise import LEVEL
from ..vocabulary import SMALLEST
from .law_fit import LawFit, Readings, StressCurve, solved, without_unstable
from .laws import laws_named, mode_number
from .stress_evidence import evidence_of, held_by_start, judged, slack_note, without_slack, worst_departure
from .stress_result import MAX_MISFIT, MIN_WEIGHT, StressFit

ROUNDING = 1e-9  # [of the peak stress] a smaller residual is rounding
MIN_READINGS = 3
COPIED = 1e-6  # of the largest reading: two files of the same readings differ by less
MAX_FITTED_READINGS = 300  # of a curve; more are averaged in blocks of neighbours
MIN_FREEDOM = 1.0  # of a standard error: Student's distribution has no fewer


def fit_stress(
    curves: StressCurve | Sequence[StressCurve],
    *,
    law: str | Sequence[str] | None = None,
    min_stretch: float = 0.0,
    max_stretch: float = math.inf,
    fit_zero: bool = False,
    progress: Callable[[Any, str], Any] | None = None,
) -> StressFit:
    """Fit stress-stretch laws to one material, choose between them, and give its initial Young modulus.

    Parameters
    ----------
    curves : StressCurve or sequence of StressCurve
        Tension or compression; several curves of one material, also of different modes, share the coefficients.
    law : str or sequence of str, optional
        Names of ``LAWS``, or "ogden" for one to three terms; default: all of them, chosen by misfit.
    min_stretch, max_stretch : float
        Readings outside are not used [1].
    fit_zero : bool
        Whether each curve has an unknown zero of the stress; default: the stress is 0 at stretch 1.
    progress : callable, optional
        ``progress(iterable, text)`` wraps the laws.

    Returns
    -------
    StressFit

    Raises
    ------
    InputError
        For readings that are not a curve, too few of them, and if every law is excluded.

    Notes
    -----
    Least squares of the nominal stress. An Ogden law has mu_k alpha_k > 0, which makes it stable (Ogden 1972, eq. 22).
    A law that is unstable within the readings, or whose coefficients they do not determine, is excluded.

    Residuals of a digitised, filtered or misfitted curve are correlated: n readings count as n_eff = n (1 - r)/(1 + r),
    r the correlation of neighbours, or as the number of waves of the residuals if these are more. n_eff of the closest
    law is the number of readings of the criterion, AIC corrected for few of them (Hurvich & Tsai 1989). n_eff of each
    law sets its standard error and its degrees of freedom, n_eff less the coefficients: a law with a smooth misfit has
    few, and so a wide interval. The interval is that of the mixture of Student distributions of E over the laws,
    weighted by exp(-AICc/2) (Burnham & Anderson 2002), and of the slope at the start where the chosen law has a shape
    that was fitted. docs/howto/bench_tests.md has how often it contains the truth.
    """
    names = laws_named(law)
    given = _checked(curves, min_stretch, max_stretch)
    fit = _fitted(given, names, fit_zero, progress)
    if not fit.departure.found:
        return fit
    loaded = [without_slack(evidence_of(curve, free_zero=fit_zero)) for curve in given]
    if not any(each is not None for each in loaded):
        return fit
    rest = tuple(each or curve for each, curve in zip(loaded, given, strict=True))
    if min(len(curve.stretch) for curve in rest) < MIN_READINGS:
        return fit
    again = _fitted(rest, names, fit_zero, progress)
    return replace(
        again, notes=(*(slack_note(curve, each) for curve, each in zip(given, loaded) if each), *again.notes)
    )


def _fitted(
    given: tuple[StressCurve, ...], names: tuple[str, ...], fit_zero: bool, progress: Callable[[Any, str], Any] | None
) -> StressFit:
    """The laws, fitted to means of neighbours, and the modulus by them or, where they miss it, by the start."""
    used = tuple(_means(curve) for curve in given)
    readings = Readings(used, fit_zero)
    work = progress(names, "fitting") if progress else names
    found = [fit for fit in (solved(name, readings) for name in work) if fit is not None]
    if not found:
        limit, step = f"not enough for {names[0]}", "Give more readings, or a law with fewer coefficients."
        raise InputError("number of readings", len(readings.stress), limit, next_step=step)
    fits, effective = _weighted(found, readings)
    if not fits[0].weight:
        reasons = "; ".join(f"{fit.law}: {fit.excluded}" for fit in fits)
        step = "Give a smaller range of stretch, or another law."
        raise InputError("law of stress and stretch", "none left", reasons, next_step=step)
    known = [evidence_of(curve, free_zero=fit_zero) for curve in given]
    missed = worst_departure(known, used, readings.by_curve(fits[0].residual))
    by_laws = _estimate(fits, used, chosen=len(names) > 1)
    if not missed.found and len(names) > 1 and len(fits[0].coefficients) > 1:
        by_laws = held_by_start(by_laws, known)
    modulus, sentences = judged(by_laws, known, missed, fits[0].law, chosen=len(names) > 1)
    by_start = modulus.value != by_laws.value
    zeros = tuple(each.start.zero if by_start and each.start else zero for each, zero in zip(known, fits[0].zero))
    notes = (*sentences, *_notes(fits, used, modulus))
    return StressFit(laws=fits, young_modulus=modulus, curves=used, effective_readings=effective, zeros=zeros,
                     departure=missed, notes=notes)  # fmt: skip


MAX_STRETCH = 1e3  # of any solid
WITHIN = f", above 0 and from {1 / MAX_STRETCH:g} to {MAX_STRETCH:g}; a strain is stretch - 1"


def _checked(
    curves: StressCurve | Sequence[StressCurve], min_stretch: float, max_stretch: float
) -> tuple[StressCurve, ...]:
    """The curves as arrays within the range, by stretch. Raises InputError for readings that are not a curve."""
    given = [curves] if isinstance(curves, StressCurve) else list(curves)
    if not given:
        raise InputError("number of curves", 0, "at least 1 is needed", next_step="Give a StressCurve.")
    used = tuple(_in_range(curve, min_stretch, max_stretch) for curve in given)
    for one, other in combinations(used, 2):
        if len(one.stretch) == len(other.stretch) and all(
            np.abs(a - b).max() <= COPIED * np.abs(a).max()
            for a, b in ((one.stretch, other.stretch), (one.stress, other.stress))
        ):
            what = f"the same as those of {one.name or 'another curve'}"
            raise InputError("readings", what, "given twice", other.name, "Give each test once.")
    return used


def _in_range(curve: StressCurve, min_stretch: float, max_stretch: float) -> StressCurve:
    mode_number(curve.mode)
    stretch, stress = np.asarray(curve.stretch, float), np.asarray(curve.stress, float)
    if stretch.ndim != 1 or stretch.shape != stress.shape:
        limit = "two columns of the same length are needed"
        raise InputError("shapes of stretch and stress", f"{stretch.shape} and {stress.shape}", limit, curve.name)
    for quantity, column, valid in (
        ("stretch", stretch, (stretch > 1.0 / MAX_STRETCH) & (stretch < MAX_STRETCH)),
        ("stress", stress, np.isfinite(stress)),
    ):
        if not valid.all():
            first = int(np.argmin(valid))
            limit = "it must be finite" + WITHIN * (quantity == "stretch")
            step = "Correct or remove this reading."
            raise InputError(quantity, column[first], limit, f"{curve.name} reading {first + 1}".strip(), step)
    used = np.flatnonzero((stretch >= min_stretch) & (stretch <= max_stretch))
    used = used[np.argsort(stretch[used], kind="stable")]
    if len(used) < MIN_READINGS:
        place = f"between stretches of {min_stretch:g} and {max_stretch:g}" if len(used) < len(stretch) else ""
        limit = f"at least {MIN_READINGS} are needed"
        raise InputError("number of readings", len(used), limit, f"{curve.name} {place}".strip(), "Give more readings.")
    for quantity, column in (("stretch", stretch[used]), ("stress", stress[used])):
        if not np.ptp(column) > 0.0:
            step = "Check the columns."
            raise InputError(quantity, f"constant at {column[0]:g}", "it must vary", curve.name, step)
    if not stress[used] @ (stretch[used] - 1.0) > 0.0:
        limit = "tension, above stretch 1, has positive stress, compression negative stress"
        step = "Reverse the sign of one column, for example by --unit stress=-kPa or displacement=-mm."
        raise InputError("stress", "of the opposite sign as the strain", limit, curve.name, step)
    return replace(curve, stretch=stretch[used], stress=stress[used])


def _means(curve: StressCurve) -> StressCurve:
    """Means of neighbours, where there are more readings than a fit needs."""
    count = len(curve.stretch)
    if count <= MAX_FITTED_READINGS:
        return curve
    edges = np.linspace(0, count, MAX_FITTED_READINGS + 1).astype(int)[:-1]
    size = np.diff(edges, append=count)
    means = (np.add.reduceat(column, edges) / size for column in (curve.stretch, curve.stress))
    stretch, stress = means
    return replace(curve, stretch=stretch, stress=stress)


def _weighted(found: list[LawFit], readings: Readings) -> tuple[tuple[LawFit, ...], float]:
    """The laws with their criterion, standard errors and weights, best first, and the effective number of readings."""
    if all(fit.excluded for fit in found):  # E may be determined where its terms are not
        found = [replace(fit, excluded="") if math.isfinite(fit.standard_error) else fit for fit in found]
    found = [without_unstable(fit, readings) for fit in found]
    closest = min(found, key=lambda fit: (bool(fit.excluded), _variance(fit, readings)))
    effective = len(readings.stress) / _inflation(closest, readings)
    fits = [_with_criterion(fit, readings, effective) for fit in found]
    lowest = min((fit.criterion for fit in fits if not fit.excluded), default=0.0)
    raw = [0.0 if fit.excluded else math.exp(-0.5 * (fit.criterion - lowest)) for fit in fits]
    total = sum(raw) or 1.0
    fits = [replace(fit, weight=each / total) for fit, each in zip(fits, raw)]
    return tuple(sorted(fits, key=lambda fit: (bool(fit.excluded), -fit.weight, fit.misfit))), effective


def _variance(fit: LawFit, readings: Readings, inflation: float = 1.0) -> float:
    """Variance of the noise that a law leaves [Pa^2]; of rounding at least.

    Of n_eff independent readings a fit of p coefficients leaves the share 1 - p/n_eff.
    """
    effective = len(readings.stress) / inflation
    left = max(float(np.mean(fit.residual**2)), (ROUNDING * readings.peak) ** 2)
    return left * effective / max(effective - fit.freedom + 1.0, MIN_FREEDOM)


def _with_criterion(fit: LawFit, readings: Readings, effective: float) -> LawFit:
    """With the criterion, the standard error of E and its degrees of freedom."""
    unknowns, inflation = fit.freedom, _inflation(fit, readings)
    left = max(float(np.mean(fit.residual**2)), (ROUNDING * readings.peak) ** 2)
    # by the number of readings: a close fit leaves few more waves than it has coefficients, and n_eff would exclude it
    few = 1.0 + (unknowns + 1.0) / max(len(readings.stress) - unknowns - 1.0, 0.5)
    return replace(
        fit,
        criterion=effective * math.log(left / readings.peak**2) + 2.0 * unknowns * few,
        freedom=max(len(readings.stress) / inflation - unknowns + 1.0, MIN_FREEDOM),
        standard_error=fit.standard_error * math.sqrt(_variance(fit, readings, inflation) * inflation),
    )


def _inflation(fit: LawFit, readings: Readings) -> float:
    """``inflation_of`` the residuals; 1 where they are rounding."""
    return 1.0 if fit.misfit <= ROUNDING else inflation_of(readings.by_curve(fit.residual), fit.freedom - 1.0)


def inflation_of(residuals: Sequence[np.ndarray], lost: float) -> float:
    """How many residuals (n,) in the order of stretch count as one independent one, at least 1.

    Of autocorrelated (AR(1)) noise it is long-run variance over variance, (1 + r)/(1 - r), r the correlation of
    neighbours, which a fit of ``lost`` coefficients lowers by ``lost``/n. By the same r a smooth misfit of m half waves
    would count as 2.5 m^2/n: less than one for each wave. A wave, that is two runs of one sign, counts as one at least.
    """
    count = sum(map(len, residuals))
    changes = sum(int(np.count_nonzero(np.diff(np.sign(each)))) for each in residuals)
    squares = sum(float(each @ each) for each in residuals)
    if not squares > 0.0:
        return 1.0
    r = sum(float(each[1:] @ each[:-1]) for each in residuals) / squares
    r = min(max(r + lost / count, 0.0), 1.0 - 1.0 / count)
    return max(1.0, min((1.0 + r) / (1.0 - r), 2.0 * count / (changes + len(residuals))))


def _estimate(fits: tuple[LawFit, ...], curves: tuple[StressCurve, ...], chosen: bool) -> Estimate:
    """E of the best law with the interval of the mixture."""
    low, high = _mixture_interval([fit for fit in fits if fit.weight > 0.0])
    modes = ", ".join(dict.fromkeys(curve.mode for curve in curves))
    number = sum(len(curve.stress) for curve in curves)
    how = f"{fits[0].law}, " + ("chosen" if chosen else "given")
    source = f"initial slope of a {modes} stress-stretch curve, {how}, {number} readings; incompressible"
    return Estimate(
        "tissue_young_modulus", fits[0].young_modulus, "Pa", low, high, identifiable=low > 0.0, source=source
    )


def _mixture_interval(fits: list[LawFit]) -> tuple[float, float]:
    """The central interval of the mixture of Student distributions of E."""
    from scipy.optimize import brentq
    from scipy.stats import t

    if not all(math.isfinite(fit.standard_error) for fit in fits):
        return -math.inf, math.inf
    weights, centres, errors, freedoms = np.array(
        [(fit.weight, fit.young_modulus, max(fit.standard_error, SMALLEST), fit.freedom) for fit in fits]
    ).T

    def limit(probability: float) -> float:
        ends = centres + errors * t.ppf(probability, freedoms)
        if np.ptp(ends) <= 1e-12 * np.abs(ends).max():
            return float(ends[0])
        margin = 1e-6 * errors.max()  # rounding may leave no change of sign where one law has nearly all the weight
        low, high = ends.min() - margin, ends.max() + margin
        return brentq(lambda e: weights @ t.cdf((e - centres) / errors, freedoms) - probability, low, high)

    return limit(0.5 - 0.5 * LEVEL), limit(0.5 + 0.5 * LEVEL)


def _notes(fits: tuple[LawFit, ...], curves: tuple[StressCurve, ...], modulus: Estimate) -> tuple[str, ...]:
    """Sentences on the limits of the fit."""
    best, notes = fits[0], []
    if best.misfit > MAX_MISFIT:
        notes.append(
            f"The misfit of {best.law} is {percent(best.misfit)} of the largest stress, above {percent(MAX_MISFIT)}: "
            "the law does not describe this curve, and the modulus depends on its form."
        )
    comparable = [fit for fit in fits if fit.weight >= MIN_WEIGHT]
    if len(comparable) > 1 and modulus.value == best.young_modulus:
        each = ", ".join(f"{fit.law} {fit.young_modulus:.4g} Pa ({percent(fit.weight)})" for fit in comparable)
        notes.append(f"Several laws fit comparably, with these moduli and weights: {each}; the interval includes them.")
    if not modulus.identifiable:
        notes.append("The interval of the modulus contains 0: the readings do not determine it.")
    gap = min(float(np.min(np.abs(curve.stretch - 1.0))) for curve in curves)
    span = max(float(np.max(np.abs(curve.stretch - 1.0))) for curve in curves)
    if gap > 0.2 * span:
        notes.append(f"No reading is nearer to stretch 1 than {gap:.3g}: the initial modulus is an extrapolation.")
    notes += [sentence for curve in curves if (sentence := _fall(curve))]
    for mode, (low, high) in best.stable.items():
        if low > 0.0 or high < math.inf:
            notes.append(f"{best.law}, {mode}: stable (Drucker) {_between(low, high)}, not beyond.")
    return tuple(notes)


def _fall(curve: StressCurve) -> str:
    """Sentence on a stress that falls while the strain grows by more than a law may miss; empty without."""
    peak = float(np.abs(curve.stress).max())
    for side in (curve.stretch >= 1.0, curve.stretch < 1.0):
        order = np.flatnonzero(side)[np.argsort(np.abs(curve.stretch[side] - 1.0), kind="stable")]
        load = np.abs(curve.stress[order])
        highest = np.maximum.accumulate(load) if len(load) else load
        fallen = np.flatnonzero(highest - load > MAX_MISFIT * peak)
        if len(fallen):
            first = order[int(load[: fallen[0] + 1].argmax())]
            option = "max" if curve.stretch[first] > 1.0 else "min"
            return (
                f"{curve.name or 'The curve'}: the stress falls after a stretch of {curve.stretch[first]:.3g}, as of a "
                f"specimen that tears or slips; no law here does. Limit the range by --{option}-stretch."
            )
    return ""


def _between(low: float, high: float) -> str:
    if low > 0.0 and high < math.inf:
        return f"between stretches of {low:.3g} and {high:.3g}"
    return f"down to a stretch of {low:.3g}" if low > 0.0 else f"up to a stretch of {high:.3g}"
