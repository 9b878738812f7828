# SPDX-License-Identifier: Apache-2.0
"""Alignment of a device's clock with the host's from arrival times: the closest line below all points."""

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from ..errors import InputError

_N_BLOCKS = 20
_MIN_SAMPLES = _N_BLOCKS  # fewer samples do not determine a rate
# Error of the line at either end of the recording, in units of the mean over blocks of the minimum delay. 95 % of
# simulated recordings are below 0.7 if the density of the delay is finite at its minimum (exponential, uniform), below
# 1.5 if it rises linearly from zero (bursts; gamma of shape 2), and below 2.1 if it rises quadratically (shape 3), for
# any number of samples. For delays that rarely approach their minimum the uncertainty is too small: gamma of shape 5 is
# covered in 87 to 97 %.
_UNCERTAINTY_FACTOR = 3.0
_LIVE_BLOCK_S = 0.5  # device time that gives one point: the sample with the minimum delay
_MAX_LIVE_POINTS = 60


@dataclass(frozen=True)
class Alignment:
    """A linear map from device time to host time, ``host = offset + rate * device``.

    Parameters
    ----------
    rate : float
        Host seconds per device second.
    offset : float
        Host time [s] at device time zero.
    uncertainty : float
        Bound [s] on the error of the host time, valid with a probability of at least 95 % within the aligned recording,
        not beyond its ends; infinite if the rate could not be determined.
    samples : int
        Number of samples used.

    Notes
    -----
    The map includes the minimum delay of the transmission. A delay common to all samples (a filter in the device, the
    minimum time on the wire, a computer that is busy from the first sample to the last) looks like an offset, and
    one-way arrival times cannot identify it.
    """

    rate: float
    offset: float
    uncertainty: float
    samples: int

    def host(self, device: np.ndarray) -> np.ndarray:
        """Convert device times (n,) [s] to host times (n,) [s]."""
        return self.offset + self.rate * np.asarray(device, float)


