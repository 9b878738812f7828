# SPDX-License-Identifier: Apache-2.0
"""A clock for the threads of one program, of which one runs at a time: no second passes that nobody computes.

The thread that waits hands its turn to the one whose data or whose time came first; only if nobody has either, the
clock goes on to the next end. What threads meet is then the same in each run, and nothing depends on the computer: that
it is busy or suspended is what these runs do not try. Sockets and files are real.
"""

import math
import os
import select
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

from needleforce.acquisition.sources import arrival_time

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from simulated_time import StampedReceiver

READING_NS = 1000  # that reading the clock takes, so that a loop that only reads it ends
_select, _wait, _start, _join, _run = (
    select.select, threading.Condition.wait, threading.Thread.start, threading.Thread.join, threading.Thread.run,
)  # fmt: skip


class SimulatedClock:
    """``with SimulatedClock():`` gives clocks, sleeps, timeouts and turns to this thread and those that it starts."""

    def __init__(self):
        self._now = arrival_time.host_time_ns()
        self._turns: dict[threading.Thread, threading.Lock] = {threading.current_thread(): _locked()}
        self._waiting: dict[threading.Thread, tuple[float, Callable[[], bool]]] = {}
        self._starting = False

    def __enter__(self) -> "SimulatedClock":
        begin, stamped = self._now, arrival_time.StampedSocket.__init__
        given = [
            (time, "time_ns", self._read),
            (time, "clock_gettime_ns", lambda clock: self._read() - arrival_time._EPOCH),
            (time, "monotonic", lambda: 1e-9 * (self._read() - begin)),
            (threading, "_time", lambda: 1e-9 * (self._read() - begin)),
            (time, "sleep", self.wait),
            (select, "select", self._select),
            (threading.Condition, "wait", lambda *given: self._noticed(*given)),
            (threading.Thread, "start", lambda thread: self._start(thread)),
            (threading.Thread, "run", lambda thread: self._in_turn(thread)),
            (threading.Thread, "join", lambda thread, timeout=None: self._join(thread, timeout)),
            (arrival_time.StampedSocket, "__init__", lambda it, receiver: stamped(it, StampedReceiver(receiver))),
            (os, "setpriority", lambda *_: None),  # a turn needs none
        ]
        self._replaced = [(place, name, getattr(place, name)) for place, name, _ in given]
        for place, name, value in given:
            setattr(place, name, value)
        return self

    def __exit__(self, *_) -> None:
        for place, name, value in self._replaced:
            setattr(place, name, value)

    def wait(self, seconds: float | None, ready: Callable[[], bool] = lambda: False) -> bool:
        """Wait until ``ready()``, at most for a time on this clock; whether it was ready."""
        thread = threading.current_thread()
        self._waiting[thread] = math.inf if seconds is None else self._now + int(1e9 * seconds), ready
        if (following := self._next()) is not thread:
            self._turns[following].release()
            self._turns[thread].acquire()
        return ready()

    def _next(self) -> threading.Thread:
        """The thread whose turn it is: of those with data or at their end, the one that has waited longest."""
        with_data = (each for each, (until, ready) in self._waiting.items() if until <= self._now or ready())
        if (thread := next(with_data, None)) is None:
            thread = min(self._waiting, key=lambda each: self._waiting[each][0])
            self._now = int(self._waiting[thread][0])  # OverflowError if all wait for one another
        del self._waiting[thread]
        return thread

    def _read(self) -> int:
        self._now += READING_NS
        return self._now

    def _select(self, reading, writing, failing, timeout: float | None = None):
        self.wait(timeout, lambda: any(_select(reading, writing, failing, 0.0)))
        return _select(reading, writing, failing, 0.0)

    def _noticed(self, condition: threading.Condition, timeout: float | None = None) -> bool:
        if self._starting:  # of a thread that the system is about to start
            return _wait(condition, timeout)
        waiter = _locked()
        condition._waiters.append(waiter)
        state = condition._release_save()
        try:
            return self.wait(timeout, lambda: not waiter.locked())
        finally:
            condition._acquire_restore(state)
            if waiter in condition._waiters:
                condition._waiters.remove(waiter)

    def _start(self, thread: threading.Thread) -> None:
        self._turns[thread], self._waiting[thread] = _locked(), (self._now, lambda: True)
        self._starting = True
        _start(thread)
        self._starting = False

    def _in_turn(self, thread: threading.Thread) -> None:
        self._turns[thread].acquire()
        try:
            _run(thread)
        finally:
            del self._turns[thread]
            self._turns[self._next()].release()

    def _join(self, thread: threading.Thread, timeout: float | None) -> None:
        if self.wait(timeout, lambda: thread not in self._turns):
            _join(thread)


def _locked() -> threading.Lock:
    lock = threading.Lock()
    lock.acquire()
    return lock
