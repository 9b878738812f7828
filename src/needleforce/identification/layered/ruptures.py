# SPDX-License-Identifier: Apache-2.0
"""Where each layer gave way: in every run, on the mean, and beside what segmentation saw."""

from dataclasses import dataclass

import numpy as np

from ...recording import Recording
from ...segmentation import Events
from ..estimates import Estimate
from ..statistics.noise import Z_95, noise_of
from .parameters import MM, prefix
from .search import Solved

NEAR = 2.0  # [mm] a rupture seen farther from the fitted one belongs to no layer
CLOSE = 0.4  # [mm] the steep fall begins so near the peak: more is another rupture
TOGETHER = 0.7  # [mm] so near, two layers give way in one rupture
FINE = 0.02  # [mm]
REACH = 1.5  # [mm]


@dataclass(frozen=True, eq=False)
class Ruptures:
    """Mean depth (layers,) [m] at which each layer gives way, and by how much it lies past the peak that is seen.

    ``contact`` [m] is the mean contact that segmentation sees. Depths are in the recordings' zero.
    """

    depth: np.ndarray
    past_peak: np.ndarray
    contact: float

    def of(self, events: Events, recording: Recording) -> tuple[float, np.ndarray]:
        """By how much a recording's surface lies deeper [m], and where its layers give way: where its own ruptures were
        seen, and no later than they are seen to be over, else on the mean."""
        shift = 0.0 if events.contact is None else events.contact.depth - self.contact
        over = {puncture.depth: recording.depth[puncture.high] for puncture in events.punctures}
        peaks = matched((self.depth + shift - self.past_peak) / MM, tuple(over)) * MM
        latest = np.array([min(over.items(), key=lambda p: abs(p[0] - z))[1] if z == z else np.nan for z in peaks])
        own = np.minimum(peaks + self.past_peak, latest)
        return shift, np.where(np.isfinite(own), own, self.depth + shift)


def matched(expected: np.ndarray, seen: tuple[float, ...]) -> np.ndarray:
    """For each expected depth (layers,) [mm] the rupture seen [m] that is nearest to it, in mm; NaN without one."""
    found = np.full(len(expected), np.nan)
    pairs = sorted((abs(z - s / MM), layer, s / MM) for layer, z in enumerate(expected) for s in seen)
    for distance, layer, place in pairs:
        taken = place in found and distance > TOGETHER
        if distance <= NEAR and np.isnan(found[layer]) and not taken:
            found[layer] = place
    return found


def ruptures(solved: Solved) -> Ruptures:
    """The mean ruptures of a fit."""
    courses = solved.problem.courses
    fitted = solved.problem.unknowns.punctures(solved.x)
    seen = np.array([matched(own, course.punctures) for own, course in zip(fitted, courses)])
    known = np.isfinite(seen).any(axis=0)
    past = np.zeros(fitted.shape[1])
    past[known] = np.clip(np.nanmedian((fitted - seen)[:, known], axis=0), -CLOSE, CLOSE)
    return Ruptures(MM * fitted.mean(axis=0), MM * past, float(np.mean([course.contact for course in courses])))


def own_ruptures(solved: Solved, run: int) -> dict[str, Estimate]:
    """Where the layers gave way in one run: an interval between two places, never a standard error.

    It holds what the noise of this run does not refuse at 95 %, the other numbers as they are, and the bin.
    """
    problem, course = solved.problem, solved.problem.courses[run]
    own = problem.unknowns.punctures(solved.x)[run]
    noise = noise_of(problem.residuals(run, solved.x), len(course.depth))
    bin_width = float(np.ptp(course.depth)) / max((course.stroke == 0).sum(), 1) / MM
    found = {}
    for layer, place in enumerate(own):
        name = f"{prefix(layer)}puncture_depth"
        allowed = _allowed(solved, run, layer, Z_95**2 * noise.long_run)
        low, high = MM * (allowed.min() - 0.5 * bin_width), MM * (allowed.max() + 0.5 * bin_width)
        reached = place < course.deepest / MM
        high, source = (high, "layered fit") if reached else (np.inf, "layered fit: not reached in this run")
        found[name] = Estimate(name, MM * place, "m", low, high, None, reached, source)
    return found


def _allowed(solved: Solved, run: int, layer: int, rise: float) -> np.ndarray:
    """Places [mm] around a rupture where the sum of squares is no more than ``rise`` above the least."""
    problem, course = solved.problem, solved.problem.courses[run]
    own = problem.unknowns.punctures(solved.x)[run]
    places = np.append(np.arange(own[layer] - REACH, own[layer] + REACH, FINE), own[layer])
    tried = np.tile(own, (len(places), 1))
    tried[:, layer] = places
    squares = problem.squares(course, np.tile(solved.x, (len(places), 1)), tried)
    return places[squares <= squares[-1] + rise]
