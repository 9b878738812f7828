# SPDX-License-Identifier: Apache-2.0
"""A run in progress: writes what was received, checks for what ends the run, then waits until the axis rests."""

import contextlib
import math
import threading
import time
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..recording.alignment import align
from ..recording.force_signal import late_depth
from ..vocabulary import Phase
from ..wire.axis_lines import AxisState
from .axis_check import REACTION_TIME_S, StopReport
from .motion_sequence import EndReason, MotionSequence, RunEnded
from .run_writer import FILE_ENDS, RunWriter
from .safety_monitor import SafetyMonitor
from .settings import Progress, RestBias, RunResult, Settings, Written
from .sources.source import ForceSample

POLL_INTERVAL_S = 0.02
_VIEW_INTERVAL_S = 0.125
_FORCE_AFTER_REST_S = 0.1  # over which the force of a needle at rest is averaged, and then not exceeded
_MAX_RISE = 0.05  # of the force at the stop
_STILL_M = 20e-6  # of depth after a stop, with which the force does not rise
_MIN_NOISES = 2.0  # standard deviations of a reading by which means of many do not differ by chance
_TURN_S = 3.0  # from the order to withdraw, over which force and depth are compared
_PULL_NOISES = 5.0  # standard deviations of the force of a needle that is pulled
_MIN_ALIGNMENT_PAIRS = 20
_END_ENTRIES = ("ended", "detail", "seconds", "received", "lost", "duplicated", "late", "longest_own_gap", "peak_force")


