# SPDX-License-Identifier: Apache-2.0
"""Faults of the force signal: the sensor's bias, from the free travel before contact, and single corrupted samples."""

import numpy as np

from .recording import Note
from .stream import Stream

_REST = 0.02  # share of the depth's range that counts as the leading part
_SAMPLES = 20
_QUIET_SHARE = 0.05  # of the force's range: above, the leading part is no quiet free travel
_LEVEL = 0.002  # of the force's range: by so much its later half may differ from its earlier one
_SURE = 4.0  # standard errors
_LAGS = 1000  # samples: no filter is longer
_FEWEST = 20  # samples
_SPIKE_OVER_NOISE = 20.0  # median second differences
_RANGE = 0.5  # of the range of all other samples …
_END_RANGE = 10.0  # … or so many at either end of a noisy force: there a step looks like a spike
_ALIKE = 0.2  # of its height: by so much the neighbours of a spike may differ
_AT_MOST = 0.01  # of all samples: more are no glitches


def bias(depth: np.ndarray, force: np.ndarray) -> tuple[float, str]:
    """The bias [N] of ``force`` (n,) over ``depth`` (n,) [m], 0 where none is sure, and why, in a sentence.

    Used are the leading samples, while depth has not moved by more than 2 % of its range. They count as free
    travel if they are at least 20, with a standard deviation below 5 % of the force's range, and if the force
    does not change from the earlier half of their travel to the later one: by less than 0.2 % of its range, or
    four standard errors. Their mean is the bias if it exceeds four standard errors (in which the correlation that a
    filter leaves counts) and one standard deviation: a sensor zeroed before the run stays as it is.

    A recording that starts in contact changes its force as soon as it moves and is left alone. What cannot
    be told apart is a needle that rests in tissue and slips 2 % of its range without any change of force.
    """
    reach = _REST * float(np.ptp(depth))
    moved = np.abs(depth - depth[0])
    end = int(np.argmax(moved > reach))
    lead, size = force[:end], float(np.ptp(force))
    if end < _SAMPLES:
        return 0.0, f"only {end} samples before motion, {_SAMPLES} are needed"
    noise = float(lead.std())
    if noise > _QUIET_SHARE * size:
        return 0.0, "the force is not quiet at the start"
    late = moved[:end] > 0.5 * reach
    change = _mean(lead[late]) - _mean(lead[~late]) if late.any() and not late.all() else 0.0
    error = _standard_error(lead - change * late)
    if abs(change) > max(_LEVEL * size, _SURE * error):
        return 0.0, "the force changes as soon as the needle moves, as in contact"
    mean = _mean(lead)
    if abs(mean) <= max(_SURE * error, noise, 1e-9 * size):
        return 0.0, f"the leading {end} samples have a mean of {mean:.3g} N, within the noise"
    return mean, f"mean of the leading {end} samples, standard error {error:.2g} N"


def _standard_error(values: np.ndarray) -> float:
    """Of the mean of correlated ``values``: their correlations are summed up to the first that is not positive."""
    deviation = values - values.mean()
    square, time = float(deviation @ deviation), 1.0
    for lag in range(1, min(len(values) // 4, _LAGS)):
        product = float(deviation[lag:] @ deviation[:-lag])
        if product <= 0.0:
            break
        time += 2.0 * product / square
    return float(np.sqrt(time * square)) / len(values)


def _mean(values: np.ndarray) -> float:
    return float(values.mean())


def remove_bias(stream: Stream, before: bool) -> None:
    """Remove a sure bias; that there is none is said unless the file tells its own story (``before``)."""
    value, why = bias(stream.values["depth"], stream.values["force"])
    if value:
        stream.values["force"] = stream.values["force"] - value
        stream.notes.append(Note("baseline", f"a bias of {value:.6g} N is removed from the force: {why}"))
    elif not before:
        stream.notes.append(Note("baseline", f"no bias is removed from the force: {why}", 0))


def glitches(force: np.ndarray) -> np.ndarray:
    """Sample numbers of the isolated spikes, one sample wide, in (n,) ``force``; a peak before a fall is none.

    Each differs from the mean of its two neighbours, which agree, by more than 20 median second differences and by
    more than half of the range of all other samples.
    """
    if len(force) < _FEWEST:
        return np.empty(0, int)
    second = np.abs(np.diff(force, 2))
    ends = abs(force[1] - force[0]), abs(force[-1] - force[-2])
    if max(0.5 * float(second.max()), *ends) <= _RANGE * _least_range(force):
        return np.empty(0, int)
    height, noise = np.concatenate((ends[:1], 0.5 * second, ends[1:])), float(np.median(second))
    before, after = np.append(force[2], force[:-1]), np.append(force[1:], force[-3])
    alone = (height > _SPIKE_OVER_NOISE * noise) & (np.abs(after - before) < _ALIKE * height)
    rest = force[~alone]
    if not alone.any() or not len(rest):
        return np.empty(0, int)
    size = float(np.ptp(rest))
    least = np.full(len(force), max(_RANGE * size, _SPIKE_OVER_NOISE * _quantum(rest)))
    least[[0, -1]] = _END_RANGE * size if noise > 0.0 else np.inf
    found = np.flatnonzero(alone & (height > least))
    return found if len(found) <= _AT_MOST * len(force) else np.empty(0, int)


def glitch_notes(time: np.ndarray, force: np.ndarray) -> list[Note]:
    """A note on the spikes in (n,) ``force`` [N] over ``time`` [s], if there are any."""
    found = glitches(force)
    return [Note("glitch", f"{spikes(time, force, found)}: told, not removed", len(found))] if len(found) else []


def spikes(time: np.ndarray, force: np.ndarray, found: np.ndarray) -> str:
    """In words, how many glitches were ``found``, and the largest of them."""
    worst = int(found[np.argmax(np.abs(force[found]))])
    what = f"of {force[worst]:.4g} N at {time[worst]:.6g} s, far beyond its neighbours"
    if len(found) == 1:
        return f"the force has a spike, one sample wide, {what}"
    return f"the force has {len(found)} spikes, one sample wide, the largest {what}"


def _least_range(force: np.ndarray) -> float:
    """What the range of all other samples exceeds, without knowing the spikes: of two neighbours one is none."""
    lower, upper = np.minimum(force[1:], force[:-1]), np.maximum(force[1:], force[:-1])
    return float(lower.max() - upper.min())


def _quantum(values: np.ndarray) -> float:
    """The smallest step of (n,) values, 0 if they are constant: a coarse sensor's last digit is no spike."""
    steps = np.abs(np.diff(values))
    steps = steps[steps > 0.0]
    return float(steps.min()) if len(steps) else 0.0
