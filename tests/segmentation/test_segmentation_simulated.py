# SPDX-License-Identifier: Apache-2.0
"""Insertions in closed form: contact, puncture and exit are known."""

import numpy as np
import pytest
from closed_form import CONTACT, CUTTING, FRICTION, PEAK, PUNCTURE, joined, paper_insertion, part

from needleforce.segmentation import segment

SLOPE = 2 * PEAK / (PUNCTURE - CONTACT)  # [N/m] just before the puncture: for the error by half the filter's delay
DROP = PEAK - FRICTION * (PUNCTURE - CONTACT) - CUTTING


def crossing(run, depth):
    """The last sample before ``depth`` in the insertion stroke."""
    return int(np.argmax(run.depth > depth)) - 1


def check_order(run, events):
    """The spans follow each other over the whole recording without gap."""
    assert events.phases[0].first == 0 and events.phases[-1].last == len(run)
    assert all(a.last == b.first for a, b in zip(events.phases, events.phases[1:], strict=False))


@pytest.mark.parametrize("speed", [1e-3, 3e-3])
@pytest.mark.parametrize("length", [1, 10, 50])
@pytest.mark.parametrize("noise", [0.2e-3, 1e-3, 3e-3, 5e-3])
def test_events_agree_with_the_closed_form(speed, length, noise):
    """Contact: 0.2 mm at the noise of a good sensor, 0.4 mm at 5 mN where the first 0.5 mm are below the noise."""
    run = paper_insertion(speed=speed, noise=noise, length=length)
    events = segment(run)
    smear = speed * (length - 1) / run.rate
    assert events.status == "ok" and len(events.punctures) == 1
    assert events.contact.depth == pytest.approx(CONTACT, abs=smear + (0.2e-3 if noise < 3e-3 else 0.4e-3))
    assert events.contact.low <= crossing(run, CONTACT) <= events.contact.high
    puncture, true = events.punctures[0], crossing(run, PUNCTURE)
    assert puncture.depth == pytest.approx(PUNCTURE, abs=0.05e-3 + smear)
    assert puncture.low <= true <= puncture.high
    assert puncture.force == pytest.approx(PEAK, abs=1e-3 + 0.5 * smear * SLOPE + 2 * noise)
    assert puncture.drop == pytest.approx(DROP, abs=1e-3 + smear * (0.5 * SLOPE + FRICTION) + 2 * noise)
    assert puncture.indentation == pytest.approx(puncture.depth - events.contact.depth)
    assert events.exit.depth == pytest.approx(CONTACT, abs=smear + 0.4e-3)
    assert [span.phase for span in events.phases] == [
        "free", "deformation", "insertion", "hold", "extraction", "free",
    ]  # fmt: skip
    check_order(run, events)


def test_the_interval_contains_contact_and_puncture_for_many_seeds():
    """3 sd on the early side and 5 sd on the late one: none of 50 seeds may fail."""
    for seed in range(50):
        run = paper_insertion(speed=3e-3, noise=3e-3, seed=seed)
        events = segment(run)
        assert len(events.punctures) == 1
        assert events.contact.low <= crossing(run, CONTACT) <= events.contact.high
        assert events.punctures[0].low <= crossing(run, PUNCTURE) <= events.punctures[0].high


@pytest.mark.parametrize(
    ("rate", "speed"),
    [(60, 0.5e-3), (60, 3e-3), (100, 2e-3), (1000, 0.5e-3), (1000, 50e-3), (10_000, 0.5e-3), (10_000, 50e-3)],
)
def test_rates_and_speeds(rate, speed):
    run = paper_insertion(rate=float(rate), speed=speed)
    events = segment(run)
    step = speed / rate
    assert events.status == "ok" and len(events.punctures) == 1
    assert events.contact.depth == pytest.approx(CONTACT, abs=0.2e-3 + step)
    assert events.punctures[0].depth == pytest.approx(PUNCTURE, abs=0.05e-3 + step)


@pytest.mark.parametrize("scale", [0.25, 50.0])
def test_small_and_large_forces(scale):
    events = segment(paper_insertion(scale=scale, noise=1e-3))
    assert events.punctures[0].depth == pytest.approx(PUNCTURE, abs=0.05e-3)
    assert events.punctures[0].force == pytest.approx(scale * PEAK, abs=5e-3)


