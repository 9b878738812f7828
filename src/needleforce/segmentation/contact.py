# SPDX-License-Identifier: Apache-2.0
"""Contact: the first sustained crossing of the free travel's baseline, traced back to its origin by a fit; exit: the
same on the withdrawal stroke, backwards in time."""

from dataclasses import dataclass, replace

import numpy as np

from .. import core
from ..vocabulary import SMALLEST
from .strokes import Blocks, Cycle, blocks, white_noise

CROSSING_SIGMA = 5.0  # [sd of the noise] height of a crossing that is not noise
SUSTAINED_SAMPLES = 10  # [samples] duration of a crossing
FIT_FORCE_SHARE = 0.02  # of the maximum force: the fit uses the force up to this share,
FIT_FORCE_SIGMA = 10.0  # or up to this many sd of the noise, whichever is more
FIT_SHARES = (1.0, 0.75, 0.5)  # of that force, tried until the fit is good
MAX_MISFIT_SIGMA = 1.3  # [sd] misfit of a good fit: a hump soon after the contact must not bias it
MAX_SQUARES_RISE = 9.0  # rise of the sum of squares, in variances, beyond which a contact point is excluded: 3 sd
MIN_NOISE_SHARE = 1e-4  # of the range of the force: simulated recordings may have no noise
WEAK_FORCE_CROSSINGS = 4.0  # crossings: a smaller maximum force is weak
MAX_DRIFT_SHARE = 0.1  # of the maximum force: a larger drift counts as contact from the first sample on
MIN_BASELINE_BLOCKS = 5  # blocks needed for a baseline
GOOD_BASELINE_BLOCKS = 20  # blocks of a well-determined baseline
MAX_ITERATIONS = 4  # iterations of baseline and contact
MAX_BASELINE_CHANGE = 0.03  # of the maximum force: largest difference between the baselines before and after,
MAX_DRIFTED_CHANGE = 0.1  # or with drift, if the exit is near the contact
MAX_EXIT_DISTANCE_SHARE = 0.25  # of the indentation: largest distance between contact and exit in that case
MAX_DRIFT_RESIDUAL = 1.5  # times the white noise: largest residual about a straight line of a force that only drifts


@dataclass(frozen=True, kw_only=True)
class Onset:
    """The contact ``depth`` [m], the blocks ``low`` (certainly free) and ``high`` (certainly in contact), and the
    ``baseline`` [N].

    ``free`` is False if there is too little free travel for a good estimate of ``baseline`` and its ``noise`` [N].
    """

    depth: float
    low: int
    high: int
    baseline: float
    noise: float
    free: bool


@dataclass(frozen=True)
class Origin:
    """The origin of the rise: its ``depth`` and the ``earliest`` depth that is not excluded [m], ``baseline`` and rms
    ``misfit`` [N]."""

    depth: float
    earliest: float
    baseline: float
    misfit: float


def free_noise(force: np.ndarray, min_noise: float) -> tuple[float, float]:
    """Robust mean and standard deviation (at least ``min_noise``) of the (n,) force [N] of free travel."""
    middle = core.median(force)
    return middle, max(core.median(np.abs(force - middle)) / 0.6745, min_noise)


def onset(stroke: Blocks, crossing: float = CROSSING_SIGMA) -> Onset | None:
    """The contact in one insertion stroke, or None if the force remains at its baseline.

    Where the force exceeds the baseline by ``crossing`` standard deviations for some time, ``F = b + c (z - z0)^p`` is
    fitted to the force up to a small share of its maximum, which extrapolates the rise to its origin; for the cone
    (p = 2) this is the straight line of sqrt(F) over z. p is 1 to 2 (Sneddon 1965); measured needles have 1.1 to 1.9.
    """
    found = _onset(stroke.depth, stroke.force, stroke.size, crossing)
    if found is None or found.free:
        return found
    level = _drift(stroke.depth, stroke.force, stroke.size)
    retried = None if level is None else _onset(stroke.depth, stroke.force - level, stroke.size, crossing)
    if retried is None or not retried.free:
        return found
    return replace(retried, baseline=retried.baseline + float(np.interp(retried.depth, stroke.depth, level)))


def _drift(z: np.ndarray, f: np.ndarray, size: int) -> np.ndarray | None:
    """The straight line (n,) of the drift in free travel, or None if the force before the rise is not straight."""
    first, peak = core.median(f[:MIN_BASELINE_BLOCKS]), float(np.max(f))
    free = _free_blocks(f, first + MAX_DRIFT_SHARE * (peak - first), _sustained(len(f), size))
    line = np.polyval(np.polyfit(z[:free], f[:free], 1), z) if np.ptp(z[:free]) > 0 else np.full_like(z, first)
    straight = float(np.std(f[:free] - line[:free])) <= MAX_MISFIT_SIGMA * white_noise(f)
    return line if straight and abs(line[-1] - line[0]) <= 2 * MAX_DRIFT_SHARE * (peak - first) else None


