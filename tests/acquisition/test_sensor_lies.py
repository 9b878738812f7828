# SPDX-License-Identifier: Apache-2.0
"""Sensors that lie while a needle moves: frozen, faulty, repeated, late or oversized readings, absurd ratings.

The true depth is that of the fake axis, which no lie changes. The bounds are those of docs/evidence/safety_case.md.
"""

import dataclasses
import random
import re

import numpy as np
import pytest
from fake_rig import BIAS, CONFIGURATION, FAR, GAP, SPEED, STIFFNESS, FakeAxis, FakeSensor, counts

from needleforce import InputError
from needleforce.acquisition.recorder import record_run
from needleforce.acquisition.settings import Settings
from needleforce.acquisition.sources import net_ft_sensor
from needleforce.acquisition.sources.axis import AxisClient
from needleforce.acquisition.sources.net_ft_sensor import SensorClient
from needleforce.acquisition.sources.opening import force_limit
from needleforce.acquisition.sources.reading_checks import QuietCheck, ScaleCheck


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


NOISE = np.array([2e-3] * 3 + [3e-5] * 3)
CHANGED_AT = 2e-3  # [m] of depth, where the force is 1 N


def changing(axis, true_of, changed):
    """A sensor with noise on all axes, and a lateral force; from ``CHANGED_AT`` on, what it sends is ``changed``."""
    draw = np.random.default_rng(3)

    def packets(sensor, k):
        force = STIFFNESS * max(0.0, axis.depth)
        true_of.append(force)
        true = np.array(BIAS) + force * np.array([0.03, -0.02, 1.0, 2e-4, 3e-4, 0.0])
        noise = NOISE * draw.standard_normal(6)
        sent = changed(true, noise) if axis.depth > CHANGED_AT else true + noise
        return [sensor.packet(k)._replace(counts=counts(sent))]

    return FakeSensor(packets=packets)


@pytest.mark.parametrize(
    "changed, words, seconds",
    [
        (lambda true, noise: 0.1 * (true + noise), "scale changed|zero moved", 0.15),
        (lambda true, noise: true * [0.5, 0.5, 0.9, 0.5, 0.5, 0.5] + noise, "scale changed", 0.2),
        (lambda true, noise: np.array(BIAS) + 0.3 * noise, "its noise fell", 1.5),
        (lambda true, noise: true + noise - [0, 0, 3.0, 0, 0, 0], "its zero moved", 0.15),
    ],
    ids=["scale with its noise", "scale without its noise", "noise", "zero"],
)
def test_a_sensor_that_changes_stops_the_needle_before_the_limit_is_far(recorded, changed, words, seconds):
    true, speed = [], 5e-3
    with FakeAxis() as axis, changing(axis, true, changed) as sensor:
        outcome, log = recorded(sensor, axis, [(0.05, speed)], force_limit=8.0, bias_time=0.5, silence=1.0)
    assert outcome.ended == "sensor fault" and re.search(words, outcome.detail) and log.complete
    assert max(true) < STIFFNESS * (CHANGED_AT + speed * seconds + outcome.stop.allowed)


def test_a_sensor_that_does_not_change_reaches_the_limit(recorded):
    with FakeAxis() as axis, changing(axis, [], lambda true, noise: true + noise) as sensor:
        outcome, _ = recorded(sensor, axis, FAR, force_limit=4.0, bias_time=0.5)
    assert outcome.ended == "force limit"


@pytest.mark.parametrize("length", [1, 10, 50])
def test_only_a_sensor_that_loses_its_scale_is_quiet(length):
    """Behind an average filter too, on an own ramp with a rupture, of 100 000 readings."""
    average = np.full(length, 1.0 / length)
    for seed in range(3):
        draw, place = np.random.default_rng(seed), np.linspace(0.0, 10.0, 100_000)
        noise = np.convolve(draw.normal(0.0, 2e-3, len(place) + length - 1), average, "valid")
        check = QuietCheck()
        check.learn(noise[:500])
        force = np.where(place < 6.0, 0.1 * place**2, 1.0) + noise
        assert not any(map(check.add, force[500:].tolist()))
        assert any(map(check.add, (1.0 + 0.3 * noise[: 2 * check.readings]).tolist()))
        assert check.readings < 4000


def scales(bias, force, scale, seed):
    """Factors that a check sees in readings (6, 4000) at 500 Hz: a rest, an insertion with ruptures of all axes at
    random, and at last the sensor at a ``scale``, its noise as before."""
    draw = np.random.default_rng([770, seed])
    across = force * draw.normal(size=(6, 4))[:, np.repeat(range(4), 1000)] * np.tile(np.linspace(0.0, 1.0, 1000), 4)
    across[:, :500] = 0.0
    true = (across + bias[:, None]) * np.where(np.arange(4000) < 3700, 1.0, scale)
    readings = (true + NOISE[:, None] * draw.standard_normal(true.shape)).T
    check = ScaleCheck()
    check.learn(readings[:500])
    return [found for wrench in readings[500:] if (found := check.add(wrench)) < 1.0]


def test_forces_of_all_axes_are_no_change_of_the_scale(many):
    """Less than once in a thousand insertions; a scale between 0.1 and 0.7 is seen where all axes have a bias."""
    bias = np.array([1.0, -0.8, 2.0, 0.05, -0.04, 0.03])
    force = np.array([0.3, 0.3, 1.0, 0.02, 0.02, 0.01])[:, None]
    seeds = range(many(20, 400))
    assert not any(scales(bias * (1.0 + 0.5 * np.sin(seed)), 0.2 * (seed % 20) * force, 1.0, seed) for seed in seeds)
    for scale in (0.1, 0.4, 0.7):
        found = scales(bias, 0.1 * force, scale, 1)
        assert found and found[0] == pytest.approx(scale, abs=0.03)


def test_a_page_that_changes_in_the_run_stops_the_needle(tmp_path, monkeypatch):
    page = tmp_path / "page.xml"
    page.write_bytes(CONFIGURATION.xml())
    monkeypatch.setattr(net_ft_sensor, "_PAGE_INTERVAL_S", 0.05)
    with FakeAxis() as axis:

        def packets(sensor, k):
            if k == 200:
                page.write_bytes(dataclasses.replace(CONFIGURATION, counts_per_force=1e4).xml())
            return [sensor.packet(k)]

        with FakeSensor(packets=packets) as sensor:
            force = SensorClient("127.0.0.1", sensor.port, CONFIGURATION, str(page))
            moved = AxisClient("127.0.0.1", axis.port, timeout=5.0)
            settings = Settings(force_limit=5.0, bias_time=0.1)
            outcome = record_run(tmp_path / "run.mcap", force, moved, FAR, {}, settings)
    assert outcome.ended == "sensor fault" and outcome.rest_confirmed
    assert "counts_per_force 1000.0 is now 10000.0" in outcome.detail
    assert axis.depth < 0.049


def test_a_lateral_axis_that_freezes_is_noted_and_stops_nothing(recorded):
    draw = random.Random(1)

    def packets(sensor, k):
        packet = sensor.packet(k)
        across = [each + draw.randrange(-3, 4) for each in packet.counts]
        return [packet._replace(counts=(across[0] if k < 150 else 500, across[1], packet.counts[2], *across[3:]))]

    with FakeAxis() as axis, FakeSensor(packets=packets) as sensor:
        outcome, log = recorded(sensor, axis, [(0.005, 0.01)])
    assert outcome.ended == "done" and outcome.frozen_axes == ("fx",)
    assert [mark.facts["axis"] for mark in log.marks if mark.kind == "frozen"] == ["fx"]
