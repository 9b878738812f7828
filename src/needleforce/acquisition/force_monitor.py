# SPDX-License-Identifier: Apache-2.0
"""The force monitor: a thread that receives readings, checks them against the force limit, and queues them."""

import contextlib
import math
import os
import sys
import threading
import time
from collections import deque

from ..wire.rdt import SATURATED, is_fault
from .settings import Settings
from .sources.source import ForceSample, ForceSource, MotionAxis

_RECEIVE_TIMEOUT_S = 0.05
_PRIORITY = -10  # above the other processes of the computer


class ForceMonitor:
    """Receives readings on its own thread into ``samples`` and stops the axis as soon as one exceeds the force limit.

    ``stop_requested`` also stops the axis, even if the other thread waits for a disk or a terminal. The axis may
    continue only while readings arrive. ``bias`` [N] of the axial force is set by another thread; until then there is
    no limit, and the axis moves only outwards. ``over_limit`` is the reading above the limit. ``last_time`` and
    ``last_healthy_time`` [s] are on the monotonic clock.
    """

    def __init__(
        self, force: ForceSource, axis: MotionAxis | None, settings: Settings, stop_requested: threading.Event
    ):
        self.samples: deque[ForceSample] = deque()
        self.bias: float | None = None
        self.over_limit: ForceSample | None = None
        self.error: Exception | None = None
        self.max_gap_ns = 0
        self.last_time = self.last_healthy_time = time.monotonic()
        self._force, self._axis, self._settings, self._stop_requested = force, axis, settings, stop_requested
        self._stale, self._stopped = 0, False
        self._commanding = threading.Lock()
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._receive_readings, name="force", daemon=True)

    def start(self) -> None:
        """Begin to receive; the source must be started."""
        self._thread.start()

    def stop(self) -> None:
        """End and join the thread."""
        self._ending.set()
        if self._thread.ident:
            self._thread.join(5.0)

    def send_stop(self) -> None:
        """Send the axis a stop, and no further message that lets it continue."""
        with self._commanding:
            self._stopped = True
        if self._axis:
            self._axis.send_stop()

    def send_move(self, depth: float, speed: float) -> None:
        """Send the axis a move, unless a stop was sent: a move never follows a stop."""
        with self._commanding:
            if not self._stopped:
                self._axis.send_move(depth, speed)

    def axial(self, sample: ForceSample) -> float:
        """The force against insertion [N], minus the bias if it is known."""
        return self._settings.sign * (sample.wrench[self._settings.column] - (self.bias or 0.0))

    def _receive_readings(self) -> None:
        if sys.platform == "linux":  # elsewhere the priority belongs to a process, and this number to another one
            with contextlib.suppress(OSError):  # needs permission
                os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _PRIORITY)
        try:
            while not self._ending.is_set():
                self._process(self._force.receive(_RECEIVE_TIMEOUT_S))
                if self._stop_requested.is_set() and not self._stopped:
                    self.send_stop()
        except Exception as error:  # the other thread reports it and ends the run
            self.error = error
            self.send_stop()

    def _process(self, samples: list[ForceSample]) -> None:
        if not samples:
            return
        if self.over_limit is None:
            self.over_limit = next(filter(self._is_over_limit, samples), None)
            if self.over_limit:
                self.send_stop()
        self.samples.extend(samples)
        self.max_gap_ns = max(self.max_gap_ns, *(sample.read - sample.arrival for sample in samples))
        self._note_time(samples)
        if self._axis and not self._stopped:
            self._axis.alive()

    def _is_over_limit(self, sample: ForceSample) -> bool:
        if self.bias is None or math.isinf(self._settings.force_limit):
            return False
        return bool(sample.status & SATURATED) or not abs(self.axial(sample)) <= self._settings.force_limit

    def _note_time(self, samples: list[ForceSample]) -> None:
        self.last_time = time.monotonic()
        stale = getattr(self._force, "stale", 0)
        repeated, self._stale = stale - self._stale, stale
        if repeated < len(samples) and not all(is_fault(sample.status) for sample in samples):
            self.last_healthy_time = self.last_time
