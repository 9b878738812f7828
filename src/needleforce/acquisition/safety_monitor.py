# SPDX-License-Identifier: Apache-2.0
"""The safety monitor: a thread that receives readings and axis states, checks them, stops the axis, and queues them."""

import contextlib
import itertools
import math
import os
import sys
import threading
import time
from collections import deque
from collections.abc import Callable

import numpy as np

from ..errors import InputError
from ..wire.axis_lines import MAX_SILENCE_S, AxisState
from ..wire.net_ft import AXES, SATURATED, is_fault, status_words
from .axis_check import AxisCheck, StopReport
from .motion_sequence import EndReason
from .settings import Settings
from .sources.arrival_time import host_time_ns
from .sources.reading_checks import FrozenCheck, Lateness, QuietCheck, ScaleCheck
from .sources.source import ForceSample, ForceSource, MotionAxis
from .stop_at import EventStop

_RECEIVE_TIMEOUT_S = 0.02
_STOP_REPEAT_S = 0.05
_SILENT_TIME_S = MAX_SILENCE_S + 0.3  # without a line, in which an axis that ignored the stop stops by itself
_MAX_QUEUE = 200_000  # readings or states that wait to be written
_MAX_UNWRITTEN_S = 2.0  # without the other thread taking what waits, after which the axis is stopped
_PRIORITY = -10  # above the other processes of the computer
_SWITCH_INTERVAL_S = 1e-3  # after which another thread of this program must let this one run
_MIN_CONSTANT = 30  # readings without any change, from which a sensor counts as constant
_PULLED_S = 0.1  # in which every reading pulls a needle that goes deeper, from which its zero has moved
_PULL_NOISES, _PULL_SHARE = 5.0, 0.1  # standard deviations of a reading, and share of the limit, of such a force
_SECOND = 1e9  # [ns]


