# SPDX-License-Identifier: Apache-2.0
"""What keeps a recording from being segmented, why it has no contact, and what is doubtful in an insertion: jumps of
the depth, stops, a force that is cut off, a zero that drifts or steps."""

import numpy as np

from .. import core
from ..display.quantities import percent, plain
from ..recording.force_signal import glitches, spikes
from ..vocabulary import SMALLEST
from .cycle_events import CycleEvents
from .strokes import MIN_RANGE_M, Blocks, blocks

WITHDRAWN_ONLY = "The depth only decreases: the needle is withdrawn, and there is no insertion."

JUMP_RATIO = 20.0  # of a step of the depth over the 95th percentile of its steps
MIN_JUMP_SHARE = 0.05  # of the depth's range
N_BLOCKS = 400  # of a recording in which stops are searched
REST_SHARE = 1e-3  # of the depth's range: a block with less travel is at rest
MIN_STOP_S = 0.2  # [s] a shorter stop is part of the motion
NOTED_SIGMA = 10.0  # [sd of the noise] change of the force at rest, or of its zero, that is noted,
NOTED_SHARE = 0.1  # if it is at least this share of the largest force
SATURATED = "the sensor may be saturated."
MIN_CLIPPED = 5  # samples at exactly the largest force
CLIPPED_STEPS = 8.0  # quanta or standard errors that the force rose over as many samples before
SAME_DEPTH_SHARE = 0.05  # of the depth's range, from the start of the insertion
MAX_ALTERNATION_SHARE = 0.05  # of the depth's range: a needle does not jump back and forth by more at every sample
MIN_ORDERED = 50  # samples of a depth whose order is judged
DEAD_SHARE = 0.98  # of the samples with one value: even a coarse sensor shows an insertion in more of them
MIN_LEVEL, MAX_LEVEL = 5, 20  # samples of a steady level
STEPS_TRIED = 5  # the largest changes between two samples
STEP_GAP = 3  # samples on either side of a step, which a filter makes gradual
STEP_QUANTA, STEP_SHARE = 3.0, 0.02  # of the sensor, and of the range of the force: a smaller step is drift
STEP_SIGMA = 10.0  # [sd of the level] of a step: white noise makes none in 1e12 recordings
STEP_WINDOWS = ((20, 3), (20, 10), (8, 3))  # [samples] on either side of a step of the zero, and left out next to it
STEP_ERRORS = 4.0  # [standard errors] by which it may differ from what the zero has moved
NEGATIVE_RATIO = 3.0  # of the largest force below zero to that above


def unreadable(time: np.ndarray, depth: np.ndarray, force: np.ndarray) -> str:
    """Why (n,) time, depth and force cannot be segmented; empty if they can."""
    if not all(np.isfinite(values).all() for values in (time, depth, force)):
        return "The recording contains values that are not finite."
    back = np.flatnonzero(np.diff(time) <= 0.0)
    if len(back):
        where = f"at {len(back)} places, first at sample {back[0] + 1}"
        return f"The time does not increase from sample to sample: {where}. Sort the samples by time."
    size = float(np.ptp(depth)) if len(depth) >= MIN_ORDERED else 0.0
    if size > 0.0 and core.noise_exceeds(depth, MAX_ALTERNATION_SHARE * size):
        return "The depth jumps back and forth from sample to sample: are the samples in the wrong order?"
    return ""


def no_contact(time: np.ndarray, depth: np.ndarray, force: np.ndarray, quantum: float, *, moved: bool) -> str:
    """Why there is no contact in (n,) time, depth and force: the needle did not move inwards, or the force does not
    show it."""
    if not moved:
        withdrawn = len(depth) > 2 and depth[0] - depth[-1] > 0.5 * float(np.ptp(depth)) > 0.0
        if withdrawn:
            return WITHDRAWN_ONLY
        if len(depth) and 0.0 < (span := float(np.ptp(depth))) <= MIN_RANGE_M:
            small = (
                f"The depth changes by {plain(span, 'm')}, and events are searched from {plain(MIN_RANGE_M, 'm')} on"
            )
            return f"{small}. For an indentation use needleforce indentation."
        return "The depth never increases: the needle does not move inwards."
    if constant := dead(force):
        return constant
    if stuck := dies(time, depth, force):
        return f"No contact is detected: {stuck}"
    found = glitches(force)
    if len(found):
        return f"No contact is detected because of a glitch: {spikes(time, force, found)}. Remove such samples."
    cause = baseline_step(time, force, quantum) or _negative(force)
    return cause or "The force never exceeds the noise of its baseline: there is no contact."


