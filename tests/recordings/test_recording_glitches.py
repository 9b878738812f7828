# SPDX-License-Identifier: Apache-2.0
"""Single-sample spikes are noted and kept; peaks, punctures, steps and noise are not spikes."""

import numpy as np
import pytest
from plain_insertion import insertion, text

from needleforce.errors import InputError
from needleforce.recording import read

TIME, DEPTH, FORCE = insertion(noise=2e-3)


def glitches_of(path):
    return [note for note in read(path).notes if note.kind == "glitch"]


def with_force(force):
    return text({"time_s": TIME, "depth_m": DEPTH, "force_N": force})


def spiked(*samples, height=1000.0):
    force = FORCE.copy()
    force[list(samples)] += height
    return force


@pytest.mark.parametrize("height", [0.8, -0.8, 5.0, -1000.0, 1e6])
@pytest.mark.parametrize("sample", [1, 300, 1251, 2498])
def test_a_spike_is_noted_and_kept(file, sample, height):
    """The force spans 1.04 N; the spike is the only sample that was changed."""
    force = spiked(sample, height=height)
    path = file(with_force(force))
    (note,) = glitches_of(path)
    assert note.count == 1 and f"{force[sample]:.4g} N at {TIME[sample]:g} s" in note.message
    np.testing.assert_array_equal(read(path, baseline=False).force, force)


def test_several_spikes_are_counted_and_the_largest_is_named(file):
    (note,) = glitches_of(file(with_force(spiked(0, 50, 900, 2499))))
    assert note.count == 4
    assert "4 spikes" in note.message and "not removed" in note.message


@pytest.mark.parametrize(
    "force",
    [
        FORCE,
        np.where(DEPTH > 5e-3, 0.0, FORCE),  # a drop from a peak to zero within one sample
        np.where(np.arange(len(TIME)) == len(TIME) - 1, 1.0, 0.0),  # the first sample of a contact at the end
        np.round(FORCE),  # a coarse sensor that alternates between two digits
        np.where(np.arange(len(TIME)) % 97 == 0, 1.0, np.arange(len(TIME)) % 89 < 2),
        np.random.default_rng(3).standard_t(3, len(TIME)),  # noise with heavy tails
        1e-3 * (np.arange(len(TIME)) % 2),
    ],
)
def test_features_that_are_not_glitches(file, force):
    assert not glitches_of(file(with_force(force)))


def test_a_spike_of_two_samples_is_not_a_glitch(file):
    assert not glitches_of(file(with_force(spiked(300, 301))))


def test_real_recordings_have_no_glitches(recordings):
    read_ones = 0
    for path in (recordings / "needle-insertion-rig").glob("*.csv"):
        try:
            assert not glitches_of(path), path.name
            read_ones += 1
        except InputError:
            assert "5N-and-move-X" in path.name
    assert read_ones > 80
