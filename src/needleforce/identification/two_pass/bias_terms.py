# SPDX-License-Identifier: Apache-2.0
"""What a subtraction of two passes cannot separate, term by term: its size, what it adds to the cutting force, and
in plain words."""

import math
from math import nan

import numpy as np

from ..estimates import Estimate, mean_estimate
from .result import BiasTerm, Site

MOST_POISSON_RATIO = 0.5  # no tissue has more; the paper gives none
ZERO = 1e-4  # [m] of shift between two zeros of depth


def spreading_force(needle, tissue: Estimate | None) -> tuple[float, float] | None:
    """Least and greatest force [N] that opens a slit to the needle's radius, pi / 4 E' R²; None if either is missing.

    Azar & Hayward 2008, in plane strain: E' = E / (1 - nu²), with nu from 0 to 0.5, as a log does not tell it; E is
    the tissue's modulus by the tension test.
    """
    if needle is None or tissue is None:
        return None
    least = 0.25 * math.pi * tissue.value * (0.5 * needle.outer_diameter) ** 2
    return least, least / (1.0 - MOST_POISSON_RATIO**2)


def terms_of(sites: list[Site], spreading: tuple[float, float] | None) -> tuple[BiasTerm, ...]:
    """The four terms, over the sites. What no interval bounds is bounded by the puncture's indentation."""
    return _dimple(sites), _intercept(sites, spreading), _friction(sites), _spreading(spreading)


def cutting_range(sites: list[Site], terms: tuple[BiasTerm, ...], upper_bound: bool) -> tuple[float, float]:
    """Least and greatest true cutting force [N] with all terms: no pull, and not more than the whole first pass.

    An upper bound leaves 0 as the least.
    """
    cutting, whole = (float(np.mean(each)) for each in zip(*((site.cutting, site.first.mean()) for site in sites)))
    low, high = (float(cutting - sum(getattr(term, name) for term in terms)) for name in ("adds_high", "adds_low"))
    high = max(min(high, whole), 0.0)
    return (0.0 if upper_bound else min(max(low, 0.0), high)), high


def _mean(sites: list[Site], name: str, unit: str = "N/m") -> Estimate:
    """Mean over the sites with its interval; of one site its own."""
    half = getattr(sites[0], f"{name}_half", nan)
    return mean_estimate(name, [getattr(site, name) for site in sites], unit, "", half)


def _dimple(sites: list[Site]) -> BiasTerm:
    """A dimple of the first pass takes f1 d1 away; it lies between none and all of the puncture's indentation."""
    friction = max(*(_mean(sites, name).value for name in ("first_slope", "friction_slope")), 0.0)
    puncture = _mean(sites, "puncture", "m").value
    left = [site.exit for site in sites if 0.0 <= site.exit <= site.puncture]
    value = float(np.mean(left)) if left else nan
    said = "A surface that stays dimpled on the first pass lowers the cutting force, by up to "
    said += f"{force(friction * puncture)} if all of the puncture indentation stays"
    if left:
        said += f", by {force(friction * value)} if it stays where that pass left the tissue, {1e3 * value:.2g} mm"
    said += "; parallel curves do not exclude it."
    return BiasTerm("dimple", value, 0.0, puncture, "m", -friction * puncture, 0.0, said)


def _intercept(sites: list[Site], spreading: tuple[float, float] | None) -> BiasTerm:
    """Of the second pass, S2 - f2 d2: a dimple of that pass adds f2 d2 = S2 - intercept."""
    found = _mean(sites, "friction_intercept", "N")
    whole = max(_mean(sites, "friction_slope").value, 0.0) * _mean(sites, "puncture", "m").value
    limits, reading = (0.0, whole + found.high), "force that spreads the hole"
    if spreading is not None:
        limits, reading = spreading, f"force that spreads the hole, {span(*spreading)} by needle and tissue"
    adds = max(limits[0] - found.high, 0.0), max(limits[1] - found.low, 0.0)
    said = (
        f"The line through the second pass meets zero depth at {force(found.value)} ({span(found.low, found.high)}): "
    )
    said += f"{reading}, less any dimple of that pass, which would raise the cutting force by {span(*adds)}; forced "
    said += "through the origin the line would bias the friction."
    return BiasTerm("intercept", found.value, float(found.low), float(found.high), "N", *map(float, adds), said)


def _friction(sites: list[Site]) -> BiasTerm:
    """Unequal friction tilts the difference by (f1 - f2) h, and raises its mean by as much at the mean depth."""
    found, first = _mean(sites, "slope_difference"), _mean(sites, "first_slope").value
    depth = _mean(sites, "mean_depth", "m").value
    adds = found.low * depth, found.high * depth
    second, apart, low, high = map(per_length, (first - found.value, found.value, found.low, found.high))
    said = f"After the puncture the first pass grows by {per_length(first)}, the second by {second}: "
    said += f"apart by {apart} ({low} to {high}). If that is friction, it adds "
    said += f"{force(found.value * depth)} ({span(*adds)}) to the cutting force; "
    tilted = found.low > 0.0 or found.high < 0.0
    said += "the difference is not constant." if tilted else "it agrees with equal friction."
    return BiasTerm(
        "unequal_friction", found.value, float(found.low), float(found.high), "N/m", *map(float, adds), said
    )


def _spreading(spreading: tuple[float, float] | None) -> BiasTerm:
    low, high = spreading or (nan, nan)
    size = "untold without the needle and the tissue's modulus" if spreading is None else span(low, high)
    said = f"The force that spreads the hole, {size}, is taken as equal on both passes: it leaves the difference and "
    said += "stays in the second pass."
    return BiasTerm("spreading_force", 0.5 * (low + high), low, high, "N", 0.0, 0.0, said)


def in_words(sites: list[Site], found: list, terms: tuple[BiasTerm, ...], doubts: tuple[str, ...], limits) -> tuple:
    """Every sentence on the subtraction; ``found`` are the reasons why second passes are more than friction."""
    told = [_more_than_friction(found, len(sites))] if found else []
    told += [term.sentence for term in terms]
    friction = sum(site.friction_slope for site in sites) / len(sites)
    told.append(
        "Second passes count in the first's zero of depth: a shift between the zeros adds "
        f"{force(friction * ZERO)} for each {1e3 * ZERO:g} mm, which no reading of the force tells from a dimple."
    )
    told += doubts
    told.append(
        f"With these biases the cutting force lies between {force(limits[0])} and {force(limits[1])}; its interval, of "
        "noise and scatter alone, does not know them."
    )
    return tuple(told)


def force(value: float) -> str:
    """A force [N] as text: three digits, in mN below one newton."""
    return f"{value:.3g} N" if abs(value) >= 1.0 else f"{1e3 * value:.3g} mN"


def span(low: float, high: float) -> str:
    """Two forces [N] as text."""
    return f"{force(low)} to {force(high)}"


def per_length(slope: float) -> str:
    """A friction per length [N/m] as text."""
    return f"{slope:.3g} N/m"


def _more_than_friction(found: list[tuple[str, ...]], count: int) -> str:
    reasons = dict.fromkeys(reason for each in found for reason in each)
    return (
        f"{len(found)} of {count} second passes are more than friction: they {'; they '.join(reasons)}. The difference "
        "is reported as an upper bound of the cutting force: it holds what the first pass deforms beyond its puncture. "
        "What the second pass still cuts is missing from it."
    )
