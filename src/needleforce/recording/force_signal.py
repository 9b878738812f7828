# SPDX-License-Identifier: Apache-2.0
"""Faults of the force signal: the sensor's bias, estimated from the free travel before contact, single corrupted
samples, and a depth that is later than it."""

import math
from statistics import NormalDist

import numpy as np

from .. import core
from .recording import Note
from .stream import Stream

_LEADING_TRAVEL_SHARE = 0.02  # of the depth's range: the leading part of the recording
_MIN_LEADING_SAMPLES = 20  # of free travel
_MAX_NOISE_SHARE = 0.05  # of the force's range: with more noise the leading part is not free travel
_MAX_CHANGE_SHARE = 0.002  # of the force's range: largest difference between its earlier and later half
_SIGNIFICANCE_SIGMA = 4.0  # standard errors
_MIN_TREND = 8  # samples of which a line is subtracted
_MAX_LAGS = 1000  # samples: longer than any filter in use
_MIN_SAMPLES = 20  # of a recording that is searched for glitches
_SPIKE_NOISE_FACTOR = 20.0  # median second differences
_SPIKE_RANGE_SHARE = 0.5  # of the range of all other samples
_END_SPIKE_RANGE_FACTOR = 10.0  # of that range at either end of a noisy force, where a step looks like a spike
_MAX_NEIGHBOUR_DIFFERENCE = 0.2  # of the spike's height: largest difference between its neighbours
_MAX_GLITCH_SHARE = 0.01  # of all samples: more of them are not glitches
_OUTLIER_FALSE_ALARMS = 1e-3  # outliers found in a recording that has only normal noise
_MAX_NEIGHBOUR_SPAN = 0.5  # of the outlier's height
_LOCAL_SAMPLES = 200  # whose differences show the noise near a sample
_LOCAL_MARGIN = 1.25  # of that noise, three standard errors of its estimate
_MAX_COMMON = 2000  # samples that show the common noise
_MIN_TURN_M = 4e-6  # of depth: travel back that is seen
_STEEPEST = 4.0  # times that travel: a needle that accelerates steadily is there in twice the time
_FALL_S = 0.5  # before a pull, of whose median the force falls
_FALLS = 4.0  # times that from half of it to the pull: the fall takes as long at most, by an accelerating needle
_MIN_LATE_S = 0.03  # between two states of an axis, or two looks of a recorder


def bias(depth: np.ndarray, force: np.ndarray) -> tuple[float, str]:
    """Estimate the bias of the force from the free travel before contact.

    Parameters
    ----------
    depth : (n,) array
        Depth [m].
    force : (n,) array
        Force [N].

    Returns
    -------
    bias : float
        The bias [N], 0 if none is significant.
    reason : str
        How it was found, or why there is none.

    Notes
    -----
    The leading samples are used, until depth has changed by more than 2 % of its range. They are free travel if there
    are at least 20 of them, their standard deviation is below 5 % of the force's range, and the force does not change
    between the earlier and the later half of their travel by more than four standard errors and more than 0.2 % of its
    range or its mean: an indentation that starts in contact has a force of which the mean is the change. Their mean is
    the bias if it exceeds four standard errors (corrected for autocorrelation) and one standard deviation, so that the
    force of a sensor zeroed before the run is not changed.

    In a recording that starts in contact the force changes as soon as the needle moves, and no bias is removed. A
    needle that rests in tissue and slips over 2 % of its range without a change of force cannot be distinguished from
    free travel.
    """
    reach = _LEADING_TRAVEL_SHARE * float(np.ptp(depth))
    moved = np.abs(depth - depth[0])
    end = int(np.argmax(moved > reach))
    lead, size = force[:end], float(np.ptp(force))
    if end < _MIN_LEADING_SAMPLES:
        return 0.0, f"only {end} samples precede the motion, {_MIN_LEADING_SAMPLES} are needed"
    noise = float(lead.std())
    if noise > _MAX_NOISE_SHARE * size:
        return 0.0, f"the noise at the start is more than {100 * _MAX_NOISE_SHARE:g} % of the force's range"
    later = moved[:end] > 0.5 * reach
    change = float(lead[later].mean() - lead[~later].mean()) if later.any() and not later.all() else 0.0
    error = _standard_error(lead - change * later)
    halves = (lead[~later], lead[later]) if change else (lead,)
    of_change = math.hypot(*(_standard_error(_without_trend(half)) for half in halves))
    mean = float(lead.mean())
    if abs(change) > max(min(_MAX_CHANGE_SHARE * size, abs(mean)), _SIGNIFICANCE_SIGMA * of_change):
        return 0.0, "the force changes as soon as the needle moves, as in contact"
    if abs(mean) <= max(_SIGNIFICANCE_SIGMA * error, noise, 1e-9 * size):
        return 0.0, f"the leading {end} samples have a mean of {mean:.3g} N, within the noise"
    return mean, f"mean of the leading {end} samples, standard error {error:.2g} N"


