# SPDX-License-Identifier: Apache-2.0
"""What a subtraction of two passes cannot separate: the size of each bias term and its effect on the cutting force, and
doubts on a pair, in sentences."""

import math
from math import nan

import numpy as np

from ...core import Needle
from ...recording import Recording
from ...segmentation import Events
from ..estimates import Estimate, mean_estimate
from ..one_layer.segmented_recording import SegmentedRecording
from .result import BiasTerm, Site

MAX_POISSON_RATIO = 0.5  # of an incompressible tissue; the paper gives no value
ZERO_SHIFT_M = 1e-4  # [m] example of a shift between the depth zeros of two passes
SPEED_TOLERANCE = 0.1  # [of the higher speed] stages keep their speed within 1 or 2 %
MIN_WINDOW_SHARE = 0.9  # [of the window]


def spreading_force(needle: Needle | None, tissue: Estimate | None) -> tuple[float, float] | None:
    """Lower and upper limit [N] of the force that opens a slit to the needle's radius, pi / 4 E' R²; None without
    needle or tissue.

    Azar & Hayward 2008, in plane strain: E' = E / (1 - nu²) with the unknown nu from 0 to 0.5; E is the tissue's
    modulus from the tension test.
    """
    if needle is None or tissue is None:
        return None
    low = 0.25 * math.pi * tissue.value * (0.5 * needle.outer_diameter) ** 2
    return low, low / (1.0 - MAX_POISSON_RATIO**2)


def terms_of(sites: list[Site], spreading: tuple[float, float] | None) -> tuple[BiasTerm, ...]:
    """The four terms, over the sites. A term without an interval is limited by the indentation at the puncture."""
    return _dimple(sites), _intercept(sites, spreading), _friction(sites), _spreading(spreading)


def cutting_range(sites: list[Site], terms: tuple[BiasTerm, ...], upper_bound: bool) -> tuple[float, float]:
    """Lower and upper limit [N] of the true cutting force with all terms, from 0 to the mean force of the first pass.

    For an upper bound of the cutting force the lower limit is 0.
    """
    cutting, total = (float(np.mean(each)) for each in zip(*((site.cutting, site.first.mean()) for site in sites)))
    low, high = (float(cutting - sum(getattr(term, name) for term in terms)) for name in ("adds_high", "adds_low"))
    high = max(min(high, total), 0.0)
    return (0.0 if upper_bound else min(max(low, 0.0), high)), high


def _mean(sites: list[Site], name: str, unit: str = "N/m") -> Estimate:
    """Mean over the sites with its interval; for one site its own."""
    half = getattr(sites[0], f"{name}_half", nan)
    return mean_estimate(name, [getattr(site, name) for site in sites], unit, "", half)


def _term(name: str, unit: str, value: tuple, adds: tuple, sentence: str) -> BiasTerm:
    """A term with its value and limits, and what these add to the cutting force."""
    middle, low, high = map(float, value)
    added = {"adds_low": float(adds[0]), "adds_high": float(adds[1])}
    return BiasTerm(name=name, value=middle, low=low, high=high, unit=unit, sentence=sentence, **added)


def _dimple(sites: list[Site]) -> BiasTerm:
    """A dimple d1 of the first pass reduces the cutting force by f1 d1; it is 0 to the puncture indentation."""
    friction = max(*(_mean(sites, name).value for name in ("first_slope", "friction_slope")), 0.0)
    puncture = _mean(sites, "puncture", "m").value
    exits = [site.exit for site in sites if 0.0 <= site.exit <= site.puncture]
    value = float(np.mean(exits)) if exits else nan
    sentence = "If the surface stays dimpled during the first pass, the cutting force is too low: by up to "
    sentence += f"{force(friction * puncture)} if the puncture indentation remains completely"
    if exits:
        sentence += f", by {force(friction * value)} for a dimple as deep as that pass's exit, {1e3 * value:.2g} mm"
    sentence += ". Parallel curves do not exclude a dimple."
    return _term("dimple", "m", (value, 0.0, puncture), (-friction * puncture, 0.0), sentence)


def _intercept(sites: list[Site], spreading: tuple[float, float] | None) -> BiasTerm:
    """Intercept of the second pass, S2 - f2 d2: a dimple d2 of that pass adds f2 d2 = S2 - intercept."""
    found = _mean(sites, "friction_intercept", "N")
    dimple = max(_mean(sites, "friction_slope").value, 0.0) * _mean(sites, "puncture", "m").value
    limits, reading = (0.0, dimple + found.high), "the force that spreads the hole"
    if spreading is not None:
        limits, reading = spreading, f"the force that spreads the hole ({span(*spreading)} from needle and tissue)"
    adds = max(limits[0] - found.high, 0.0), max(limits[1] - found.low, 0.0)
    sentence = (
        f"At zero depth the line through the second pass has the force {force(found.value)} "
        f"({span(found.low, found.high)}): {reading}, minus the effect of a dimple of that pass. Such a dimple would "
        f"raise the cutting force by {span(*adds)}. A line forced through the origin would bias the friction."
    )
    return _term("intercept", "N", (found.value, found.low, found.high), adds, sentence)


