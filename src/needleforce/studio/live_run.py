# SPDX-License-Identifier: Apache-2.0
"""A run of the recorder in a process of its own, watched from the page.

``python -m needleforce.studio.live_run`` reads one line of JSON, the job, and then a word a line: ``alive`` while a
page looks on, and ``stop``. It writes a line of JSON for what was opened, for the points about thirty times a second,
for the end, and for the events of the file. The word ``stop``, the end of its input, which is that of the server, and
``MAX_ALONE`` without ``alive`` each stop the axis, as Ctrl-C stops ``needleforce record``.
"""

import json
import math
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, TextIO

from ..acquisition.axis_check import stop_distance
from ..acquisition.motion_sequence import EndReason
from ..acquisition.recorder import AxisNotStopped, record_run
from ..acquisition.settings import RunResult, Settings, Written
from ..acquisition.sources.opening import force_limit, open_sources
from ..checks import within
from ..errors import InputError
from ..files import json_safe
from ..models.model import Model
from ..preset_files import preset
from ..recording import read
from ..rig import Sensor
from ..rig.live import VirtualRig
from ..segmentation import segment
from ..wire.net_ft import PAGE
from .live_points import Along, Points

INTERVAL = 1 / 30  # [s] between two lines of points
MAX_ALONE = 2.0  # [s] without a page that looks on, after which the axis is stopped
MAX_POINTS, MAX_EVENTS = 400, 100  # of a line
HERE = "127.0.0.1"
_PLAIN = ("name", "condition", "why", "words", "axis")  # facts of a mark that need no name
STOP_BUTTON, PAGE_GONE, SERVER_GONE = "stop button", "no page looks on", "the server ended"


class Publisher:
    """Writes what the recorder feeds, on a thread of its own: whoever does not read cannot delay the recorder."""

    def __init__(self, target: TextIO, along: Along, stop: threading.Event):
        self.last_alive, self.why = time.monotonic(), ""
        self._target, self._along, self._stop = target, along, stop
        self._points, self._events, self._left_out = Points(MAX_POINTS), [], 0
        self._begun: int | None = None  # time of the first reading [ns]
        self._progress: dict[str, Any] = {}
        self._lock, self._writing, self._ending = threading.Lock(), threading.Lock(), threading.Event()
        self._thread = threading.Thread(target=self._run, name="publisher", daemon=True)

    def feed(self, written: Written) -> None:
        """Take what was written; returns at once."""
        with self._lock:
            if self._begun is None and written.samples:
                self._begun = written.samples[0][1]
            readings = [(self._time(at), force) for (_, at), force in zip(written.samples, written.forces)]
            states = [(self._time(at), state.depth) for state, at in written.states]
            points = self._along.add(readings, states)
            self._points.add(points, len(points))
            new = [{"time": self._time(at), "kind": kind, "text": _words(facts)} for at, kind, facts in written.marks]
            self._left_out += max(0, len(self._events) + len(new) - MAX_EVENTS)
            self._events = (self._events + new)[-MAX_EVENTS:]
            self._progress = written.progress._asdict()

    def order_stop(self, why: str) -> None:
        """Stop the run, once."""
        if not self._stop.is_set():
            self.why = why
            self._stop.set()
            self.write({"kind": "stopping", "why": why})

    def write(self, message: dict[str, Any]) -> None:
        """Write a line; a server that is gone stops the axis."""
        try:
            with self._writing:
                self._target.write(json.dumps(json_safe(message)) + "\n")
                self._target.flush()
        except (OSError, ValueError):
            self._stop.set()

    def start(self) -> None:
        """Begin to write."""
        self.last_alive = time.monotonic()
        self._thread.start()

    def end(self) -> None:
        """Write the rest, and end."""
        self._ending.set()
        self._thread.join(5.0)
        with self._lock:
            points = self._along.rest()
            self._points.add(points, len(points))
        self._publish()

    def _run(self) -> None:
        while not self._ending.wait(INTERVAL):
            if time.monotonic() - self.last_alive > MAX_ALONE:
                self.order_stop(PAGE_GONE)
            self._publish()

    def _publish(self) -> None:
        with self._lock:
            (points, readings), (events, self._events) = self._points.take(), (self._events, [])
            left_out, self._left_out = self._left_out, 0
            progress = self._progress
        if readings or events:
            rounded = [[None if v is None else round(v, 8) for v in point] for point in points]
            sent = {"points": rounded, "readings": readings, "events": events, "events_left_out": left_out}
            self.write({"kind": "points", **sent, "progress": progress})

    def _time(self, at: int) -> float:
        return max(0.0, (at - (at if self._begun is None else self._begun)) * 1e-9)


def main(source: TextIO, target: TextIO) -> None:
    """Make the run that the first line asks for; every end is written as a line."""
    stop, job = threading.Event(), json.loads(source.readline())
    publisher = None
    try:
        model = None if job["model"] is None else preset(job["model"])
        publisher = Publisher(target, Along(model, job["surface"]), stop)
        threading.Thread(target=_listen, args=(source, publisher), name="listener", daemon=True).start()
        publisher.start()
        result = _recorded(job, publisher, stop)
        publisher.end()
        publisher.write({"kind": "end", **_outcome(result, publisher.why)})
        if publisher.why != SERVER_GONE:
            publisher.write({"kind": "found", **_found(result.path)})
    except (InputError, KeyboardInterrupt) as error:
        before = "stopped before the recording began; there is no file"
        text = str(error) if isinstance(error, InputError) else before
        lost = isinstance(error, AxisNotStopped)
        (publisher or Publisher(target, Along(None), stop)).write(
            {"kind": "refused", "text": text, "unconfirmed": lost}
        )


