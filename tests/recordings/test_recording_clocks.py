# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from plain_insertion import insertion, text

import needleforce as nf
from needleforce.recording import read

TIME, DEPTH, FORCE = insertion()


def notes(run):
    return {note.kind: note for note in run.notes}


def run_at(file, time, depth=DEPTH, force=FORCE):
    return read(file(text({"time_s": time, "depth_m": depth, "force_N": force})))


def test_a_uniform_clock_has_no_note(file):
    assert not {"gap", "jitter", "repeated_time"} & notes(run_at(file, TIME)).keys()


def test_gaps_are_noted_with_the_longest(file):
    time = TIME + 0.05 * (np.arange(len(TIME)) >= 300) + 0.03 * (np.arange(len(TIME)) >= 700)
    gap = notes(run_at(file, time))["gap"]
    assert gap.count == 2
    assert "longest of 60 ms at 2.99 s" in gap.message


def test_jitter_is_noted(file):
    time = TIME + 1e-3 * (np.arange(len(TIME)) % 2)  # steps of 11 and 9 ms; TIME itself has steps of 10
    jitter = notes(run_at(file, time * 1.0 + 5e-4 * (np.arange(len(TIME)) % 4 == 1)))["jitter"]
    assert jitter.count > 0.2 * len(TIME)


def test_repeated_stamps_are_averaged_with_a_note(file):
    time, force = TIME.copy(), FORCE.copy()
    time[401] = time[400]
    force[400:402] = 1.0, 3.0
    run = run_at(file, time, force=force)
    assert len(run) == len(TIME) - 1
    assert run.force[400] == 2.0 and run.time[400] == TIME[400]
    assert notes(run)["repeated_time"].count == 1


def test_time_may_start_anywhere(file):
    run = run_at(file, TIME + 1637705108.54)
    assert run.rate == pytest.approx(100.0, rel=1e-4)


@pytest.mark.parametrize("rate", [80.0, 90.0, 300.0])
def test_the_rate_of_stamps_in_whole_milliseconds_is_that_of_the_clock(rate):
    time = np.round(np.arange(2800) / rate, 3)
    time[1400:] += 5.0  # an interruption is no step
    assert nf.Recording(time=time, depth=0.0 * time, force=0.0 * time).rate == pytest.approx(rate, rel=1e-4)