def _friction(sites: list[Site]) -> BiasTerm:
    """Unequal friction adds (f1 - f2) h to the difference, h the embedded length; to its mean at the mean depth."""
    found, first = _mean(sites, "slope_difference"), _mean(sites, "first_slope").value
    depth = _mean(sites, "mean_depth", "m").value
    adds = found.low * depth, found.high * depth
    texts = (friction_text(each) for each in (first - found.value, found.value, found.low, found.high))
    second, difference, low, high = texts
    sentence = f"After the puncture the force of the first pass rises by {friction_text(first)}, that of the second by "
    sentence += f"{second}, a difference of {difference} ({low} to {high}). If that is friction, it adds "
    sentence += f"{force(found.value * depth)} ({span(*adds)}) to the cutting force; "
    tilted = found.low > 0.0 or found.high < 0.0
    sentence += "the difference of the forces is not constant." if tilted else "it agrees with equal friction."
    return _term("unequal_friction", "N/m", (found.value, found.low, found.high), adds, sentence)


def _spreading(spreading: tuple[float, float] | None) -> BiasTerm:
    low, high = spreading or (nan, nan)
    size = "unknown without the needle and the tissue's modulus" if spreading is None else span(low, high)
    sentence = (
        f"The force that spreads the hole ({size}) is assumed equal in both passes: it cancels in the difference "
    )
    sentence += "and remains in the second pass."
    return _term("spreading_force", "N", (0.5 * (low + high), low, high), (0.0, 0.0), sentence)


def bias_sentences(
    sites: list[Site],
    found: list[tuple[str, ...]],
    terms: tuple[BiasTerm, ...],
    doubts: tuple[str, ...],
    limits: tuple[float, float],
) -> tuple[str, ...]:
    """Every sentence on the subtraction; ``found`` are the reasons why second passes contain more than friction."""
    sentences = [_more_than_friction(found, len(sites))] if found else []
    sentences += [term.sentence for term in terms]
    friction = sum(site.friction_slope for site in sites) / len(sites)
    sentences.append(
        "Both passes must have the same zero of depth: a shift between the zeros adds "
        f"{force(friction * ZERO_SHIFT_M)} to the cutting force per {1e3 * ZERO_SHIFT_M:g} mm, and the force does not "
        "distinguish it from a dimple."
    )
    sentences += doubts
    sentences.append(
        f"With these biases the cutting force is between {force(limits[0])} and {force(limits[1])}; its interval "
        "includes only noise and scatter, not these biases."
    )
    return tuple(sentences)


def force(value: float) -> str:
    """A force [N] as text: three digits, in mN below one newton."""
    return f"{value:.3g} N" if abs(value) >= 1.0 else f"{1e3 * value:.3g} mN"


def span(low: float, high: float) -> str:
    """Two forces [N] as text."""
    return f"{force(low)} to {force(high)}"


def friction_text(slope: float) -> str:
    """A friction per length [N/m] as text."""
    return f"{slope:.3g} N/m"


def doubts_of(
    first: SegmentedRecording, second: Recording, events: Events, grid: np.ndarray, window: float
) -> tuple[str, ...]:
    """Sentences on different speeds, a short window, a second contact above the first, a further puncture."""
    doubts = []
    speeds = [speed_of(first.recording), speed_of(second)]
    if min(speeds) < (1.0 - SPEED_TOLERANCE) * max(speeds):
        doubts.append(
            f"The speeds of first and second pass are {1e3 * speeds[0]:.3g} and {1e3 * speeds[1]:.3g} mm/s: the "
            "difference includes the change of friction and cutting force with speed."
        )
    if np.ptp(grid) < MIN_WINDOW_SHARE * window:
        doubts.append(
            f"The passes share {1e3 * np.ptp(grid):.1f} mm after the puncture, less than the {1e3 * window:.0f} mm of "
            "the paper."
        )
    if _above(first, events, second):
        doubts.append(
            "The second pass has contact at a smaller depth than the first: its zero of depth may differ, or the "
            "surface was pulled up."
        )
    start = first.events.punctures[0].depth - first.events.punctures[0].indentation
    if any(grid[0] < puncture.depth - start < grid[-1] for puncture in first.events.punctures[1:]):
        doubts.append(
            "The force of the first pass drops again within the window: the difference includes a further deformation, "
            "unless the cutting force oscillates."
        )
    return tuple(doubts)


def speed_of(recording: Recording) -> float:
    """Median speed [m/s] of the insertion stroke, over the moving samples."""
    inwards = recording.velocity[: int(np.argmax(recording.depth)) + 1]
    moving = inwards > 0.1 * float(np.max(inwards, initial=0.0))
    return float(np.median(inwards[moving])) if moving.any() else 0.0


def _above(first: SegmentedRecording, events: Events, second: Recording) -> bool:
    """True if the second contact is above the first, beyond the uncertainty of both."""
    one, other = first.events.contact, events.contact
    if one is None or other is None:
        return False
    return float(second.depth[other.high]) < float(first.recording.depth[one.low])


def _more_than_friction(found: list[tuple[str, ...]], count: int) -> str:
    reasons = dict.fromkeys(reason for each in found for reason in each)
    return (
        f"{len(found)} of {count} second passes contain more than friction: they {'; they '.join(reasons)}. The "
        "difference is therefore an upper bound of the cutting force: it includes the deformation by the first pass "
        "beyond its puncture. Any cutting in the second pass is missing from it."
    )
