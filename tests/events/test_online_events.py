# SPDX-License-Identifier: Apache-2.0
"""Events found while they happen: planted ruptures, real insertions sample by sample, and what Python sees of them."""

import pickle
import runpy

import numpy as np
import pytest
from recorded_data import RECORDINGS

import needleforce as nf


@pytest.fixture(scope="module")
def streams(root):
    return runpy.run_path(str(root / "benchmarks" / "online_streams.py"))


def replay(watch, time, force, depth) -> list:
    """The events of a stream, each with the sample at which it was found."""
    rows = zip(force, depth, np.diff(time, prepend=time[0]), strict=True)
    return [(i, event) for i, event in enumerate(watch.step(*row) for row in rows) if event is not None]


def of_kind(found: list, kind: str) -> list:
    return [(i, event) for i, event in found if event.kind == kind]


def test_the_same_settings_find_planted_ruptures_at_100_and_1000_hertz(streams):
    for latest, insertions in zip((20e-3, 10e-3), streams["simulated"](12, noise=20e-3), strict=True):
        late = []
        for each in insertions:
            found = of_kind(replay(nf.EventDetector(), each.time, each.force, each.depth), "puncture")
            assert len(found) == len(each.punctures)
            for (i, event), fall in zip(found, each.punctures, strict=True):
                late.append(each.time[i] - each.time[fall.snap])
                assert event.depth == pytest.approx(each.depth[fall.snap], abs=0.2e-3)
                assert 0.5 < event.probability <= 1.0
        assert min(late) >= 0
        assert np.percentile(late, 90) <= latest + 1e-9


def test_real_insertions_have_their_events_in_order_and_no_puncture_is_missed(streams):
    if not (RECORDINGS / "needle-insertion-rig").is_dir():
        pytest.skip(f"no real recordings in {RECORDINGS}")
    missed = false = 0
    insertions = streams["rig"](odd=True)[::4]
    for each in insertions:
        found = replay(nf.EventDetector(), each.time, each.force, each.depth)
        seen = [i for i, _ in of_kind(found, "puncture")]
        missed += sum(not any(f.start < i <= f.end for i in seen) for f in each.punctures)
        false += sum(not any(f.start < i <= f.end for f in each.halves) for i in seen)
        kinds = [event.kind for _, event in found]
        if each.punctures:
            assert kinds[0] == "contact"
            assert kinds.index("puncture") < kinds.index("reversal") < kinds.index("exit")
    assert len(insertions) >= 10
    assert missed == 0
    assert false == 0


def test_a_detection_states_what_was_found_and_a_copy_goes_its_own_way():
    watch = nf.EventDetector(fall=0.2, false_alarms=1e-4)
    depth = np.arange(0.0, 8e-3, 2e-5)
    force = np.where(depth < 6e-3, 250.0 * np.maximum(depth - 2e-3, 0.0), 0.4)
    time = np.arange(len(depth)) / 100
    found = replay(watch, time[:350], force[:350], depth[:350])
    other = watch.copy()
    (_, puncture), *_ = of_kind(found, "puncture")
    assert puncture.size == pytest.approx(0.6, abs=3 * 250.0 * 2e-5)  # three readings
    assert puncture.delay == pytest.approx(0.02, abs=0.011)
    assert f"kind='puncture', time={puncture.time}" in repr(puncture)
    watch.reset()
    assert watch.status == "learning"
    assert other.status == "ok"
    assert watch.settings == other.settings
    watch.restore(other.save())
    assert watch.status == "ok"
    with pytest.raises(nf.InputError, match="not of this version and these settings, or altered"):
        nf.EventDetector().restore(other.save())


@pytest.mark.parametrize("bad", [{"within": 0.0}, {"share": 1.5}, {"false_alarms": float("nan")}, {"drop": 1.0}])
def test_settings_outside_their_range_are_refused_by_name(bad):
    with pytest.raises(nf.InputError, match=next(iter(bad))):
        nf.EventDetector(**bad)


def test_settings_are_kept_by_pickling():
    settings = nf.EventDetector(share=0.2).settings
    assert pickle.loads(pickle.dumps(settings)).share == 0.2
