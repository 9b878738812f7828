# SPDX-License-Identifier: Apache-2.0
"""Friction from the second insertion and cutting force by subtraction, site by site (paper secs. 2.2 and 2.3), with the
range of an oscillation of the cutting force, and the estimates that follow."""

import math
from dataclasses import dataclass, replace

import numpy as np

from ...errors import InputError
from ...mechanics.foundation import LAWS
from ...models.parameter_units import UNITS
from ...recording import Recording
from ...segmentation import Events, segment
from ..diagnostics import FitInputs
from ..estimates import Estimate, mean_estimate, pool
from ..one_layer.segmented_recording import SegmentedRecording
from ..statistics.noise import TWO_SIDED, noise_of
from ..statistics.regression import VERY_STRONG_BIC, least_squares, line
from ..strokes import strokes_of, undelayed_depth
from .bias_terms import bias_sentences, cutting_range, doubts_of, spreading_force, terms_of
from .result import Site, TwoPass
from .second_pass import (
    bin_means,
    friction_forms,
    friction_window,
    lasting_drops,
    not_friction_only,
    stiffness_share,
    unevenness,
)

CUTTING_WINDOW_M = 8e-3  # [m] after the puncture, as in the paper's Fig. 7
GRID_STEP_M = 0.05e-3  # [m]
FINE_STEP_M = 0.01e-3  # [m] of the first pass only; the second pass is smooth
FREE_MARGIN = 0.1  # [of the puncture's indentation] the contact depth is not known better
MIN_FREE_SAMPLES = 50  # of free travel, for its noise
POINTS_PER_BLOCK = 10  # grid points per independent value: 0.5 mm of travel, longer than the filter
MIN_CYCLES = 3  # fewer are not an oscillation
MIN_OSCILLATION_SIGMA = 8.0  # [standard deviations of the noise] a thousand points of noise have a range of about 6.5
TWO_PASS = "second insertion at the same site"
MIN_OSCILLATION = 0.25  # [of the mean difference] less may be a local variation of friction between the passes


@dataclass(frozen=True, eq=False)
class Pair:
    """First and second insertion at one site, with contact depth [m] and puncture indentation [m] of the first."""

    first: SegmentedRecording
    second: Recording
    contact: float
    puncture: float


def two_pass_estimates(
    singles: list[SegmentedRecording], seconds: list, own: dict, given: FitInputs, foundation: str
) -> tuple[TwoPass | None, dict, dict]:
    """The result over all pairs, the estimates that it replaces, and the reason for each recording that was refused."""
    pairs = [
        Pair(single, second, own[single]["contact_depth"].value, own[single]["puncture_indentation"].value)
        for single, second in zip(singles, seconds)
        if second is not None and single in own
    ]
    spreading = spreading_force(given.needle, given.bench.get("tissue_young_modulus"))
    two_pass, refused = subtract(pairs, spreading)
    by_single = {pairs[k].first: sentence for k, sentence in refused.items()}
    return two_pass, {} if two_pass is None else _replaced(two_pass) | _bent_friction(two_pass, foundation), by_single


def _bent_friction(two_pass: TwoPass, foundation: str) -> dict[str, Estimate]:
    """Friction under a nonlinear form of the foundation; empty for a linear one, and with too few bins."""
    forms = () if foundation == "linear" else two_pass.forms(foundation)
    source = f"{TWO_PASS}, {foundation} foundation, least squares with intercept"
    own = [
        {
            name: Estimate(
                name, value, UNITS[name], form.low[name], form.high[name],
                identifiable=name in form.identifiable, source=source,
            )
            for name, value in form.values.items()
        }
        for form in forms
    ]  # fmt: skip
    return pool(own)


