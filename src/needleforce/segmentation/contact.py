# SPDX-License-Identifier: Apache-2.0
"""Contact: first sustained crossing of the free travel's baseline, then a fit back to zero; exit: the same,
backwards in time, on the withdrawal stroke."""

from dataclasses import dataclass, replace

import numpy as np

from .strokes import Blocks, Cycle, blocks, first_run, jitter

CROSSING = 5.0  # [sd of the noise] a crossing this high is no noise
SUSTAINED = 10  # [samples] and must stay there so long
RISE = 0.02  # the fit uses the force up to this share of its maximum …
RISE_NOISE = 10.0  # … or so many sd of the noise, whichever is more
EXPONENTS = (1.0, 1.25, 1.5, 1.75, 2.0)  # of force over depth: flat punch 1, sphere 3/2, cone 2
SHARES = (1.0, 0.75, 0.5)  # of that force are tried until the law follows it …
FOLLOWS = 1.3  # … within so many sd: a hump soon after the contact must not bend the fit
SURE = 9.0  # rise of the sum of squares, in variances, beyond which a contact point is excluded: 3 sd
LEAST_NOISE = 1e-4  # of the range of the force: simulated recordings may have none
WEAK = 4.0  # a greatest force of fewer crossings is weak
LARGEST_DRIFT = 0.1  # of the greatest force: more is taken for contact from the first sample on
FEWEST = 5  # blocks that make a baseline …
ENOUGH = 20  # … and that make a good one
ROUNDS = 4  # at most, of baseline and contact in turn
SAME_BASELINE = 0.03  # of the greatest force: the baselines before and after differ by no more …
DRIFTED_BASELINE = 0.1  # … or by so much, if the needle is back near where it went in
NEAR = 0.25  # of the indentation: so near
ONLY_DRIFT = 1.5  # times the white noise: what a straight line in time may leave of a force that only drifts


@dataclass(frozen=True)
class Onset:
    """The contact ``depth`` [m], the blocks ``low`` (surely free) and ``high`` (surely in contact), the baseline [N].

    ``free`` is false where there is too little free travel to know ``baseline`` and its ``noise`` [N] well.
    """

    depth: float
    low: int
    high: int
    baseline: float
    noise: float
    free: bool


@dataclass(frozen=True)
class Origin:
    """Where the rise begins: ``depth``, the ``earliest`` not excluded [m]; ``baseline`` and rms ``misfit`` [N]."""

    depth: float
    earliest: float
    baseline: float
    misfit: float


def free_noise(force: np.ndarray, least: float) -> tuple[float, float]:
    """Mean and standard deviation (``least`` or more) of the (n,) force [N] of a free travel, deaf to outliers."""
    middle = float(np.median(force))
    return middle, max(float(np.median(np.abs(force - middle))) / 0.6745, least)


