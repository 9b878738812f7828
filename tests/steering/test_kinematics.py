# SPDX-License-Identifier: Apache-2.0
"""Unicycle and bicycle: exact curves, and where they meet the mechanics."""

import math

import numpy as np
import pytest

import needleforce as nf
from needleforce.steering import Bicycle, Unicycle


def follow(model, depths, rolls):
    return [model.step(depth, roll=roll) for depth, roll in zip(depths, rolls)][-1]


@pytest.mark.parametrize("roll", [0.0, 0.7, math.pi / 2, -2.0])
def test_unicycle_follows_an_arc_towards_its_bevel(roll):
    tip = follow(Unicycle(5.0), np.linspace(0.0, 0.2, 7), np.full(7, roll)).tip
    across = (1.0 - math.cos(1.0)) / 5.0
    np.testing.assert_allclose(tip, [across * math.cos(roll), across * math.sin(roll), math.sin(1.0) / 5.0], atol=1e-14)


def test_even_roll_is_exact_in_any_number_of_steps():
    tips = [follow(Unicycle(8.0), np.linspace(0.0, 0.15, n), np.linspace(0.0, 3.0, n)).tip for n in (2, 31, 300)]
    np.testing.assert_allclose(tips[0], tips[1], atol=1e-13)
    np.testing.assert_allclose(tips[0], tips[2], atol=1e-13)


def test_fast_roll_goes_straight_along_a_helix():
    tip = follow(Unicycle(8.0), np.linspace(0.0, 0.1, 2001), np.linspace(0.0, 2000.0, 2001)).tip
    assert np.hypot(*tip[:2]) < 1e-4


def test_withdrawal_goes_back_along_the_path_and_returns():
    model = Unicycle(6.0)
    depths, rolls = np.linspace(0.0, 0.1, 11), np.linspace(0.0, 2.0, 11)
    tips = [model.step(d, roll=r).tip for d, r in zip(depths, rolls)]
    for i in (8, 5, 2, 0):
        np.testing.assert_allclose(model.step(depths[i], roll=2.0).tip, tips[i], atol=1e-14)
    np.testing.assert_allclose(model.step(0.1, roll=2.0).tip, tips[-1], atol=1e-14)


def test_bicycle_tip_is_ahead_and_kinks_where_the_bevel_flips():
    model = Bicycle(math.radians(10.0), 0.04, 0.02)
    assert model.curvature == pytest.approx(math.tan(math.radians(10.0)) / 0.04)
    assert model.step(0.0).tip == pytest.approx([0.0, 0.0, 0.02])
    before = [model.step(d).tip for d in (0.05, 0.0501)]
    model.step(0.0501, roll=math.pi)
    after = [model.step(0.0501, roll=math.pi).tip, model.step(0.0502, roll=math.pi).tip]
    slope = [(b - a)[0] / (b - a)[2] for a, b in (before, after)]
    assert slope[0] - slope[1] == pytest.approx(2.0 * model.curvature * 0.02, rel=0.2)


def test_entry_is_on_the_line_of_the_base():
    sample = Unicycle(0.0).step(0.0, (1e-3, 2e-3), tilt=(0.1, -0.2))
    np.testing.assert_allclose(sample.tip, [1e-3, 2e-3, 0.0])
    assert sample.tangent[0] > 0.0 > sample.tangent[1]


@pytest.mark.parametrize("bad", [{"depth": math.nan}, {"depth": 0.1, "roll": math.inf}, {"depth": 0.1, "roll": 7.0}])
def test_bad_steps_are_refused_and_change_nothing(bad):
    model = Unicycle(4.0)
    model.step(0.0)
    expected = model.step(0.05).tip
    sample = model.step(**bad)
    assert sample.status != "ok"
    np.testing.assert_array_equal(sample.tip, expected)
    np.testing.assert_array_equal(model.step(0.05).tip, expected)


def test_bad_parameters_are_named():
    with pytest.raises(nf.InputError, match="curvature"):
        Unicycle(math.nan)
    with pytest.raises(nf.InputError, match="wheelbase"):
        Bicycle(0.1, 0.0, 0.0)
    with pytest.raises(nf.InputError, match="wheel_angle"):
        Bicycle(2.0, 0.1, 0.0)


def test_the_mechanics_tend_to_the_unicycle_of_their_curvature():
    stiffness, modulus, force = 1.662e-4, 71350.0, 0.0776
    curvature = nf.steady_curvature(stiffness, modulus, force)
    needle = nf.Needle(1e-3, 0.0, 0.9, stiffness * 64.0 / (math.pi * 1e-12))
    mechanics = nf.FlexibleInsertion(
        None, needle, lateral=[nf.LateralLayer(modulus=modulus, tip_force=force)], guide_distance=0.03,
        bevel_length=2e-3, max_speed=math.inf,
    )  # fmt: skip
    mechanics.step(0.1, dt=1.0)  # a straight hole
    start = mechanics.run(np.linspace(0.1, 0.13, 31))  # until it steers steadily
    tip, tangent = start["tip"], start["tip"][-1] - start["tip"][-2]
    model = Unicycle(curvature)
    tilt = (math.atan2(tangent[0], tangent[2]) + 0.5e-3 * curvature, 0.0)
    model.step(0.13, tuple(tip[-1, :2]), tilt=tilt)
    ends = [mechanics.run(np.linspace(0.13, 0.2, 71))["tip"][-1], model.step(0.2).tip]
    assert ends[0][0] == pytest.approx(ends[1][0], rel=2e-3)
    # the unicycle's entry counts z as travel; the needle is shorter there by its slope
    assert ends[0][2] - ends[1][2] == pytest.approx(tip[-1, 2] - 0.13, abs=2e-5)