def _replaced(two_pass: TwoPass) -> dict[str, Estimate]:
    bound = ", an upper bound" if two_pass.upper_bound else ""
    by_slope, by_difference = f"{TWO_PASS}, least squares with intercept", f"first minus {TWO_PASS}{bound}"
    own = [
        {
            name: Estimate(name, value, UNITS[name], value - half, value + half, source=source)
            for name, value, half, source in (
                ("friction_per_length", site.friction_slope, site.friction_slope_half, by_slope),
                ("cutting_force", site.cutting, site.cutting_half, by_difference),
            )
        }
        for site in two_pass.sites
    ]
    pooled = pool(own)
    pooled["cutting_force"] = replace(pooled["cutting_force"], identifiable=not two_pass.upper_bound)
    extremes = {} if two_pass.upper_bound else {each.name: each for each in cutting_oscillation(two_pass) or ()}
    return pooled | extremes


def subtract(pairs: list[Pair], spreading: tuple[float, float] | None = None) -> tuple[TwoPass | None, dict[int, str]]:
    """The two-pass procedure over the sites; each pass has its own zero, of depth that of the first.

    The passes may differ in rate, speed, start and largest depth: each is averaged onto one grid, over the depths that
    both reached, not deeper than the hole of the first. ``spreading`` [N] is the result of ``spreading_force``. If a
    pair cannot be subtracted, the others still are: the second value has the reason, by its index in ``pairs``. The
    first value is None if no pair can be subtracted.
    """
    sites, refused = [], {}
    for k, pair in enumerate(pairs):
        try:
            sites.append(_site(pair, segment(pair.second)))
        except InputError as error:
            refused[k] = f"The second pass cannot be used: {error}"
    return (_all_sites(sites, spreading) if sites else None), refused


def _all_sites(sites: list[Site], spreading: tuple[float, float] | None) -> TwoPass:
    found = [reasons for reasons in map(not_friction_only, sites) if reasons]
    terms = terms_of(sites, spreading)
    limits = cutting_range(sites, terms, bool(found))
    doubts = dict.fromkeys(doubt for site in sites for doubt in site.doubts)
    result = TwoPass(
        sites=tuple(sites),
        upper_bound=bool(found),
        biases=bias_sentences(sites, found, terms, tuple(doubts), limits),
        terms=terms,
        cutting_range=limits,
    )
    return replace(result, biases=(*result.biases, *_bend(result)))


def _bend(two_pass: TwoPass) -> tuple[str, ...]:
    """A sentence if the friction of the second passes, over their whole depth, is that of a nonlinear foundation."""
    bic = two_pass.bic
    best = next(iter(bic), "linear")
    if best == "linear" or two_pass.upper_bound or bic["linear"] - bic[best] < VERY_STRONG_BIC:
        return ()
    return (
        f"Over its whole depth the friction of the second passes bends, as on a {best} foundation (BIC lower by "
        f"{bic['linear'] - bic[best]:.0f} than that of a line): friction_per_length is that of the line up to where "
        f"it holds. Identify with model='{LAWS[best]}' for the bend.",
    )


def _site(pair: Pair, events: Events) -> Site:
    # indentations; after the puncture they are the embedded length
    depth_1, force_1, zero_1 = _zeroed(pair, pair.first.strokes.depth_in - pair.contact, pair.first.strokes.force_in)
    depth_2, force_2, zero_2 = _zeroed(pair, *_insertion_of(pair.second, events, pair.contact))
    in_hole = depth_2 <= depth_1.max()  # deeper, the second pass cuts too
    depth_2, force_2 = depth_2[in_hole], force_2[in_hole]
    grid = _grid(pair, min(depth_1.max(), max(depth_2, default=0.0)))
    first, second = (_binned(grid, *each, GRID_STEP_M) for each in ((depth_1, force_1), (depth_2, force_2)))
    start, stop, reason = friction_window(depth_2, force_2, pair.puncture)
    friction, intercept = _friction_line(*bin_means(depth_2, force_2, start, stop))
    deep = bin_means(depth_2, force_2, start, float(depth_2.max()))
    blocks = [_block_means(each) for each in (grid, first, first - second)]
    slope, _, error, t = line(blocks[0], blocks[2])
    cutting = mean_estimate("cutting_force", blocks[2], "N", "")
    share = stiffness_share((depth_1, force_1), (depth_2, force_2), pair.puncture)
    drops = [(each.depth - pair.contact, each.drop) for each in events.punctures]
    oscillating, noise = _fine_difference(grid, second, (depth_1, force_1), (depth_2, force_2))
    return Site(
        grid=grid,
        first=first,
        second=second,
        difference=first - second,
        oscillating=oscillating,
        noise=noise,
        friction_depth=depth_2,
        friction_force=force_2,
        friction_slope=friction[0],
        friction_slope_half=friction[1],
        friction_intercept=intercept[0],
        friction_end=stop,
        friction_end_reason=reason,
        cutting=cutting.value,
        cutting_half=math.hypot(cutting.high - cutting.value, zero_1, zero_2),
        friction_intercept_half=math.hypot(intercept[1], zero_2),
        puncture=pair.puncture,
        exit=_exit(pair),
        first_slope=line(*blocks[:2])[0],
        slope_difference=slope,
        slope_difference_half=t * error,
        mean_depth=float(grid.mean()),
        stiffness_share=share[0],
        stiffness_share_half=share[1],
        drops=lasting_drops(depth_2, force_2, drops),
        unevenness=unevenness(blocks[0], blocks[2]),
        forms=friction_forms(*deep, np.ones((len(deep[0]), 1))),
        doubts=doubts_of(pair.first, pair.second, events, grid, CUTTING_WINDOW_M),
    )


