# SPDX-License-Identifier: Apache-2.0
"""The moves of a run in sequence, driven by the states that the axis reports; no function here waits."""

from collections.abc import Callable, Iterator, Sequence
from enum import StrEnum

from ..vocabulary import Phase
from ..wire.axis_lines import AxisState
from .axis_check import POSITION_TOLERANCE_M
from .sources.source import MotionAxis

_HOLD_TOLERANCE_M = 5e-6  # a move shorter than this is a hold
_MIN_PROGRESS = 0.1  # share of the expected travel below which an axis has stalled
_MAX_PROGRESS_TIME_S = 60.0  # over which the progress of a slow axis is judged
_MAX_START_DELAY_S = 1.0  # from the answer to the first state with the condition moving


class EndReason(StrEnum):
    """Why a run ended. The values are written into the recorded file."""

    DONE = "done"
    INTERRUPTED = "interrupted"
    FORCE_LIMIT = "force limit"
    EVENT = "event"
    SOURCE_ENDED = "source ended"
    SENSOR_SILENT = "sensor silent"
    SENSOR_FAULT = "sensor fault"
    SENSOR_LOST = "sensor lost"
    AXIS_SILENT = "axis silent"
    AXIS_STALLED = "axis stalled"
    AXIS_FAULT = "axis fault"
    AXIS_STOPPED = "axis stopped"
    AXIS_LOST = "axis lost"
    DEPTH_LATE = "depth late"
    AXIS_NOT_STOPPED = "axis did not stop"
    MOVE_REFUSED = "move refused"
    RECORDER_DELAYED = "recorder delayed"
    DISK_FULL = "disk full"
    FILE_NOT_WRITTEN = "file not written"
    FAILED = "failed"


_FAILED_CONDITIONS = {"stalled": EndReason.AXIS_STALLED, "fault": EndReason.AXIS_FAULT}


class RunEnded(Exception):
    """A run has ended: the reason, and details if there are any."""

    def __init__(self, reason: EndReason, detail: str = ""):
        super().__init__(reason, detail)
        self.reason, self.detail = reason, detail


class MotionSequence:
    """Sends the moves one after the other; raises ``RunEnded`` at the end or when something goes wrong.

    Pass the axis' states to ``add_states`` and call ``step`` often. ``phase`` is that of the motion, independent of the
    force: ``free`` until the first move, then ``insertion`` for the insertion stroke, ``hold``, ``extraction``.
    ``timeout`` [s] is how long the axis may be silent or without progress. Whether its depth keeps to the orders is the
    task of ``AxisCheck``.
    """

    def __init__(self, axis: MotionAxis, moves: Sequence[tuple[float, float]], timeout: float, send_move: Callable):
        self.phase = Phase.free
        self.state: AxisState | None = None
        self._axis, self._moves, self._timeout, self._send_move = axis, moves, timeout, send_move
        self._last_state_time = self._now = 0.0
        self._travelled: list[tuple[float, float]] = []  # time and depth during a move, over the last ``timeout``
        self._steps = self._all_moves()

    def add_states(self, states: list[tuple[AxisState, int]], now: float) -> None:
        """Add the axis' new states at ``now`` [s] of the monotonic clock. Raises RunEnded for a fault of the axis."""
        if states:
            self.state, self._last_state_time = states[-1][0], now
        for state, _ in states:
            if state.condition in _FAILED_CONDITIONS:
                raise RunEnded(_FAILED_CONDITIONS[state.condition], f"at {1e3 * state.depth:.3f} mm")

    def step(self, now: float) -> None:
        """Send the next move if it is due. Raises RunEnded."""
        self._now = now
        self._last_state_time = self._last_state_time or now
        if now - self._last_state_time > self._timeout:
            raise RunEnded(EndReason.AXIS_SILENT, f"no state for {self._timeout:g} s")
        next(self._steps)

    def _all_moves(self) -> Iterator[None]:
        while self.state is None:
            yield
        here = self.state.depth
        for depth, speed in self._moves:
            if abs(depth - here) <= _HOLD_TOLERANCE_M:
                yield from self._hold(speed)
                continue
            self.phase = Phase.insertion if depth > here else Phase.extraction
            yield from self._move(here, depth, speed)
            here = depth
        raise RunEnded(EndReason.DONE)

    def _hold(self, seconds: float) -> Iterator[None]:
        self.phase, end = Phase.hold, self._now + seconds
        while self._now < end:
            yield

    def _move(self, start: float, depth: float, speed: float) -> Iterator[None]:
        self._send_move(depth, speed)
        sent = self._now
        while (answer := self._axis.answer("move")) is None:
            if self._now - sent > self._timeout:
                raise RunEnded(EndReason.AXIS_SILENT, f"no answer to a move for {self._timeout:g} s")
            yield
        if not answer.accepted:
            raise RunEnded(EndReason.MOVE_REFUSED, answer.reason)
        number_before, begun, self._travelled = self.state.number, self._now, []
        max_duration = 5.0 + 2.0 * (abs(depth - start) / speed + speed / self._axis.limits.max_acceleration)
        while not self._arrived(number_before, begun, depth):
            if self._now - begun > max_duration:
                raise RunEnded(EndReason.AXIS_STALLED, f"not at {1e3 * depth:.3f} mm after {max_duration:.1f} s")
            self._check_progress(depth, speed)
            yield

    def _arrived(self, number_before: int, begun: float, depth: float) -> bool:
        """Whether the axis rests at its target. Raises RunEnded if it rests elsewhere."""
        state = self.state
        if state.number == number_before or state.condition != "idle":
            return False
        if abs(state.depth - depth) <= POSITION_TOLERANCE_M:
            return True
        if self._travelled or self._now - begun > _MAX_START_DELAY_S:
            where = f"at {1e3 * state.depth:.3f} mm instead of {1e3 * depth:.3f} mm"
            raise RunEnded(EndReason.AXIS_STOPPED, where)
        return False

    def _check_progress(self, depth: float, speed: float) -> None:
        if self.state.condition == "idle":
            return
        travelled = self._travelled
        if not travelled or travelled[-1][0] != self._last_state_time:  # silence of the axis is checked elsewhere
            travelled.append((self._last_state_time, self.state.depth))
        since, from_depth = travelled[0]
        span = self._last_state_time - since
        if span < self._timeout:
            return
        accelerating = 0.5 * self._axis.limits.max_acceleration * span**2
        expected = min(speed * span, accelerating, abs(depth - from_depth))
        if expected <= POSITION_TOLERANCE_M and depth != self.state.depth and span < _MAX_PROGRESS_TIME_S:
            return  # too slow to judge yet
        if expected > POSITION_TOLERANCE_M and abs(self.state.depth - from_depth) < _MIN_PROGRESS * expected:
            where = f"at {1e3 * self.state.depth:.3f} mm, although it reports that it is moving"
            raise RunEnded(EndReason.AXIS_STALLED, where)
        travelled.pop(0)
