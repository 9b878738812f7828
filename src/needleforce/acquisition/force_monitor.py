# SPDX-License-Identifier: Apache-2.0
"""The thread between a force source and a needle: it receives, holds the force against its limit, and keeps."""

import contextlib
import math
import os
import sys
import threading
import time
from collections import deque

from ..wire.rdt import SATURATED, is_fault
from .settings import Settings
from .sources.source import ForceSample, ForceSource

_PATIENCE = 0.05  # [s] for one receive
_PRIORITY = -10  # before what else the computer does


class ForceMonitor:
    """Receives on a thread of its own into ``samples``. Over the limit it sends the axis its stop before all else.

    ``asked`` sends it as well, however long the other thread waits for a disk or a terminal.
    An axis hears that it may go on only as long as readings come. ``bias`` [N] of the axial force is set by another
    thread; before, no limit holds, and nothing moves but outwards. ``over`` is the reading beyond the limit. ``last``
    and ``last_healthy`` [s] are of the monotonic clock.
    """

    def __init__(self, force: ForceSource, axis, settings: Settings, asked: threading.Event):
        self.samples: deque[ForceSample] = deque()
        self.bias: float | None = None
        self.over: ForceSample | None = None
        self.error: Exception | None = None
        self.longest_gap = 0  # [ns]
        self.last = self.last_healthy = time.monotonic()
        self._force, self._axis, self._settings, self._asked = force, axis, settings, asked
        self._stale, self._stopped = 0, False
        self._commanding = threading.Lock()
        self._leave = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="force", daemon=True)

    def start(self) -> None:
        """Begin to receive; the source has been started."""
        self._thread.start()

    def stop(self) -> None:
        """End and join the thread."""
        self._leave.set()
        if self._thread.ident:
            self._thread.join(5.0)

    def send_stop(self) -> None:
        """Tell the axis to stop, and no more that it may go on."""
        with self._commanding:
            self._stopped = True
        if self._axis:
            self._axis.send_stop()

    def send_move(self, depth: float, speed: float) -> None:
        """Send the axis on, unless it was told to stop: a stop is never followed by a move."""
        with self._commanding:
            if not self._stopped:
                self._axis.send_move(depth, speed)

    def axial(self, sample: ForceSample) -> float:
        """The force against insertion [N], without bias where it is known."""
        return self._settings.sign * (sample.wrench[self._settings.column] - (self.bias or 0.0))

    def _watch(self) -> None:
        if sys.platform == "linux":  # elsewhere a priority is a process's, and this number another one's
            with contextlib.suppress(OSError):  # only where the system lets it
                os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _PRIORITY)
        try:
            while not self._leave.is_set():
                self._take(self._force.receive(_PATIENCE))
                if self._asked.is_set() and not self._stopped:
                    self.send_stop()
        except Exception as error:  # the other thread tells it and ends the run
            self.error = error
            self.send_stop()

    def _take(self, samples: list[ForceSample]) -> None:
        if not samples:
            return
        if self.over is None:
            self.over = next(filter(self._is_over, samples), None)
            if self.over:
                self.send_stop()
        self.samples.extend(samples)
        self.longest_gap = max(self.longest_gap, *(sample.read - sample.arrival for sample in samples))
        self._note_time(samples)
        if self._axis and not self._stopped:
            self._axis.alive()

    def _is_over(self, sample: ForceSample) -> bool:
        if self.bias is None or math.isinf(self._settings.force_limit):
            return False
        return bool(sample.status & SATURATED) or not abs(self.axial(sample)) <= self._settings.force_limit

    def _note_time(self, samples: list[ForceSample]) -> None:
        self.last = time.monotonic()
        stale = getattr(self._force, "stale", 0)
        told_again, self._stale = stale - self._stale, stale
        if told_again < len(samples) and not all(is_fault(sample.status) for sample in samples):
            self.last_healthy = self.last