def _friction_line(depth: np.ndarray, force: np.ndarray) -> tuple[tuple, tuple]:
    """Slope and intercept, each with its half width."""
    if len(depth) < 3:
        limit = "at least 3 with samples are needed for the friction line"
        step = "Record the second pass deeper or at a higher rate."
        raise InputError("number of 0.25 mm bins of the second pass", len(depth), limit, next_step=step)
    values, covariance, t = least_squares(np.column_stack([depth, np.ones_like(depth)]), force)
    half = t * np.sqrt(np.diagonal(covariance))
    return tuple((float(value), float(width)) for value, width in zip(values, half))


def _fine_difference(grid: np.ndarray, second: np.ndarray, cut: tuple, uncut: tuple) -> tuple[np.ndarray, float]:
    """First minus second pass in fine steps, and the noise of a first pass that does not cut, in such steps."""
    fine = np.arange(grid[0], grid[-1], FINE_STEP_M)
    cutting, friction = (_binned(fine, *each, FINE_STEP_M) for each in (cut, uncut))
    residual = friction - np.polyval(np.polyfit(fine, friction, 2), fine)
    # with fewer samples per step, less noise is averaged out
    samples = [
        max(np.count_nonzero((depth > fine[0]) & (depth < fine[-1])) / len(fine), 1) for depth, _ in (cut, uncut)
    ]
    return cutting - np.interp(fine, grid, second), float(np.std(residual)) * max(samples[1] / samples[0], 1.0) ** 0.5


