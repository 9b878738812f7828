# SPDX-License-Identifier: Apache-2.0
"""A device's clock against the host's while the samples come in."""

import math
from collections import deque

from .alignment import align

_BLOCK = 0.5  # s of device time that give one point: the sample with the least delay
_POINTS = 60
_RATE_FROM = 20  # points from which a rate is told


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
        self._least, self._block_end, self._origin = math.inf, device + _BLOCK, device
        if len(self._points) >= _RATE_FROM:
            self._drift = align(*zip(*self._points, strict=True)).rate - 1.0
        above = [came - sent - self._drift * (sent - device) for sent, came in self._points]
        self._base = min(above, default=math.inf)
