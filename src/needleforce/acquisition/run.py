# SPDX-License-Identifier: Apache-2.0
"""A run while it goes on: what came is kept, what ends it is looked for; then the axis comes to rest."""

import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..recording.alignment import align
from ..wire.axis_lines import SILENCE, AxisState
from .force_monitor import ForceMonitor
from .motion_sequence import DONE, MotionSequence, RunEnded
from .run_writer import FILE_ENDS, RunWriter
from .settings import Progress, RestBias, RunResult, Settings

EVERY = 0.02  # [s] between two looks at what came
_VIEW_EVERY = 0.125  # [s]
_COASTS = 3.0  # [s] that an axis may need to come to rest once told to


class Run:
    """The run while it goes on, on the caller's thread."""

    def __init__(
        self,
        path: Path,
        run_writer: RunWriter,
        watch: ForceMonitor,
        axis,
        bias: RestBias,
        settings: Settings,
        view: Callable[[Progress], None] | None,
    ):
        self._path, self._writer_of_run, self._watch, self._axis = path, run_writer, watch, axis
        self._bias, self._settings, self._view = bias, settings, view
        self._begun = self._flushed = time.monotonic()
        self._processor = time.process_time()
        self._viewed = self._peak = self._force = 0.0
        self._course: MotionSequence | None = None
        self._state: AxisState | None = None

    def run(self, course: MotionSequence | None, stop: threading.Event) -> RunResult:
        """From the first move of ``course`` to the closed file."""
        self._course = course
        try:
            self._keep(self._begun)
            self._writer_of_run.bias(self._bias)
            while True:
                self._look(stop)
                time.sleep(EVERY)
        except RunEnded as ended:
            end = ended
        except BaseException as error:
            self._view = None
            self._end(RunEnded("failed", repr(error)))
            raise
        return self._end(end)

    def _look(self, stop: threading.Event) -> None:
        """One look at all that came, and at all that may end the run."""
        now = time.monotonic()
        self._keep(now)
        if self._watch.over:
            over = self._watch.axial(self._watch.over)
            self._writer_of_run.mark("limit", force=over, limit=self._settings.force_limit)
            raise RunEnded("force limit", f"{over:.3f} N")
        if stop.is_set():
            raise RunEnded("interrupted")
        self._check_sensor(now)
        if self._course:
            self._step(self._course, now)
            self._writer_of_run.phase(self._course.phase)
        if self._settings.duration is not None and now - self._begun >= self._settings.duration:
            raise RunEnded(DONE)

    def _keep(self, now: float) -> None:
        """Write what came."""
        samples = _taken(self._watch.samples)
        for sample in samples:
            self._force = self._watch.axial(sample)
            self._peak = max(self._peak, self._force, key=abs)
        self._writer_of_run.force(samples)
        if self._axis:
            self._keep_states(now)
        if now - self._flushed >= self._settings.flush_every:
            self._flushed = now
            self._writer_of_run.flush()
        self._show(now)

    def _keep_states(self, now: float) -> None:
        try:
            states = self._axis.receive()
        except InputError as error:
            raise RunEnded("axis lost", str(error)) from None
        self._writer_of_run.axis(states)
        if states:
            self._state = states[-1][0]
        if self._course:
            self._course.hear(states, now)

    def _step(self, course: MotionSequence, now: float) -> None:
        """Go on with the moves. An axis that stops by itself does so where readings, and so words to it, have ended."""
        try:
            course.step(now)
        except RunEnded as ended:
            quiet = now - self._watch.last
            if ended.why == "axis stopped" and quiet > 0.5 * SILENCE:
                detail = f"no reading for {quiet:.2f} s, so the {ended.why} {ended.detail}"
                raise RunEnded("sensor silent", detail) from None
            raise

    def _check_sensor(self, now: float) -> None:
        silence = self._settings.silence
        if isinstance(self._watch.error, EOFError):
            raise RunEnded("source ended")
        if self._watch.error:
            raise RunEnded("sensor lost", str(self._watch.error))
        if now - self._watch.last > silence:
            raise RunEnded("sensor silent", f"no reading for {silence:g} s")
        if now - self._watch.last_healthy > silence:
            raise RunEnded("sensor fault", f"no healthy reading for {silence:g} s")
        for second in self._writer_of_run.check.seconds[-1:]:
            if second.late > 0.5 * second.received:
                what = f"its counter goes astray: {second.late} of {second.received} late in a second"
                raise RunEnded("sensor fault", what)

    def _end(self, ended: RunEnded) -> RunResult:
        """Stop the axis, keep what comes until it rests, and close the file."""
        if self._course:
            self._watch.send_stop()
        try:
            self._coast()
        except RunEnded as another:  # an axis that fails as well changes nothing; a file does
            ended = _worse(ended, another)
        outcome = self._outcome(ended)
        try:
            self._writer_of_run.close(ended.why, told(outcome))
        except RunEnded as another:
            outcome = self._outcome(_worse(ended, another))
        return outcome

    def _coast(self) -> None:
        """Keep what comes until the axis has come to rest, or says nothing more."""
        before, begun = self._state, time.monotonic()
        last = begun
        self._keep(begun)
        while self._course and time.monotonic() - begun < _COASTS and time.monotonic() - last < self._settings.silence:
            time.sleep(EVERY)
            heard = self._state
            self._keep(time.monotonic())
            last = last if self._state is heard else time.monotonic()
            if self._state is not before and self._state.condition not in ("moving", "stopping"):
                return

    def _outcome(self, ended: RunEnded) -> RunResult:
        counts, seconds = self._writer_of_run.check.total, time.monotonic() - self._begun
        return RunResult(
            ended.why,
            ended.detail,
            seconds,
            *(counts.received, counts.lost, counts.doubled, counts.late),
            self._watch.longest_gap * 1e-9,
            self._bias,
            self._peak,
            (time.process_time() - self._processor) / max(seconds, 1e-3),
            alignment_uncertainty(self._writer_of_run.pairs),
            self._path,
            self._writer_of_run.dropped,
            self._writer_of_run.buffer,
        )

    def _show(self, now: float) -> None:
        if self._view is None or now - self._viewed < _VIEW_EVERY:
            return
        self._viewed = now
        counts = self._writer_of_run.check.total
        phase = self._course.phase if self._course else None
        depth = self._state.depth if self._state else None
        bias = self._settings.sign * self._bias.wrench[self._settings.column]
        try:
            self._view(Progress(now - self._begun, counts.received, counts.lost, self._force, depth, phase, bias))
        except OSError:  # nobody watches any more, which ends no recording
            self._view = None


def _worse(first: RunEnded, then: RunEnded) -> RunEnded:
    """The end to tell: the first, unless it is then that the file fails."""
    return then if then.why in FILE_ENDS and first.why not in FILE_ENDS else first


def _taken(queue) -> list:
    """What stands in a queue that another thread fills."""
    return [queue.popleft() for _ in range(len(queue))]


def told(outcome: RunResult) -> dict[str, str]:
    """The end of a file, in words."""
    shown = ("ended", "detail", "seconds", "received", "lost", "doubled", "late", "longest_own_gap", "peak_force")
    return {
        name: f"{value:.6g}" if isinstance(value := getattr(outcome, name), float) else str(value) for name in shown
    }


def alignment_uncertainty(pairs: list[tuple[int, int]]) -> float | None:
    """How well the sensor's clock is known on this computer's [s], 95 %; None for too few readings."""
    if len(pairs) < 20:
        return None
    kept = np.array(sorted(pairs), dtype=np.int64)  # late ones in their place
    device, arrival = 1e-9 * (kept - kept[0]).T
    try:
        return float(align(device, arrival).uncertainty)
    except InputError:
        return None
