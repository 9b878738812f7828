# SPDX-License-Identifier: Apache-2.0
"""Friction from the second insertion and cutting by subtraction, site by site: paper secs. 2.2 and 2.3."""

import numpy as np

from ..errors import InputError
from ..recording import Recording
from ..segmentation import segment
from .friction_break import friction_window
from .regression import line
from .single import Single
from .strokes import strokes_of, undelayed_depth
from .two_pass import Site, TwoPass

CUTTING_WINDOW = 8e-3  # [m] after the puncture, as in the paper's Fig. 7
GRID = 0.05e-3  # [m]
SLOPING = 2.0  # standard errors of the difference's slope between sites


def subtract(firsts: list[Single], seconds: list[Recording], contact: list[float], puncture: list[float]) -> TwoPass:
    """The two-pass procedure over the sites.

    ``contact`` [m] and ``puncture`` [m of indentation] are those of each first insertion; a second pass at the same
    site has the same zero. Raises InputError where a pair has no depth in common after the puncture.
    """
    sites = tuple(_site(*each) for each in zip(firsts, seconds, contact, puncture, strict=True))
    deforming = sum(bool(segment(second).punctures) for second in seconds)
    return TwoPass(sites, upper_bound=deforming > 0, biases=_biases(sites, deforming, puncture))


def _site(first: Single, second: Recording, contact: float, puncture: float) -> Site:
    depth_1, force_1 = first.strokes.depth_in - contact, first.strokes.force_in
    depth_2, force_2 = _insertion_of(second, contact)
    end = min(depth_1.max(), depth_2.max(), puncture + CUTTING_WINDOW)
    grid = np.arange(puncture + _smear(first.recording) + GRID, end, GRID)
    if len(grid) < 3:
        raise InputError(
            "depth in common",
            f"{1e3 * (end - puncture):.2f} mm after the puncture",
            "too short to subtract",
            second.card.source,
            "Insert both passes beyond the puncture.",
        )
    on_grid = [_binned(grid, depth, force) for depth, force in ((depth_1, force_1), (depth_2, force_2))]
    start, stop, reason = friction_window(depth_2, force_2, puncture)
    inside = (depth_2 >= start) & (depth_2 <= stop)
    slope, intercept, _, _ = line(depth_2[inside], force_2[inside])
    difference = on_grid[0] - on_grid[1]
    return Site(grid, *on_grid, difference, depth_2, force_2, slope, intercept, stop, reason, float(difference.mean()))


def _insertion_of(recording: Recording, contact: float) -> tuple[np.ndarray, np.ndarray]:
    """Indentation and force of the insertion stroke; a second pass may have neither contact nor puncture to see."""
    strokes = strokes_of(recording, segment(recording))
    if len(strokes.depth_in):
        return strokes.depth_in - contact, strokes.force_in
    deepest = int(np.argmax(recording.depth)) + 1
    return undelayed_depth(recording)[:deepest] - contact, recording.force[:deepest]


def _smear(recording: Recording) -> float:
    """Travel [m] over which the average filter smears the puncture into what follows."""
    return float(np.max(np.abs(recording.velocity))) * recording.card.filter_length / recording.rate


def _binned(grid: np.ndarray, depth: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Mean force within half a grid step of each grid point; interpolated where a step holds no sample."""
    bins = np.searchsorted(grid + 0.5 * GRID, depth)
    inside = (depth >= grid[0] - 0.5 * GRID) & (bins < len(grid))
    count = np.bincount(bins[inside], minlength=len(grid))
    total = np.bincount(bins[inside], force[inside], minlength=len(grid))
    order = np.argsort(depth, kind="stable")
    return np.where(count > 0, total / np.maximum(count, 1), np.interp(grid, depth[order], force[order]))


def _biases(sites: tuple[Site, ...], deforming: int, puncture: list[float]) -> tuple[str, ...]:
    """What the subtraction cannot separate, each with its size here."""
    friction = float(np.mean([site.friction_slope for site in sites]))
    dimple = friction * float(np.mean(puncture))
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
            f"The difference is not constant: it changes by {slopes.mean():.2g} N/m with depth, "
            "so friction or embedded length differ between the passes."
        )
    return tuple(told)