def dead(force: np.ndarray) -> str:
    """A sentence if almost all of the (n,) force has one value."""
    usual = float(np.median(force))
    share = float(np.mean(force == usual))
    if share <= DEAD_SHARE:
        return ""
    samples = "all samples" if share == 1.0 else f"{percent(share)} of the samples"
    return (
        f"The force is constant, {plain(usual, 'N')} in {samples}: there is no contact, or the channel is dead. Check "
        "the sensor, and which column is the force."
    )


def dies(time: np.ndarray, depth: np.ndarray, force: np.ndarray) -> str:
    """A clause if the (n,) force has its last value from a sample on, beyond which half of the depth is travelled."""
    changes = np.flatnonzero(np.diff(force))
    last = int(changes[-1]) + 1 if len(changes) else len(force)
    if float(depth[last:].max(initial=-np.inf) - depth[last:].min(initial=np.inf)) <= 0.5 * float(np.ptp(depth)):
        return ""
    return f"the force is exactly {plain(force[-1], 'N')} from {time[last]:.6g} s on, and the channel is dead."


def baseline_step(time: np.ndarray, force: np.ndarray, quantum: float, stop: int | None = None) -> str:
    """A sentence if the (n,) force has a ``first_step``."""
    at, change = first_step(force, quantum, stop)
    if not at:
        return ""
    return (
        f"The force steps by {plain(change, 'N')} at {time[at]:.6g} s, from one steady level to another: the baseline "
        "changes, as if the sensor was zeroed while it recorded. Leave out what is before, with --first-row or "
        "Recording.between, or record again."
    )


