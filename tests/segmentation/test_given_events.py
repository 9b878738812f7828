# SPDX-License-Identifier: Apache-2.0
"""Events that are given take the place of those found, in segmentation and in every fit."""

import numpy as np
import pytest

import needleforce as nf

SPEED, SURFACE, PEAKS = 2e-3, 1e-3, (4e-3, 8e-3)  # m/s, m


@pytest.fixture(scope="module")
def layered():
    """A force that rises from the surface by 50 N/m and falls by half at each of two peaks; withdrawn at 12 mm."""
    depth = np.concatenate([np.arange(0, 12e-3, 1e-5), np.arange(12e-3, 0, -1e-5)])
    time = np.arange(len(depth)) * 1e-5 / SPEED
    inside = np.clip(depth - SURFACE, 0.0, None)
    force = 50.0 * inside - sum(25.0 * (peak - SURFACE) * (depth > peak) for peak in PEAKS)
    force[1200:] = -0.05 * (depth[1200:] > SURFACE)
    force += np.random.default_rng(4).normal(0.0, 1e-3, len(force))
    return nf.Recording(time=time, depth=depth, force=force)


def test_given_events_are_at_their_samples_and_the_phases_follow(layered):
    given = nf.segment(layered.with_events(contact=0.6, punctures=(2.0, 3.0), exit=11.6))
    assert given.contact.depth == pytest.approx(1.2e-3)
    assert [each.depth for each in given.punctures] == pytest.approx([4e-3, 6e-3])
    assert given.exit.depth == pytest.approx(12e-3 - (11.6 - 6.0) * SPEED)
    assert given.punctures[0].drop == pytest.approx(25.0 * 3e-3, abs=8e-3)  # to the lowest force after it
    assert given.punctures[0].indentation == pytest.approx(2.8e-3)
    assert given.spans("deformation")[0].end == pytest.approx(2.0, abs=0.006)
    assert "Given, not found: contact, punctures, exit." in given.notes


def test_events_that_are_given_where_they_were_found_change_nothing(layered):
    found = nf.segment(layered)
    times = {"contact": found.contact.time, "punctures": [each.time for each in found.punctures]}
    assert len(found.punctures) == 2
    same = nf.identify(layered.with_events(**times)).parameters
    other = nf.identify(layered.with_events(contact=found.contact.time + 0.2)).recordings[0].events
    assert {k: e.value for k, e in same.items()} == {k: e.value for k, e in nf.identify(layered).parameters.items()}
    assert other.contact.time == pytest.approx(found.contact.time + 0.2, abs=0.003)


def test_no_puncture_can_be_given(layered):
    events = nf.segment(layered.with_events(punctures=()))
    assert events.punctures == () and "There is no puncture." in events.notes


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"contact": -1.0}, "time of the contact is -1 s.*from 0 to 11.99"),
        ({"contact": 3.0, "punctures": (2.0,)}, "before the puncture at 2 s"),
        ({"punctures": (2.0, 2.0)}, "before the puncture at 2 s"),
        ({"exit": float("nan")}, "time of the exit"),
    ],
)
def test_times_outside_the_recording_or_out_of_order_are_refused(layered, given, message):
    with pytest.raises(nf.InputError, match=message):
        layered.with_events(**given)
