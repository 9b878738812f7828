# SPDX-License-Identifier: Apache-2.0
"""Every tip against quadrature by SciPy, its limits, and invalid tips."""

import math
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

import needleforce as nf
from needleforce.preset_files.schema import tips

R, ANGLE = 0.35e-3, math.radians(15)
KNOTS = nf.tips.Profile([0, 5e-5, 1.2e-4, 2e-4, R], [0, 2e-5, 1e-4, 3e-4, 1e-3])
TIPS = [
    nf.tips.Cone(ANGLE),
    nf.tips.Paraboloid(R),
    nf.tips.Sphere(R),
    nf.tips.Flat(R),
    nf.tips.PowerProfile(1.5, 1e-3, 4e-3),
    nf.tips.TruncatedCone(ANGLE, 5e-5),
    nf.tips.BluntedCone(ANGLE, 2e-5),
    nf.tips.BluntedCone(ANGLE, 2e-5, 2e-5 * math.cos(ANGLE)),
    nf.tips.TangentOgive(R, 1.3e-3),
    nf.tips.LancetBevel(ANGLE, equivalence="equal_volume"),
    KNOTS,
]
each_tip = pytest.mark.parametrize("tip", TIPS, ids=repr)
GROWING = [tip for tip in TIPS if tip.flat < R]


def breaks_of(tip):
    return {
        "blunted_cone": lambda: [tip.transition_radius or tip.tip_radius / math.tan(ANGLE)],
        "truncated_cone": lambda: [tip.flat_radius],
        "profile": lambda: tip.radii[1:],
    }.get(tip.name, list)()


def sneddon(tip, a):
    """Depth and force over E_r by adaptive quadrature of Sneddon's integrals, with r = a sin t."""
    at = [math.asin(b / a) for b in breaks_of(tip) if b < a]
    options = {"points": at or None, "epsabs": 0, "epsrel": 1e-13, "limit": 200}
    depth = quad(lambda t: a * tip.slope(a * math.sin(t)), 0, math.pi / 2, **options)[0]
    force = quad(lambda t: 2 * a**2 * math.sin(t) ** 2 * tip.slope(a * math.sin(t)), 0, math.pi / 2, **options)[0]
    return depth, force


@pytest.mark.parametrize("share", [0.2, 0.5, 0.9, 0.999])
@pytest.mark.parametrize("tip", GROWING, ids=repr)
def test_every_tip_agrees_with_sneddons_integral(tip, share):
    contact = nf.contact(tip, contact_radius=share * R, reduced_modulus=1e5)
    depth, force = sneddon(tip, share * R)
    assert contact.depth == pytest.approx(depth, rel=1e-10)
    assert contact.force == pytest.approx(1e5 * force, rel=1e-10)
    back = nf.contact(tip, depth=contact.depth, reduced_modulus=1e5)
    assert back.contact_radius == pytest.approx(share * R, rel=1e-11)
    assert back.force == pytest.approx(contact.force, rel=1e-11)


@each_tip
def test_energy_and_slope_agree_with_the_force_and_the_law_with_the_contact(tip):
    depth = np.linspace(0, 4e-3, 2001)
    contact = nf.contact(tip, depth=depth, reduced_modulus=1e5, shank_radius=R)
    law = nf.laws.TipContact(1e5, R, tip)
    middle = 0.5 * (depth[1:] + depth[:-1])
    rise = nf.contact(tip, depth=middle, reduced_modulus=1e5, shank_radius=R)
    slope = np.diff(contact.force) / np.diff(depth)
    # for a power below 2 the first differences are not derivatives
    np.testing.assert_allclose(slope[5:], rise.slope[5:], rtol=3e-3, atol=1e-3 * rise.slope.max())
    np.testing.assert_allclose(np.diff(contact.energy), rise.force * np.diff(depth), rtol=2e-3, atol=1e-11)
    assert law.force(3e-3) == pytest.approx(contact.force[1500], rel=1e-6)
    assert law.energy(3e-3) == pytest.approx(contact.energy[1500], rel=1e-6)
    assert law.slope(3e-3) == pytest.approx(contact.slope[1500], rel=1e-5)
    assert law.force(law.indentation(0.1)) == pytest.approx(0.1, rel=1e-12)


