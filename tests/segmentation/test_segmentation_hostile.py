# SPDX-License-Identifier: Apache-2.0
"""Segmentation raises no error for any recording; only its options can be refused."""

import warnings

import numpy as np
import pytest
from closed_form import CONTACT, FRICTION, PEAK, PUNCTURE, paper_insertion, part, travel

import needleforce as nf
from needleforce.recording.recording import Recording
from needleforce.segmentation import segment


def noise_free(friction=FRICTION, depth=20e-3, rate=100.0, back=-1.0):
    """A cone up to the puncture, ``friction`` [N/m] after it, no noise; withdrawn to the depth ``back`` [m]."""
    z = travel(3e-3, depth, 0.5, True, rate, rest=0.3)
    time = np.arange(len(z)) / rate
    inside = np.maximum(z - CONTACT, 0.0)
    pierced, inwards = np.maximum.accumulate(z) > PUNCTURE, np.diff(z, append=z[-1]) >= 0
    force = np.where(pierced, friction * inside * np.where(inwards, 1, -1), PEAK * (inside / (PUNCTURE - CONTACT)) ** 2)
    complete = Recording(time, z, np.gradient(z, time), force)
    return part(complete, 0, len(z) - int(np.argmax(z[::-1] > back)))


def test_a_truncated_simulation_has_a_status():
    """510 of the truncated recordings end in the withdrawal; a sum of squares below zero once failed for 92 of them."""
    run = nf.simulate(nf.preset("physical"), nf.Motion.insert(-4e-3, 3e-3, 16e-3), 100.0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = [segment(part(run, 0, end)) for end in range(len(run) + 1)]
    assert found[-1].status == "ok" and found[-1].exit is not None
    assert {events.status for events in found} == {"no_contact", "incomplete", "ok"}


def test_a_needle_that_rests_while_the_force_rises():
    """The depth in the fit is constant: there is no division by its range."""
    z = np.r_[np.zeros(300), np.linspace(0, 1e-2, 100)]
    force = np.r_[np.zeros(100), np.linspace(0, 1, 300)]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        segment(Recording(np.arange(400) / 100.0, z, np.gradient(z), force))


@pytest.mark.parametrize("seed", range(40))
def test_random_recordings_raise_no_error(seed):
    random = np.random.default_rng(seed)
    count = int(random.integers(0, 400))
    time = np.cumsum(random.exponential(0.01, count) + 1e-6)
    depth, force = (np.cumsum(random.normal(0, size, count)) for size in (1e-4, 1e-2))
    depth[random.random(count) < 0.2] = 0.0
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        segment(Recording(time, np.round(depth, 3), np.zeros(count), np.round(force, int(random.integers(0, 5)))))


@pytest.mark.parametrize("time", [np.zeros(100), np.arange(100.0)[::-1]])
def test_a_time_that_does_not_increase_is_unreadable(time):
    events = segment(Recording(time, np.linspace(0, 0.01, 100), np.zeros(100), np.linspace(0, 1, 100)))
    assert events.status == "unreadable" and "time does not increase" in events.notes[0]


def test_a_complete_recording_without_friction_is_complete():
    """No tension shows the exit: that is noted, and the recording is not called incomplete."""
    for friction in (0.0, 1e-3):
        events = segment(noise_free(friction))
        assert events.status == "ok" and len(events.punctures) == 1
        assert not any("incomplete" in note for note in events.notes)
        if events.exit is None:
            assert "no tension" in events.notes[-1]
        else:
            assert events.exit.depth == pytest.approx(CONTACT, abs=0.5e-3)
    assert segment(noise_free(0.0)).exit is None


def test_a_withdrawal_that_ends_in_tissue_is_incomplete():
    events = segment(noise_free(0.0, back=CONTACT + 2e-3))
    assert events.status == "incomplete" and "ends below the contact depth" in events.notes[-1]


def test_a_force_that_does_not_return_to_its_baseline_is_incomplete():
    run = noise_free(0.0)
    run.force[len(run) // 2 :] = 0.5 * PEAK
    events = segment(run)
    assert events.status == "incomplete" and "not at its baseline" in events.notes[-1]


def test_a_spike_is_named_and_left_out():
    """It hid the contact, and was named as the reason."""
    run = paper_insertion(rate=100.0)
    without = segment(run)
    run.force[250] = 5000.0
    events = segment(run)
    assert events.status == "ok" and list(events.outliers) == [250] and "1 sample of the force" in events.notes[0]
    assert events.contact.depth == pytest.approx(without.contact.depth, abs=1e-5)
    assert [each.depth for each in events.punctures] == [each.depth for each in without.punctures]
    run.force[:] = 0.0
    assert "The force is constant" in segment(run).notes[0]


@pytest.mark.parametrize(
    "options",
    [{name: value} for name in ("crossing", "drop", "within") for value in (np.nan, -1.0, "x", None)]
    + [{"cycle": -3}, {"cycle": 1.5}, {"cycle": None}, {"within": np.inf}, {"drop": 2.0}],
)
def test_options_out_of_range_are_refused(options):
    (name,) = options
    with pytest.raises(nf.InputError, match=f"segment: {name} is"):
        segment(paper_insertion(rate=100.0), **options)
