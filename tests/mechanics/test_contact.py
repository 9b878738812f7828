# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

import needleforce as nf

depths = st.floats(1e-6, 5e-2)
angles = st.floats(0.05, 1.5)
moduli = st.floats(1e2, 1e9)
radii = st.floats(1e-5, 1e-2)


def sneddon(half_angle, radius):
    """Depth and force over E_r by quadrature of Sneddon's eqs. (2), (3), with x = sin t."""
    slope = radius / np.tan(half_angle)
    depth = quad(lambda t: slope, 0, np.pi / 2)[0]
    force = 2 * radius * quad(lambda t: np.sin(t) ** 2 * slope, 0, np.pi / 2)[0]
    return depth, force


@given(angles, radii, moduli)
def test_the_cone_agrees_with_sneddons_integral(angle, radius, modulus):
    contact = nf.contact(nf.tips.Cone(half_angle=angle), contact_radius=radius, reduced_modulus=modulus)
    depth, force = sneddon(angle, radius)
    assert contact.depth == pytest.approx(depth, rel=1e-12)
    assert contact.force == pytest.approx(modulus * force, rel=1e-12)


@given(depths, angles, moduli, st.floats(0.1, 10))
def test_the_force_of_a_cone_scales_with_the_square_of_depth(depth, angle, modulus, factor):
    tip = nf.tips.Cone(half_angle=angle)
    force = nf.contact(tip, depth=np.array([depth, factor * depth]), reduced_modulus=modulus).force
    assert force[1] == pytest.approx(factor**2 * force[0], rel=1e-12)


@given(depths, angles, moduli, radii)
def test_slope_is_twice_modulus_times_radius_and_a_shank_reduces_the_force(depth, angle, modulus, radius):
    tip, at = nf.tips.Cone(half_angle=angle), depth * np.array([1 - 1e-6, 1, 1 + 1e-6])
    shank = nf.contact(tip, depth=at, reduced_modulus=modulus, shank_radius=radius)
    bare = nf.contact(tip, depth=at, reduced_modulus=modulus)
    assert (shank.force[2] - shank.force[0]) / (at[2] - at[0]) == pytest.approx(shank.slope[1], rel=1e-5)
    assert shank.slope[1] == 2 * modulus * shank.contact_radius[1]
    assert shank.force[1] <= bare.force[1] * (1 + 1e-12)


@given(depths, moduli, radii, st.floats(0.1, 10), st.floats(0.1, 10))
def test_force_and_energy_scale_with_their_dimensions(depth, modulus, radius, length, stiffness):
    tip = nf.tips.Cone(half_angle=0.3)
    one = nf.contact(tip, depth=depth, reduced_modulus=modulus, shank_radius=radius)
    other = nf.contact(tip, depth=length * depth, reduced_modulus=stiffness * modulus, shank_radius=length * radius)
    assert other.force == pytest.approx(stiffness * length**2 * one.force, rel=1e-9)
    assert other.energy == pytest.approx(stiffness * length**3 * one.energy, rel=1e-9)


def test_a_blunter_tip_needs_more_force_at_the_same_depth():
    force = [nf.contact(nf.tips.Cone(half_angle=a), depth=2e-3, reduced_modulus=1e5).force for a in (0.1, 0.3, 0.9)]
    assert force == sorted(force)


def test_results_have_the_shape_of_the_input():
    tip = nf.tips.Cone(half_angle=0.3)
    assert nf.contact(tip, depth=np.zeros((2, 3)), reduced_modulus=1e5).force.shape == (2, 3)
    assert isinstance(nf.contact(tip, depth=1e-3, reduced_modulus=1e5).force, float)


@pytest.mark.parametrize(
    "arguments",
    [
        {"reduced_modulus": 1e5},
        {"reduced_modulus": 1e5, "depth": 1e-3, "contact_radius": 1e-3},
        {"reduced_modulus": -1e5, "depth": 1e-3},
        {"reduced_modulus": np.nan, "depth": 1e-3},
        {"reduced_modulus": 1e5, "depth": np.nan},
        {"reduced_modulus": 1e5, "depth": 1e-3, "shank_radius": 0.0},
        {"reduced_modulus": 1e5, "contact_radius": 2e-3, "shank_radius": 1e-3},
        {"reduced_modulus": 1e5, "contact_radius": -1e-3},
    ],
)
def test_invalid_input_is_refused(arguments):
    with pytest.raises(nf.InputError):
        nf.contact(nf.tips.Cone(half_angle=0.3), **arguments)


@pytest.mark.parametrize("angle", [0.0, np.pi / 2, -0.1, np.nan])
def test_a_half_angle_outside_0_to_90_degrees_is_refused(angle):
    with pytest.raises(nf.InputError, match="half_angle"):
        nf.tips.Cone(half_angle=angle)


@pytest.mark.parametrize("argument", ["a", None, [0.3]])
def test_a_half_angle_that_is_not_a_number_is_refused(argument):
    with pytest.raises(nf.InputError, match=r"cone\.half_angle .* not a number"):
        nf.tips.Cone(half_angle=argument)