@pytest.mark.parametrize("drift", [-20e-3, 20e-3])
@pytest.mark.parametrize("withdraw", [True, False])
def test_a_slow_drift_is_not_a_contact(drift, withdraw):
    """10 % of the peak over the recording; without a withdrawal the drift is not identifiable."""
    run = paper_insertion(withdraw=withdraw, extra=lambda t, z: drift * t / t[-1])
    assert segment(run).contact.depth == pytest.approx(CONTACT, abs=0.2e-3 if withdraw else 0.4e-3)
    if withdraw:
        assert segment(paper_insertion(scale=0.0, extra=lambda t, z: drift * t / t[-1])).status == "no_contact"


@pytest.mark.parametrize("period", [0.5e-3, 1e-3, 2e-3])
def test_an_oscillating_stage_is_not_a_contact(period):
    """5 mN, as measured on stages, with a peak of 0.2 N: the contact is less certain, and its bounds show it."""
    run = paper_insertion(extra=lambda t, z: 5e-3 * np.sin(2 * np.pi * z / period))
    events = segment(run)
    assert len(events.punctures) == 1
    assert events.contact.low <= crossing(run, CONTACT) <= events.contact.high
    assert events.contact.depth == pytest.approx(CONTACT, abs=0.7e-3)


@pytest.mark.parametrize("length", [1, 50])
def test_a_blank_has_no_contact(length):
    for seed in range(100):
        events = segment(paper_insertion(scale=0.0, noise=5e-3, length=length, seed=seed))
        assert (events.status, events.contact, events.punctures, events.exit) == ("no_contact", None, (), None)
        assert [span.phase for span in events.phases] == ["free"] and events.notes


@pytest.mark.parametrize("hold", [0.0, 0.1, 2.0])
def test_one_stroke_is_incomplete_keeps_its_events_and_has_no_withdrawal(hold):
    events = segment(paper_insertion(withdraw=False, hold=hold))
    assert events.status == "incomplete" and events.exit is None and len(events.punctures) == 1
    assert [span.phase for span in events.phases] == ["free", "deformation", "insertion"] + ["hold"] * (hold > 0.0)


def test_without_hold_there_is_no_hold():
    assert not segment(paper_insertion(hold=0.0)).spans("hold")


def second_pass(seed=2):
    """Only friction, for a needle that follows its own hole."""
    run = paper_insertion(seed=seed, scale=0.0)
    moving = np.sign(np.diff(run.depth, append=run.depth[-1]))
    run.force[:] += FRICTION * np.maximum(run.depth - CONTACT, 0.0) * np.where(moving < 0, -1.0, 1.0)
    return run


def test_a_second_pass_has_contact_and_exit_and_no_puncture():
    events = segment(second_pass())
    assert events.status == "no_puncture" and not events.punctures
    assert events.contact.depth == pytest.approx(CONTACT, abs=0.1e-3)
    assert events.exit.depth == pytest.approx(CONTACT, abs=0.1e-3)


def test_two_passes_in_one_recording():
    run = joined([paper_insertion(), second_pass()])
    first, second = segment(run), segment(run, cycle=1)
    assert first.status == "ok" and second.status == "no_puncture" and "2 insertions" in first.notes[0]
    assert second.contact.time > first.exit.time and first.phases == second.phases
    assert [len(first.spans(each)) for each in ("deformation", "insertion", "extraction")] == [1, 2, 2]
    check_order(run, first)


@pytest.mark.parametrize(
    ("ends", "status", "punctures"),
    [
        ((0, 1, 2, 3, 7, 50, 199, 300, 5200), "no_contact", 0),
        ((8000, 8300, 8440), "incomplete", 0),
        ((9000, 20_200, 21_000, 22_000, 30_000, 36_000), "incomplete", 1),
        ((37_000, 40_000), "ok", 1),
    ],
)
def test_a_truncated_recording_keeps_its_events(ends, status, punctures):
    for end in ends:
        run = part(paper_insertion(), 0, end)
        events = segment(run)
        assert (events.status, len(events.punctures)) == (status, punctures)
        assert end == 0 or check_order(run, events) is None


def test_values_that_are_not_finite_and_depths_that_do_not_move():
    run = paper_insertion()
    run.force[100] = np.nan
    assert segment(run).status == "unreadable"
    still = paper_insertion()
    still.depth[:] = 0.0
    assert segment(still).status == "no_contact" and segment(still).notes