def _sustained(count: int, size: int) -> int:
    """The number of blocks that a crossing must last: 10 samples, at least 3 blocks, at most 5 % of a short stroke."""
    return max(3, min(-(-SUSTAINED_SAMPLES // size), count // 20))


def _onset(z: np.ndarray, f: np.ndarray, size: int, crossing: float) -> Onset | None:
    """``onset`` for a constant baseline, estimated from a short start, or from a longer one if the force returns to the
    baseline after the crossing."""
    if len(f) < 2 * MIN_BASELINE_BLOCKS:
        return None
    length, first, peak = _sustained(len(f), size), core.median(f[:MIN_BASELINE_BLOCKS]), float(np.max(f))
    clear = _free_blocks(f, first + 2 * FIT_FORCE_SHARE * (peak - first), length)
    found = _iterated_onset(z, f, length, crossing, min(clear, GOOD_BASELINE_BLOCKS))
    if found is None:
        return None
    # a short start may have little noise by chance
    if peak - found.baseline < WEAK_FORCE_CROSSINGS * crossing * found.noise:
        return _iterated_onset(z, f, length, crossing, _free_blocks(f, 0.5 * (first + peak), length))
    after = f[found.high : found.high + int(np.argmax(f[found.high :])) + 1]
    back = core.first_run(-after, -found.baseline - found.noise, length)
    return found if back is None else _iterated_onset(z, f, length, crossing, clear) or found


def _iterated_onset(z: np.ndarray, f: np.ndarray, length: int, crossing: float, free: int) -> Onset | None:
    """Estimate baseline and contact iteratively, starting with ``free`` blocks of free travel."""
    peak, white = float(np.max(f)), max(white_noise(f), MIN_NOISE_SHARE * float(np.ptp(f)))
    for _ in range(MAX_ITERATIONS):
        baseline, noise = free_noise(f[:free], white)
        if core.first_run(f, baseline + crossing * noise, length) is None:
            return None
        rise = min(max(FIT_FORCE_SIGMA * noise, FIT_FORCE_SHARE * (peak - baseline)), 0.6 * (peak - baseline))
        for share in FIT_SHARES:
            top = max(core.first_run(f, baseline + share * rise, length) or 0, MIN_BASELINE_BLOCKS) + 1
            fit = fit_origin(z[:top], f[:top], noise)
            if fit.misfit <= MAX_MISFIT_SIGMA * noise:
                break
        before, free = free, max(MIN_BASELINE_BLOCKS, int(np.searchsorted(z[:top], fit.depth)))
        if free == before:
            break
    low = max(0, int(np.searchsorted(z[:top], fit.earliest)) - 1)
    below = np.flatnonzero(f[: top + 1] <= baseline + crossing * noise)
    high = int(below[-1]) + 1 if len(below) else 0  # from here on the force stays above the crossing
    return Onset(
        depth=fit.depth,
        low=low,
        high=max(high, low + 1),
        baseline=fit.baseline,
        noise=noise,
        free=free >= GOOD_BASELINE_BLOCKS,
    )


def _free_blocks(force: np.ndarray, level: float, length: int) -> int:
    """A first estimate of the number of free blocks: 60 % of those before the force exceeds ``level``."""
    crossed = core.first_run(force, level, length)
    return max(MIN_BASELINE_BLOCKS, int(0.6 * (len(force) if crossed is None else crossed)))


def fit_origin(z: np.ndarray, f: np.ndarray, noise: float) -> Origin:
    """Least-squares fit of ``F = b + c (z - z0)^p`` to (n,) depths [m] and forces [N]; ``noise`` is the minimum sd.

    The exponents p are a quarter apart from 1, a flat punch, to 2, a cone.
    """
    depth, earliest, baseline, variance = core.fit_origin(
        z, f, noise=noise, max_rise=MAX_SQUARES_RISE, min_free=MIN_BASELINE_BLOCKS
    )
    return Origin(depth, earliest, baseline, variance**0.5)


def exit_depth(depth: np.ndarray, force: np.ndarray, cycle: Cycle, size: int, crossing: float) -> Onset | None:
    """The exit of a withdrawal in (n,) depths [m] and forces [N]; ``low`` and ``high`` are samples, in order of time.

    Backwards in time, the force at the exit becomes tensile; compression is tried only if there is no tension.
    """
    back, pull = depth[cycle.withdrawal_start : cycle.end][::-1], force[cycle.withdrawal_start : cycle.end][::-1]
    for sign in (-1.0, 1.0):
        reversed_stroke = blocks(back, sign * pull, 0, len(back), size)
        last = onset(reversed_stroke, crossing)
        if last is not None:
            low = cycle.end - 1 - reversed_stroke.sample(last.high + 1)
            high = cycle.end - 1 - reversed_stroke.sample(last.low)
            return replace(last, low=max(low, cycle.withdrawal_start), high=high, baseline=sign * last.baseline)
    return None


def returned(begin: Onset, last: Onset, deepest: float, peak: float) -> bool:
    """Whether the force after the exit ``last`` is the baseline before the contact ``begin``, rather than a constant
    force of a needle at rest in tissue."""
    change = abs(last.baseline - begin.baseline)
    if change <= (max(5.0 * begin.noise, MAX_BASELINE_CHANGE * peak) if last.free else 5.0 * begin.noise):
        return True
    near = abs(last.depth - begin.depth) <= MAX_EXIT_DISTANCE_SHARE * (deepest - begin.depth)
    return change <= MAX_DRIFTED_CHANGE * peak and near and last.free


def only_drift(time: np.ndarray, force: np.ndarray, size: int) -> bool:
    """Whether the (n,) force of a complete cycle is a straight line in time, which a contact never is."""
    short = blocks(time, force, 0, len(force), size)
    if len(short) < 10:
        return False
    left, about = short.force - short.force.mean(), short.depth - short.depth.mean()
    left -= about * (float(about @ left) / max(float(about @ about), SMALLEST))
    return float(left.std()) <= MAX_DRIFT_RESIDUAL * white_noise(short.force)
