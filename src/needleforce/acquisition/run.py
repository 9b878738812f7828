# SPDX-License-Identifier: Apache-2.0
"""A run in progress: writes what was received, checks for what ends the run, then waits until the axis rests."""

import threading
import time
from collections import deque
from collections.abc import Callable
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..recording.alignment import align
from ..wire.axis_lines import MAX_SILENCE_S, AxisState
from .force_monitor import ForceMonitor
from .motion_sequence import EndReason, MotionSequence, RunEnded
from .run_writer import FILE_ENDS, RunWriter
from .settings import Progress, RestBias, RunResult, Settings
from .sources.source import MotionAxis

POLL_INTERVAL_S = 0.02
_VIEW_INTERVAL_S = 0.125
_MAX_STOP_TIME_S = 3.0  # for an axis to come to rest after a stop
_MIN_ALIGNMENT_PAIRS = 20
_MAX_LATE_SHARE = 0.5  # of the records of a second, above which the sensor's counter is invalid
_END_ENTRIES = ("ended", "detail", "seconds", "received", "lost", "duplicated", "late", "longest_own_gap", "peak_force")


class Run:
    """The run in progress, on the caller's thread."""

    def __init__(
        self,
        *,
        path: Path,
        run_writer: RunWriter,
        monitor: ForceMonitor,
        axis: MotionAxis | None,
        bias: RestBias,
        settings: Settings,
        view: Callable[[Progress], None] | None,
    ):
        self._path, self._run_writer, self._monitor, self._axis = path, run_writer, monitor, axis
        self._bias, self._settings, self._view = bias, settings, view
        self._begun = self._flushed = time.monotonic()
        self._processor_time = time.process_time()
        self._viewed = self._peak = self._force = 0.0
        self._motion: MotionSequence | None = None
        self._state: AxisState | None = None

    def run(self, motion: MotionSequence | None, stop: threading.Event) -> RunResult:
        """Record from the first move of ``motion`` until the file is closed."""
        self._motion = motion
        try:
            self._write_received(self._begun)
            self._run_writer.bias(self._bias)
            while True:
                self._poll(stop)
                time.sleep(POLL_INTERVAL_S)
        except RunEnded as ended:
            end = ended
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
        if stop.is_set():
            raise RunEnded(EndReason.INTERRUPTED)
        self._check_sensor(now)
        if self._motion:
            self._step(self._motion, now)
            self._run_writer.phase(self._motion.phase)
        if self._settings.duration is not None and now - self._begun >= self._settings.duration:
            raise RunEnded(EndReason.DONE)

    def _write_received(self, now: float) -> None:
        samples = _emptied(self._monitor.samples)
        for sample in samples:
            self._force = self._monitor.axial(sample)
            self._peak = max(self._peak, self._force, key=abs)
        self._run_writer.force(samples)
        if self._axis:
            self._write_states(now)
        if now - self._flushed >= self._settings.flush_every:
            self._flushed = now
            self._run_writer.flush()
        self._show(now)

    def _write_states(self, now: float) -> None:
        try:
            states = self._axis.receive()
        except InputError as error:
            raise RunEnded(EndReason.AXIS_LOST, str(error)) from None
        self._run_writer.axis(states)
        if states:
            self._state = states[-1][0]
        if self._motion:
            self._motion.add_states(states, now)

    def _step(self, motion: MotionSequence, now: float) -> None:
        """Send the next move if it is due; an axis that stopped because readings ended counts as a silent sensor."""
        try:
            motion.step(now)
        except RunEnded as ended:
            silence = now - self._monitor.last_time
            if ended.reason is EndReason.AXIS_STOPPED and silence > 0.5 * MAX_SILENCE_S:
                detail = f"no reading for {silence:.2f} s, so the {ended.reason} {ended.detail}"
                raise RunEnded(EndReason.SENSOR_SILENT, detail) from None
            raise

    def _check_sensor(self, now: float) -> None:
        silence = self._settings.silence
        if isinstance(self._monitor.error, EOFError):
            raise RunEnded(EndReason.SOURCE_ENDED)
        if self._monitor.error:
            raise RunEnded(EndReason.SENSOR_LOST, str(self._monitor.error))
        if now - self._monitor.last_time > silence:
            raise RunEnded(EndReason.SENSOR_SILENT, f"no reading for {silence:g} s")
        if now - self._monitor.last_healthy_time > silence:
            raise RunEnded(EndReason.SENSOR_FAULT, f"no healthy reading for {silence:g} s")
        for second in self._run_writer.check.seconds[-1:]:
            if second.late > _MAX_LATE_SHARE * second.received:
                detail = f"its counter is invalid: {second.late} of {second.received} records late in a second"
                raise RunEnded(EndReason.SENSOR_FAULT, detail)

    def _end(self, ended: RunEnded) -> RunResult:
        """Stop the axis, write what arrives until it rests, and close the file."""
        if self._motion:
            self._monitor.send_stop()
        try:
            self._wait_for_rest()
        except RunEnded as later:  # a file that fails replaces the reason, an axis that fails does not
            ended = _reported(ended, later)
        result = self._result(ended)
        try:
            self._run_writer.close(ended.reason, end_entries(result))
        except RunEnded as later:
            result = self._result(_reported(ended, later))
        return result

    def _wait_for_rest(self) -> None:
        """Write what arrives until the axis rests or is silent."""
        before, begun = self._state, time.monotonic()
        last = begun
        self._write_received(begun)
        while (
            self._motion
            and time.monotonic() - begun < _MAX_STOP_TIME_S
            and time.monotonic() - last < self._settings.silence
        ):
            time.sleep(POLL_INTERVAL_S)
            previous = self._state
            self._write_received(time.monotonic())
            last = last if self._state is previous else time.monotonic()
            if self._state is not before and self._state.condition not in ("moving", "stopping"):
                return

    def _result(self, ended: RunEnded) -> RunResult:
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
        )

    def _show(self, now: float) -> None:
        if self._view is None or now - self._viewed < _VIEW_INTERVAL_S:
            return
        self._viewed = now
        counts = self._run_writer.check.total
        progress = Progress(
            seconds=now - self._begun,
            received=counts.received,
            lost=counts.lost,
            force=self._force,
            depth=self._state.depth if self._state else None,
            phase=self._motion.phase if self._motion else None,
            bias=self._settings.sign * self._bias.wrench[self._settings.column],
        )
        try:
            self._view(progress)
        except OSError:  # the terminal is gone; the recording continues without a view
            self._view = None


def _reported(first: RunEnded, later: RunEnded) -> RunEnded:
    """The end that is reported: the first one, unless only the later one is a failure of the file."""
    return later if later.reason in FILE_ENDS and first.reason not in FILE_ENDS else first


def _emptied(queue: deque) -> list:
    """The present content of a queue that another thread fills; it is removed."""
    return [queue.popleft() for _ in range(len(queue))]


def end_entries(result: RunResult) -> dict[str, str]:
    """The entries at the end of a recorded file, as text."""
    values = {name: getattr(result, name) for name in _END_ENTRIES}
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
