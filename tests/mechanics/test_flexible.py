# SPDX-License-Identifier: Apache-2.0
"""A needle that bends, through the Python names: against an exact rod, in space, and with bad input."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_bvp

import needleforce as nf

STIFFNESS, MODULUS, GUIDE, DEPTH = 0.02, 2e4, 0.04, 0.05
NEEDLE = nf.Needle(1e-3, 0.0, 0.5, STIFFNESS * 64.0 / (math.pi * 1e-12))
PAPER = nf.preset("paper")


def insertion(**options):
    settings = {"lateral": MODULUS, "guide_distance": GUIDE, "max_speed": math.inf}
    return nf.FlexibleInsertion(options.pop("model", None), NEEDLE, **settings | options)


def exact_rod(aside, guide=GUIDE, depth=DEPTH, stiffness=STIFFNESS, modulus=MODULUS):
    """Planar rod of any slope (x, z, angle, moment, forces across and along over its length), its base moved aside.

    Where it is in the tissue, K x per depth pushes it at a right angle to itself; its end moves what it meets aside.
    """

    def slopes(_, y):
        x, z, angle, moment, across, along = y
        push = modulus * x * 0.5 * (1.0 + np.tanh(z / 2e-5))
        bent = along * np.sin(angle) - across * np.cos(angle)
        return np.vstack(
            [np.sin(angle), np.cos(angle), moment / stiffness, bent, push * np.cos(angle), -push * np.sin(angle)]
        )

    def ends(base, tip):
        return np.r_[base[0] - aside, base[1] + guide, base[2], tip[3:5], tip[5] + 0.5 * modulus * tip[0] ** 2]

    s = np.unique(np.concatenate([np.linspace(0.0, guide + depth, 400), guide + np.linspace(-2e-3, 4e-3, 600)]))
    first = np.vstack([np.where(s < guide, aside * (1.0 - s / guide), 0.0), s - guide] + [np.zeros_like(s)] * 4)
    solution = solve_bvp(slopes, ends, s, first, tol=1e-7, max_nodes=200_000)
    assert solution.success
    return solution.y


@pytest.mark.parametrize("hub", [False, True])
@pytest.mark.parametrize("aside, allowed", [(1e-3, 3e-4), (6e-3, 3e-3), (15e-3, 2e-2)])
def test_base_moved_aside_meets_an_exact_rod(aside, allowed, hub):
    # slopes of 0.016, 0.10 and 0.24; a hub at the place of the guide has the same shape and another axial force
    needle = insertion(planar=True)
    if hub:
        rod = nf.Needle(1e-3, 0.0, GUIDE + DEPTH, STIFFNESS * 64.0 / (math.pi * 1e-12))
        needle = nf.FlexibleInsertion(None, rod, lateral=MODULUS, planar=True, max_speed=math.inf)
    needle.step(DEPTH - 1e-4, dt=1.0)
    needle.step(DEPTH + 1e-4 if not hub else DEPTH, dt=1.0)
    needle.step(DEPTH, dt=1.0)
    sample = needle.step(DEPTH, (aside, 0.0), dt=1.0)
    x, z, _, moment, across, along = exact_rod(aside)
    assert sample.status == "ok"
    assert sample.wrench[0] == pytest.approx(across[0], rel=allowed)
    assert sample.wrench[4] == pytest.approx(moment[0], rel=allowed)
    assert sample.tip[0] == pytest.approx(x[-1], abs=allowed * aside)
    assert sample.tip[2] - DEPTH == pytest.approx(z[-1] - DEPTH, rel=max(allowed, 1e-3))  # the needle is shorter
    # the axial part of the lateral forces: a guide gives it back where the needle comes out of it
    returned = 0.0 if hub else 0.5 * moment[0] ** 2 / STIFFNESS
    assert -sample.force - returned == pytest.approx(along[0], rel=allowed, abs=1e-9)


def test_run_is_the_steps_one_by_one():
    one, many = insertion(model=PAPER), insertion(model=PAPER)
    depth = np.linspace(-2e-3, 0.03, 65)
    lateral = np.column_stack([1e-3 * np.sin(100 * depth), 5e-4 * depth / 0.03])
    roll = np.linspace(0.0, 2.0, 65)
    rows = many.run(depth, lateral, roll=roll, dt=0.5)
    for i in range(65):
        sample = one.step(depth[i], tuple(lateral[i]), roll=roll[i], dt=0.5)
        np.testing.assert_array_equal(sample.tip, rows["tip"][i])
        np.testing.assert_array_equal(sample.wrench, rows["wrench"][i])
    assert np.all(rows["status"] == 0)
    np.testing.assert_array_equal(one.shape()[-1], rows["tip"][-1])
    assert one.path[-1, 2] == pytest.approx(0.03, abs=1e-4)


def test_snapshot_restores():
    needle = insertion(model=PAPER)
    needle.run(np.linspace(-1e-3, 0.02, 22))
    saved = needle.snapshot()
    first = needle.run(np.linspace(0.02, 0.03, 11), roll=1.0)
    needle.restore(saved)
    second = needle.run(np.linspace(0.02, 0.03, 11), roll=1.0)
    np.testing.assert_array_equal(first["tip"], second["tip"])


@pytest.mark.parametrize("planar", [True, False])
def test_a_state_can_be_saved_as_bytes_and_continues_to_the_bit(planar):
    needle, other = (insertion(model=PAPER, planar=planar) for _ in range(2))
    needle.run(np.linspace(-1e-3, 0.02, 22))
    saved = needle.save()
    first = needle.run(np.linspace(0.02, 0.03, 11), roll=1.0)
    other.restore(saved)
    second = other.run(np.linspace(0.02, 0.03, 11), roll=1.0)
    for part in first:
        np.testing.assert_array_equal(first[part], second[part])


def test_bytes_of_another_needle_or_altered_ones_are_refused_and_change_nothing():
    needle, twin = insertion(model=PAPER), insertion(model=PAPER)
    for each in (needle, twin):
        each.run(np.linspace(-1e-3, 0.02, 22))
    saved = needle.save()
    others = [
        insertion(model=PAPER, elements=20).save(),
        insertion().save(),
        insertion(model=PAPER, planar=True).save(),
    ]
    for bad in (*others, saved[:-1], saved[:50_000] + bytes([saved[50_000] ^ 1]) + saved[50_001:], b""):
        with pytest.raises(nf.InputError, match="or altered"):
            needle.restore(bad)
    np.testing.assert_array_equal(needle.step(0.021, dt=1.0).wrench, twin.step(0.021, dt=1.0).wrench)


def test_a_needle_has_no_shape_before_its_first_step():
    assert insertion().shape().shape == (0, 3)


def test_foundation_of_the_models_tissue_is_the_default():
    physical = nf.preset("physical")
    needle = nf.FlexibleInsertion(physical, NEEDLE)
    assert needle.lateral[0].modulus == pytest.approx(nf.foundation_modulus(NEEDLE, physical.tissue))


@pytest.mark.parametrize(
    "options, words",
    [
        ({"lateral": None}, "Give a modulus in Pa"),
        ({"lateral": -1.0}, "modulus"),
        ({"lateral": [1.0]}, "LateralLayer"),
        ({"lateral": [nf.LateralLayer(top=0.01, modulus=1.0)]}, "start at 0"),
        ({"lateral": []}, "lateral layers"),
        ({"lateral": [nf.LateralLayer(top=0.01 * i, modulus=1.0) for i in range(9)]}, "more than 8"),
        ({"sections": [(0.1, -1.0, 0.0)]}, "sections"),
        ({"sections": [(0.1 * i, 1.0, 0.0) for i in range(1, 6)]}, "more than 4"),
        ({"elements": 0}, "elements"),
        ({"elements": 1000}, "elements"),
        ({"guide_distance": math.nan}, "guide_distance"),
        ({"path_spacing": 1.0}, "path_spacing"),
        ({"pivot_stiffness": -1.0}, "pivot_stiffness"),
        ({"bevel_length": math.nan}, "bevel_length"),
        ({"model": "paper"}, "nf.preset"),
    ],
)
def test_bad_options_are_named(options, words):
    with pytest.raises(nf.InputError, match=words):
        insertion(**options)


def test_lateral_layer_knows_its_forms():
    layer = nf.LateralLayer(modulus=1e4, form="tanh", scale=1e-4)
    assert layer.form == "tanh"
    with pytest.raises(nf.InputError, match="linear, cubic, hyperbolic, tanh"):
        nf.LateralLayer(modulus=1e4, form="soft")


def test_a_run_with_arrays_of_different_length_is_refused():
    with pytest.raises((nf.InputError, ValueError)):
        insertion().run(np.zeros(3), np.zeros((4, 2)))


def returning():
    """A model whose crack gives half of the work of spreading back."""
    cutting = nf.laws.Fracture(
        toughness=80.0, crack_length=1e-3, plane_strain_modulus=7200.0, radius=0.35e-3, recovered=0.5
    )
    return PAPER.replace(cutting=cutting)


PUSHED = {"lateral": [nf.LateralLayer(modulus=MODULUS, tip_force=0.05)]}
BEVELLED = {"bevel": nf.core.Bevel(half_angle=0.4, friction_coefficient=0.1, face_share=1.0)}


@pytest.mark.parametrize(
    "model, tip, why",
    [
        (None, PUSHED, "there is no model."),
        (nf.preset("layered"), PUSHED, "layer 1 has no cutting force; layer 2 has no cutting force."),
        (returning(), PUSHED, "fracture in layer 1 gives work back"),
        (returning(), BEVELLED, "fracture in layer 1 gives work back"),
    ],
)
def test_warnings_name_what_keeps_bending_and_axial_force_apart(model, tip, why):
    (sentence,) = insertion(model=model, **tip).warnings
    assert why in sentence
    assert insertion(model=model, **tip, small_slopes=True).warnings == ()


def test_a_tip_force_beyond_ten_times_the_cutting_force_is_stated():
    layers = [
        nf.LateralLayer(modulus=MODULUS, tip_force=0.5),
        nf.LateralLayer(top=8e-3, modulus=MODULUS, tip_force=-3.0),
    ]
    (sentence,) = insertion(model=PAPER, lateral=layers).warnings
    cutting = PAPER.cutting.force
    assert f"-3 N from 8 mm on is more than ten times the cutting force there, {cutting:.3g} N" in sentence
    assert f"{10.0 * cutting:.3g} N act" in sentence


@pytest.mark.parametrize("model, tip", [(PAPER, PUSHED), (PAPER, BEVELLED), (None, BEVELLED), (returning(), {})])
def test_a_needle_whose_tip_is_paid_for_has_no_warning(model, tip):
    assert insertion(model=model, **tip).warnings == ()