@each_tip
def test_the_integral_of_the_pressure_is_the_force(tip):
    for depth in (2e-4, 4e-3):
        contact = nf.contact(tip, depth=depth, reduced_modulus=1e5, shank_radius=0.3e-3)
        theta = (np.arange(4000) + 0.5) * math.pi / 8000
        r = contact.contact_radius * np.sin(theta)
        ring = 2 * math.pi * r * contact.contact_radius * np.cos(theta) * math.pi / 8000
        assert (contact.pressure(r) * ring).sum() == pytest.approx(contact.force, rel=1e-3)
    assert contact.pressure([0.31e-3, 1.0]).tolist() == [0.0, 0.0]
    pair = nf.contact(tip, depth=np.array([[1e-4, 2e-4, 0.0]]), reduced_modulus=1e5, shank_radius=0.3e-3)
    assert pair.pressure(np.zeros((2, 5)) + 1e-5).shape == (1, 3, 2, 5)


@each_tip
def test_tips_are_unchanged_by_pickle_and_repr(tip):
    assert pickle.loads(pickle.dumps(tip)) == tip and eval(f"nf.tips.{tip!r}") == tip
    law = nf.laws.TipContact(1e5, R, tip=tip)
    assert pickle.loads(pickle.dumps(law)) == law and eval(repr(law), vars(nf.laws) | vars(nf.tips)) == law
    assert law.replace(radius=2 * R).tip == tip and law != law.replace(tip=nf.tips.Cone(0.1))


def test_every_shape_is_tested():
    assert {type(tip) for tip in TIPS} == set(tips())


@settings(deadline=None)
@given(st.floats(1e-6, 5e-2), st.sampled_from(GROWING))
def test_a_shank_reduces_the_force_and_slope_is_twice_modulus_times_radius(depth, tip):
    at = depth * np.array([1 - 1e-5, 1, 1 + 1e-5])
    shank = nf.contact(tip, depth=at, reduced_modulus=1e5, shank_radius=0.2e-3)
    bare = nf.contact(tip, depth=at, reduced_modulus=1e5)
    assert (shank.force[2] - shank.force[0]) / (at[2] - at[0]) == pytest.approx(shank.slope[1], rel=1e-4)
    assert shank.force[1] <= bare.force[1] * (1 + 1e-12)


def test_sphere_and_ogive_never_saturate_and_remain_stable():
    depth = np.geomspace(1e-6, 1.0, 2000)
    for tip in (nf.tips.Sphere(R), nf.tips.TangentOgive(R, 1.3e-3)):
        contact = nf.contact(tip, depth=depth, reduced_modulus=1.0)
        assert (np.diff(contact.force) > 0).all() and (np.diff(contact.contact_radius) >= 0).all()
        assert (contact.contact_radius < R).all()
    # at a large depth a sphere acts as its shank: F = 2 E_r R h less a constant; E_r R^2 from F - a h at a -> R
    assert np.diff(contact.force[-2:])[0] / np.diff(depth[-2:])[0] == pytest.approx(2 * R, rel=1e-9)


def test_equivalent_cones_of_a_bevel_have_the_expected_angles():
    # tan of half the bevel, and thirds; 7.63 and 5.10 degrees for 15
    expected = {"paper_half_angle": 15.0, "equal_length": 7.6307, "equal_volume": 5.1037, "wedge_bisector": 7.5}
    for word, degrees in expected.items():
        cone = nf.tips.LancetBevel(ANGLE, word).equivalent_cone()
        assert math.degrees(cone.half_angle) == pytest.approx(degrees, abs=1e-3)
    assert nf.tips.LancetBevel(ANGLE).equivalence == "paper_half_angle"


def test_a_slope_function_agrees_with_the_tip():
    ogive = nf.tips.TangentOgive(R, 1.3e-3)
    rho = (R**2 + 1.3e-3**2) / (2 * R)
    options = {"depth": np.array([0.0, 2e-4, 1e-3, 3e-3]), "reduced_modulus": 1e5, "shank_radius": 0.3e-3}
    theirs = nf.contact(lambda r: (r + rho - R) / np.sqrt(rho**2 - (r + rho - R) ** 2), **options)
    ours = nf.contact(ogive, **options)
    np.testing.assert_allclose(theirs.force, ours.force, rtol=1e-10)
    np.testing.assert_allclose(theirs.energy, ours.energy, rtol=1e-7)
    np.testing.assert_allclose(theirs.pressure([1e-5, 1e-4]), ours.pressure([1e-5, 1e-4]), rtol=1e-6)


