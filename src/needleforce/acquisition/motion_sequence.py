# SPDX-License-Identifier: Apache-2.0
"""The moves of a run, one after the other, by what the axis says of itself; nothing here waits."""

from collections.abc import Callable, Iterator, Sequence

from ..vocabulary import Phase
from ..wire.axis_lines import AxisState

DONE = "done"  # why a run ended that went to its end
REACHED = 0.25e-3  # [m] from where it was sent: lag and play of a spindle
_SAME = 5e-6  # [m] within which a move goes nowhere, and so waits
_SHARE = 0.1  # of the way it ought to have gone, below which an axis stands
_ASTRAY = 1e-3  # [m] off the way it was sent, beyond which an axis is let go no further
_BEGIN = 0.5  # [s] from the answer to a first state that says moving


class RunEnded(Exception):
    """A run is over: why, in a word or two, and what more there is to say."""

    def __init__(self, why: str, detail: str = ""):
        super().__init__(why, detail)
        self.why, self.detail = why, detail


class MotionSequence:
    """Sends the moves. ``hear`` the states, ``step`` often; ``RunEnded`` is raised with ``DONE`` or what went wrong.

    ``phase`` is that of the motion, for the force plays no part in it: ``free`` until the first move, then
    ``insertion`` for all of the way in, ``hold``, ``extraction``.
    """

    def __init__(self, axis, moves: Sequence[tuple[float, float]], patience: float, send_move: Callable):
        self.phase = Phase.free
        self.state: AxisState | None = None
        self._axis, self._moves, self._patience, self._send_move = axis, moves, patience, send_move
        self._heard = self._now = 0.0
        self._moved: list[tuple[float, float]] = []  # time and depth while it moves, over the last ``patience``
        self._steps = self._all()

    def hear(self, states: list[tuple[AxisState, int]], now: float) -> None:
        """What the axis said, and the time [s] of the monotonic clock. Raises Ended for a fault of the axis."""
        if states:
            self.state, self._heard = states[-1][0], now
        for state, _ in states:
            if state.condition in ("stalled", "fault"):
                raise RunEnded(f"axis {state.condition}", f"at {1e3 * state.depth:.3f} mm")

    def step(self, now: float) -> None:
        """Go on where there is something to do. Raises Ended."""
        self._now = now
        self._heard = self._heard or now
        if now - self._heard > self._patience:
            raise RunEnded("axis silent", f"no state for {self._patience:g} s")
        next(self._steps)

    def _all(self) -> Iterator[None]:
        while self.state is None:
            yield
        here = self.state.depth
        for depth, speed in self._moves:
            if abs(depth - here) <= _SAME:
                yield from self._hold(speed)
                continue
            self.phase = Phase.insertion if depth > here else Phase.extraction
            yield from self._move(here, depth, speed)
            here = depth
        raise RunEnded(DONE)

    def _hold(self, seconds: float) -> Iterator[None]:
        self.phase, end = Phase.hold, self._now + seconds
        way = self._way(self.state.depth, self.state.depth)
        while self._now < end:
            self._check_way(*way)
            yield

    def _move(self, start: float, depth: float, speed: float) -> Iterator[None]:
        way = self._way(start, depth)
        self._send_move(depth, speed)
        sent = self._now
        while (answer := self._axis.answer("move")) is None:
            if self._now - sent > self._patience:
                raise RunEnded("axis silent", f"no answer to a move for {self._patience:g} s")
            yield
        if not answer.accepted:
            raise RunEnded("move refused", answer.reason)
        before, begun, self._moved = self.state.number, self._now, []
        longest = self._longest(abs(depth - start), speed)
        while not self._there(before, begun, depth):
            if self._now - begun > longest:
                raise RunEnded("axis stalled", f"not at {1e3 * depth:.3f} mm after {longest:.1f} s")
            self._check_way(*way)
            self._check_progress(depth, speed)
            yield

    def _way(self, start: float, depth: float) -> tuple[float, float]:
        """The lowest and highest depth between the two, with what it needs to brake where it still moves."""
        spare = _ASTRAY + self.state.velocity**2 / (2.0 * self._axis.limits.max_acceleration)
        return min(start, depth) - spare, max(start, depth) + spare

    def _check_way(self, lowest: float, highest: float) -> None:
        here = self.state.depth
        if not lowest <= here <= highest:
            sent = f"{1e3 * lowest:.3f} to {1e3 * highest:.3f} mm"
            raise RunEnded("axis fault", f"at {1e3 * here:.3f} mm, off the way it was sent, {sent}")

    def _longest(self, way: float, speed: float) -> float:
        return 5.0 + 2.0 * (way / speed + speed / self._axis.limits.max_acceleration)

    def _there(self, before: int, begun: float, depth: float) -> bool:
        """Whether it rests at its target. Raises Ended if it rests elsewhere."""
        state = self.state
        if state.number == before or state.condition != "idle":
            return False
        if abs(state.depth - depth) <= REACHED:
            return True
        if self._moved or self._now - begun > _BEGIN:
            raise RunEnded("axis stopped", f"at {1e3 * state.depth:.3f} mm instead of {1e3 * depth:.3f} mm")
        return False

    def _check_progress(self, depth: float, speed: float) -> None:
        if self.state.condition != "moving":
            return
        if not self._moved or self._moved[-1][0] != self._heard:  # an axis that says nothing is another matter
            self._moved.append((self._heard, self.state.depth))
        since, from_depth = self._moved[0]
        span = self._heard - since
        if span < self._patience:
            return
        ought = min(speed * span, 0.5 * self._axis.limits.max_acceleration * span**2, abs(depth - from_depth))
        if ought > REACHED and abs(self.state.depth - from_depth) < _SHARE * ought:
            raise RunEnded("axis stalled", f"at {1e3 * self.state.depth:.3f} mm, though it says that it moves")
        self._moved.pop(0)
