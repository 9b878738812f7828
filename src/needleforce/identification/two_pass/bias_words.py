# SPDX-License-Identifier: Apache-2.0
"""What two passes cannot separate, in plain words, the weightiest first."""

from .result import Bias, Site

ZERO = 1e-4  # [m] of shift between two zeros of depth


def in_words(sites: list[Site], found: list, terms: tuple[Bias, ...], doubts: tuple[str, ...], limits) -> tuple:
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