def first_step(force: np.ndarray, quantum: float, stop: int | None = None) -> tuple[int, float]:
    """The sample before ``stop`` at which the (n,) force steps from the steady level where it begins to another, as
    that of a sensor that is zeroed, and the change [N]; zeros without one."""
    min_step = max(STEP_QUANTA * quantum, STEP_SHARE * float(np.ptp(force)))
    force = force[:stop]
    size = min(MAX_LEVEL, len(force) // 4)
    if size < MIN_LEVEL:
        return 0, 0.0
    level, spread, steps = core.median(force[:size]), float(force[:size].std()), np.abs(np.diff(force))
    largest = np.argpartition(steps, -min(STEPS_TRIED, len(steps)))[-STEPS_TRIED:] + 1
    for at in sorted(int(each) for each in largest if size <= each - STEP_GAP and each + STEP_GAP + size <= len(force)):
        after = force[at + STEP_GAP :][:size]
        change = core.median(after) - level
        if abs(change) <= max(min_step, STEP_SIGMA * spread, STEP_SIGMA * float(after.std())):
            continue
        if float(np.ptp(force[: at - STEP_GAP])) < 0.5 * abs(change):
            return at, change
    return 0, 0.0


def _negative(force: np.ndarray) -> str:
    """A sentence if the force goes below its first value beyond its noise, and is mostly below zero."""
    low, high = float(force.min()), float(force.max())
    noise = core.second_difference_noise(np.ascontiguousarray(force, float))
    if float(force[0]) - low <= STEP_SIGMA * noise or -low <= NEGATIVE_RATIO * high:
        return ""
    return (
        f"The force is negative, down to {plain(low, 'N')}: a force that opposes the insertion is positive. Reverse "
        "its sign, with --unit force=-N, if it was pressed."
    )


def doubtful(time: np.ndarray, depth: np.ndarray, force: np.ndarray, chosen: CycleEvents, quantum: float) -> list[str]:
    """Sentences on what is doubtful in (n,) time, depth and force of the insertion ``chosen``."""
    span = slice(chosen.cycle.start, chosen.cycle.withdrawal_start)
    peak, moved = float(np.ptp(force[span])), _zero_change(depth, force, chosen)
    found = [_jumps(depth)]
    if abs(moved) > max(NOTED_SIGMA * chosen.noise, NOTED_SHARE * peak, SMALLEST):
        sentence, step = _changed_zero(time, depth, force, chosen, moved)
        found += [f"Back at its first depth, the force differs by {plain(moved, 'N')}, {percent(abs(moved) / peak)} of "
                  f"the range: {sentence}"]  # fmt: skip
        force = force - step
    found += [*_stops(time, depth, force, chosen, peak), _clipped(depth[span], force[span], quantum, chosen.noise)]
    return [each for each in found if each]


def _jumps(depth: np.ndarray) -> str:
    """A note on steps of the depth that are far larger than all others."""
    step = np.abs(np.diff(depth))
    min_jump = MIN_JUMP_SHARE * float(np.ptp(depth))
    if not step.max(initial=0.0) > min_jump:
        return ""
    usual = float(np.partition(step, int(0.95 * (len(step) - 1)))[int(0.95 * (len(step) - 1))])
    far = np.flatnonzero(step > max(JUMP_RATIO * usual, min_jump))
    if not len(far):
        return ""
    size = f"{1e3 * float(step[far].max()):.3g} mm"
    return f"The depth jumps by up to {size}, first at sample {far[0] + 1}: samples are missing or in the wrong order."


def _stops(time: np.ndarray, depth: np.ndarray, force: np.ndarray, chosen: CycleEvents, peak: float) -> list[str]:
    """Notes on stops during the insertion, and on a force that rises while the depth stands."""
    cycle = chosen.cycle
    size = max(1, (cycle.withdrawal_start - cycle.start) // N_BLOCKS)
    part = blocks(depth, force, cycle.start, cycle.withdrawal_start, size)
    still = np.abs(np.diff(part.depth)) < REST_SHARE * float(np.ptp(depth))
    edges = np.flatnonzero(np.diff(np.concatenate(([False], still, [False])).astype(int)))
    notes = []
    for a, b in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        first, last = part.sample(a), min(part.sample(b + 1), cycle.withdrawal_start) - 1
        if time[last] - time[first] >= MIN_STOP_S and depth[first] > chosen.contact.depth:
            notes += [_rise(part, a, b, chosen.noise, peak), _pause(time, depth, first, last, cycle.stop)]
    return notes


def _rise(part: Blocks, first: int, last: int, noise: float, peak: float) -> str:
    """A note on a force that rises over blocks in which the depth stands."""
    rise = float(part.force[last] - part.force[first])
    if rise < max(NOTED_SIGMA * noise, NOTED_SHARE * peak):
        return ""
    where = f"{1e3 * part.depth[first]:.4g} mm"
    return (
        f"The force rises by {rise:.3g} N while the depth stands at {where}: the depth is not that of the tip (a rig "
        "that yields, or a signal that is not updated)."
    )


def _pause(time: np.ndarray, depth: np.ndarray, first: int, last: int, stop: int) -> str:
    """A note on a stop before the deepest point."""
    if last >= stop:
        return ""
    duration, where = f"{time[last] - time[first]:.2g} s", f"{1e3 * depth[first]:.4g} mm"
    return f"The depth stands for {duration} at {where} during the insertion: a pause, or a motor that stalls."


def saturated(depth: np.ndarray, force: np.ndarray, quantum: float, noise: float) -> tuple[int, int] | None:
    """The first and the number of samples of a force that stays at exactly its largest value although the travel would
    have raised it further: by more than its noise, and by two steps, as rounding hides one before and one after."""
    top = float(force.max())
    edges = np.flatnonzero(np.diff(np.concatenate(([False], force == top, [False])).astype(int)))
    lengths = edges[1::2] - edges[::2]
    first, count = int(edges[2 * int(np.argmax(lengths))]), int(lengths.max())
    begin = max(first - count, 0)
    if min(count, first - begin) < MIN_CLIPPED or not max(quantum, noise) > 0.0:
        return None
    risen = top - float(force[begin : begin + max((first - begin) // 4, 1)].mean())
    before, meanwhile = float(depth[first] - depth[begin]), float(depth[first : first + count].max() - depth[first])
    expected = risen * min(meanwhile / before, 1.0) if before > 0.0 else risen
    if expected < max(2.0 * quantum, CLIPPED_STEPS * max(quantum, noise) / (first - begin) ** 0.5):
        return None
    return first, count


def _clipped(depth: np.ndarray, force: np.ndarray, quantum: float, noise: float) -> str:
    found = saturated(depth, force, quantum, noise)
    if found is None:
        return ""
    stands = f"The force stands at exactly its maximum of {force.max():.4g} N for {found[1]} samples"
    return f"{stands}: {SATURATED}"


def _zero_change(depth: np.ndarray, force: np.ndarray, chosen: CycleEvents) -> float:
    """The force at the end of the withdrawal less that at the start of the insertion, at one depth; 0 where either is
    not known."""
    cycle = chosen.cycle
    near = depth <= depth[cycle.start] + SAME_DEPTH_SHARE * float(np.ptp(depth))
    before = force[: cycle.stop][near[: cycle.stop]]
    after = force[cycle.withdrawal_start : cycle.end][near[cycle.withdrawal_start : cycle.end]]
    if not cycle.withdrawn or min(len(after), len(before)) < MIN_CLIPPED:
        return 0.0
    return core.median(after) - core.median(before)


def _changed_zero(
    time: np.ndarray, depth: np.ndarray, force: np.ndarray, chosen: CycleEvents, moved: float
) -> tuple[str, np.ndarray | float]:
    """Why the zero has ``moved``, and the step (n,) of the zero if it is one. Where the recording begins in contact,
    the two levels differ by the friction too."""
    if stuck := dies(time, depth, force):
        return stuck, 0.0
    at = _step_by(force, moved, max(chosen.noise, float(core.second_difference_noise(force))))
    lowest = float(depth.max()) - SAME_DEPTH_SHARE * float(np.ptp(depth))
    falls = at < chosen.cycle.stop or depth[at] > lowest  # in the insertion, or where the needle reverses
    step = f"steps by as much at {time[at]:.6g} s, at a depth of {plain(depth[at], 'm')}"
    if at and moved < 0.0 and falls:
        return f"its zero {step}, or drifts: a puncture and a reversal look like that step.", 0.0
    if at:
        return f"its zero {step}.", np.where(np.arange(len(force)) < at, 0.0, moved)
    return "the sensor drifts" + ", or it begins in the tissue" * (chosen.baseline is None) + ".", 0.0


def _step_by(force: np.ndarray, size: float, noise: float) -> int:
    """The sample from which (n,) force is another by ``size`` [N], all of it within a few samples; 0 without one.

    Lines through the samples before and after a place, which describe them within the noise, differ there by the step,
    within four of its standard errors: noise alone makes no such step, as the size is at least twice that. Nor does a
    kink, at which the lines meet, as where the needle reverses.
    """
    for width, gap in STEP_WINDOWS:
        count = len(force) - 2 * (width + gap) + 1
        x, reach = np.arange(width) - 0.5 * (width - 1), 0.5 * (width - 1) + gap
        error = noise * (2.0 / width + 2.0 * reach**2 / float(x @ x)) ** 0.5
        if count < 1 or 2.0 * STEP_ERRORS * error > abs(size):
            continue
        part = np.lib.stride_tricks.sliding_window_view(force, width)
        level, slope = part.mean(axis=1), part @ x / float(x @ x)
        straight = np.abs(part - level[:, None] - slope[:, None] * x).max(axis=1) <= STEP_ERRORS * noise
        step = (level - slope * reach)[-count:] - (level + slope * reach)[:count]
        kink = (2 * gap + 1) * np.abs(slope[-count:] - slope[:count])
        sudden = straight[-count:] & straight[:count] & (np.abs(step) > kink)
        off = np.where(sudden, np.abs(step - size), np.inf)
        if float(off.min()) <= STEP_ERRORS * error:
            middle = int(off.argmin()) + width + gap
            return middle - gap + int((np.sign(size) * np.diff(force[middle - gap - 1 : middle + gap + 1])).argmax())
    return 0