def _standard_error(values: np.ndarray) -> float:
    """The standard error of the mean of correlated ``values``, with correlations up to the first that is not
    positive."""
    deviation = values - values.mean()
    square, time = float(deviation @ deviation), 1.0
    for lag in range(1, min(len(values) // 4, _MAX_LAGS)):
        product = float(deviation[lag:] @ deviation[:-lag])
        if product <= 0.0:
            break
        time += 2.0 * product / square
    return float(np.sqrt(time * square)) / len(values)


def _without_trend(values: np.ndarray) -> np.ndarray:
    """What (n,) values differ by from their line: a rise in contact is no noise."""
    if len(values) < _MIN_TREND:
        return values
    place = np.linspace(-1.0, 1.0, len(values))
    slope = float(place @ (values - values.mean())) / float(place @ place)
    return values - slope * place


def remove_bias(stream: Stream, already_noted: bool) -> None:
    """Remove a significant bias and note it; without one, note that, unless the file has such a note already."""
    value, reason = bias(stream.values["depth"], stream.values["force"])
    if value:
        stream.values["force"] = stream.values["force"] - value
        stream.notes.append(Note("baseline", f"a bias of {value:.6g} N is removed from the force: {reason}"))
    elif not already_noted:
        stream.notes.append(Note("baseline", f"no bias is removed from the force: {reason}", 0))


def glitches(force: np.ndarray) -> np.ndarray:
    """The sample numbers of isolated spikes, one sample wide, in (n,) ``force``; a peak before a drop is not a spike.

    The two neighbours of a spike agree. The spike differs from their mean by more than 20 median second differences and
    by more than half of the range of all other samples.
    """
    if len(force) < _MIN_SAMPLES:
        return np.empty(0, int)
    second = np.abs(np.diff(force, 2))
    ends = abs(force[1] - force[0]), abs(force[-1] - force[-2])
    if max(0.5 * float(second.max()), *ends) <= _SPIKE_RANGE_SHARE * _min_range(force):
        return np.empty(0, int)
    height, noise = np.concatenate((ends[:1], 0.5 * second, ends[1:])), float(np.median(second))
    before, after = np.append(force[2], force[:-1]), np.append(force[1:], force[-3])
    isolated = (height > _SPIKE_NOISE_FACTOR * noise) & (np.abs(after - before) < _MAX_NEIGHBOUR_DIFFERENCE * height)
    others = force[~isolated]
    if not isolated.any() or not len(others):
        return np.empty(0, int)
    size = float(np.ptp(others))
    threshold = np.full(len(force), max(_SPIKE_RANGE_SHARE * size, _SPIKE_NOISE_FACTOR * quantum_of(others)))
    threshold[[0, -1]] = _END_SPIKE_RANGE_FACTOR * size if noise > 0.0 else np.inf
    found = np.flatnonzero(isolated & (height > threshold))
    return found if len(found) <= _MAX_GLITCH_SHARE * len(force) else np.empty(0, int)


def glitch_notes(time: np.ndarray, force: np.ndarray) -> list[Note]:
    """A note on the spikes in (n,) ``force`` [N] over ``time`` [s], if there are any."""
    found = glitches(force)
    return [Note("glitch", f"{spikes(time, force, found)}; not removed", len(found))] if len(found) else []


def spikes(time: np.ndarray, force: np.ndarray, found: np.ndarray) -> str:
    """A phrase with the number of the glitches ``found`` and the largest of them."""
    worst = int(found[np.argmax(np.abs(force[found]))])
    what = f"of {force[worst]:.4g} N at {time[worst]:.6g} s, far from its neighbours"
    if len(found) == 1:
        return f"the force has a spike, one sample wide, {what}"
    return f"the force has {len(found)} spikes, one sample wide, the largest {what}"


def _min_range(force: np.ndarray) -> float:
    """A lower bound on the range of the samples without spikes: of two neighbours at most one is a spike."""
    lower, upper = np.minimum(force[1:], force[:-1]), np.maximum(force[1:], force[:-1])
    return float(lower.max() - upper.min())


def outliers(force: np.ndarray, quantum: float | None = None) -> np.ndarray:
    """Find single samples that lie far from their neighbours on both sides.

    Parameters
    ----------
    force : (n,) array
        Force [N], sampled uniformly.
    quantum : float, optional
        Its smallest step [N], where it is known.

    Returns
    -------
    (k,) array of int
        Sample numbers, in order.

    Notes
    -----
    A sample is compared with the median of its six neighbours. It is an outlier if the difference is beyond what normal
    noise reaches once in 1000 recordings of this length, with the robust standard deviation of such differences near
    it, and if the neighbours agree: but for one on either side they span less than half of the difference, as neither
    those of a peak before a drop nor those of a step do. A sample that lies nearer to the line through the three before
    it, or after it, is the end of a rise before a drop and no outlier. A quantum of the sensor counts as noise.
    """
    count = len(force)
    if count < _MIN_SAMPLES:
        return np.empty(0, int)
    level = -NormalDist().inv_cdf(0.5 * _OUTLIER_FALSE_ALARMS / count)
    step = max(quantum_of(force) if quantum is None else quantum, 1e-9 * float(np.ptp(force)))
    found = core.outliers(
        force,
        level,
        step,
        max_span=_MAX_NEIGHBOUR_SPAN,
        margin=_LOCAL_MARGIN,
        local=_LOCAL_SAMPLES,
        common=_MAX_COMMON,
    )
    return np.array(found, int)


def without_outliers(force: np.ndarray, found: np.ndarray) -> np.ndarray:
    """The (n,) force with every outlier replaced by the median of its neighbours that are none."""
    if not len(found):
        return force
    clean, spiked = force.copy(), set(found.tolist())
    for k in found:
        near = [j for j in range(max(k - 3, 0), min(k + 4, len(force))) if j not in spiked]
        clean[k] = np.median(force[near]) if near else clean[k]
    return clean


def quantum_of(force: np.ndarray) -> float:
    """The smallest step [N] of (n,) values beyond their rounding, 0 if they are constant."""
    return core.quantum_of(force)


def late_depth(
    force: tuple[np.ndarray, np.ndarray], depth: tuple[np.ndarray, np.ndarray], pull: float, spread: float
) -> tuple[float, float] | None:
    """The range [s] in which a depth is later than the force where a needle turns back; None if it is not.

    ``force`` are times (n,) [s] and forces against the insertion above their zero [N], ``depth`` times (m,) and depths
    [m] with noise of at most ``spread`` [m], both from a rest or the end of an insertion into the withdrawal. A needle
    that rests or goes deeper is not pulled, however the tissue relaxes: if the force pulls by more than ``pull`` [N]
    before the depth can have begun to turn, the depth is late. The range is from the pull to the earliest
    begin of its fall.
    """
    (time, force), (when, depth) = force, depth
    travel, seen = depth.max() - depth, max(_MIN_TURN_M, 2.0 * spread)
    moved = [np.flatnonzero(travel <= each)[-1] for each in (seen, _STEEPEST * seen)]
    if moved[1] + 1 >= len(when):
        return None
    early, late = float(when[moved[0]]), float(when[moved[1] + 1])
    begins = 2.0 * early - late
    before = np.flatnonzero((time <= begins) & (force >= -pull))
    if not len(before) or before[-1] + 1 >= len(time):
        return None
    pulled = before[-1] + 1
    shortest, fall = begins - float(time[pulled]), slice(np.searchsorted(time, time[pulled] - _FALL_S), pulled)
    half = time[fall][force[fall] >= 0.5 * np.median(force[fall])][-1]
    falls = max(float(time[0]), float(time[pulled] - _FALLS * (time[pulled] - half)))
    return (shortest, early - falls) if shortest > _MIN_LATE_S else None