def _block_means(values: np.ndarray) -> np.ndarray:
    return np.array([block.mean() for block in np.array_split(values, len(values) // POINTS_PER_BLOCK)])


def _exit(pair: Pair) -> float:
    """Indentation [m] of the first pass at its exit from the tissue; NaN without an exit."""
    event = pair.first.events.exit
    return np.nan if event is None else event.depth - pair.contact


def _grid(pair: Pair, deepest: float) -> np.ndarray:
    """The common grid of indentation, beyond the smeared puncture."""
    end = min(deepest, pair.puncture + CUTTING_WINDOW_M)
    first = pair.first.recording
    smear = float(np.max(np.abs(first.velocity))) * first.card.filter_length / first.rate  # of the puncture [m]
    grid = np.arange(pair.puncture + smear + GRID_STEP_M, end, GRID_STEP_M)
    if len(grid) < 3 * POINTS_PER_BLOCK:
        raise InputError(
            "common depth of both passes after the puncture",
            f"{1e3 * max(end - pair.puncture, 0.0):.2f} mm",
            f"at least {1e3 * 3 * POINTS_PER_BLOCK * GRID_STEP_M:g} mm are needed",
            place=pair.second.card.source,
            next_step="Insert both passes deeper beyond the puncture.",
        )
    return grid


def _insertion_of(recording: Recording, events: Events, contact: float) -> tuple[np.ndarray, np.ndarray]:
    """Indentation and force of the insertion stroke; a second pass may have neither contact nor puncture."""
    strokes = strokes_of(recording, events)
    if len(strokes.depth_in):
        return strokes.depth_in - contact, strokes.force_in
    deepest = int(np.argmax(recording.depth)) + 1
    return undelayed_depth(recording)[:deepest] - contact, recording.force[:deepest]


def _zeroed(pair: Pair, depth: np.ndarray, force: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Indentation, force less the sensor's zero of this pass, and the half width of the zero's interval [N].

    The zero is the mean force clearly above the surface, by a tenth of the puncture's indentation; a pass with too
    little of that has the zero of the first.
    """
    free = force[depth < -FREE_MARGIN * pair.puncture]
    if len(free) >= MIN_FREE_SAMPLES:
        noise = noise_of(free - free.mean(), len(free), pair.first.recording.card.filter_length, 1.0)
        return depth, force - float(free.mean()), TWO_SIDED * math.sqrt(noise.long_run / len(free))
    fit = next(iter(pair.first.fits.values()))
    low, high = fit.low["force_offset"], fit.high["force_offset"]
    return depth, force - fit.values["force_offset"], 0.5 * (high - low)


def _binned(grid: np.ndarray, depth: np.ndarray, force: np.ndarray, step: float) -> np.ndarray:
    """Mean force within half a grid step of each grid point; interpolated for a step without samples."""
    bins = np.searchsorted(grid + 0.5 * step, depth)
    inside = (depth >= grid[0] - 0.5 * step) & (bins < len(grid))
    count = np.bincount(bins[inside], minlength=len(grid))
    total = np.bincount(bins[inside], force[inside], minlength=len(grid))
    order = np.argsort(depth, kind="stable")
    return np.where(count > 0, total / np.maximum(count, 1), np.interp(grid, depth[order], force[order]))


def cutting_oscillation(two_pass: TwoPass) -> tuple[Estimate, Estimate] | None:
    """Mean trough and mean crest [N] of the difference between the passes, over the sites; None without oscillation.

    The names are ``cutting_force_low`` and ``cutting_force_high``; the interval is that over the sites. A bias of the
    difference is the same in both.
    """
    extremes = [found for found in map(_extremes, two_pass.sites) if found is not None]
    if 2 * len(extremes) <= len(two_pass.sites):
        return None
    source = "mean trough and crest of first minus second insertion during stick–slip"
    low, high = zip(*extremes)
    return tuple(
        mean_estimate(f"cutting_force_{name}", list(values), "N", source)
        for name, values in (("low", low), ("high", high))
    )


def _extremes(site: Site) -> tuple[float, float] | None:
    """Mean trough and crest [N] at one site; None without oscillation."""
    if not len(site.oscillating):
        return None
    min_range = max(MIN_OSCILLATION_SIGMA * site.noise, MIN_OSCILLATION * abs(float(np.mean(site.oscillating))))
    troughs, crests = _troughs_and_crests(site.oscillating, min_range)
    # the first half cycle depends on the puncture
    return (float(np.mean(troughs[1:])), float(np.mean(crests[1:]))) if len(troughs) > MIN_CYCLES else None


def _troughs_and_crests(values: np.ndarray, min_range: float) -> tuple[list[float], list[float]]:
    """Troughs and crests of ``values`` (n,) that differ by ``min_range`` or more, in order."""
    troughs, crests = [], []
    lowest = highest = float(values[0])
    rising = None
    for value in values:
        lowest, highest = min(lowest, value), max(highest, value)
        if rising is not False and highest - value >= min_range:  # after a crest
            crests.append(float(highest))
            rising, lowest = False, value
        elif rising is not True and value - lowest >= min_range:  # after a trough
            troughs.append(float(lowest))
            rising, highest = True, value
    pairs = min(len(troughs), len(crests))
    return troughs[:pairs], crests[:pairs]
