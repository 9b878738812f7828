# SPDX-License-Identifier: Apache-2.0
"""Friction from the second insertion and cutting by subtraction, site by site (paper secs. 2.2 and 2.3), with the
range over which the cutting force oscillates."""

from dataclasses import dataclass

import numpy as np

from ...errors import InputError
from ...recording import Recording
from ...segmentation import Events, segment
from ..estimates import Estimate, mean_estimate
from ..one_layer.fit_recording import SegmentedRecording
from ..statistics.regression import least_squares, line
from ..strokes import strokes_of, undelayed_depth
from .bias_terms import cutting_range, in_words, terms_of
from .result import Site, TwoPass
from .second_pass import bin_means, friction_window, lasting_drops, not_friction_only, stiffness_share, unevenness

CUTTING_WINDOW = 8e-3  # [m] after the puncture, as in the paper's Fig. 7
GRID = 0.05e-3  # [m]
FINE = 0.01e-3  # [m]; of the first pass alone, the second is smooth
BLOCK = 10  # grid points that count as one: 0.5 mm of travel outlasts the filter
ALIKE = 0.1  # of the faster: stages keep their speed to a percent or two
SHORT = 0.9  # of the window
FEWEST = 3  # cycles: fewer are a wander
CLEAR = 8.0  # standard deviations of the noise: a thousand points of noise alone span some 6.5
LEAST = 0.25  # of the mean difference: less is not told apart from two passes that differ in friction here and there


@dataclass(frozen=True, eq=False)
class Pair:
    """One site's first insertion, its second, and from the first contact [m] and puncture [m of indentation]."""

    first: SegmentedRecording
    second: Recording
    contact: float
    puncture: float


def subtract(pairs: list[Pair], spreading: tuple[float, float] | None = None) -> tuple[TwoPass | None, dict[int, str]]:
    """The two-pass procedure over the sites; a second pass has the zero of the first.

    The passes may differ in rate, speed, start and greatest depth: each is averaged onto one grid, over the depths that
    both went and no deeper than the hole of the first. ``spreading`` [N] is what ``spreading_force`` gives. A pair that
    cannot be subtracted does not stop the rest: the second value says why, by its place in ``pairs``. The first is None
    where no pair can.
    """
    sites, refused = [], {}
    for k, pair in enumerate(pairs):
        try:
            sites.append(_site(pair, segment(pair.second)))
        except InputError as error:
            refused[k] = f"Its second pass cannot be used: {error}"
    return (_all_sites(sites, spreading) if sites else None), refused


def _all_sites(sites: list[Site], spreading: tuple[float, float] | None) -> TwoPass:
    found = [reasons for reasons in map(not_friction_only, sites) if reasons]
    terms = terms_of(sites, spreading)
    limits = cutting_range(sites, terms, bool(found))
    doubts = dict.fromkeys(doubt for site in sites for doubt in site.doubts)
    return TwoPass(tuple(sites), bool(found), in_words(sites, found, terms, tuple(doubts), limits), terms, limits)


def _site(pair: Pair, events: Events) -> Site:
    depth_1, force_1 = pair.first.strokes.depth_in - pair.contact, pair.first.strokes.force_in
    depth_2, force_2 = _insertion_of(pair.second, events, pair.contact)
    in_hole = depth_2 <= depth_1.max()  # deeper it cuts anew
    depth_2, force_2 = depth_2[in_hole], force_2[in_hole]
    grid = _grid(pair, min(depth_1.max(), max(depth_2, default=0.0)))
    first, second = (_binned(grid, depth, force, GRID) for depth, force in ((depth_1, force_1), (depth_2, force_2)))
    start, stop, reason = friction_window(depth_2, force_2, pair.puncture)
    friction, intercept = _friction_line(*bin_means(depth_2, force_2, start, stop))
    blocks = [_block_means(each) for each in (grid, first, first - second)]
    slope, _, error, t = line(blocks[0], blocks[2])
    cutting = mean_estimate("cutting_force", blocks[2], "N", "")
    share = stiffness_share((depth_1, force_1), (depth_2, force_2), pair.puncture)
    return Site(
        grid,
        first,
        second,
        first - second,
        *_fine_difference(grid, second, (depth_1, force_1), (depth_2, force_2)),
        depth_2,
        force_2,
        *friction,
        intercept[0],
        stop,
        reason,
        cutting.value,
        cutting.high - cutting.value,
        intercept[1],
        pair.puncture,
        _exit(pair),
        line(*blocks[:2])[0],
        slope,
        t * error,
        float(grid.mean()),
        *share,
        lasting_drops(depth_2, force_2, [(each.depth - pair.contact, each.drop) for each in events.punctures]),
        unevenness(blocks[0], blocks[2]),
        doubts_of(pair.first, pair.second, events, grid, CUTTING_WINDOW),
    )


