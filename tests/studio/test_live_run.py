# SPDX-License-Identifier: Apache-2.0
"""A run of the live view on a clock of its own: every reading is in a line, drawn or counted, and the events are
the recorder's; and a page that is slow."""

import io
import json
import time

import numpy as np
import pytest
from simulated_time import SimulatedTime

import needleforce as nf
from needleforce.recording.log import read_log
from needleforce.studio import live_run
from needleforce.studio.live import _VIRTUAL, KEPT_EVENTS, WAITING_POINTS, Watcher

MOTION = {"start": -4e-3, "depth": 6e-3, "speed": 10e-3, "hold": 0.1}


class Server:
    """What the process reads of the server: the job, then ``alive`` for a time, then the end."""

    def __init__(self, job, after):
        self.lines, self.after, self.begun = [json.dumps(job)], after, time.monotonic()

    def readline(self):
        if self.lines:
            return self.lines.pop()
        time.sleep(0.4)
        return "alive\n" if time.monotonic() - self.begun < self.after else ""


def made(tmp_path, motion=MOTION, after=1e9, model="paper"):
    """The lines of a run of the virtual rig, and its file."""
    file = tmp_path / "run.mcap"
    rig = _VIRTUAL | {"preset": "paper", "seed": 1, "words": "virtual"}
    job = {"file": str(file), "rig": rig, "motion": motion, "model": model, "surface": 0.0}
    target = io.StringIO()
    live_run.main(Server(job, after), target)
    return [json.loads(line) for line in target.getvalue().splitlines()], file


@pytest.fixture
def simulated_time():
    with SimulatedTime() as clock:
        yield clock


def of(lines, kind):
    return [line for line in lines if line["kind"] == kind]


@pytest.mark.usefixtures("simulated_time")
@pytest.mark.parametrize(
    "speed, seconds", [(10e-3, 4.0), pytest.param(0.7e-3, 30.0, marks=pytest.mark.long)], ids=["quick", "30 s"]
)
def test_every_reading_and_event_of_the_virtual_rig_is_in_the_lines(tmp_path, speed, seconds):
    lines, file = made(tmp_path, MOTION | {"speed": speed})
    (end,), points = of(lines, "end"), of(lines, "points")
    log = read_log(file)
    assert end["ended"] == "done" and end["confirmed"] and end["seconds"] > 0.9 * seconds
    assert sum(line["readings"] for line in points) == end["received"] == len(log.wrench)
    drawn = np.array([point for line in points for point in line["points"]], float)
    assert len(drawn) > end["received"] - 300  # only the first line, with the time of the bias, has too many
    events = [event for line in points for event in line["events"]]
    assert [event["kind"] for event in events] == [mark.kind for mark in log.marks]
    phases = [event["text"] for event in events if event["kind"] == "phase"]
    assert phases == [mark.facts["name"] for mark in log.marks if mark.kind == "phase"] and phases[-1] == "extraction"
    # what is drawn is what the file has: the same force, and depths and times to what the clocks are known to
    recording = nf.read(file)
    force = np.interp(drawn[:, 0], recording.time, recording.force)
    assert np.percentile(np.abs(drawn[:, 2] - force), 95) < 5e-3
    # in the preset's own tissue its model predicts, but for noise and the sensor's filter of 10 ms
    assert np.percentile(np.abs(drawn[:, 3] - drawn[:, 2]), 95) < 10e-3
    found = nf.segment(recording)
    (shown,) = of(lines, "found")
    assert [each["kind"] for each in shown["events"]] == ["contact", "puncture", "exit"]
    assert shown["events"][1]["depth"] == pytest.approx(found.punctures[0].depth)


@pytest.mark.usefixtures("simulated_time")
def test_the_end_of_the_server_stops_the_axis(tmp_path):
    lines, file = made(tmp_path, MOTION | {"speed": 2e-3}, after=1.0, model=None)
    (end,) = of(lines, "end")
    assert (end["ended"], end["why"], end["confirmed"]) == ("interrupted", "the server ended", True)
    assert "at rest at" in end["stop"] and read_log(file).complete
    depth = of(lines, "points")[-1]["points"][-1][1]
    assert depth < 5.5e-3  # it was on its way to 6 mm


@pytest.mark.usefixtures("simulated_time")
@pytest.mark.parametrize(
    "change, text",
    [({"depth": 0.5}, "the axis moves from -0.03 to 0.07 m"), ({"speed": 0.5}, "the axis moves at up to 0.05 m/s"),
     ({"depth": -0.01}, "must be greater than the start"), ({"hold": -1.0}, "outside 0 to 3600 s")],
)  # fmt: skip
def test_a_motion_outside_the_limits_of_the_rig_is_refused(tmp_path, change, text):
    lines, file = made(tmp_path, MOTION | change)
    (refused,) = of(lines, "refused")
    assert text in refused["text"] and not refused["unconfirmed"] and not file.exists()


def test_a_slow_page_gets_the_extremes_and_every_reading_counted():
    watcher, force = Watcher(), np.sin(np.arange(50_000) * 0.013) + 1e-3 * (np.arange(50_000) * 7919 % 101)
    for start in range(0, len(force), 33):
        part = [(k * 1e-3, None, float(force[k]), None) for k in range(start, min(start + 33, len(force)))]
        watcher.add(part, len(part), [{"kind": "status"}], 0)
        assert len(watcher.points.points) <= WAITING_POINTS and len(watcher.events) <= KEPT_EVENTS
    sent, after = watcher.take(), watcher.take()
    kept = sent["points"]
    assert sent["readings"] == 50_000 and (after["points"], after["readings"]) == ([], 0)
    assert len(sent["events"]) + sent["events_left_out"] == 1516  # one for each 33 readings
    assert {min(p[2] for p in kept), max(p[2] for p in kept)} == {force.min(), force.max()}
    assert [p[0] for p in kept] == sorted(p[0] for p in kept)
