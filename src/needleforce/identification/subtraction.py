# SPDX-License-Identifier: Apache-2.0
"""Friction from the second insertion and cutting by subtraction, site by site: paper secs. 2.2 and 2.3."""

from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..recording import Recording
from ..segmentation import Events, segment
from .friction_break import bin_means, friction_window
from .pooling import mean_estimate
from .regression import line
from .single import Single
from .strokes import strokes_of, undelayed_depth
from .two_pass import Site, TwoPass

CUTTING_WINDOW = 8e-3  # [m] after the puncture, as in the paper's Fig. 7
GRID = 0.05e-3  # [m]
FINE = 0.01e-3  # [m]; of the first pass alone, the second is smooth
BLOCK = 10  # grid points that count as one: 0.5 mm of travel outlasts the filter
SLOPING = 2.0  # standard errors of the difference's slope between sites


@dataclass(frozen=True, eq=False)
class Pair:
    """One site's first insertion, its second, and from the first contact [m] and puncture [m of indentation]."""

    first: Single
    second: Recording
    contact: float
    puncture: float


def subtract(pairs: list[Pair]) -> tuple[TwoPass | None, dict[int, str]]:
    """The two-pass procedure over the sites; a second pass has the zero of the first.

    A pair that cannot be subtracted does not stop the rest: the second value says why, by its place in ``pairs``. The
    first is None where no pair can.
    """
    sites, refused, deforming = [], {}, 0
    for k, pair in enumerate(pairs):
        events = segment(pair.second)
        try:
            sites.append(_site(pair, *_insertion_of(pair.second, events, pair.contact)))
            deforming += bool(events.punctures)
        except InputError as error:
            refused[k] = f"Its second pass cannot be used: {error}"
    if not sites:
        return None, refused
    dimple = float(np.mean([pair.puncture for pair in pairs]))
    return TwoPass(tuple(sites), deforming > 0, _biases(sites, deforming, dimple)), refused


def _site(pair: Pair, depth_2: np.ndarray, force_2: np.ndarray) -> Site:
    depth_1, force_1 = pair.first.strokes.depth_in - pair.contact, pair.first.strokes.force_in
    grid = _grid(pair, min(depth_1.max(), depth_2.max()))
    on_grid = [_binned(grid, depth, force, GRID) for depth, force in ((depth_1, force_1), (depth_2, force_2))]
    start, stop, reason = friction_window(depth_2, force_2, pair.puncture)
    slope, intercept, error, t = line(*bin_means(depth_2, force_2, start, stop))
    window = (slope, t * error, intercept, stop, reason)
    difference = on_grid[0] - on_grid[1]
    fine = np.arange(grid[0], grid[-1], FINE)
    smooth = np.interp(fine, grid, on_grid[1])
    swinging = _binned(fine, depth_1, force_1, FINE) - smooth
    uncut = _binned(fine, depth_2, force_2, FINE)
    noise = float(np.std(uncut - np.polyval(np.polyfit(fine, uncut, 2), fine)))
    blocks = [block.mean() for block in np.array_split(difference, len(grid) // BLOCK)]
    cutting = mean_estimate("cutting_force", blocks, "N", "")
    return Site(
        grid,
        *on_grid,
        difference,
        swinging,
        noise,
        depth_2,
        force_2,
        *window,
        cutting.value,
        cutting.high - cutting.value,
    )


def _grid(pair: Pair, deepest: float) -> np.ndarray:
    """The common grid of indentation, clear of the puncture's smear."""
    end = min(deepest, pair.puncture + CUTTING_WINDOW)
    grid = np.arange(pair.puncture + _smear(pair.first.recording) + GRID, end, GRID)
    if len(grid) < 2 * BLOCK:
        raise InputError(
            "depth in common",
            f"{1e3 * (end - pair.puncture):.2f} mm after the puncture",
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


def _biases(sites: list[Site], deforming: int, puncture: float) -> tuple[str, ...]:
    """What the subtraction cannot separate, each with its size here."""
    dimple = float(np.mean([site.friction_slope for site in sites])) * puncture
    intercept = float(np.mean([site.friction_intercept for site in sites]))
    told = [
        "A surface that stays dimpled on the first pass lowers the cutting force, by up to "
        f"{1e3 * dimple:.0f} mN if all of the puncture indentation stays; parallel curves do not exclude it.",
        f"The line through the second pass meets zero depth at {1e3 * intercept:.1f} mN: force that spreads the hole, "
        "less any dimple of that pass; forced through the origin it would bias the friction.",
        "Friction is taken as equal on both passes; others report it smaller on the second.",
    ]
    if deforming:
        told.insert(
            0,
            f"{deforming} of {len(sites)} second passes still deform and drop as at a puncture: the difference is an "
            "upper bound of the cutting force.",
        )
    slopes = np.array([np.polyfit(site.grid, site.difference, 1)[0] for site in sites])
    if len(sites) > 2 and abs(slopes.mean()) > SLOPING * slopes.std(ddof=1) / np.sqrt(len(sites)):
        told.append(
            f"The difference is not constant: it changes by {1e-3 * slopes.mean():.2g} N/mm with depth, "
            "so friction or embedded length differ between the passes."
        )
    return tuple(told)