def align(device: np.ndarray, arrival: np.ndarray) -> Alignment:
    """Align a device's clock with the host's from arrival times.

    Parameters
    ----------
    device : (n,) array
        Device times [s], not decreasing.
    arrival : (n,) array
        Host times [s] at which the samples arrived.

    Returns
    -------
    Alignment
        The map from device time to host time. With fewer than 20 samples the rate is 1, the offset is that of the
        sample with the minimum delay, and the uncertainty is infinite.

    Raises
    ------
    InputError
        Device times that decrease (a restart: align each part separately), values that are not finite, or arrays of
        unequal length.

    Notes
    -----
    A sample arrives after a delay >= 0 of any distribution, never early. The line is therefore below all points; of
    these lines it has the smallest sum of distances: it is the edge of the lower convex hull over the mean device time.
    Large delays have no influence on it. The uncertainty follows from the minimum delays above the line in 20 blocks of
    equal count, which are near zero if each block contains samples with the minimum delay. Gaps are harmless. A clock
    that is set forward during the recording appears only in the uncertainty.
    """
    device, arrival = np.asarray(device, float), np.asarray(arrival, float)
    _check(device, arrival)
    x, delayed = device - device[0], arrival - arrival[0] - (device - device[0])
    if len(x) < _MIN_SAMPLES or x[-1] == 0.0:
        offset = float(delayed.min() + arrival[0] - device[0])
        return Alignment(1.0, offset, np.inf, len(x))
    left, right = _hull_edge(x, delayed)
    drift = float((delayed[right] - delayed[left]) / (x[right] - x[left]))
    base = float(delayed[left] - drift * x[left])
    delays = delayed - base - drift * x
    mean_minimum = np.minimum.reduceat(delays, np.arange(_N_BLOCKS) * len(x) // _N_BLOCKS).mean()
    rounding = np.spacing(max(abs(device[-1]), np.abs(arrival).max()))
    offset = float(arrival[0] + base - (1.0 + drift) * device[0])
    return Alignment(1.0 + drift, offset, float(_UNCERTAINTY_FACTOR * mean_minimum + rounding), len(x))


class LiveAlignment:
    """Host times [s] for the headers of live samples: causal, in constant time, never decreasing, never in the future.

    As ``align``, from the sample with the minimum delay in each half second of the last half minute and from the
    samples since then; for the first 10 s the rate is 1. A device time that decreases is a restart: the alignment
    starts again and the host time continues. After the recording, ``align`` on the recorded arrival times is more
    accurate.
    """

    def __init__(self):
        self._now = -math.inf
        self._restart()

    def update(self, device: float, arrival: float) -> float:
        """Return the host time [s] of a sample.

        Parameters
        ----------
        device : float
            Its device time [s].
        arrival : float
            Host time [s] at which it arrived.

        Returns
        -------
        float
            Host time [s], at most ``arrival`` and not less than the previous result.
        """
        if device < self._last:
            self._restart()
        if device >= self._block_end:
            self._close_block(device)
        self._last = device
        base = arrival - device - self._drift * (device - self._origin)
        if base < self._min_base:
            self._min_base, self._min_base_sample = base, (device, arrival)
        self._base = min(self._base, base)
        host = device + self._base + self._drift * (device - self._origin)
        self._now = max(self._now, min(host, arrival))
        return self._now

    def _restart(self) -> None:
        self._points: deque[tuple[float, float]] = deque(maxlen=_MAX_LIVE_POINTS)
        self._last, self._block_end = -math.inf, -math.inf
        self._drift, self._base, self._min_base, self._origin = 0.0, math.inf, math.inf, 0.0

    def _close_block(self, device: float) -> None:
        """Add the sample with the minimum delay of the finished block, and fit the line below all such samples.

        The cost is O(1) per sample and at most 60 points per block.
        """
        if self._min_base < math.inf:
            self._points.append(self._min_base_sample)
        self._min_base, self._block_end, self._origin = math.inf, device + _LIVE_BLOCK_S, device
        if len(self._points) >= _MIN_SAMPLES:
            self._drift = align(*zip(*self._points, strict=True)).rate - 1.0
        offsets = [arrival - sent - self._drift * (sent - device) for sent, arrival in self._points]
        self._base = min(offsets, default=math.inf)


def _hull_edge(x: np.ndarray, y: np.ndarray) -> tuple[int, int]:
    """The end points of the lower hull's edge over the mean of ``x``, for points with ascending ``x``.

    Quickhull restricted to this edge: the point farthest below the chord replaces the end on its side, and points
    beyond it or above the chord are dropped.
    """
    middle, left, right = x.mean(), int(np.argmin(y[x == x[0]])), len(x) - 1
    right -= int(np.argmin(y[x == x[-1]][::-1]))
    inside = np.arange(left + 1, right)
    while True:
        slope = (y[right] - y[left]) / (x[right] - x[left])
        below = y[inside] - y[left] - slope * (x[inside] - x[left])
        inside, below = inside[below < 0.0], below[below < 0.0]
        if not len(inside):
            return left, right
        lowest = int(inside[np.argmin(below)])
        left, right = (lowest, right) if x[lowest] <= middle else (left, lowest)
        inside = inside[(x[inside] > x[left]) & (x[inside] < x[right])]


def _check(device: np.ndarray, arrival: np.ndarray) -> None:
    if device.ndim != 1 or device.shape != arrival.shape or not len(device):
        raise InputError("shape of the arrival times", arrival.shape, f"the device times have {device.shape}", "align",
                         "Give one arrival time for each device time.")  # fmt: skip
    for name, values in (("device time", device), ("arrival time", arrival)):
        if not np.isfinite(values).all():
            limit = f"at sample {int(np.argmin(np.isfinite(values)))}"
            raise InputError(name, "not finite", limit, next_step="Leave this sample out.")
    decreases = np.flatnonzero(np.diff(device) < 0.0)
    if len(decreases):
        before, after = device[decreases[0]], device[decreases[0] + 1]
        raise InputError("device time", f"{after:.9g} after {before:.9g}", "it must not decrease",
                         f"sample {int(decreases[0]) + 1}",
                         "Sort the samples; align the samples after a restart separately.")  # fmt: skip
