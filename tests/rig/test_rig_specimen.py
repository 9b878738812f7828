# SPDX-License-Identifier: Apache-2.0
"""The specimen against closed forms: equal and different forces of the two passes."""

import math

import numpy as np
import pytest

from needleforce import InputError
from needleforce.rig import NOTHING_UNMODELLED, Specimen, Unmodelled

DEEPEST = 16e-3
IN = np.arange(-1e-3, DEEPEST, 2e-6)
CYCLE = np.concatenate([IN, IN[::-1]])
INSIDE = (IN > 3.3e-3) & (IN < 12e-3)
R, ALPHA = 0.35e-3, math.radians(15.0)


def passes(specimen):
    return specimen.force(IN), specimen.force(IN, hole=DEEPEST + 1e-3)


def test_the_peak_is_the_papers_and_the_modulus_follows_from_the_saturated_contact():
    specimen = Specimen()
    saturation = 0.5 * math.pi * R / math.tan(ALPHA)
    shape = 0.5 * math.pi * R**2 / math.tan(ALPHA) + 2.0 * R * (3.237e-3 - saturation)
    assert specimen.reduced_modulus == pytest.approx(0.2101 / shape, rel=1e-12)
    assert specimen.reduced_modulus == pytest.approx(135_744, rel=1e-4)  # F_p / (pi/2 R^2 cot(alpha) + 2 R (h - h_s))
    before = specimen.force(IN)[IN <= 3.237e-3]
    assert before.argmax() == len(before) - 1
    assert before[-1] == pytest.approx(0.2101, abs=2e-6 * 2.0 * specimen.reduced_modulus * R)


def test_the_difference_of_the_passes_is_cutting_minus_the_friction_of_the_dimple():
    first, second = passes(Specimen())
    np.testing.assert_allclose((first - second)[INSIDE], 0.0776 - 18.6 * 0.8e-3, atol=1e-9)


def test_without_unmodelled_effects_the_difference_is_the_cutting_force():
    first, second = passes(Specimen(unmodelled=NOTHING_UNMODELLED))
    np.testing.assert_allclose((first - second)[INSIDE], 0.0776, atol=1e-9)


def test_unequal_friction_adds_a_slope_to_the_difference():
    first, second = passes(Specimen(unmodelled=Unmodelled(second_friction_ratio=0.69)))
    expected = 0.0776 + 18.6 * (IN - 0.8e-3) - 0.69 * 18.6 * IN
    np.testing.assert_allclose((first - second)[INSIDE], expected[INSIDE], atol=1e-9)


@pytest.mark.parametrize("share", [0.8, 1.2])
def test_a_cutting_force_changed_by_a_fifth_changes_the_difference_by_a_fifth_of_it(share):
    before, after = (np.subtract(*passes(Specimen(cutting_force=force))) for force in (0.0776, share * 0.0776))
    np.testing.assert_allclose((after - before)[INSIDE], (share - 1.0) * 0.0776, atol=1e-9)


def test_the_second_pass_neither_deforms_nor_punctures_nor_cuts():
    parts = Specimen().parts(IN, hole=DEEPEST + 1e-3)
    assert not parts["stiffness"].any() and not parts["cutting"].any()
    force = sum(parts.values())
    assert np.diff(force).min() > -1e-12  # no drop during the insertion stroke


def test_the_second_pass_is_friction_and_the_spreading_force_up_to_twelve_millimetres():
    force = Specimen().force(IN, hole=DEEPEST + 1e-3)
    opened = (IN > R / math.tan(ALPHA)) & (IN < 12e-3)
    spreading = 0.25 * math.pi * 116e3 / 0.75 * R**2
    assert spreading == pytest.approx(0.0149, abs=5e-5)  # pi/4 E' R^2, after Azar and Hayward 2008
    np.testing.assert_allclose(force[opened], spreading + 18.6 * IN[opened], atol=1e-9)
    beyond = IN > 12e-3
    departure = 0.5 * 150.0 * 18.6 * (IN[beyond] - 12e-3) ** 2
    np.testing.assert_allclose(force[beyond] - spreading - 18.6 * IN[beyond], departure, atol=1e-9)


def test_the_spreading_force_begins_with_the_tip_and_ends_with_the_advance():
    parts = Specimen().parts(CYCLE)
    spreading, half = parts["spreading"], len(IN)
    assert not spreading[:half][IN <= 3.237e-3].any()
    assert not spreading[half:][IN[::-1] < IN[-1] - 25e-6].any()
    np.testing.assert_allclose(spreading[:half][IN > 3.24e-3], spreading.max())


def test_withdrawal_is_friction_against_the_motion():
    second = Specimen().force(CYCLE, hole=DEEPEST + 1e-3)[len(IN) :]
    depth = IN[::-1]
    window = (depth < 12e-3) & (depth > 0.0)
    np.testing.assert_allclose(second[window], -18.6 * depth[window], atol=1e-9)
    first = Specimen().force(CYCLE)[len(IN) :]
    np.testing.assert_allclose(first[window], -18.6 * np.maximum(depth[window] - 0.8e-3, 0.0), atol=1e-9)


def test_the_end_of_the_hole_is_cut_again():
    parts = Specimen().parts(IN, hole=10e-3)
    assert not parts["cutting"][IN < 9.97e-3].any()
    np.testing.assert_allclose(parts["cutting"][IN > 10e-3], 0.0776)


@pytest.mark.parametrize("hole", [-1e-3, 1e-6, 3e-3, np.nan])
def test_a_hole_no_deeper_than_the_puncture_is_refused(hole):
    with pytest.raises(InputError, match="hole"):
        Specimen().force(IN, hole=hole)


def test_another_cutting_law_can_be_used():
    forces = []

    def cutting(force):
        forces.append(force)
        return Specimen().model().cutting

    Specimen(cutting_force=0.05, cutting=cutting).force(IN)
    assert forces and set(forces) == {0.05}


@pytest.mark.parametrize("bad", [{"dimple": -1.0}, {"spreading_force": np.nan}, {"second_friction_ratio": -0.1}])
def test_impossible_specimens_are_refused(bad):
    with pytest.raises(InputError, match=next(iter(bad))):
        Unmodelled(**bad)


def test_a_dimple_deeper_than_the_puncture_is_refused():
    with pytest.raises(InputError, match="dimple_ratio"):
        Specimen(unmodelled=Unmodelled(dimple=4e-3)).force(IN)