def _listen(source: TextIO, publisher: Publisher) -> None:
    with suppress(ValueError, OSError):
        for line in iter(source.readline, ""):
            if line.strip() == "alive":
                publisher.last_alive = time.monotonic()
            elif line.strip() == "stop":
                publisher.order_stop(STOP_BUTTON)
    publisher.order_stop(SERVER_GONE)


def _recorded(job: dict[str, Any], publisher: Publisher, stop: threading.Event) -> RunResult:
    with _named(job["rig"]) as rig:
        opened, configuration = open_sources(rig["sensor"], rig["sensor_page"], rig["axis"], None)
        limit, source = force_limit(rig["force_limit_n"], configuration, rig["axial"], rig["axis"])
        settings = Settings(
            force_limit=limit,
            limit_source=source,
            max_force_gap=rig["max_force_gap_s"],
            bias_time=rig["bias_s"],
            axial=rig["axial"],
            filter_length=rig["filter_length"],
            steady=rig["steady_n"],
            frozen_check=rig["frozen_check"],
        )
        moves = _moves(job["motion"])
        force, axis = opened()
        if stop.is_set():
            raise KeyboardInterrupt
        publisher.write(
            {"kind": "opened", **_declared(axis, moves), "force_limit": limit, "force_limit_source": source}
        )
        card = {"needle": rig["needle"], "tissue": rig["tissue"], "rig": rig["words"]}
        return record_run(
            Path(job["file"]), force, axis, moves, card=card, settings=settings, stop=stop, feed=publisher.feed
        )


@contextmanager
def _named(rig: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """The rig as ``needleforce record`` names it; a virtual one runs in this process meanwhile."""
    if rig["sensor"] is not None:
        yield rig
        return
    model: Model | None = None if rig["preset"] is None else preset(rig["preset"])
    with VirtualRig(model, rig["seed"], sensor=Sensor(rig["filter_length"])) as virtual:
        page = f"http://{HERE}:{virtual.page_port}/{PAGE}"
        yield rig | {
            "sensor": f"{HERE}:{virtual.sensor_port}",
            "sensor_page": page,
            "axis": f"{HERE}:{virtual.axis_port}",
        }


def _moves(motion: dict[str, float] | None) -> list[tuple[float, float]]:
    """To the start, insertion, hold, withdrawal, as ``needleforce record`` moves; none without a motion."""
    if motion is None:
        return []
    start, depth, speed, hold = (motion[name] for name in ("start", "depth", "speed", "hold"))
    within("speed", speed, 1e-6, 1.0, "m/s", next_step="Give a speed in mm/s.")
    within("hold", hold, 0.0, 3600.0, "s", next_step="Give a shorter hold.")
    within("start", start, -1.0, 1.0, "m", next_step="Give where the tip is free, such as −5 mm.")
    if not start < depth < 1.0:
        step = "Give a greater depth, or another start."
        raise InputError(
            "depth", f"{1e3 * depth:g} mm", f"must be greater than the start, {1e3 * start:g} mm", "", step
        )
    return [(start, speed), (depth, speed), (depth, hold), (start, speed)]


def _declared(axis: Any, moves: list) -> dict[str, Any]:
    """What the axis declares, and how far it may come after a stop from the speed of the moves."""
    if axis is None or axis.limits is None:
        return {"limits": None, "stop_distance": None}
    distance = stop_distance(axis.limits, moves[0][1]) if moves else None
    return {"limits": list(axis.limits[:3]), "stop_distance": distance}


def _words(facts: dict[str, Any]) -> str:
    """The facts of a mark in words; readings of six axes are for the file."""
    shown = {name: value for name, value in facts.items() if not isinstance(value, list)}
    return ", ".join(str(value) if name in _PLAIN else f"{name} {value}" for name, value in shown.items())


def _found(file: Path) -> dict[str, Any]:
    """The events that a whole recording shows, as ``segment`` finds them."""
    try:
        events = segment(read(file))
    except InputError as error:
        return {"events": [], "status": str(error)}
    kinds = [("contact", events.contact), *(("puncture", each) for each in events.punctures), ("exit", events.exit)]
    found = [{"kind": kind, "time": e.time, "depth": e.depth, "force": e.force} for kind, e in kinds if e is not None]
    return {"events": found, "status": str(events.status)}


def _outcome(result: RunResult, why: str) -> dict[str, Any]:
    kept = ("detail", "seconds", "received", "lost", "duplicated", "late", "dropped", "unwritten", "peak_force")
    complete = result.ended in (EndReason.DONE, EndReason.INTERRUPTED)
    return {name: getattr(result, name) for name in kept} | {
        "ended": str(result.ended),
        "complete": complete,
        "why": why,
        "confirmed": result.rest_confirmed,
        "stop": None if result.stop is None or math.isnan(result.stop.depth) else str(result.stop),
    }


if __name__ == "__main__":
    main(sys.stdin, sys.stdout)