def _friction_line(depth: np.ndarray, force: np.ndarray) -> tuple[tuple, tuple]:
    """Slope and intercept, each with its half width."""
    if len(depth) < 3:
        raise InputError("second pass", len(depth), "too few stretches for a line", next_step="Record it faster.")
    values, covariance, t = least_squares(np.column_stack([depth, np.ones_like(depth)]), force)
    half = t * np.sqrt(np.diagonal(covariance))
    return tuple((float(value), float(width)) for value, width in zip(values, half))


def _fine_difference(grid: np.ndarray, second: np.ndarray, cut: tuple, uncut: tuple) -> tuple[np.ndarray, float]:
    """First minus second pass in fine steps, and the noise of a first pass that does not cut, in such steps."""
    fine = np.arange(grid[0], grid[-1], FINE)
    cutting, friction = (_binned(fine, *each, FINE) for each in (cut, uncut))
    wander = friction - np.polyval(np.polyfit(fine, friction, 2), fine)
    # a pass of fewer samples a step has less of its noise averaged away
    samples = [
        max(np.count_nonzero((depth > fine[0]) & (depth < fine[-1])) / len(fine), 1) for depth, _ in (cut, uncut)
    ]
    return cutting - np.interp(fine, grid, second), float(np.std(wander)) * max(samples[1] / samples[0], 1.0) ** 0.5


