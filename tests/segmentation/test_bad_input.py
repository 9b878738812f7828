# SPDX-License-Identifier: Apache-2.0
"""Recordings with something wrong: each is named, and nothing is silently wrong."""

import re

import numpy as np
import pytest
from closed_form import PUNCTURE, paper_insertion, part

import needleforce as nf
from needleforce.recording.recording import Recording

RUN = paper_insertion(noise=3e-3)
RATE = 1000.0


def changed(time=RUN.time, depth=RUN.depth, force=RUN.force):
    return Recording(time, depth, np.gradient(depth, time), force)


def noted(events, words):
    return any(words in note for note in events.notes)


def test_a_plain_recording_has_no_notes():
    assert not nf.segment(RUN).notes and nf.segment(RUN).status == "ok"


def test_a_short_withdrawal_to_the_air_ends_an_insertion():
    """It travels 6 % of the range, most of which is the approach."""
    legs = ((9e-3, 3e-3), (-0.5e-3, 3e-3), (9e-3, 3e-3), (-0.5e-3, 3e-3))
    run = nf.simulate(nf.preset("paper"), nf.Motion(-150e-3, legs, 0.05), 200.0)
    noise = np.random.default_rng(0).normal(0.0, 3e-3, len(run))
    events = nf.segment(Recording(run.time, run.depth, run.velocity, run.force + noise))
    assert noted(events, "2 insertions") and len(events.punctures) == 1


def test_withdrawn_only():
    events = nf.segment(part(RUN, int(np.argmax(RUN.depth)) + 500, len(RUN)))
    assert events.status == "no_contact" and noted(events, "withdrawn, and there is no insertion")


@pytest.mark.parametrize(("until", "rise"), [(8.2e-3, r"0\.1\d*"), (8.8e-3, r"0\.0[67]\d*")])
def test_a_depth_that_stands_while_the_force_rises(until, rise):
    """It is not updated, and jumps to where the motion leads; the needle may rupture the tissue meanwhile."""
    depth = RUN.depth.copy()
    inside = np.arange(len(depth)) < np.argmax(depth)
    depth[inside & (depth > 7e-3) & (depth < until)] = 7e-3
    events = nf.segment(changed(depth=depth))
    (note,) = (each for each in events.notes if "rises" in each)
    assert re.search(rf"rises by {rise} N while the depth stands at (6\.99|7)", note) and "not updated" in note
    assert [each.depth for each in events.punctures] == [pytest.approx(PUNCTURE, abs=0.03e-3)]


@pytest.mark.parametrize("relaxing", [0.0, 0.3])
def test_a_motor_that_stalls(relaxing):
    """The force may relax at the stop: that is no puncture."""
    at, count = int(np.argmax(RUN.depth > 7e-3)), 2000
    noise = np.random.default_rng(0).normal(0.0, 3e-3, count)
    level = np.mean(RUN.force[at - 20 : at]) * (1.0 - relaxing * (1.0 - np.exp(-np.arange(count) / RATE / 0.5)))
    depth = np.concatenate((RUN.depth[:at], np.full(count, RUN.depth[at]), RUN.depth[at:]))
    force = np.concatenate((RUN.force[:at], level + noise, RUN.force[at:]))
    events = nf.segment(changed(np.arange(len(depth)) / RATE, depth, force))
    assert noted(events, "stands for 2 s") or noted(events, "stands for 2.1 s")
    assert noted(events, "stalls") and [round(1e3 * (each.depth - PUNCTURE), 1) for each in events.punctures] == [0.0]


@pytest.mark.parametrize("quantum", [0.0, 1e-3])
def test_a_saturated_force(quantum):
    force = np.minimum(RUN.force, 0.17)
    events = nf.segment(changed(force=quantum * np.round(force / quantum) if quantum else force))
    assert noted(events, "may be saturated")


@pytest.mark.parametrize("drift", [-0.36, 0.36])
def test_a_sensor_that_drifts_by_its_peak(drift):
    events = nf.segment(changed(force=RUN.force + drift * RUN.time / RUN.time[-1]))
    assert noted(events, "the sensor drifts")
    assert [round(1e3 * (each.depth - PUNCTURE), 1) for each in events.punctures] == [0.0]


def test_samples_in_the_wrong_order():
    order = np.arange(len(RUN))
    order[3000:6000], order[6000:9000] = order[6000:9000].copy(), order[3000:6000].copy()
    sorted_later = changed(depth=RUN.depth[order], force=RUN.force[order])
    assert noted(nf.segment(sorted_later), "first at sample 3000: samples are missing or in the wrong order")
    unsorted = Recording(RUN.time[order], RUN.depth[order], RUN.velocity[order], RUN.force[order])
    assert nf.segment(unsorted).status == "unreadable" and noted(nf.segment(unsorted), "Sort the samples by time")
    mixed = np.random.default_rng(0).permutation(len(RUN))
    shuffled = nf.segment(changed(depth=RUN.depth[mixed], force=RUN.force[mixed]))
    assert shuffled.status == "unreadable" and noted(shuffled, "wrong order")


def test_a_recording_that_begins_in_contact():
    first = int(np.argmax(RUN.depth > 6.5e-3))
    events = nf.segment(part(RUN, first, len(RUN)))
    assert noted(events, "begins in contact") and events.baseline is None
    assert events.contact.low == 0 and [round(1e3 * (p.depth - PUNCTURE), 1) for p in events.punctures] == [0.0]
    assert not noted(events, "drifts.")


def test_no_puncture_has_all_phases():
    """Tissue that is not pierced, or gives way slowly: insertion, hold and withdrawal are there for a layered model."""
    run = paper_insertion(noise=3e-3, depth=7.5e-3)
    events = nf.segment(run)
    assert events.status == "no_puncture" and noted(events, "no puncture")
    assert [span.phase for span in events.phases] == ["free", "deformation", "hold", "extraction", "free"]