class SafetyMonitor:
    """Receives on its own thread, the force first, and stops the axis for anything that makes motion unsafe:

    - a reading beyond the force limit (``over_limit``),
    - the event at which it is to stop (``event_stop``),
    - a sensor whose page, scale or zero changes while the axis moves (``_changed_sensor``),
    - no usable reading for ``settings.max_force_gap``: silent, faulty, repeated, overtaken, old or frozen readings, or
      a thread that did not run,
    - an axis that contradicts its orders or its declared range (``AxisCheck``), or whose connection is lost,
    - an event ``stop_requested``, even if the other thread waits for a disk or a terminal,
    - another thread that no longer takes what is to be written.

    ``reason`` and ``detail`` are why, for what the other thread cannot know; ``has_moved`` is whether a move was sent.
    The stop is repeated until the depth is seen at rest; an axis that ignores it gets no further line, so that it stops
    by itself if it can. ``bias`` [N] is set by the other thread; until then the axis moves only outwards, and the limit
    is on the change of the force.
    """

    def __init__(
        self, force: ForceSource, axis: MotionAxis | None, settings: Settings, stop_requested: threading.Event
    ):
        self.samples: deque[ForceSample] = deque()
        self.states: deque[tuple[AxisState, int]] = deque()
        self.bias: float | None = None
        self.over_limit: ForceSample | None = None
        self.error: Exception | None = None  # of the force source
        self.axis_error: InputError | None = None
        self.recording = False  # whether what is received is written; until then only the newest of it is kept
        self.reason: EndReason | None = None
        self.detail = ""
        self.max_gap_ns = 0
        now = time.monotonic()
        self.last_time = self.last_usable_time = self.last_taken = now
        self.axis_check = AxisCheck(axis.limits) if axis else None
        self._force, self._axis, self._settings, self._stop_requested = force, axis, settings, stop_requested
        self.has_moved = self._moving = self._stopped = False
        self._stop_time = self._stop_sent = 0.0
        self._beyond_since: float | None = None  # when the axis was seen not to stop
        self._restarts = 0
        self._newest = self._reference = 0.0  # axial force [N] with its bias: newest, before a move
        parts = (lambda wrench: wrench, lambda wrench: wrench[settings.column])  # a buffer repeats a few in turn
        self._frozen = [FrozenCheck(part, depth) for depth in (8, 1) for part in parts]
        self._across = {
            name: FrozenCheck(lambda wrench, k=k: wrench[k], 1) for k, name in enumerate(AXES) if k != settings.column
        }
        self.frozen_axes: list[str] = []  # of the other axes, those that froze: noted, as nothing is limited by them
        self._quiet, self._scale, self._scaled = QuietCheck(), ScaleCheck(), 1.0
        self._too_quiet = self._advancing = self._pulled = False
        self._deepest, self._pull, self._pulled_since = -math.inf, math.inf, math.inf
        self.event_stop = EventStop(settings.stop_at) if settings.stop_at else None
        self._lateness = Lateness()
        self.why_unusable = ""
        self._commanding = threading.Lock()
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run, name="safety", daemon=True)

    def start(self) -> None:
        """Begin to receive; the source must be started."""
        self._switch_interval = sys.getswitchinterval()
        sys.setswitchinterval(min(self._switch_interval, _SWITCH_INTERVAL_S))
        self._thread.start()

    def stop(self) -> None:
        """End and join the thread."""
        self._ending.set()
        if self._thread.ident:
            self._thread.join(5.0)
            sys.setswitchinterval(self._switch_interval)

    def take(self) -> tuple[list[ForceSample], list[tuple[AxisState, int]]]:
        """The readings and states since the last call, to be written."""
        self.last_taken = time.monotonic()
        return _emptied(self.samples), _emptied(self.states)

    def send_stop(self) -> None:
        """Send the axis a stop, which is repeated, and no further message that lets it continue."""
        with self._commanding:
            if not self._stopped and self.axis_check:
                self.axis_check.order_stop(host_time_ns() / _SECOND)
                self._stop_time = time.monotonic()
            self._stopped = True
        if self._axis:
            self._stop_sent = time.monotonic()
            self._axis.send_stop()

    def send_move(self, depth: float, speed: float) -> None:
        """Send the axis a move, unless a stop was sent: a move never follows a stop."""
        with self._commanding:
            if self._stopped:
                return
            if not self._moving:
                self.last_taken = time.monotonic()
                self._reference = self._newest
            self._moving = self.has_moved = True
            self._restarts = getattr(self._force, "restart", 0)
            self.axis_check.order_move(depth, speed)
            self._axis.send_move(depth, speed)

    def pause_motion(self) -> None:
        """The axis is at rest until the next move: until then gaps in the readings are no danger."""
        self._moving = False

    def begins_at_rest(self) -> bool:
        """Whether the axis is seen at rest before its first order; its depth is then that of rest."""
        with self._commanding:
            return self.axis_check.begin()

    @property
    def waits_for_rest(self) -> bool:
        """Whether the axis, ordered to stop, was not yet seen at rest and its time for it is not over."""
        if self.axis_check is None or not self._stopped or not self._thread.is_alive():
            return False
        late = time.monotonic() > self._until_rest() + _SILENT_TIME_S
        with self._commanding:
            return not (self.axis_check.at_rest or self.axis_error or late)

    @property
    def stop_report(self) -> StopReport | None:
        """What the axis did after the stop; None if no stop was sent to an axis."""
        with self._commanding:
            return self.axis_check.stop_report() if self.axis_check and self._stopped else None

    def axial(self, sample: ForceSample) -> float:
        """The force against insertion [N], minus the bias if it is known."""
        return self._settings.sign * (sample.wrench[self._settings.column] - (self.bias or 0.0))

    def learn_noise(self, samples: list[ForceSample]) -> None:
        """From readings at rest, how many repeated ones in a row are a frozen sensor, its noise, and its bias.

        Raises InputError if the axial force never changes: then a frozen sensor cannot be recognised.
        """
        if not self._settings.frozen_check:
            return
        for check in (*self._frozen, *self._across.values()):
            check.learn(samples)
        wrenches = np.array([sample.wrench for sample in samples if sample.fresh and not is_fault(sample.status)])
        if len(wrenches):
            axial = wrenches[:, self._settings.column]
            self._quiet.learn(axial)
            self._scale.learn(wrenches)
            noise = _PULL_NOISES * float(np.std(axial))
            self._pull = max(self._settings.steady, noise, _PULL_SHARE * self._settings.force_limit)
            self._deepest = -math.inf  # what was before was perhaps another site
        if self._axis and not self._frozen[-1].changes and len(samples) > _MIN_CONSTANT:
            limit = f"the same in {len(samples)} readings: the sensor is frozen, or too coarse to be checked for it"
            advice = "Check the sensor; --no-frozen-check records without this check."
            raise InputError("axial force at rest", f"{self._newest:g} N", limit, "bias", advice)

    def _run(self) -> None:
        if sys.platform == "linux":  # elsewhere the priority belongs to a process, and this number to another one
            with contextlib.suppress(OSError):  # needs permission
                os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _PRIORITY)
        before = host_time_ns()
        while not self._ending.is_set():
            for part in (self._receive_force, self._receive_states, self._repeat_stop):
                self._guarded(part)
            now = host_time_ns()
            self._guarded(self._check, (now - before) / _SECOND)
            before = now

    def _guarded(self, part: Callable, *arguments: float) -> None:
        """A failing part ends the run, which the other thread reports; the axis is still watched and stopped."""
        try:
            part(*arguments)
        except Exception as error:
            with contextlib.suppress(Exception):
                self._end(EndReason.FAILED, repr(error))

    def _receive_force(self) -> None:
        if self.error:
            time.sleep(_RECEIVE_TIMEOUT_S)
            return
        try:
            samples = self._force.receive(_RECEIVE_TIMEOUT_S)
        except Exception as error:
            self.error = error
            self.send_stop()
            return
        if not samples:
            return
        if self.over_limit is None:
            self.over_limit = next(filter(self._is_over_limit, samples), None)
            if self.over_limit:
                self.send_stop()
        usable = [self._is_usable(sample) for sample in samples]
        for sample in itertools.compress(samples, usable):
            self._watch(sample)
        self.samples.extend([sample._replace(fresh=fresh) for sample, fresh in zip(samples, usable)])
        self._newest = samples[-1].wrench[self._settings.column]
        self.max_gap_ns = max(self.max_gap_ns, *(sample.read - sample.arrival for sample in samples))
        self.last_time = time.monotonic()
        if any(usable):
            self.last_usable_time = self.last_time
            if self._axis and not self._stopped:
                self._axis.alive()

    def _is_over_limit(self, sample: ForceSample) -> bool:
        """Before the bias is known, the force is compared with that at the beginning of the move."""
        if math.isinf(self._settings.force_limit) or (self.bias is None and not self._moving):
            return False
        reference = self._reference if self.bias is None else self.bias
        force = sample.wrench[self._settings.column] - reference
        return bool(sample.status & SATURATED) or not abs(force) <= self._settings.force_limit

    def _is_usable(self, sample: ForceSample) -> bool:
        """Whether a reading is a new measurement of a working sensor, from now; ``why_unusable`` is why not."""
        frozen = max([check.add(sample) for check in self._frozen])
        late = self._lateness.add(sample)
        if is_fault(sample.status):
            self.why_unusable = status_words(sample.status)
        elif not sample.fresh:
            self.why_unusable = "its counters repeat, fall or jump"
        elif frozen:
            self.why_unusable = f"the same values for {frozen} readings; --no-frozen-check if the sensor is that coarse"
        elif self._moving and late > self._settings.max_force_gap:
            self.why_unusable = f"{late:.2f} s late, unless the configured rate is wrong"
        else:
            return True
        return False

    def _watch(self, sample: ForceSample) -> None:
        """What a usable reading shows of the sensor itself, in constant time."""
        self._too_quiet |= self._quiet.add(sample.wrench[self._settings.column])
        self._scaled = min(self._scaled, self._scale.add(sample.wrench))
        now = sample.arrival / _SECOND
        pulls = self._advancing and self.bias is not None and self.axial(sample) < -self._pull
        self._pulled_since = min(self._pulled_since, now) if pulls else math.inf
        self._pulled |= now - self._pulled_since > _PULLED_S
        if self.event_stop and self.bias is not None and (found := self.event_stop.add(sample, self.axial(sample))):
            self._end(EndReason.EVENT, found)
        for name, check in self._across.items():
            if check.add(sample) and name not in self.frozen_axes:
                self.frozen_axes.append(name)

    def _receive_states(self) -> None:
        source = self._axis or getattr(self._force, "axis", None)  # lines on standard input may contain a depth
        if source is None or self.axis_error:
            return
        try:
            states = source.receive()
        except InputError as error:
            self.axis_error = error
            self.send_stop()
            return
        with self._commanding:
            new = [each for each in states if not self.axis_check or self.axis_check.add(each[0], each[1] / _SECOND)]
        if self.event_stop and new:
            self.event_stop.add_state(*new[-1])
        for state, _ in new:
            self._advancing, self._deepest = state.depth > self._deepest, max(self._deepest, state.depth)
        self.states.extend(new)

    def _check(self, since_last: float) -> None:
        """Stop the axis for anything but the force limit, the first cause first."""
        moving = self._moving and not self._stopped
        if self._stop_requested.is_set() and not self._stopped:
            self.send_stop()
        if moving and since_last > self._settings.max_force_gap:  # what arrived in between arrived at once
            detail = f"this program did not run for {since_last:.2f} s while the axis moved"
            self._end(EndReason.RECORDER_DELAYED, detail)
        if getattr(self._axis, "flood", False):
            self._end(EndReason.AXIS_FAULT, "sends more lines than an axis may")
        if self.axis_check and self.axis_check.fault:
            self._end(EndReason.AXIS_FAULT, self.axis_check.fault)
        self._limit_queues()
        if moving:
            self._check_force()

    def _check_force(self) -> None:
        """Stop an axis that moves without a usable force, or without being recorded."""
        now = time.monotonic()
        if getattr(self._force, "restart", 0) > self._restarts:
            detail = "its counter restarted while the axis moved: it was switched off or exchanged, its bias is unknown"
            self._end(EndReason.SENSOR_FAULT, detail)
        elif changed := self._changed_sensor():
            self._end(EndReason.SENSOR_FAULT, f"{changed}; --no-frozen-check records without the checks of its signal")
        elif now - self.last_usable_time > self._settings.max_force_gap and not self.error:
            self._end(*self._without_force(now))
        elif now - self.last_taken > _MAX_UNWRITTEN_S:
            self._end(EndReason.FILE_NOT_WRITTEN, f"nothing could be written for {_MAX_UNWRITTEN_S:g} s")

    def _changed_sensor(self) -> str:
        """In words, that the sensor is no longer the one whose bias was taken; empty as far as can be seen."""
        if changed := getattr(self._force, "changed", ""):
            return changed
        if self._scaled < 1.0:
            return f"all its axes fell to {self._scaled:.2g} of their values, bias included: its scale changed"
        if self._too_quiet:
            return f"its noise fell to less than half of that at rest, over {self._quiet.readings} readings"
        if self._pulled:
            pulled = f"the force pulls a needle that goes deeper, by more than {self._pull:.3g} N for {_PULLED_S:g} s"
            return f"{pulled}: its zero moved, --axial has the wrong sign, or the depth that is reported has"
        return ""

    def _limit_queues(self) -> None:
        for queue in (self.samples, self.states):
            if len(queue) <= _MAX_QUEUE:
                continue
            if self.recording:
                self._end(EndReason.FILE_NOT_WRITTEN, f"{_MAX_QUEUE} readings or states wait to be written")
            while len(queue) > _MAX_QUEUE // 2:
                queue.popleft()

    def _without_force(self, now: float) -> tuple[EndReason, str]:
        gap = self._settings.max_force_gap
        if now - self.last_time > gap:
            return EndReason.SENSOR_SILENT, f"no reading for {now - self.last_time:.2f} s while the axis moved"
        return EndReason.SENSOR_FAULT, f"no usable reading for {gap:g} s while the axis moved: {self.why_unusable}"

    def _end(self, reason: EndReason, detail: str) -> None:
        if self.reason is None:
            self.detail = detail
            self.reason = reason
        if not self._stopped:
            self.send_stop()

    def _until_rest(self) -> float:
        """When [s of the monotonic clock] an axis that obeys is seen at rest."""
        until = self._stop_time + self.axis_check.stop_time
        return until if self._beyond_since is None else min(until, self._beyond_since)

    def _repeat_stop(self) -> None:
        """Order the stop again until the axis is at rest; if it does not stop, be silent: its watchdog may stop it."""
        if not (self._stopped and self._axis) or self.axis_error:
            return
        now = time.monotonic()
        if self._beyond_since is None and (report := self.axis_check.stop_report()).beyond:
            self._beyond_since = now
            text = f"{EndReason.AXIS_NOT_STOPPED}: {report}"
            threading.Thread(target=_print, args=(text,), daemon=True).start()  # a terminal may block
        due = now - self._stop_sent > _STOP_REPEAT_S and now < self._until_rest()
        if due and not self.axis_check.at_rest:
            self._stop_sent = now
            self._axis.send_stop()


def _print(text: str) -> None:
    with contextlib.suppress(OSError, ValueError):  # the terminal may be gone
        print(text, file=sys.stderr, flush=True)


def _emptied(queue: deque) -> list:
    """The present content of a queue that another thread fills; it is removed."""
    return [queue.popleft() for _ in range(len(queue))]
