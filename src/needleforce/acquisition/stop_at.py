# SPDX-License-Identifier: Apache-2.0
"""An event at which the axis stops: the puncture of a layer, or a force that falls faster than a limit."""

import math
from collections import deque
from dataclasses import dataclass, field

from ..checks import within
from ..core import EventDetector, EventSettings
from ..errors import InputError
from ..recording.alignment import LiveAlignment
from ..wire.axis_lines import AxisRange, AxisState
from .axis_check import stop_distance, top_speed
from .sources.source import ForceSample

RATE_TIME_S = 0.01  # over which a force rate is taken
_MAX_LAYERS = 100
_SURE = 0.5  # a puncture of more than this probability: nothing else explains its fall
_MAX_STATE_AGE_S = 0.1  # for which a depth is continued at its velocity
_SECOND = 1e9  # [ns]
_EXAMPLES = "Give puncture, layer=2, or force-rate=20 [N/s]."


@dataclass(frozen=True)
class StopAt:
    """What stops the axis.

    Parameters
    ----------
    layer : int
        The number of the puncture, from 1: 2 stops after the second one.
    force_rate : float, optional
        Instead of a puncture, a fall of the force [N/s], over 10 ms or between two readings that are further apart.
    settings : EventSettings
        What counts as a puncture, as of ``nf.EventDetector``.

    Raises
    ------
    InputError
        If a value is outside its range.
    """

    layer: int = 1
    force_rate: float | None = None
    settings: EventSettings = field(default_factory=EventSettings)

    def __post_init__(self):
        within("layer", self.layer, 1, _MAX_LAYERS, next_step=_EXAMPLES)
        if self.force_rate is not None:
            within("force rate", self.force_rate, 1e-3, 1e6, "N/s", next_step=_EXAMPLES)

    def farthest(self, limits: AxisRange, speed: float) -> float:
        """The distance [m] past the peak of the force within which the axis must rest: a puncture is found within the
        time in which its force falls, or never."""
        found_in = self.settings.within if self.force_rate is None else RATE_TIME_S
        return top_speed(limits, speed) * found_in + stop_distance(limits, speed)


def parse_stop(text: str, settings: EventSettings) -> StopAt:
    """``puncture``, ``layer=2`` or ``force-rate=20``. Raises InputError."""
    word, _, number = text.partition("=")
    try:
        if word == "puncture" and not number:
            return StopAt(settings=settings)
        if word == "layer":
            return StopAt(layer=int(number), settings=settings)
        if word == "force-rate":
            return StopAt(force_rate=float(number), settings=settings)
    except ValueError:
        pass
    raise InputError("--stop-at", repr(text), "no event at which an axis stops", next_step=_EXAMPLES)


def detector_of(settings: EventSettings) -> EventDetector:
    """A detector with these settings."""
    return EventDetector(**{row["name"]: getattr(settings, row["name"]) for row in settings.table()})


class DepthNow:
    """The depth at a reading: an axis reports more seldom than a sensor, and later under load."""

    def __init__(self):
        self._seen, self._state, self._depth = 0.0, None, None

    def add(self, time: float, state: AxisState) -> None:
        """Take a state of the axis at ``time`` [s]."""
        self._seen, self._state = time, state

    def at(self, time: float) -> float | None:
        """The depth [m] at ``time`` [s], from the newest state and its velocity; None without a state. What is known
        better later moves a needle that advances no step back."""
        if self._state is None:
            return None
        velocity, age = self._state.velocity, min(max(-_MAX_STATE_AGE_S, time - self._seen), _MAX_STATE_AGE_S)
        found = self._state.depth + velocity * age
        if self._depth is None or (found - self._depth) * velocity >= 0.0:
            self._depth = found
        return self._depth


class EventStop:
    """Looks for the event in readings and states as they come, in constant time for each.

    ``depth`` [m] is where the event was, NaN until then.
    """

    def __init__(self, condition: StopAt):
        self.depth = math.nan
        self._condition, self._detector = condition, detector_of(condition.settings)
        self._punctures, self._time = 0, None
        self._course = DepthNow()
        self._sensor_clock, self._axis_clock = LiveAlignment(), LiveAlignment()
        self._recent: deque[tuple[float, float, float]] = deque()  # time, force, depth over the time of a rate

    @property
    def missing(self) -> str:
        """In words, that the event was not there."""
        if self._condition.force_rate is not None:
            return f"the force never fell by {self._condition.force_rate:g} N/s"
        return f"{self._punctures} punctures were found; one is a fall of {self._detector.needed_fall:.3g} N by now"

    def add_state(self, state: AxisState, arrival: int) -> None:
        """Take a state of the axis and its arrival [ns]."""
        self._course.add(self._axis_clock.update(state.time, arrival / _SECOND), state)

    def add(self, sample: ForceSample, force: float) -> str:
        """In words, the event that this reading of the axial force [N] completes; empty if there is none."""
        time, before = sample.device / _SECOND, self._time
        here = self._sensor_clock.update(time, sample.arrival / _SECOND)
        depth = self._course.at(here)
        if depth is None or (before is not None and time <= before):
            return ""
        self._time = time
        if self._condition.force_rate is not None:
            return self._fast_fall(time, force, depth)
        event = self._detector.step(force, depth, 0.0 if before is None else time - before)
        if event is None or event.kind != "puncture" or not event.probability > _SURE:
            return ""
        self._punctures += 1
        if self._punctures < self._condition.layer:
            return ""
        self.depth = event.depth
        found = f"found {1e3 * event.delay:.0f} ms after its peak, as the force had fallen by {event.size:.3f} N"
        return f"puncture {self._punctures} at {1e3 * event.depth:.3f} mm, {found}"

    def _fast_fall(self, time: float, force: float, depth: float) -> str:
        recent = self._recent
        recent.append((time, force, depth))
        while len(recent) > 2 and time - recent[1][0] >= RATE_TIME_S - 1e-9:
            recent.popleft()
        then, high, where = recent[0]
        span = max(time - then, RATE_TIME_S)
        rate = (high - force) / span
        if len(recent) < 2 or not rate >= self._condition.force_rate:
            return ""
        self.depth = where
        return f"the force fell by {rate:.3g} N/s, at {1e3 * where:.3f} mm"