class Run:
    """The run in progress, on the caller's thread."""

    def __init__(
        self,
        *,
        path: Path,
        run_writer: RunWriter,
        monitor: SafetyMonitor,
        bias: RestBias,
        settings: Settings,
        view: Callable[[Progress], None] | None,
        feed: Callable[[Written], None] | None,
    ):
        self._path, self._run_writer, self._monitor = path, run_writer, monitor
        self._bias, self._settings, self._view = bias, settings, view
        self._feed = feed
        self._begun = self._flushed = time.monotonic()
        self._processor_time = time.process_time()
        self._viewed = self._peak = self._force = 0.0
        self._motion: MotionSequence | None = None
        self._state: AxisState | None = None
        self._latest: list[float] = []  # forces of the usable readings written last
        self._frozen: list[str] = []  # axes that are marked as such
        self._turn: tuple[list, list] = ([], [])  # times and forces, times and depths of the first withdrawal
        self._ending = False

    def run(self, motion: MotionSequence | None, stop: threading.Event) -> RunResult:
        """Record from the first move of ``motion`` until the file is closed."""
        self._motion, self._monitor.recording = motion, True
        try:
            self._write_received(self._begun)
            self._run_writer.bias(self._bias)
            while True:
                self._poll(stop)
                time.sleep(POLL_INTERVAL_S)
        except RunEnded as ended:
            end = self._judged(self._with_missing(ended))
        except BaseException as error:
            self._view = None
            self._end(RunEnded(EndReason.FAILED, repr(error)))
            raise
        return self._end(end)

    def _poll(self, stop: threading.Event) -> None:
        """Write what was received, and raise RunEnded for anything that ends the run."""
        now = time.monotonic()
        self._write_received(now)
        if self._monitor.over_limit:
            force = self._monitor.axial(self._monitor.over_limit)
            self._run_writer.mark("limit", force=force, limit=self._settings.force_limit)
            raise RunEnded(EndReason.FORCE_LIMIT, f"{force:.3f} N, limit {self._settings.force_limit:g} N")
        if self._monitor.reason:
            if self._monitor.reason is EndReason.EVENT:
                self._run_writer.mark("event", what=self._monitor.detail, depth=self._monitor.event_stop.depth)
            raise RunEnded(self._monitor.reason, self._monitor.detail)
        if stop.is_set():
            raise RunEnded(EndReason.INTERRUPTED)
        self._check_sensor(now)
        if self._motion:
            self._motion.step(now)
            self._run_writer.phase(self._motion.phase)
        if self._settings.duration is not None and now - self._begun >= self._settings.duration:
            raise RunEnded(EndReason.DONE)

    def _write_received(self, now: float) -> None:
        samples, states = self._monitor.take()
        forces = [self._monitor.axial(sample) for sample in samples]
        self._latest = [force for force, sample in zip(forces, samples) if sample.fresh]
        if forces:
            self._force = forces[-1]
            self._peak = max(self._peak, *forces, key=abs)
        new = self._run_writer.force(samples)
        timed = self._write_states(states, now)
        self._add_to_turn([each for each in zip(samples, forces) if each[0].fresh], states)
        for name in self._monitor.frozen_axes[len(self._frozen) :]:
            self._frozen.append(name)
            self._run_writer.mark("frozen", axis=name)
        if now - self._flushed >= self._settings.flush_every:
            self._flushed = now
            self._run_writer.flush()
        self._show(now)
        self._feed_on(now, new, timed)

    def _write_states(self, states: list[tuple[AxisState, int]], now: float) -> list[tuple[AxisState, int]]:
        timed = self._run_writer.axis(states)
        if states:
            self._state = states[-1][0]
        if self._motion:
            self._motion.add_states(states, now)
        if self._monitor.axis_error and not states:
            raise RunEnded(EndReason.AXIS_LOST, str(self._monitor.axis_error))
        return timed

    def _add_to_turn(self, readings: list, states: list[tuple[AxisState, int]]) -> None:
        """Keep force and depth of the first withdrawal for a while."""
        pulls, turns = self._turn
        over = pulls and pulls[-1][0] - pulls[0][0] > _TURN_S
        if over or not self._motion or self._motion.phase is not Phase.extraction:
            return
        pulls += [(1e-9 * sample.arrival, force) for sample, force in readings]
        turns += [(1e-9 * arrival, state.depth) for state, arrival in states]

    def _with_missing(self, ended: RunEnded) -> RunEnded:
        """The end of the run, with that the event was not there at which it was to stop."""
        found = self._monitor.event_stop
        return RunEnded(ended.reason, found.missing) if found and ended.reason is EndReason.DONE else ended

    def _judged(self, ended: RunEnded) -> RunEnded:
        """The end of the run, with that the depth was late, if the force of its first withdrawal shows that."""
        pull = max(self._settings.steady, _PULL_NOISES * self._bias.noise[self._settings.column])
        if not (self._bias.samples and all(self._turn)):
            return ended
        forces, depths = (tuple(np.array(each).T) for each in self._turn)
        late = late_depth(forces, depths, pull, self._monitor.axis_check.spread)
        if late is None:
            return ended
        reason = EndReason.DEPTH_LATE if ended.reason is EndReason.DONE else ended.reason
        words = "the force pulled at the withdrawal {:.2f} to {:.2f} s before the reported depth turned back".format(
            *late
        )
        return RunEnded(reason, "; ".join(filter(None, [ended.detail, words])))

    def _check_sensor(self, now: float) -> None:
        silence = self._settings.silence
        if isinstance(self._monitor.error, EOFError):
            raise RunEnded(EndReason.SOURCE_ENDED)
        if self._monitor.error:
            raise RunEnded(EndReason.SENSOR_LOST, str(self._monitor.error))
        if now - self._monitor.last_time > silence:
            raise RunEnded(EndReason.SENSOR_SILENT, f"no reading for {silence:g} s")
        if now - self._monitor.last_usable_time > silence:
            raise RunEnded(EndReason.SENSOR_FAULT, f"no usable reading for {silence:g} s: {self._monitor.why_unusable}")

    def _end(self, ended: RunEnded) -> RunResult:
        """Stop the axis, write what arrives until it rests, and close the file."""
        self._ending, stop = True, None
        if self._monitor.axis_check:
            self._monitor.send_stop()
            ended, stop = self._watch_stop(ended)
        ended = self._write_while_stopping(ended)
        result = self._result(ended, stop)
        try:
            self._run_writer.close(ended.reason, end_entries(result))
        except RunEnded as later:
            result = self._result(_reported(ended, later), stop)
        self._feed_on(time.monotonic(), [], [])  # the marks of the end
        return result

    def _watch_stop(self, ended: RunEnded) -> tuple[RunEnded, StopReport]:
        """Write what arrives until the axis is seen at rest; what it did becomes part of the reason."""
        begun, at_order = time.monotonic(), []
        while self._monitor.waits_for_rest:
            ended = self._write_while_stopping(ended)
            if time.monotonic() - begun < REACTION_TIME_S:
                at_order += self._latest
        report, rising = self._monitor.stop_report, ""
        if report.at_rest and not (self._motion and self._motion.phase is Phase.extraction):
            still = report.distance <= _STILL_M and at_order  # then the force at the order is already that of rest
            rising = self._rising_force(max(map(abs, at_order)) if still else None)
        report = self._monitor.stop_report  # it may have moved since
        return _with_stop(ended, report, rising), report

    def _write_while_stopping(self, ended: RunEnded) -> RunEnded:
        time.sleep(POLL_INTERVAL_S)
        try:
            self._write_received(time.monotonic())
        except RunEnded as later:
            return _reported(ended, later)
        return ended

    def _rising_force(self, first: float | None) -> str:
        """In words, a force that rises although the depth is at rest: then the depth is not the needle's.

        After an insertion the force of a needle at rest only relaxes. The means over successive times are compared with
        one another, or with ``first`` [N].
        """
        means = [abs(self._mean_force()) for _ in range(4)]
        noise = _MIN_NOISES * self._bias.noise[self._settings.column]
        steady = all(b > a for a, b in pairwise(means)) and means[-1] - means[0] > noise
        above = first is not None and max(means) > first + max(noise, _MAX_RISE * first)
        if not (noise > 0.0 and (steady or above)):
            return ""
        low = means[0] if first is None else min(first, means[0])
        return (
            f", but the force rises from {low:.3f} to {max(means):.3f} N: the needle still moves; switch the axis off"
        )

    def _mean_force(self) -> float:
        """The mean force over ``_FORCE_AFTER_REST_S`` from now on; NaN without a reading."""
        until, forces = time.monotonic() + _FORCE_AFTER_REST_S, []
        while time.monotonic() < until:
            self._write_while_stopping(RunEnded(EndReason.DONE))
            forces += self._latest
        return float(np.mean(forces)) if forces else math.nan

    def _result(self, ended: RunEnded, stop: StopReport | None) -> RunResult:
        counts, seconds = self._run_writer.check.total, time.monotonic() - self._begun
        return RunResult(
            ended=ended.reason,
            detail=ended.detail,
            seconds=seconds,
            received=counts.received,
            lost=counts.lost,
            duplicated=counts.duplicated,
            late=counts.late,
            longest_own_gap=self._monitor.max_gap_ns * 1e-9,
            bias=self._bias,
            peak_force=self._peak,
            cpu_share=(time.process_time() - self._processor_time) / max(seconds, 1e-3),
            alignment_uncertainty=alignment_uncertainty(self._run_writer.pairs),
            path=self._path,
            dropped=self._run_writer.dropped,
            buffer=self._run_writer.buffer,
            restarts=self._run_writer.restarts,
            frozen_axes=tuple(self._monitor.frozen_axes),
            unwritten=self._run_writer.unwritten,
            stop=stop,
            past_event=self._past_event(stop),
        )

    def _past_event(self, stop: StopReport | None) -> float | None:
        """How far past the event at which it was to stop the axis rests [m]."""
        found = self._monitor.event_stop
        known = found is not None and stop is not None and math.isfinite(found.depth)
        return stop.depth - found.depth if known else None

    def _show(self, now: float) -> None:
        if self._view is None or now - self._viewed < _VIEW_INTERVAL_S:
            return
        self._viewed = now
        try:
            self._view(self._progress(now))
        except Exception as error:  # the terminal is gone; the recording continues without a view
            self._view = None
            if not (self._ending or isinstance(error, OSError)):
                raise

    def _feed_on(self, now: float, new: list[tuple[ForceSample, int]], states: list[tuple[AxisState, int]]) -> None:
        """Feed what was written; whoever watches cannot end the run."""
        marks, self._run_writer.marks = self._run_writer.marks, []
        if self._feed is not None:
            forces = [self._monitor.axial(sample) for sample, _ in new]
            with contextlib.suppress(Exception):
                self._feed(Written(new, forces, states, marks, self._progress(now)))

    def _progress(self, now: float) -> Progress:
        counts = self._run_writer.check.total
        return Progress(
            seconds=now - self._begun,
            received=counts.received,
            lost=counts.lost,
            force=self._force,
            depth=self._state.depth if self._state else None,
            phase=self._motion.phase if self._motion else None,
            bias=self._settings.sign * self._bias.wrench[self._settings.column],
        )


