# SPDX-License-Identifier: Apache-2.0
"""A clock for the threads of one test, which advances only while all of them wait.

A recorder, a sensor and an axis that a test runs side by side then meet the same delays on an idle computer and on one
that is busy, and nobody waits for seconds to pass. Sockets and threads are real. A program that a test starts has the
computer's own clock and is tested without this one.
"""

import math
import select
import socket
import struct
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from needleforce.acquisition.sources import arrival_time

_READING_NS = 1000  # that reading the clock takes, so that a loop that only reads it ends
_LOOK_S = 0.002  # of the computer's clock, after which a thread that waits looks for data again
_STANDS_S = 0.02  # of it, after which a thread that does nothing is taken to wait for another one
_TIMESPEC = struct.Struct("@ll")

_condition_wait, _computers_select = threading.Condition.wait, select.select
_computers_clock = time.monotonic


class _Waiting(NamedTuple):
    until: float  # [ns]
    ready: Callable[[], bool]
    woken: threading.Condition

    def is_over(self, now: int) -> bool:
        return now >= self.until or self.ready()


class SimulatedTime:
    """``with SimulatedTime():`` gives clocks, sleeps and timeouts to this thread and to those that begin meanwhile."""

    def __init__(self):
        self._foreign = set(threading.enumerate()) - {threading.current_thread()}
        self._waiting: dict[threading.Thread, _Waiting] = {}
        self._arriving: set[threading.Thread] = set()  # that are about to wait
        self._standing: dict[threading.Thread, tuple[str | None, float]] = {}
        self._lock = threading.Lock()
        self._now = arrival_time.host_time_ns()

    def __enter__(self) -> "SimulatedTime":
        begin, stamped = self._now, arrival_time.StampedSocket.__init__
        given = [
            (time, "time_ns", self._read),
            (time, "monotonic_ns", lambda: self._read() - arrival_time._EPOCH),
            (time, "clock_gettime_ns", lambda clock: self._read() - arrival_time._EPOCH),
            (time, "monotonic", lambda: 1e-9 * (self._read() - begin)),
            (threading, "_time", lambda: 1e-9 * (self._read() - begin)),
            (time, "sleep", self._instead_of(time.sleep, self._sleep)),
            (select, "select", self._instead_of(select.select, self._select)),
            (threading.Condition, "wait", self._instead_of(_condition_wait, self._wait_for_notice)),
            (threading.Thread, "join", self._instead_of(threading.Thread.join, self._join)),
            (arrival_time.StampedSocket, "__init__", lambda it, receiver: stamped(it, StampedReceiver(receiver))),
        ]
        self._replaced = [(place, name, getattr(place, name)) for place, name, _ in given]
        for place, name, value in given:
            setattr(place, name, value)
        return self

    def __exit__(self, *_) -> None:
        for place, name, value in self._replaced:
            setattr(place, name, value)

    def pass_by(self, seconds: float) -> None:
        """Let time pass in which no thread ran."""
        self._now += int(1e9 * seconds)

    def _instead_of(self, computers: Callable, simulated: Callable) -> Callable:
        """Threads that were there before, such as those of a test runner, keep the computer's own function."""

        def chosen(*arguments, **options):
            function = computers if threading.current_thread() in self._foreign else simulated
            return function(*arguments, **options)

        return chosen

    def _read(self) -> int:
        self._now += _READING_NS
        return self._now

    def _sleep(self, seconds: float) -> None:
        self._wait(seconds)

    def _select(self, reading, writing, failing, timeout: float | None = None):
        self._wait(timeout, lambda: any(_ready(reading, writing, failing)))
        return _ready(reading, writing, failing)

    def _join(self, thread: threading.Thread, timeout: float | None = None) -> None:
        self._wait(timeout, lambda: not thread.is_alive())

    def _wait_for_notice(self, condition: threading.Condition, timeout: float | None = None) -> bool:
        waiter = threading.Lock()
        waiter.acquire()
        condition._waiters.append(waiter)
        state = condition._release_save()
        try:
            noticed = self._wait(timeout, lambda: not waiter.locked())
        finally:
            condition._acquire_restore(state)
            if waiter in condition._waiters:
                condition._waiters.remove(waiter)
        return noticed

    def _wait(self, seconds: float | None, ready: Callable[[], bool] = lambda: False) -> bool:
        """Wait until ``ready()``, at most for a time on this clock; whether it was ready."""
        thread = threading.current_thread()
        self._arriving.add(thread)
        with self._lock:
            self._arriving.remove(thread)
            until = math.inf if seconds is None else self._now + int(1e9 * seconds)
            this = self._waiting[thread] = _Waiting(until, ready, threading.Condition(self._lock))
            while not this.is_over(self._now):
                over = [each for each in self._waiting.values() if each.is_over(self._now)]
                for each in over:
                    each.woken.notify()
                next_end = min(each.until for each in self._waiting.values())
                if not over and next_end < math.inf and self._all_others_stand():
                    self._now = next_end
                else:
                    _condition_wait(this.woken, _LOOK_S)
            del self._waiting[thread]
            return ready()

    def _all_others_stand(self) -> bool:
        """Whether the threads that do not wait on this clock wait for another one, as for an answer or a lock."""
        now, others = _computers_clock(), set(threading.enumerate()) - self._foreign - set(self._waiting)
        before, self._standing = self._standing, {}
        for thread in others:
            state, since = None if thread in self._arriving else _state(thread), now
            if state is not None and state == before.get(thread, (None, now))[0]:
                since = before[thread][1]
            self._standing[thread] = (state, since)
        return all(now - since > _STANDS_S for _, since in self._standing.values())


def _ready(reading, writing, failing):
    return _computers_select(reading, writing, failing, 0.0)


def _state(thread: threading.Thread) -> str | None:
    """What changes whenever a thread runs; None while it does, waits for a processor, or for a disk."""
    try:
        lines = Path(f"/proc/self/task/{thread.native_id}/status").read_text().splitlines()
    except OSError:  # it begins or ends, or the system does not tell
        return None if Path("/proc/self/task").exists() else ""
    facts = [line for line in lines if "State" in line or "ctxt" in line]
    return "".join(facts) if "sleeping" in facts[0] else None


class StampedReceiver:
    """A socket whose kernel stamps what it receives by the simulated clock."""

    def __init__(self, receiver: socket.socket):
        self._receiver = receiver

    def __getattr__(self, name):
        return getattr(self._receiver, name)

    def recvmsg(self, *sizes):
        data, ancillary, flags, sender = self._receiver.recvmsg(*sizes)
        stamp = _TIMESPEC.pack(*divmod(time.time_ns(), 10**9))
        stamps = (socket.SOL_SOCKET, arrival_time._STAMP)
        return data, [(*each[:2], stamp) if each[:2] == stamps else each for each in ancillary], flags, sender
