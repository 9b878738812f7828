# SPDX-License-Identifier: Apache-2.0
"""Several tables of a text one below the other, phases and repeats with clocks of their own."""

import numpy as np
import pytest
from plain_insertion import insertion

from needleforce.recording import read, read_all

TIME, DEPTH, FORCE = insertion(rate=50.0)


def phases(*parts):
    """A table of parts, each with its own clock from 0."""
    rows = [f"{t - part[0][0]:.3f},{1e3 * z:.6f},{f:.8f}" for part in parts for t, z, f in part]
    return "Time (s),Depth (mm),Force (N)\n" + "\n".join(rows) + "\n"


def test_phases_with_clocks_of_their_own_are_one_recording(file):
    """Approach, insertion and withdrawal: each time starts again, and the depth continues."""
    samples = list(zip(TIME, DEPTH, FORCE))
    deepest = int(np.argmax(DEPTH))
    run = read(file(phases(samples[:150], samples[150 : deepest + 1], samples[deepest + 1 :])))
    np.testing.assert_allclose(run.time - run.time[0], TIME - TIME[0], atol=2e-3)
    np.testing.assert_allclose(run.depth, DEPTH, atol=1e-8)
    assert any(note.kind == "phases" and note.count == 2 for note in run.notes)


def test_repeats_are_no_phases(file):
    """Whole insertions, insertions without withdrawal, and some that are not withdrawn to the end."""
    samples = list(zip(TIME, DEPTH, FORCE))
    in_only = samples[: int(np.argmax(DEPTH))]
    for part in (samples, in_only, samples[:-100]):
        assert len(read_all(file(phases(part, part, part)))) == 3
    higher = [(t, z + 3e-3, f) for t, z, f in samples[:-75]]  # the next one begins where the first one was left
    assert len(read_all(file(phases(samples[:-75], higher)))) == 2


def test_a_table_below_another_has_its_headers(file):
    rows = [f"{t:.2f},{1e3 * z:.4f},{f:.6f}" for t, z, f in zip(TIME, DEPTH, FORCE)]
    header = "Time (s),Depth (mm),Force (N)"
    runs = read_all(file("\n".join([header, *rows, "End of run 1", *rows, "End of run 2"]) + "\n"))
    assert len(runs) == 2
    for run in runs:
        np.testing.assert_allclose(run.force, FORCE, atol=1e-6)


@pytest.mark.parametrize("home", [0.5, 3.0])
def test_insertions_that_return_beyond_their_start_are_no_phases(file, home):
    out = np.linspace(DEPTH[-1], DEPTH[0] - 1e-3 * home, 40)
    whole = [*zip(TIME, DEPTH, FORCE), *zip(TIME[-1] + 0.02 * np.arange(1, 41), out, np.zeros(40))]
    later = [(t, z - 1e-3 * home, f) for t, z, f in whole]
    assert len(read_all(file(phases(whole, later)), part=None)) == 2


def test_insertions_into_fresh_depth_are_no_phases(file):
    part = [(t, z - DEPTH[0], f) for t, z, f in zip(TIME[:600], DEPTH[:600], FORCE[:600])]
    deeper = [(t, z + part[-1][1], f) for t, z, f in part]
    assert len(read_all(file(phases(part, deeper)))) == 2


@pytest.mark.parametrize("delimiter", [",", " ", "\t"])
def test_headers_of_a_second_table_in_a_comment(file, delimiter):
    first = ["# time_s,depth_mm,force_N", *(f"{t:.2f},{1e3 * z:.4f},{f:.6f}" for t, z, f in zip(TIME, DEPTH, FORCE))]
    second = ["# time_s,force_N,depth_mm", *(f"{t:.2f},{f:.6f},{1e3 * z:.4f}" for t, z, f in zip(TIME, DEPTH, FORCE))]
    runs = read_all(file("\n".join([*first, *second]).replace(",", delimiter) + "\n"))
    assert len(runs) == 2
    for run in runs:
        np.testing.assert_allclose(run.force, FORCE, atol=1e-6)
        np.testing.assert_allclose(run.depth, DEPTH, atol=1e-7)
