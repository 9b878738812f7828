# SPDX-License-Identifier: Apache-2.0
"""The bias of the force sensor, from the free travel before contact."""

import numpy as np

_REST = 0.02  # share of the depth's range that counts as the leading part
_SAMPLES = 20
_NOISE = 0.05  # of the force's range: above, the leading part is no quiet free travel
_LEVEL = 0.002  # of the force's range: by so much its later half may differ from its earlier one
_SURE = 4.0  # standard errors
_LAGS = 1000  # samples: no filter is longer


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
    if noise > _NOISE * size:
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
