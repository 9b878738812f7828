# SPDX-License-Identifier: Apache-2.0
"""What is known of an insertion while it happens: the events so far and the state of this moment."""

from typing import TYPE_CHECKING, Any

from ..acquisition.stop_at import detector_of
from ..core import Detection, EventSettings
from .rows import Row

if TYPE_CHECKING:
    from ..online import OnlineIdentifier

AHEAD = 2e-3  # [m] over which the force is expected


class Watch:
    """A stream that is watched: rows in, events out.

    Parameters
    ----------
    settings : EventSettings, optional
        What counts as an event; by default the settings that hold everywhere.
    online : OnlineIdentifier, optional
        What learns the parameters on the way.

    Attributes
    ----------
    events : list of Detection
        All events so far, in the order in which they were found.
    row : Row or None
        The newest row.
    rows : int
        How many there were.
    """

    def __init__(self, settings: EventSettings | None = None, online: "OnlineIdentifier | None" = None):
        self.online = online
        self.detector = detector_of(settings or EventSettings())
        self.events: list[Detection] = []
        self.row: Row | None = None
        self.rows = 0

    def add(self, row: Row) -> Detection | None:
        """Take one row; returns the event that it shows, if there is one."""
        elapsed = 0.0 if self.row is None else row.time - self.row.time
        event = self.detector.step(row.force, row.depth, elapsed)
        if self.online is not None:
            self.online.step(row.force, row.depth, elapsed)
        if self.row is None or elapsed > 0.0:
            self.row = row
        self.rows += 1
        if event is not None:
            self.events.append(event)
        return event

    def punctures(self) -> int:
        """How many punctures were found that nothing else explains."""
        return sum(each.kind == "puncture" and each.probability > 0.5 for each in self.events)

    def now(self) -> dict[str, Any]:
        """The newest row and what the detector makes of it, by names with units."""
        time, force, depth = self.row or (None, None, None)
        detector = self.detector
        return self._learnt() | {
            "time_s": time,
            "force_N": force,
            "depth_m": depth,
            "status": detector.status,
            "noise_N": detector.noise,
            "needed_fall_N": detector.needed_fall,
            "resistance": detector.resistance,
            "punctures": self.punctures(),
        }

    def _learnt(self) -> dict[str, Any]:
        """What the motion so far has determined of the tissue, and the force that it lets expect."""
        if self.online is None:
            return {}
        fields = ("name", "value", "unit", "low", "high", "identifiable")
        parameters = [{name: getattr(each, name) for name in fields} for each in self.online.parameters.values()]
        ahead = self.online.ahead(AHEAD)
        expected = {"travel_m": AHEAD, "force_N": ahead.force[-1], "low_N": ahead.low[-1], "high_N": ahead.high[-1]}
        expected["puncture_probability"] = ahead.puncture_probability
        return {"regime": ahead.regime, "parameters": parameters, "ahead": expected}


def event_document(event: Detection) -> dict[str, Any]:
    """An event by names with units, as a line for other programs has it."""
    return {
        "event": event.kind,
        "time_s": event.time,
        "depth_m": event.depth,
        "way_back_m" if event.kind == "reversal" else "force_change_N": event.size,
        "probability": event.probability,
        "delay_s": event.delay,
    }