def _block_means(values: np.ndarray) -> np.ndarray:
    return np.array([block.mean() for block in np.array_split(values, len(values) // BLOCK)])


def _exit(pair: Pair) -> float:
    """Indentation [m] at which the first pass left the tissue; NaN where it did not."""
    left = pair.first.events.exit
    return np.nan if left is None else left.depth - pair.contact


def _grid(pair: Pair, deepest: float) -> np.ndarray:
    """The common grid of indentation, clear of the puncture's smear."""
    end = min(deepest, pair.puncture + CUTTING_WINDOW)
    grid = np.arange(pair.puncture + _smear(pair.first.recording) + GRID, end, GRID)
    if len(grid) < 3 * BLOCK:
        raise InputError(
            "depth in common",
            f"{1e3 * max(end - pair.puncture, 0.0):.2f} mm after the puncture",
            "too short to subtract",
            pair.second.card.source,
            "Insert both passes beyond the puncture.",
        )
    return grid


def _insertion_of(recording: Recording, events: Events, contact: float) -> tuple[np.ndarray, np.ndarray]:
    """Indentation and force of the insertion stroke; a second pass may have neither contact nor puncture to see."""
    strokes = strokes_of(recording, events)
    if len(strokes.depth_in):
        return strokes.depth_in - contact, strokes.force_in
    deepest = int(np.argmax(recording.depth)) + 1
    return undelayed_depth(recording)[:deepest] - contact, recording.force[:deepest]


def _smear(recording: Recording) -> float:
    """Travel [m] over which the average filter smears the puncture into what follows."""
    return float(np.max(np.abs(recording.velocity))) * recording.card.filter_length / recording.rate


def _binned(grid: np.ndarray, depth: np.ndarray, force: np.ndarray, step: float) -> np.ndarray:
    """Mean force within half a grid step of each grid point; interpolated where a step holds no sample."""
    bins = np.searchsorted(grid + 0.5 * step, depth)
    inside = (depth >= grid[0] - 0.5 * step) & (bins < len(grid))
    count = np.bincount(bins[inside], minlength=len(grid))
    total = np.bincount(bins[inside], force[inside], minlength=len(grid))
    order = np.argsort(depth, kind="stable")
    return np.where(count > 0, total / np.maximum(count, 1), np.interp(grid, depth[order], force[order]))


def doubts_of(
    first: SegmentedRecording, second: Recording, events: Events, grid: np.ndarray, window: float
) -> tuple[str, ...]:
    """Speeds that differ, a window cut short, a second contact above the first's, another puncture in the window."""
    said = []
    speeds = [speed_of(first.recording), speed_of(second)]
    if min(speeds) < (1.0 - ALIKE) * max(speeds):
        said.append(
            f"First and second pass went at {1e3 * speeds[0]:.3g} and {1e3 * speeds[1]:.3g} mm/s: what friction and "
            "cutting change with speed is in the difference."
        )
    if np.ptp(grid) < SHORT * window:
        said.append(f"The passes share {1e3 * np.ptp(grid):.1f} mm after the puncture, not {1e3 * window:.0f} mm.")
    if _above(first, events, second):
        said.append(
            "The second pass meets the tissue before the first did: its zero of depth may be another, or the surface "
            "was pulled up."
        )
    start = first.events.punctures[0].depth - first.events.punctures[0].indentation
    if any(grid[0] < puncture.depth - start < grid[-1] for puncture in first.events.punctures[1:]):
        said.append(
            "The first pass drops once more within the window: the difference holds what it deforms there, unless the "
            "cutting force swings."
        )
    return tuple(said)


def speed_of(recording: Recording) -> float:
    """Median speed [m/s] of the way in, over the samples that move."""
    inwards = recording.velocity[: int(np.argmax(recording.depth)) + 1]
    moving = inwards > 0.1 * float(np.max(inwards, initial=0.0))
    return float(np.median(inwards[moving])) if moving.any() else 0.0


def _above(first: SegmentedRecording, events: Events, second: Recording) -> bool:
    """Whether the second contact surely lies above the first."""
    one, other = first.events.contact, events.contact
    if one is None or other is None:
        return False
    return float(second.depth[other.high]) < float(first.recording.depth[one.low])


def cutting_oscillation(two_pass: TwoPass) -> tuple[Estimate, Estimate] | None:
    """Mean trough and mean crest [N] of the difference between the passes, over the sites; None where it is steady.

    Names ``cutting_force_low`` and ``cutting_force_high``; the interval is that of the sites. What biases the
    difference biases both ends alike.
    """
    ends = [found for found in map(_of_site, two_pass.sites) if found is not None]
    if 2 * len(ends) <= len(two_pass.sites):
        return None
    source = "mean trough and crest of the first minus the second insertion, where it sticks and slips"
    low, high = zip(*ends)
    return tuple(
        mean_estimate(f"cutting_force_{name}", list(values), "N", source)
        for name, values in (("low", low), ("high", high))
    )


def _of_site(site: Site) -> tuple[float, float] | None:
    if not len(site.oscillating):
        return None
    least = max(CLEAR * site.noise, LEAST * abs(float(np.mean(site.oscillating))))
    troughs, crests = _turns(site.oscillating, least)
    # the first half cycle starts where the puncture left it
    return (float(np.mean(troughs[1:])), float(np.mean(crests[1:]))) if len(troughs) > FEWEST else None


def _turns(values: np.ndarray, least: float) -> tuple[list[float], list[float]]:
    """Troughs and crests of ``values`` (n,) between which it swings by at least ``least``, in order."""
    troughs, crests = [], []
    lowest = highest = float(values[0])
    rising = None
    for value in values:
        lowest, highest = min(lowest, value), max(highest, value)
        if rising is not False and highest - value >= least:  # it turned down
            crests.append(float(highest))
            rising, lowest = False, value
        elif rising is not True and value - lowest >= least:  # it turned up
            troughs.append(float(lowest))
            rising, highest = True, value
    pairs = min(len(troughs), len(crests))
    return troughs[:pairs], crests[:pairs]
