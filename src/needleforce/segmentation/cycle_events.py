# SPDX-License-Identifier: Apache-2.0
"""Contact, punctures and exit of one insertion."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import stdtrit

from .. import core
from .contact import MAX_DRIFT_SHARE, Onset, exit_depth, only_drift, onset, returned
from .events import Event, Puncture
from .fall_location import LocatedDrop, lasting_share, locate, rupture_share, unslowed_share
from .punctures import FALSE_ALARMS, block_noise, drop_candidates
from .strokes import Cut, Cycle, at_cut

MIN_RUPTURE_TIME_S = 0.03  # [s] minimum duration of a rupture at any speed: needle and sensor oscillate
MIN_RUPTURE_SAMPLES = 5  # minimum number of samples of a rupture
BLOCKS_PER_RUPTURE = 10
MIN_STROKE_BLOCKS = 300  # of a stroke with enough samples
MAX_GRADUAL_TRAVEL_M = 1e-3  # [m] travel of the most gradual rupture that is searched
NEGLIGIBLE_DRIFT_SHARE = 1e-3  # of the maximum force: a smaller drift is not corrected
MIN_LOAD_SIGMA = 8.0  # [sd] range of blocks beyond which the force before the contact may be a load
MIN_RISE_RATIO = 3.0  # of the duration of a rise before a fall over that of the fall, if the stroke begins in contact
HILL_FALLS = (0.1, 0.8)  # of the rise to a rounded maximum in contact, before a further rise: a hum falls back
SPEED_REACH = 4  # gradual ruptures within which the speed may be back after a fall, and the force is not
LASTING_SHARE = 0.5  # of a fall beyond the pull-backs and rests in it: with less it is theirs
MIN_HALF_WAVES = 5  # of a regular oscillation; two layers with a puncture each have four
MIN_FALL_LENGTH = 0.5  # of that of a rise, in an oscillation that is no series of ruptures
MIN_WAVE_SIGMA = 5.0  # [sd of a block] of the smallest half-wave
MAX_SPACING_VARIATION = 0.3  # sd over mean of its periods; random places have 0.7
MAX_SIZE_RATIO = 2.0  # between a half-wave and their median


@dataclass(frozen=True, kw_only=True)
class CycleEvents:
    """The events of one cycle, with ``baseline`` (None if the cycle begins in contact) and ``noise`` of a sample [N].

    ``exit`` is None if the force does not show it; ``minor`` are significant falls that are no punctures, of which
    ``oscillations`` belong to a regular series; ``free`` is False if there is too little free travel, and
    ``in_contact`` is True if there is none.
    """

    cycle: Cycle
    contact: Event | None = None
    punctures: tuple[Puncture, ...] = ()
    minor: tuple[Puncture, ...] = ()
    oscillations: int = 0
    exit: Event | None = None
    free: bool = True
    in_contact: bool = False
    baseline: float | None = 0.0
    noise: float = 0.0


@dataclass(frozen=True, kw_only=True)
class DetectionLimits:
    """``crossing`` [sd] of a contact, ``drop`` (share of the peak) and ``window`` [samples] of a puncture in a rough
    stroke, the ``gradual`` rupture [samples], the filter's ``lag`` [samples] and the ``quantum`` of the force [N]."""

    crossing: float
    drop: float
    window: int
    gradual: int
    lag: int
    quantum: float

    def size(self, cycle: Cycle) -> int:
        """Samples per block: a tenth of a rupture, or less in a stroke of few such blocks."""
        return max(1, min(self.window // BLOCKS_PER_RUPTURE, (cycle.stop - cycle.start) // MIN_STROKE_BLOCKS))


def limits(
    *, crossing: float, drop: float, within: float, rate: float, speed: float, filter_length: int, quantum: float
) -> DetectionLimits:
    """Limits for a rupture over ``within`` [m] at ``speed`` [m/s], at least as long as sensor, filter and ``rate`` [Hz]
    require."""
    window = int(max(within / speed * rate, MIN_RUPTURE_TIME_S * rate, MIN_RUPTURE_SAMPLES)) + filter_length - 1
    gradual = max(window, int(MAX_GRADUAL_TRAVEL_M / speed * rate))
    return DetectionLimits(
        crossing=crossing, drop=drop, window=window, gradual=gradual, lag=filter_length - 1, quantum=quantum
    )


def cycle_events(
    time: np.ndarray, depth: np.ndarray, force: np.ndarray, cycle: Cycle, allowed: DetectionLimits
) -> CycleEvents:
    """The events of ``cycle`` in (n,) arrays of time [s], depth [m] and force [N] without outliers."""
    cut = _cut(depth, force, cycle, allowed)
    begin, last = _ends(time, depth, force, cycle, allowed=allowed, cut=cut)
    stroke = cut.blocks
    free = 0 if begin is None else int(np.searchsorted(stroke.depth, begin.depth))
    if (begin is None or free) and _loaded_before(cut, depth, free, allowed):
        begin, free = _from_the_start(cut), 0
    if begin is None:
        return CycleEvents(cycle=cycle)
    in_contact = not begin.free and begin.low <= cut.samples[0]
    contact = _event(time, depth, force, replace(begin, low=0) if in_contact else begin, allowed.lag)
    noise = block_noise(stroke.force, free, allowed.quantum, stroke.size)
    turns = cycle.withdrawn and cycle.stop == cycle.withdrawal_start
    found = _drops(cut, depth, free, begin.baseline, allowed, turns=turns)
    sudden, minor, oscillations = _classified(found, cut, begin.baseline, noise.white, allowed)
    puncture = lambda each: _puncture(each, cut, time, contact.depth, allowed.lag)  # noqa: E731
    return CycleEvents(
        cycle=cycle,
        contact=contact,
        punctures=tuple(map(puncture, sudden)),
        minor=tuple(map(puncture, minor)),
        oscillations=oscillations,
        exit=None if last is None else _event(time, depth, force, last, allowed.lag),
        free=begin.free,
        in_contact=in_contact,
        baseline=None if in_contact else begin.baseline,
        noise=noise.white * stroke.size**0.5,
    )


def _loaded_before(cut: Cut, depth: np.ndarray, free: int, allowed: DetectionLimits) -> bool:
    """Whether the force rises from the start and falls significantly before the supposed contact at block ``free`` (0:
    none was found): then the stroke begins in contact. Noise, hum and drift fall too, but do not rise for longer than
    they fall, by a good part of the fall."""
    before = cut.blocks if not free else cut.blocks.until(free)
    white = block_noise(before.force, 0, allowed.quantum, before.size).white
    if len(before) < 2 * MIN_RUPTURE_SAMPLES or np.ptp(before.force) < MIN_LOAD_SIGMA * white:
        return False
    if _has_a_hill(before.force, float(cut.blocks.force.max()), white):
        return True
    for drop in _drops(replace(cut, blocks=before), depth, 0, float(before.force.min()), allowed):
        rise, third = before.force[: drop.candidate.first + 1], max((drop.candidate.first + 1) // 3, 1)
        longer = drop.candidate.first * before.size > MIN_RISE_RATIO * (drop.end - drop.peak)
        if longer and float(rise[-third:].mean() - rise[:third].mean()) > drop.drop / 3.0:
            return True
    return False


def _has_a_hill(force: np.ndarray, peak: float, white: float) -> bool:
    """Whether the (m,) force of supposed free travel rises from its start to a rounded maximum and falls again, but
    never back: by a tenth of the ``peak`` of the stroke, as no drift does; hum and noise come back."""
    smooth = np.convolve(force, np.full(MIN_RUPTURE_SAMPLES, 1.0 / MIN_RUPTURE_SAMPLES), "valid")
    top = int(smooth.argmax())
    rise, fall = float(smooth[top] - force[:2].mean()), float(smooth[top] - smooth[top:].min())
    high = rise > max(MIN_LOAD_SIGMA * white, MAX_DRIFT_SHARE * (peak - float(force[:2].mean())))
    low, high_fall = (share * rise for share in HILL_FALLS)
    return high and top >= MIN_RUPTURE_SAMPLES and max(MIN_LOAD_SIGMA * white, low) < fall < high_fall


def _from_the_start(cut: Cut) -> Onset:
    """The contact of a stroke that begins in contact: its first sample, at the latest."""
    first, low = float(cut.blocks.depth[0]), cut.sample(0)
    return Onset(depth=first, low=low, high=low, baseline=float(cut.blocks.force.min()), noise=0.0, free=False)


def _drops(
    cut: Cut, depth: np.ndarray, free: int, baseline: float, allowed: DetectionLimits, *, turns: bool = False
) -> list[LocatedDrop]:
    """The significant falls after the ``free`` first blocks, located; of falls within a window the most significant:
    the needle oscillates after a rupture. A fall that a pull-back, a pause or a change of speed explains is not a
    puncture."""
    stroke = cut.blocks
    noise = block_noise(stroke.force, free, allowed.quantum, stroke.size)
    sizes = {"rupture": -(-allowed.window // stroke.size), "max_gap": -(-allowed.gradual // stroke.size)}
    kept: list[LocatedDrop] = []
    for candidate in drop_candidates(stroke, free=free, noise=noise, turns=turns, **sizes):
        drop = locate(cut.force, candidate, stroke, size=stroke.size, window=allowed.window, noise=noise)
        share = unslowed_share(drop, cut, baseline, SPEED_REACH * allowed.gradual)
        lasts = lasting_share(drop, cut, depth, allowed.window) >= LASTING_SHARE
        if candidate.statistic * share < candidate.threshold or not lasts:
            continue
        if not kept or drop.peak > kept[-1].end + allowed.window:
            kept.append(drop)
        elif candidate.statistic > kept[-1].candidate.statistic:
            kept[-1] = drop
    return kept


def _classified(
    found: list[LocatedDrop], cut: Cut, baseline: float, noise: float, allowed: DetectionLimits
) -> tuple[list[LocatedDrop], list[LocatedDrop], int]:
    """Punctures, minor falls, and the number of the latter that are a regular oscillation.

    In a smooth stroke every significant fall is a puncture. In a rough one small falls belong to the texture of the
    tissue, which grows with the force: there a puncture falls by the share ``allowed.drop`` of the force within a
    third of the rupture travel.
    """
    share = lambda drop: rupture_share(cut.force, drop, baseline, allowed.window, allowed.gradual)  # noqa: E731
    sudden = [each for each in found if not each.candidate.rough or share(each) >= allowed.drop]
    regular = _oscillation(sudden, cut, noise)
    minor = [each for each in found if each not in sudden or each in regular]
    return [each for each in sudden if each not in regular], minor, len(regular)


def _oscillation(found: list[LocatedDrop], cut: Cut, noise: float) -> list[LocatedDrop]:
    """Those of the located falls after the first that belong to a regular oscillation, as that of a cutting force; the
    first fall ends the deformation and remains a puncture.

    The force after it rises and falls in half-waves of at least half of the smallest of these falls. They oscillate
    regularly if there are enough of similar size, with a steady period over the depth: five, or twice as many where the
    force falls faster than it rises, as at the punctures of layers. A fall whose half-wave is larger than the others
    let expect, by Student's t for one false alarm in 1000 recordings, remains a puncture too.
    """
    later = found[1:]
    if not later:
        return []
    first = int(np.searchsorted(cut.blocks.starts, found[0].end))
    force, depth = cut.blocks.force[first:], cut.blocks.depth[first:]
    turns = core.reversals(force, max(0.5 * min(each.drop for each in later), MIN_WAVE_SIGMA * noise))
    sizes, at = np.abs(np.diff(force[turns])), depth[turns]
    usual = float(np.median(sizes)) if len(sizes) else 0.0
    similar = (sizes > usual / MAX_SIZE_RATIO) & (sizes < MAX_SIZE_RATIO * usual)
    periods = (at[2:] - at[:-2])[similar[1:] & similar[:-1]]
    falling = np.diff(force[turns]) < 0.0
    lengths = [
        float(np.median(np.diff(at)[similar & which])) if (similar & which).any() else 0.0
        for which in (falling, ~falling)
    ]
    needed = MIN_HALF_WAVES * (1 if lengths[0] > MIN_FALL_LENGTH * lengths[1] else 2)
    if similar.sum() < needed or np.std(periods) > MAX_SPACING_VARIATION * np.mean(periods):
        return []
    return [each for each in later if not _stands_out(cut.depth[each.peak], sizes[falling], at[1:][falling])]


def _stands_out(depth: float, sizes: np.ndarray, ends: np.ndarray) -> bool:
    """Whether the fall at a ``depth``, in one of (n,) half-waves with ``sizes`` and ``ends``, is larger than the others
    of a regular oscillation let expect."""
    own = min(int(np.searchsorted(ends, depth)), len(ends) - 1)
    others = np.delete(sizes, own)
    if len(others) < 3:
        return False
    limit = -float(stdtrit(len(others) - 1, FALSE_ALARMS / len(sizes))) * (1.0 + 1.0 / len(others)) ** 0.5
    return bool(sizes[own] > float(others.mean()) + limit * float(others.std(ddof=1)))


def _puncture(drop: LocatedDrop, cut: Cut, time: np.ndarray, contact_depth: float, lag: int) -> Puncture:
    """A located drop as a puncture; a filter may delay it by ``lag`` samples."""
    peak_depth = float(cut.depth[drop.peak])
    return Puncture(
        time=float(time[cut.number(drop.peak)]),
        depth=peak_depth,
        force=drop.force,
        low=max(cut.number(drop.low) - lag, 0),
        high=cut.number(drop.high),
        drop=drop.drop,
        indentation=peak_depth - contact_depth,
        statistic=drop.candidate.statistic,
        drop_low=drop.drop_low,
        drop_high=drop.drop_high,
        end=cut.number(drop.end),
        end_depth=float(cut.depth[min(drop.end, len(cut.depth) - 1)]),
        gradual=drop.gradual,
    )


def _event(time: np.ndarray, depth: np.ndarray, force: np.ndarray, where: Onset, lag: int) -> Event:
    """``where`` as an event at the first sample past its depth; a filter may delay it by ``lag`` samples."""
    low, high = max(where.low - lag, 0), min(where.high, len(depth) - 1)
    between = depth[low : high + 1]
    passed = np.flatnonzero(between >= where.depth if depth[high] >= depth[low] else between <= where.depth)
    at = low + int(passed[0]) if len(passed) else high
    return Event(float(time[at]), float(where.depth), float(force[at]), low, high)


def _ends(
    time: np.ndarray, depth: np.ndarray, force: np.ndarray, cycle: Cycle, allowed: DetectionLimits, cut: Cut
) -> tuple[Onset | None, Onset | None]:
    """Contact and exit with ``low`` and ``high`` as samples; both are determined again after the drift between them is
    subtracted. ``cut`` is the insertion."""
    span = slice(cycle.start, cycle.end)
    if cycle.withdrawn and only_drift(time[span], force[span], allowed.size(cycle)):
        return None, None
    begin, last = _contact(cut, allowed), None
    if begin is None or not cycle.withdrawn:
        return begin, None
    last = exit_depth(depth, force, cycle, allowed.size(cycle), allowed.crossing)
    peak = float(np.max(np.abs(force[span] - begin.baseline)))
    if last is None or not returned(begin, last, float(depth[cycle.stop - 1]), peak):
        return begin, None
    drift = last.baseline - begin.baseline
    if abs(drift) <= max(begin.noise, NEGLIGIBLE_DRIFT_SHARE * peak):
        return begin, last
    before, after = time[(cycle.start + begin.low) // 2], time[(last.high + cycle.end - 1) // 2]
    level = force - drift * (time - before) / (after - before)
    again = (
        _contact(_cut(depth, level, cycle, allowed), allowed),
        exit_depth(depth, level, cycle, allowed.size(cycle), allowed.crossing),
    )
    return again if None not in again else (begin, last)


def _cut(depth: np.ndarray, force: np.ndarray, cycle: Cycle, allowed: DetectionLimits) -> Cut:
    """The insertion stroke at the cut."""
    return at_cut(depth, force, cycle.start, cycle.stop, size=allowed.size(cycle), lag=allowed.lag)


def _contact(cut: Cut, allowed: DetectionLimits) -> Onset | None:
    """The contact of the insertion stroke, with blocks converted to samples."""
    found = onset(cut.blocks, allowed.crossing)
    return None if found is None else replace(found, low=cut.sample(found.low), high=cut.sample(found.high + 1))
