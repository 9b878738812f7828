# SPDX-License-Identifier: Apache-2.0
"""Sensors that lie while a needle moves: frozen, faulty, repeated, late or oversized readings, absurd ratings.

The true depth is that of the fake axis, which no lie changes. The bounds are those of docs/evidence/safety_case.md.
"""

import random

import pytest
from fake_rig import CONFIGURATION, FAR, GAP, SPEED, STIFFNESS, FakeAxis, FakeSensor

from needleforce import InputError
from needleforce.commands.record import force_limit


def frozen_sequence(sensor, k):
    return [sensor.packet(min(k, 200))]


def random_counters(sensor, k):
    packet = sensor.packet(k)
    return [packet if k < 200 else packet._replace(sequence=random.getrandbits(32), sample=random.getrandbits(32))]


def frozen_values(sensor, k):
    return [sensor.packet(k)._replace(counts=sensor.packet(min(k, 200)).counts)]


def faulty(sensor, k):
    return [sensor.packet(k)._replace(status=(1 << 20 | 1 << 31) * (k > 200))]


def doubled(sensor, k):
    return [sensor.packet(k if k < 200 else 199 + (k & 1))]


def two_buffers(sensor, k):
    return [sensor.packet(k)._replace(counts=sensor.packet(k if k < 200 else 199 + (k & 1)).counts)]


def axial_frozen(sensor, k):
    packet = sensor.packet(k)
    return [
        packet._replace(counts=(k % 7, *packet.counts[1:2], 2001 if k > 200 else packet.counts[2], *packet.counts[3:]))
    ]


def restarted(sensor, k):
    return [sensor.packet(k if k < 200 else k + 5_000_000)]


@pytest.mark.parametrize(
    "lie", [frozen_sequence, random_counters, frozen_values, two_buffers, axial_frozen, faulty, doubled, restarted]
)
def test_motion_ends_without_usable_force(recorded, lie):
    with FakeAxis() as axis:
        reached = []

        def packets(sensor, k):
            reached.extend([axis.depth] * (k == 200))
            return lie(sensor, k)

        with FakeSensor(packets=packets) as sensor:
            outcome, log = recorded(sensor, axis, FAR, silence=1.0)
    assert outcome.ended == "sensor fault" and outcome.rest_confirmed and log.complete
    assert axis.depth - reached[0] < SPEED * (GAP + 0.1) + outcome.stop.allowed


def test_datagrams_longer_than_any_sensor_sends_are_not_read(recorded):
    def packets(sensor, k):
        return [sensor.packet(k), bytes(36 * 1800)] if k % 2 else [sensor.packet(k)]

    with FakeAxis() as axis:
        with FakeSensor(lambda t: max(0.0, STIFFNESS * axis.depth), packets=packets) as sensor:
            outcome, log = recorded(sensor, axis, FAR, force_limit=1.0)
    assert outcome.ended == "force limit" and outcome.lost == 0
    assert sum(mark.facts["count"] for mark in log.marks if mark.kind == "wrong_size") > 10
    assert axis.depth < 1.0 / STIFFNESS + outcome.stop.allowed + SPEED * 0.1


LIMITED = {"counts_per_force": 1e6, "ratings": (12.0, 12.0, 17.0, 0.0, 0.0, 0.0)}


@pytest.mark.parametrize(
    "given, page_values, words",
    [
        (None, {"ratings": (0.0, 0.0, 1e8, 0.0, 0.0, 0.0)}, "its counts end at"),
        (None, {"counts_per_force": 1.0, "ratings": (0.0, 0.0, 1e8, 0.0, 0.0, 0.0)}, "which no needle needs"),
        (None, {"ratings": (0.0,) * 6}, "no rated range"),
        (40.0, {}, "the sensor measures up to 17 N"),
        (float("inf"), {}, "the sensor measures up to 17 N"),
        (float("inf"), {"ratings": (0.0,) * 6}, "no needle needs more"),
        (float("nan"), {}, "the sensor measures up to 17 N"),
    ],
)
def test_a_limit_that_cannot_protect_is_refused(given, page_values, words):
    configuration = CONFIGURATION.__class__(**(LIMITED | {"counts_per_torque": 1e6, "rate": 1e3} | page_values))
    with pytest.raises(InputError, match=words):
        force_limit(given, configuration, "-fz", "127.0.0.1")


def test_the_default_limit_names_its_source():
    configuration = CONFIGURATION.__class__(**(LIMITED | {"counts_per_torque": 1e6, "rate": 1e3}))
    limit, text = force_limit(None, configuration, "fz", "127.0.0.1")
    assert limit == pytest.approx(13.6) and text == "0.8 of the rated range on the sensor's page"
    assert force_limit(3.0, configuration, "fz", "127.0.0.1") == (3.0, "given")


def test_a_stream_that_gets_later_and_later_ends_the_motion(recorded):
    """Counters fresh, order kept, nothing lost: the network only delays more and more, by half of the time."""
    kept, sent = [], []

    def packets(sensor, k):
        kept.append(sensor.packet(k))
        due = k if k < 250 else 250 + (k - 250) // 2
        released = kept[len(sent) : due]
        sent.extend(released)
        return released

    with FakeAxis() as axis:
        with FakeSensor(lambda t: max(0.0, STIFFNESS * axis.depth), packets=packets) as sensor:
            outcome, _ = recorded(sensor, axis, [(0.05, 0.01)], force_limit=4.0)
    assert outcome.ended == "sensor fault" and "late" in outcome.detail
    assert axis.depth < 0.02


def test_a_sensor_that_never_changes_is_refused_unless_that_is_wanted(recorded):
    constant = lambda sensor, k: [sensor.packet(k)._replace(counts=(0, 0, 2000, 0, 0, 0))]  # noqa: E731
    with FakeSensor(packets=constant) as sensor, FakeAxis() as axis:
        with pytest.raises(InputError, match="--no-frozen-check"):
            recorded(sensor, axis, FAR)
    with FakeSensor(packets=constant) as sensor, FakeAxis() as axis:
        outcome, _ = recorded(sensor, axis, [(0.002, 0.02)], frozen_check=False)
    assert outcome.ended == "done"


def test_without_a_usable_reading_no_move_is_made(recorded):
    faulty_always = FakeSensor(status=lambda k: 1 << 20 | 1 << 31)
    with faulty_always as sensor, FakeAxis() as axis:
        axis.depth = 0.03
        with pytest.raises(InputError):
            recorded(sensor, axis, [(-0.015, 0.05), (0.03, 0.01)])
    assert axis.depth > 0.03 - 0.05 * 0.15


def test_the_force_is_watched_while_the_needle_is_withdrawn_before_the_bias(recorded):
    with FakeAxis() as axis:
        axis.depth = 0.05
        with FakeSensor(lambda t: 1000.0 * (0.05 - axis.depth)) as sensor:
            with pytest.raises(InputError, match="force limit"):
                recorded(sensor, axis, [(-0.015, 0.02), (0.03, 0.01)], force_limit=3.0)
    assert 0.05 - axis.depth < 3e-3 + SPEED * 0.1 + 0.5e-3
