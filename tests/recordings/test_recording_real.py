# SPDX-License-Identifier: Apache-2.0
"""Published recordings; expected values are those of their README."""

import numpy as np
import pytest

from needleforce.errors import InputError
from needleforce.recording import read

STATIC = "5N-and-move-X"


def test_every_insertion_is_read_with_its_stated_travel_and_rate(recordings):
    files = sorted((recordings / "needle-insertion-rig").glob("*.csv"))
    assert len(files) == 94
    for path in [path for path in files if STATIC not in path.name]:
        run = read(path)
        assert 1e3 * np.ptp(run.depth) == pytest.approx(20 if "blank" in path.name else 25, rel=0.03) or np.ptp(
            run.depth
        ) == pytest.approx(30e-3, rel=0.01)
        assert min(abs(1 / run.rate - step) for step in (10.0e-3, 13.2e-3, 11.3e-3)) < 0.1e-3
        assert np.abs(run.force).max() < 8.0 and set(run.axes) == {"fx", "fy"}


def test_speed_is_the_one_in_the_name(recordings):
    for path in (recordings / "needle-insertion-rig").glob("dev__control-needle__skin-on-muscle_?_0_*.csv"):
        commanded = 1e-3 * float(path.name.split("_")[5])
        assert np.percentile(read(path).velocity, 95) == pytest.approx(commanded, rel=0.04)


def test_given_units_and_assumed_ones_are_the_same(recordings):
    path = next((recordings / "needle-insertion-rig").glob("*control-needle__skin_2_0_2_1_*.csv"))
    assumed = read(path)
    columns = {"force": "fz", "depth": "pz", "time": "time"}
    given = read(path, columns=columns, units={"time": "us", "depth": "mm", "force": "N", "tx": "N mm"})
    for name in ("time", "depth", "velocity", "force"):
        np.testing.assert_array_equal(getattr(given, name), getattr(assumed, name))
    assert list(given.axes) == ["fx", "fy", "tx"]
    sentences = " ".join(assumed.card.assumptions)
    assert "time is assumed to be in us" in sentences and "depth is assumed to be in mm" in sentences


def test_a_static_recording_has_constant_depth(recordings):
    path = next((recordings / "needle-insertion-rig").glob(f"*{STATIC}*.csv"))
    with pytest.raises(InputError, match=r"depth.*'pz'.* is constant at 0"):
        read(path)


def test_the_direction_of_a_cone_on_a_gel_is_recognised(recordings):
    path = recordings / "afm-cone-indentation" / "spot3-0192.csv"
    run = read(path, columns={"depth": "tip_position_m"})
    assert any("depth decreases while" in sentence for sentence in run.card.assumptions)
    given = read(path, columns={"depth": "tip_position_m"}, inwards="decreasing")
    np.testing.assert_array_equal(run.depth, given.depth)
    assert len(run) == 4000 and run.rate == pytest.approx(2000.0)
