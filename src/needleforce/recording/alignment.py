# SPDX-License-Identifier: Apache-2.0
"""A device's clock against the host's, from times of arrival: the line below all of them that is closest to them."""

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from ..errors import InputError

_BLOCKS = 20
_FEWEST = _BLOCKS  # samples from which a rate is told
# error of the line at either end of the recording, in mean least delays of a block: 95 % of simulated recordings lie
# below 0.7 if the delay's density is finite at its shortest (exponential, uniform), 1.5 if it rises from zero there
# (bursts; gamma of shape 2), 2.1 if it does as a square (shape 3), whatever the number of samples. Delays
# that hardly ever come near their shortest are told too well: gamma of shape 5, 87 to 97 % covered
_MARGIN = 3.0
_LIVE_BLOCK = 0.5  # s of device time that give one point: the sample with the least delay
_POINTS = 60


@dataclass(frozen=True)
class Alignment:
    """The host's time of a device's: ``offset + rate * device``; times in seconds, ``rate`` in host s per device s.

    ``uncertainty`` [s] holds with 95 % or more over all of the aligned recording, and not beyond its ends. It is
    that of the clock *and the shortest delay the way can have*: a delay that every sample has in full (a filter in the
    device, the least time on the wire) looks like an offset, and one-way times of arrival cannot tell it. A machine
    that is busy from the first sample to the last is such a part.
    """

    rate: float
    offset: float
    uncertainty: float
    samples: int

    def host(self, device: np.ndarray) -> np.ndarray:
        """The host's time (n,) [s] of the device's (n,) [s]."""
        return self.offset + self.rate * np.asarray(device, float)


def align(device: np.ndarray, arrival: np.ndarray) -> Alignment:
    """The clock of ``device`` times (n,) [s], whose samples came at the host's times ``arrival`` (n,) [s].

    A sample arrives late by a delay >= 0 of any distribution, never early. So the line lies below all points, and of
    those it is the one with the least sum of distances: the edge of the lower convex hull over the mean device time.
    The largest delays have no weight in it. Its uncertainty comes from the least delays above it in 20 blocks of
    equal count: were the shortest delay met often in each, all would be near zero.

    Fewer than 20 samples tell no rate: it is 1, the offset that of the quickest sample, the uncertainty infinite.
    Gaps do no harm. Raises InputError for device times that go back (a restart: align each part by itself), values
    that are not finite, and arrays of unequal length. A device or host that sets its clock forward on the way shows
    in the uncertainty alone.
    """
    device, arrival = np.asarray(device, float), np.asarray(arrival, float)
    _check(device, arrival)
    x, late = device - device[0], arrival - arrival[0] - (device - device[0])
    if len(x) < _FEWEST or x[-1] == 0.0:
        offset = float(late.min() + arrival[0] - device[0])
        return Alignment(1.0, offset, np.inf, len(x))
    left, right = _edge(x, late)
    drift = float((late[right] - late[left]) / (x[right] - x[left]))
    base = float(late[left] - drift * x[left])
    delays = late - base - drift * x
    least = np.minimum.reduceat(delays, np.arange(_BLOCKS) * len(x) // _BLOCKS).mean()
    rounding = np.spacing(max(abs(device[-1]), np.abs(arrival).max()))
    offset = float(arrival[0] + base - (1.0 + drift) * device[0])
    return Alignment(1.0 + drift, offset, float(_MARGIN * least + rounding), len(x))


class LiveAlignment:
    """Host times [s] for the headers of live samples: causal, in constant time, never backwards, never in the future.

    As ``align``, from the least delayed sample of each half second in the last half minute, and of the samples since;
    until there are 10 s of them the rate is 1. A device time that goes back is a restart: what was known is
    forgotten, and the host's time goes on. The recorded times of arrival give the better clock afterwards.
    """

    def __init__(self):
        self._now = -math.inf
        self._restart()

    def update(self, device: float, arrival: float) -> float:
        """The host's time [s] of a sample with ``device`` time [s] that came at the host's ``arrival`` [s]."""
        if device < self._last:
            self._restart()
        if device >= self._block_end:
            self._close_block(device)
        self._last = device
        base = arrival - device - self._drift * (device - self._origin)
        if base < self._least:
            self._least, self._quickest = base, (device, arrival)
        self._base = min(self._base, base)
        host = device + self._base + self._drift * (device - self._origin)
        self._now = max(self._now, min(host, arrival))
        return self._now

    def _restart(self) -> None:
        self._points: deque[tuple[float, float]] = deque(maxlen=_POINTS)
        self._last, self._block_end = -math.inf, -math.inf
        self._drift, self._base, self._least, self._origin = 0.0, math.inf, math.inf, 0.0

    def _close_block(self, device: float) -> None:
        """Take the finished block's quickest sample, and the line below all such; O(1) a sample, 60 points a block."""
        if self._least < math.inf:
            self._points.append(self._quickest)
        self._least, self._block_end, self._origin = math.inf, device + _LIVE_BLOCK, device
        if len(self._points) >= _FEWEST:
            self._drift = align(*zip(*self._points, strict=True)).rate - 1.0
        above = [came - sent - self._drift * (sent - device) for sent, came in self._points]
        self._base = min(above, default=math.inf)


def _edge(x: np.ndarray, y: np.ndarray) -> tuple[int, int]:
    """The ends of the edge over the mean of ``x`` in the lower hull of points with ascending ``x``.

    Quickhull along this one edge: the point lowest below the chord takes the place of the end on its side, and what
    lies beyond it or above the chord is done with.
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
        raise InputError("times of arrival", arrival.shape, f"device times have {device.shape}, one each is needed")
    for name, values in (("device time", device), ("time of arrival", arrival)):
        if not np.isfinite(values).all():
            raise InputError(name, "not finite", f"at sample {int(np.argmin(np.isfinite(values)))}")
    back = np.flatnonzero(np.diff(device) < 0.0)
    if len(back):
        told = f"{device[back[0] + 1]:.9g} after {device[back[0]]:.9g}"
        raise InputError("device time", told, "it must not go back", f"sample {int(back[0]) + 1}",
                         "Put samples in order; align what follows a restart by itself.")  # fmt: skip
