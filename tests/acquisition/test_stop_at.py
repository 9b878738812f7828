# SPDX-License-Identifier: Apache-2.0
"""An axis that stops at an event: at the puncture of a layer, at a fall of the force, and what is not that event."""

import json

import pytest
from fake_rig import CONFIGURATION, FakeAxis, FakeSensor
from typer.testing import CliRunner

from needleforce import InputError
from needleforce.acquisition.stop_at import DepthNow, StopAt, parse_stop
from needleforce.cli import app
from needleforce.core import EventSettings
from needleforce.wire.axis_lines import AxisRange, AxisState

INSERTION = [(0.02, 0.01)]  # [m], [m/s]
FIRST, SECOND = 3e-3, 6e-3  # depths of the two punctures [m]


def layers(depth):
    """500 N/m to each puncture, at which two thirds of the force are lost."""
    if depth < FIRST:
        return 500.0 * max(depth, 0.0)
    return 0.5 + 500.0 * (depth - FIRST) if depth < SECOND else 0.6


@pytest.mark.parametrize(
    "stop_at, depth, words",
    [
        (StopAt(), FIRST, "puncture 1 at "),
        (StopAt(layer=2), SECOND, "puncture 2 at "),
        (StopAt(force_rate=20.0), FIRST, "the force fell by"),
    ],
)
def test_the_axis_stops_at_the_event_within_the_stated_distance(recorded, stop_at, depth, words):
    with FakeAxis() as axis, FakeSensor(lambda t: layers(axis.depth)) as sensor:
        outcome, log = recorded(sensor, axis, INSERTION, stop_at=stop_at)
        assert axis.received[-1] == "stop" and axis.target is None
        limits = AxisRange(*axis.limits)
    assert outcome.ended == "event" and outcome.rest_confirmed and words in outcome.detail
    assert 0.0 < outcome.past_event <= stop_at.farthest(limits, 0.01)
    assert depth <= axis.depth < depth + stop_at.farthest(limits, 0.01)
    (mark,) = [mark for mark in log.marks if mark.kind == "event"]
    assert mark.facts["depth"] == pytest.approx(depth, abs=2e-4)  # 10 mm/s: readings and states every 2 and 5 ms


@pytest.mark.parametrize("limit, ended", [(5.0, "done"), (0.7, "force limit")])
def test_an_event_that_does_not_come_is_reported_and_the_force_limit_still_holds(recorded, limit, ended):
    stop_at = StopAt(settings=EventSettings(fall=3.0))
    with FakeAxis() as axis, FakeSensor(lambda t: layers(axis.depth)) as sensor:
        moves = [(8e-3, 0.01), (-2e-3, 0.02)]
        outcome, _ = recorded(sensor, axis, moves, stop_at=stop_at, force_limit=limit)
    assert outcome.ended == ended and outcome.past_event is None
    assert outcome.detail.startswith("0 punctures were found") == (ended == "done")


def test_a_push_that_ends_by_a_stop_or_a_withdrawal_is_no_puncture(recorded):
    moves = [(2.5e-3, 0.01), (2.5e-3, 0.3), (-2e-3, 0.02)]
    with FakeAxis() as axis, FakeSensor(lambda t: layers(axis.depth)) as sensor:
        outcome, _ = recorded(sensor, axis, moves, stop_at=StopAt())
    assert outcome.ended == "done"


@pytest.mark.usefixtures("simulated_time")
def test_a_rig_is_watched_moved_and_stopped_at_the_second_layer(tmp_path):
    (tmp_path / "page.xml").write_bytes(CONFIGURATION.xml())
    with FakeAxis() as axis, FakeSensor(lambda t: layers(axis.depth)) as sensor:
        where = ["--sensor", f"127.0.0.1:{sensor.port}", "--sensor-page", tmp_path / "page.xml"]
        where += ["--axis", f"127.0.0.1:{axis.port}"]
        moved = [
            "--depth-mm",
            "20",
            "--start-mm",
            "-2",
            "--speed-mm-s",
            "10",
            "--stop-at",
            "layer=2",
            "--bias-s",
            "0.2",
        ]
        done = CliRunner().invoke(app, ["watch", "rig", *map(str, [*where, *moved]), "--json", "-", "--plain"])
    assert done.exit_code == 0, done.output
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    events = [each["event"] for each in lines if each["kind"] == "event"]
    assert [each for each in events if each in ("contact", "puncture")] == ["contact", "puncture", "puncture"]
    assert SECOND <= axis.depth < SECOND + 1e-3
    assert "event: puncture 2" in done.stderr and "mm past the peak of a puncture" in done.stderr


def test_the_depth_between_two_states_follows_the_velocity_and_never_steps_back():
    course = DepthNow()
    assert course.at(0.0) is None
    course.add(1.0, AxisState(1, 0.0, 1e-3, 2e-3, "moving"))
    assert course.at(1.010) == pytest.approx(1.02e-3)
    course.add(1.012, AxisState(2, 0.0, 1.015e-3, 2e-3, "moving"))  # slower than was expected
    assert course.at(1.013) == pytest.approx(1.02e-3)
    assert course.at(1.020) == pytest.approx(1.031e-3)
    assert course.at(9.0) == pytest.approx(1.215e-3)  # 0.1 s ahead, and no farther
    course.add(9.0, AxisState(3, 0.0, 0.9e-3, -2e-3, "moving"))
    assert course.at(9.0) == pytest.approx(0.9e-3)


def test_the_stated_distance_is_that_of_the_fall_and_of_the_stop():
    limits = AxisRange(-0.02, 0.06, 1.0, 1.0, 2.0)
    v = 1.05 * 0.01  # an axis may be so much faster
    stop = 0.1 * v + v**2 / 4.0 + 0.25e-3
    assert StopAt().farthest(limits, 0.01) == pytest.approx(0.1 * v + stop)
    assert StopAt(force_rate=20.0).farthest(limits, 0.01) == pytest.approx(0.01 * v + stop)


@pytest.mark.parametrize("text", ["", "punctures", "puncture=1", "layer", "layer=0", "layer=1.5", "force-rate=-1"])
def test_what_is_no_event_is_refused_with_examples(text):
    with pytest.raises(InputError, match="layer=2"):
        parse_stop(text, EventSettings())


def test_words_of_events_are_read():
    settings = EventSettings(fall=0.5)
    assert parse_stop("puncture", settings).layer == 1
    assert parse_stop("layer=3", settings).settings.fall == 0.5
    assert parse_stop("force-rate=12.5", settings).force_rate == 12.5