def test_a_slope_function_with_a_break_agrees_with_the_blunted_cone():
    b, cot = 2e-5 * math.cos(ANGLE), 1 / math.tan(ANGLE)
    radius = np.array([1e-5, 5e-5, 3e-4])
    theirs = nf.contact(
        lambda r: np.where(r < b, r / 2e-5, cot), contact_radius=radius, reduced_modulus=1.0, slope_breaks=[b]
    )
    ours = nf.contact(nf.tips.BluntedCone(ANGLE, 2e-5, b), contact_radius=radius, reduced_modulus=1.0)
    np.testing.assert_allclose(theirs.depth, ours.depth, rtol=1e-12)
    np.testing.assert_allclose(theirs.force, ours.force, rtol=1e-12)
    np.testing.assert_allclose(theirs.energy, ours.energy, rtol=1e-9)


@pytest.mark.parametrize(
    "slope, match",
    [
        (lambda r: 1.0 - 5e3 * r, r"slope is -.*radius.*not monotone|not monotone"),
        (lambda r: r / np.sqrt(np.maximum((1e-4) ** 2 - r**2, 0)), "vertical"),
        (lambda r: np.where(r < 1e-4, 3.0, 0.01), "contact radius .*jump|jump"),
        (lambda r: 0 * r, "Flat"),
        ("cone", "neither one of nf.tips nor a function"),
    ],
)
def test_functions_that_are_not_the_slope_of_a_profile_are_refused(slope, match):
    with pytest.raises(nf.InputError, match=match):
        nf.contact(slope, contact_radius=np.array([1e-4, 4e-4]), reduced_modulus=1e5)


@pytest.mark.parametrize(
    "radii, heights, match",
    [
        ([0, 1e-4, 2e-4], [0, 1e-4, 5e-5], r"heights\[2\] is 5e-05.*not monotone"),
        ([0, 1e-4, 2e-4], [1e-5, 1e-4, 2e-4], r"heights\[0\] is 1e-05, not 0"),
        ([1e-5, 1e-4, 2e-4], [0, 1e-4, 2e-4], r"radii\[0\] is 1e-05, not 0"),
        ([0, 1e-4, 1e-4], [0, 1e-4, 2e-4], r"radii\[2\] .*vertical"),
        ([0, 1e-4, 2e-4], [0, 1e-4, 1.5e-4], r"heights\[2\].*jump"),
        ([0, 1e-4, np.nan], [0, 1e-4, 1.5e-4], "not finite"),
        ([0, 1e-4], [0, 1e-4, 2e-4], "length of profile"),
        (np.linspace(0, 1, 33), np.linspace(0, 1, 33), "2 to 32 knots"),
        ([0, 1e-4], [0, 0], "Flat"),
        ("tip", [0, 1], "not a column"),
    ],
)
def test_knots_that_do_not_make_a_profile_are_refused(radii, heights, match):
    with pytest.raises(nf.InputError, match=match):
        nf.tips.Profile(radii, heights)


@pytest.mark.parametrize(
    "make, match",
    [
        (lambda: nf.tips.TangentOgive(1e-3, 0.5e-3), r"tangent_ogive\.length is 0\.0005, below the radius"),
        (lambda: nf.tips.BluntedCone(ANGLE, 2e-5, 1e-3), r"transition_radius is 0\.001.*slope would fall"),
        (lambda: nf.tips.LancetBevel(ANGLE, "equal_area"), "equivalence is 'equal_area'.*equal_volume"),
        (lambda: nf.laws.TipContact(1e5, R), "tip is missing"),
        (lambda: nf.laws.TipContact(1e5, R, tip=0.3), "tip is 0.3"),
        (lambda: nf.contact(nf.tips.Flat(R), contact_radius=R, reduced_modulus=1.0), "flat face"),
        (lambda: nf.contact(nf.tips.TruncatedCone(ANGLE, R), contact_radius=R / 2, reduced_modulus=1.0), "flat face"),
        (lambda: nf.contact(nf.tips.Sphere(R), contact_radius=R, reduced_modulus=1.0), "end of the tip"),
        (lambda: nf.contact(nf.tips.Cone(ANGLE), depth=R, reduced_modulus=1.0).pressure(-1.0), "radius is negative"),
    ],
)
def test_inconsistent_tips_and_contacts_are_refused(make, match):
    with pytest.raises(nf.InputError, match=match):
        make()


@each_tip
def test_a_needle_shows_its_tip_with_units(tip):
    needle = nf.Needle(outer_diameter=2 * R, length=0.1, young_modulus=70e9, poisson_ratio=0.3, tip=tip)
    shown = needle._repr_html_()
    assert "<table" in tip._repr_html_() and f"{type(tip).__name__} (" in shown
    assert repr(ANGLE) not in shown  # fifteen digits of radians