def _reported(first: RunEnded, later: RunEnded) -> RunEnded:
    """The end that is reported: the first one, unless only the later one is a failure of the file.

    An axis that does not stop is reported before all else, with the failure; a failure that occurs again, when the file
    is closed, is reported once.
    """
    if later.reason not in FILE_ENDS or first.reason in FILE_ENDS:
        return first
    if (later.detail or str(later.reason)) in first.detail:
        return first
    if first.reason is EndReason.AXIS_NOT_STOPPED:
        return RunEnded(first.reason, f"{first.detail}; {later.reason}: {later.detail}")
    return RunEnded(later.reason, "; ".join(filter(None, [later.detail, first.detail])))


def _with_stop(ended: RunEnded, report: StopReport, rising: str) -> RunEnded:
    """The reason of the end with what the axis did after the stop."""
    if report.beyond or rising:
        first = f"{ended.reason} ({ended.detail})" if ended.detail else ended.reason
        return RunEnded(EndReason.AXIS_NOT_STOPPED, f"{first}: {report}{rising}")
    if report.confirmed and ended.reason is EndReason.DONE:
        return ended
    return RunEnded(ended.reason, "; ".join(filter(None, [ended.detail, str(report)])))


def end_entries(result: RunResult) -> dict[str, str]:
    """The entries at the end of a recorded file, as text."""
    values = {name: getattr(result, name) for name in _END_ENTRIES}
    if result.stop:
        values |= {f"stop_{name}": value for name, value in result.stop._asdict().items()}
    return {name: f"{value:.6g}" if isinstance(value, float) else str(value) for name, value in values.items()}


def alignment_uncertainty(pairs: list[tuple[int, int]]) -> float | None:
    """95 % uncertainty [s] of the sensor's clock relative to this computer's; None with too few readings."""
    if len(pairs) < _MIN_ALIGNMENT_PAIRS:
        return None
    ordered = np.array(sorted(pairs), dtype=np.int64)  # late readings in their place
    device, arrival = 1e-9 * (ordered - ordered[0]).T
    try:
        return float(align(device, arrival).uncertainty)
    except InputError:
        return None
