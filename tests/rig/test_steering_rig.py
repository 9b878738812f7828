# SPDX-License-Identifier: Apache-2.0
"""The steering rig: what is tracked, what differs between sites, and its table."""

import math

import numpy as np
import pytest

import needleforce as nf
from needleforce.rig import SteeringPhantom, steering_insertion, write_steering

QUIET = SteeringPhantom(noise=0.0, slope_noise=0.0, offset=0.0, tilt=0.0, unevenness=0.0, wander=0.0, play=0.0)


def inserted(phantom=QUIET, *, seed=1, number=0, lateral=(0.0, 0.0), roll=0.0, depth=0.06):
    insertion = steering_insertion(seed, number, phantom)
    for each in np.arange(0.0, depth + 1e-9, 5e-3):
        insertion.advance(float(each), lateral if each > 0.015 else (0.0, 0.0), roll)
    return insertion


def test_the_bevel_decides_where_the_tip_goes_and_the_wrench_turns_with_it():
    ahead, aside = inserted(), inserted(roll=0.5 * math.pi)
    assert ahead.tip[0] > 0.2e-3 and abs(ahead.tip[1]) < 1e-9
    np.testing.assert_allclose(aside.tip[:2], [0.0, ahead.tip[0]], atol=1e-7)
    assert math.remainder(math.atan2(*aside.wrench[1::-1]) - math.atan2(*ahead.wrench[1::-1]), 2 * math.pi) == (
        pytest.approx(0.5 * math.pi, abs=1e-5)
    )


def test_play_of_the_guide_takes_a_part_of_the_motion():
    full, loose = (
        inserted(lateral=(3e-3, 0.0)),
        inserted(SteeringPhantom(**{**vars(QUIET), "play": 1e-3}), lateral=(3e-3, 0.0)),
    )
    less = inserted(lateral=(2e-3, 0.0))
    assert loose.tip[0] == pytest.approx(less.tip[0], abs=1e-9) and abs(loose.tip[0] - full.tip[0]) > 1e-5


def test_sites_are_drawn_by_seed_and_number():
    phantom = SteeringPhantom()
    again = [inserted(phantom, number=number).rows[-1] for number in (0, 0, 1)]
    assert again[0] == again[1] and again[0] != again[2]


def test_readings_scatter_by_their_noise_about_the_tip():
    insertion = steering_insertion(5, 0, SteeringPhantom(noise=1e-4, slope_noise=1e-3))
    tips = np.array([insertion.advance(0.0, (0.0, 0.0))[0] for _ in range(400)])
    assert np.std(tips, axis=0) == pytest.approx(1e-4, rel=0.15)
    np.testing.assert_allclose(tips.mean(axis=0), insertion.tip, atol=2e-5)


def test_the_table_is_read_as_it_was_recorded(tmp_path):
    insertions = [inserted(SteeringPhantom(), number=number, lateral=(1e-3, -2e-3), roll=0.3) for number in (0, 1)]
    write_steering(insertions, tmp_path / "paths.csv")
    paths = nf.steering.read(tmp_path / "paths.csv")
    assert [path.name for path in paths] == ["insertion 0", "insertion 1"]
    for path, insertion in zip(paths, insertions):
        rows = insertion.rows
        np.testing.assert_allclose(path.tip[:, 0], [1e-3 * row["tip_x_mm"] for row in rows], rtol=1e-5, atol=1e-9)
        np.testing.assert_allclose(path.slope[:, 1], [row["tip_slope_y"] for row in rows], rtol=1e-5, atol=1e-9)
        np.testing.assert_allclose(path.base[-1], [1e-3, -2e-3])
        np.testing.assert_allclose(path.roll, 0.3, rtol=1e-5)


def test_the_axial_force_is_that_of_the_model():
    insertion = steering_insertion(1, 0, QUIET, axial=nf.preset("paper"))
    for depth in np.arange(0.0, 0.021, 1e-3):
        insertion.advance(float(depth), (0.0, 0.0))
    axial = nf.Insertion(nf.preset("paper"))
    force = [axial.step(depth, None, 0.2).force for depth in np.arange(0.0, 0.0201, 1e-3)][-1]
    assert insertion.force == pytest.approx(force, rel=0.02)


@pytest.mark.parametrize(("quantity", "value"), [("modulus", 0.0), ("noise", -1e-4), ("play", math.nan)])
def test_values_that_no_phantom_has_are_named(quantity, value):
    with pytest.raises(nf.InputError, match=f"{quantity} of the steering phantom"):
        SteeringPhantom(**{quantity: value})