def onset(stroke: Blocks, crossing: float = CROSSING) -> Onset | None:
    """The contact in one inward stroke, or ``None`` where the force never leaves its baseline.

    Once the force has crossed ``crossing`` standard deviations and stays there, ``F = b + c (z - z0)^p`` is fitted to
    all of it before it has clearly risen: the extrapolation of the rise back to its origin that for the cone (p = 2) is
    the straight line of sqrt(F) over z. p is 1 to 2 after Sneddon (1965); measured needles rise with 1.1 to 1.9.
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
    """The straight line of a drifting free travel, (n,), or ``None`` if what comes before the rise is none."""
    first, peak = float(np.median(f[:FEWEST])), float(np.max(f))
    free = _before(f, first + LARGEST_DRIFT * (peak - first), _sustained(len(f), size))
    line = np.polyval(np.polyfit(z[:free], f[:free], 1), z) if np.ptp(z[:free]) > 0 else np.full_like(z, first)
    straight = float(np.std(f[:free] - line[:free])) <= FOLLOWS * jitter(f)
    return line if straight and abs(line[-1] - line[0]) <= 2 * LARGEST_DRIFT * (peak - first) else None


def _sustained(count: int, size: int) -> int:
    """How many blocks a crossing must last: 10 samples, 3 blocks at least, a twentieth of a short stroke at most."""
    return max(3, min(-(-SUSTAINED // size), count // 20))


def _onset(z: np.ndarray, f: np.ndarray, size: int, crossing: float) -> Onset | None:
    """``onset`` for a level baseline, learnt from a short start, where no hump hides, or a longer one if it swings."""
    if len(f) < 2 * FEWEST:
        return None
    length, first, peak = _sustained(len(f), size), float(np.median(f[:FEWEST])), float(np.max(f))
    clear = _before(f, first + 2 * RISE * (peak - first), length)
    found = _settled(z, f, length, crossing, min(clear, ENOUGH))
    if found is None:
        return None
    if peak - found.baseline < WEAK * crossing * found.noise:  # a short start may have been quiet by chance
        return _settled(z, f, length, crossing, _before(f, 0.5 * (first + peak), length))
    after = f[found.high : found.high + int(np.argmax(f[found.high :])) + 1]
    back = first_run(after <= found.baseline + found.noise, length)
    return found if back is None else _settled(z, f, length, crossing, clear) or found


def _settled(z: np.ndarray, f: np.ndarray, length: int, crossing: float, free: int) -> Onset | None:
    """Baseline and contact found in turn, from ``free`` blocks of free travel at first."""
    peak, white = float(np.max(f)), max(jitter(f), LEAST_NOISE * float(np.ptp(f)))
    for _ in range(ROUNDS):
        baseline, noise = free_noise(f[:free], white)
        if first_run(f > baseline + crossing * noise, length) is None:
            return None
        rise = min(max(RISE_NOISE * noise, RISE * (peak - baseline)), 0.6 * (peak - baseline))
        for share in SHARES:
            top = max(first_run(f > baseline + share * rise, length) or 0, FEWEST) + 1
            fit = fit_origin(z[:top], f[:top], noise)
            if fit.misfit <= FOLLOWS * noise:
                break
        before, free = free, max(FEWEST, int(np.searchsorted(z[:top], fit.depth)))
        if free == before:
            break
    low = max(0, int(np.searchsorted(z[:top], fit.earliest)) - 1)
    below = np.flatnonzero(f[: top + 1] <= baseline + crossing * noise)
    high = int(below[-1]) + 1 if len(below) else 0  # from here on never back before the rise
    return Onset(fit.depth, low, max(high, low + 1), fit.baseline, noise, free >= ENOUGH)


def _before(force: np.ndarray, level: float, length: int) -> int:
    """How many blocks are free travel at a first guess: most of those before the force passes ``level``."""
    crossed = first_run(force > level, length)
    return max(FEWEST, int(0.6 * (len(force) if crossed is None else crossed)))


def fit_origin(z: np.ndarray, f: np.ndarray, noise: float) -> Origin:
    """Least squares of ``F = b + c (z - z0)^p`` over (n,) depths [m] and forces [N], with ``noise`` at least."""
    coarse = np.linspace(z[0], z[-1], 65)[:-1]
    squares, _ = _squares(z, f, coarse)
    best = int(np.argmin(squares))
    fine = np.linspace(coarse[max(best - 1, 0)], coarse[min(best + 1, len(coarse) - 1)], 33)
    fine_squares, baselines = _squares(z, f, fine)
    at = int(np.argmin(fine_squares))
    lowest, variance = float(fine_squares[at]), float(fine_squares[at]) / max(len(z) - 3, 1)
    free = f[: max(int(np.searchsorted(z, fine[at])), FEWEST)]
    allowed = coarse[squares <= lowest + SURE * max(noise**2, variance) * _correlation(free)]
    earliest = min([*allowed, fine[at]]) - (coarse[1] - coarse[0])
    return Origin(float(fine[at]), float(earliest), float(baselines[at]), variance**0.5)


def _squares(z: np.ndarray, f: np.ndarray, origins: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Least residual sums of squares over the exponents, and the baselines, for (m,) origins."""
    past = np.maximum(z - origins[:, None], 0.0) / (float(np.ptp(z)) or 1.0)
    centred = f - f.mean()
    squares, bases = [], []
    for p in EXPONENTS:
        shape = past**p
        mean = shape.mean(axis=1)
        shape -= mean[:, None]
        height = np.maximum(shape @ centred, 0.0) / np.maximum((shape * shape).sum(axis=1), 1e-300)
        left = centred - height[:, None] * shape  # squared itself: a difference of sums could be negative
        squares.append((left * left).sum(axis=1))
        bases.append(f.mean() - height * mean)
    best = np.argmin(squares, axis=0)
    pick = np.arange(len(origins))
    return np.array(squares)[best, pick], np.array(bases)[best, pick]


def _correlation(free: np.ndarray, group: int = 10) -> float:
    """How much more the mean of ten neighbours varies than ten independent values would: 1 for white noise."""
    if len(free) < 5 * group:
        return 1.0
    groups = free[: len(free) // group * group].reshape(-1, group)
    return max(1.0, group * float(groups.mean(axis=1).var() / max(free.var(), 1e-300)))


def exit_depth(depth: np.ndarray, force: np.ndarray, cycle: Cycle, size: int, crossing: float) -> Onset | None:
    """The exit of a withdrawal in (n,) depths [m] and forces [N]; ``low`` and ``high`` are samples, in order of time.

    Run backwards, the needle meets the tissue under tension; only if it was never pulled, under pressure.
    """
    back, pull = depth[cycle.leave : cycle.end][::-1], force[cycle.leave : cycle.end][::-1]
    for sign in (-1.0, 1.0):
        way = blocks(back, sign * pull, 0, len(back), size)
        last = onset(way, crossing)
        if last is not None:
            low, high = cycle.end - 1 - way.sample(last.high + 1), cycle.end - 1 - way.sample(last.low)
            return replace(last, low=max(low, cycle.leave), high=high, baseline=sign * last.baseline)
    return None


def returned(begin: Onset, last: Onset, deepest: float, peak: float) -> bool:
    """Whether the force after ``last`` is the baseline from before ``begin``, and not one level the needle rests at."""
    change = abs(last.baseline - begin.baseline)
    if change <= (max(5.0 * begin.noise, SAME_BASELINE * peak) if last.free else 5.0 * begin.noise):
        return True
    near = abs(last.depth - begin.depth) <= NEAR * (deepest - begin.depth)
    return change <= DRIFTED_BASELINE * peak and near and last.free


def only_drift(time: np.ndarray, force: np.ndarray, size: int) -> bool:
    """Whether a whole cycle's (n,) force is a straight line in time: there and back again, no contact is one."""
    short = blocks(time, force, 0, len(force), size)
    if len(short) < 10:
        return False
    left = short.force - np.polyval(np.polyfit(short.depth, short.force, 1), short.depth)
    return float(left.std()) <= ONLY_DRIFT * jitter(short.force)
