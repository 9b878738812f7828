# SPDX-License-Identifier: Apache-2.0
"""A solid across a needle: closed forms of a disc and of a pile, layers, and a needle that bends in a solid."""

import numpy as np
import pytest

import needleforce as nf
from needleforce import fe
from needleforce.fe.elastic.lateral_foundation import lateral_compliance
from needleforce.mechanics.foundation import foundation_modulus

RADIUS = 0.5e-3
NEEDLE = nf.Needle(
    outer_diameter=2 * RADIUS, inner_diameter=0.0, length=0.15, young_modulus=3e9, poisson_ratio=0.3
)  # a polymer, which bends over a centimetre, as a small mesh can follow
STIFFNESS = NEEDLE.bending_stiffness


def disc_modulus(material, radius, outer):
    """Force per length over displacement of a rigid disc in a ring that is held at its outer radius, plane strain.

    Muskhelishvili's phi = A ln z + B z^2, psi = -kappa A ln z + C + D / z^2, with A = -F / (2 pi (1 + kappa)).
    """
    kappa = 3.0 - 4.0 * material.poisson_ratio
    held = (outer**2 - radius**2) / (kappa * (outer**2 + radius**2))
    return 2.0 * np.pi * material.shear_modulus * (1.0 + kappa) / (kappa * np.log(outer / radius) - held)


@pytest.mark.parametrize(("cell", "growth", "error"), [(0.5e-3, 0.4, 0.06), (0.15e-3, 0.1, 0.015)])
@pytest.mark.parametrize("ratio", [0.3, 0.49])
def test_a_slice_that_is_held_around_resists_as_a_disc_does(ratio, cell, growth, error):
    gel = fe.Elastic(10e3, ratio)
    depth = 4.0 * cell  # two cells, which are twice as long as wide
    mesh = fe.cylinder(8e-3, depth, cell, needle_depth=depth, growth=growth)
    held = {"bottom": "sliding", "top": "sliding", "sides": "fixed"}
    path = fe.NeedlePath(depth, 0.5 * depth, RADIUS)
    compliance = lateral_compliance(fe.Tissue(mesh, gel, supports=held), path)
    found = np.linalg.solve(compliance, np.ones(len(compliance))) / path.lengths
    np.testing.assert_allclose(found, found[0], rtol=1e-6)
    assert found[0] == pytest.approx(disc_modulus(gel, RADIUS, 8e-3), rel=error)


@pytest.fixture(scope="module")
def half_space():
    """A needle of 4 mm in a block a hundred radii wide."""
    mesh = fe.block((0.2, 0.2, 0.15), 2e-3, needle_depth=50e-3, growth=0.6)
    tissue = fe.Tissue(mesh, fe.Elastic(10e3, 0.3), supports={"bottom": "fixed", "sides": "fixed"})
    path = fe.NeedlePath(50e-3, 2e-3, 2e-3)
    return tissue, path, lateral_compliance(tissue, path)


@pytest.mark.parametrize("ratio", [pytest.param(300.0, marks=pytest.mark.long), 1000.0, 3000.0])
def test_the_head_of_a_pile_gives_way_as_published(half_space, ratio):
    # Randolph (1981), a fit of finite elements; the mesh, as coarse as the radius, is the stiffer one
    tissue, path, compliance = half_space
    shear = tissue.materials["tissue"].shear_modulus * (1.0 + 0.75 * 0.3)
    stiffness = ratio * shear * 0.25 * np.pi * path.radius**4
    critical = 2.0 * path.radius * ratio ** (2.0 / 7.0)
    published = ratio ** (1.0 / 7.0) / shear * 0.27 / (0.5 * critical)
    assert 0.85 < _head(compliance, path.nodes[1], stiffness) / published < 1.02


def test_steel_feels_three_times_the_modulus_of_vesic_with_the_width_of_the_source_paper():
    steel = nf.Needle(2.0 * RADIUS, 0.0, 0.2, 200e9, 0.3)
    mesh = fe.cylinder(0.1, 0.12, 1e-3, needle_depth=60e-3, growth=1.0)
    tissue = fe.Tissue(mesh, fe.Elastic(10e3, 0.49), supports={"bottom": "fixed", "sides": "fixed"})
    path = fe.NeedlePath(60e-3, 4e-3, RADIUS)
    found = fe.lateral_foundation(tissue, path, steel.bending_stiffness).layers[0].modulus
    vesic = foundation_modulus(steel, nf.Tissue(young_modulus=10e3, poisson_ratio=0.49))
    assert 2.5 < found / vesic < 4.0


def _head(compliance, spacing, stiffness):
    """Displacement of a beam's first node per force on it, by minimising energy over a space of splines."""
    from scipy.interpolate import BSpline

    count = len(compliance)
    ends = np.concatenate([[0.0] * 3, np.arange(count), [count - 1.0] * 3]) * spacing
    basis = BSpline(ends, np.eye(count + 2), 3)
    at, weights = np.polynomial.legendre.leggauss(4)
    places = (np.arange(count - 1)[:, None] + 0.5 * (1.0 + at)).ravel() * spacing
    bent = basis.derivative(2)(places)
    values = basis(np.arange(count) * spacing)
    energy = stiffness * bent.T @ (np.tile(0.5 * spacing * weights, count - 1)[:, None] * bent)
    matrix = energy + values.T @ np.linalg.solve(compliance, values)
    return values[0] @ np.linalg.solve(matrix, values[0])


def free_tip_deflection(stiffness, modulus, length):
    """Of the end of a beam with two free ends, per force on it: Hetenyi (1946), section 22."""
    beta = (0.25 * modulus / stiffness) ** 0.25
    at = beta * length
    ends = np.sinh(at) ** 2 - np.sin(at) ** 2
    return 2.0 * beta / modulus * (np.sinh(at) * np.cosh(at) - np.sin(at) * np.cos(at)) / ends


@pytest.fixture(scope="module")
def gel():
    mesh = fe.cylinder(15e-3, 30e-3, 0.5e-3, needle_depth=24e-3, growth=0.8)
    return fe.Tissue(mesh, fe.Elastic(20e3, 0.49), supports={"bottom": "fixed", "sides": "fixed"})


@pytest.fixture(scope="module")
def path():
    return fe.NeedlePath(24e-3, 1e-3, RADIUS)


@pytest.fixture(scope="module")
def found(gel, path):
    return fe.lateral_foundation(gel, path, STIFFNESS)


def test_the_foundation_gives_the_needle_the_deflection_of_the_solid(found):
    assert found.labels == ("tissue",) and found.layers[0].top == 0.0
    modulus = found.layers[0].modulus
    exact = free_tip_deflection(STIFFNESS, modulus, found.tip_depth[-1])
    assert found.deflection[-1] == pytest.approx(exact, rel=0.01)
    decay = (4.0 * STIFFNESS / modulus) ** 0.25
    long = found.tip_depth > 1.8 * decay
    assert long.sum() > 3
    np.testing.assert_allclose(found.deflection[long], found.solid_deflection[long], rtol=0.05)
    assert 20e3 < modulus < 60e3  # one to three times the modulus of the tissue


def test_a_stiffer_needle_feels_softer_tissue_as_on_a_half_space(gel, path, found):
    # Biot (1937), Vesic (1961): the modulus goes with the -1/12 power of the bending stiffness
    softer = fe.lateral_foundation(gel, path, 0.1 * STIFFNESS)
    long = softer.tip_depth > 2.0 * (0.4 * STIFFNESS / softer.layers[0].modulus) ** 0.25
    np.testing.assert_allclose(softer.deflection[long], softer.solid_deflection[long], rtol=0.12)
    power = np.log(softer.layers[0].modulus / found.layers[0].modulus) / np.log(10.0)
    assert 0.5 / 12.0 < power < 2.0 / 12.0


def test_a_base_that_moves_aside_meets_a_foundation_that_is_too_stiff(found):
    modulus = found.layers[0].modulus
    on_foundation = free_tip_deflection(STIFFNESS, modulus, 24e-3)
    assert 1.3 < _head(found.compliance, 1e-3, STIFFNESS) / on_foundation < 1.7


def test_stiffer_tissue_and_needle_keep_their_proportion(gel, path, found):
    stiffer = fe.lateral_foundation(gel.with_materials(fe.Elastic(40e3, 0.49)), path, 2.0 * STIFFNESS)
    assert stiffer.layers[0].modulus == pytest.approx(2.0 * found.layers[0].modulus, rel=1e-9)


def test_each_layer_has_its_own(path):
    mesh = fe.cylinder(15e-3, 30e-3, 0.5e-3, needle_depth=24e-3, growth=0.8, layers=[("soft", 12e-3), ("stiff", 1.0)])
    moduli = {"soft": fe.Elastic(10e3, 0.49), "stiff": fe.Elastic(40e3, 0.49)}
    tissue = fe.Tissue(mesh, moduli, supports={"bottom": "fixed", "sides": "fixed"})
    found = fe.lateral_foundation(tissue, path, STIFFNESS)
    assert found.labels == ("soft", "stiff")
    assert [layer.top for layer in found.layers] == pytest.approx([0.0, 12e-3], abs=0.05e-3)
    assert found.layers[1].modulus / found.layers[0].modulus == pytest.approx(4.0, rel=0.35)
    np.testing.assert_allclose(found.deflection[-4:], found.solid_deflection[-4:], rtol=0.1)


def test_what_has_no_foundation_is_named(gel, path):
    flat = fe.Tissue(fe.axisymmetric_block(25e-3, 50e-3, 0.5e-3), fe.Elastic(20e3, 0.4), symmetry="axisymmetric")
    with pytest.raises(nf.InputError, match="only in space"):
        fe.lateral_foundation(flat, path, STIFFNESS)
    with pytest.raises(nf.InputError, match="bending_stiffness is nan"):
        fe.lateral_foundation(gel, path, np.nan)
    with pytest.raises(nf.InputError, match="a lateral load decays over"):
        fe.lateral_foundation(gel, fe.NeedlePath(24e-3, 4e-3, RADIUS), 1e-3 * STIFFNESS)
    thin = fe.cylinder(
        15e-3, 30e-3, 0.5e-3, needle_depth=24e-3, growth=0.8, layers=[("a", 2.5e-3), ("b", 1.2e-3), ("c", 1.0)]
    )
    with pytest.raises(nf.InputError, match="layer is 2 from the surface, has no node"):
        fe.lateral_foundation(fe.Tissue(thin, fe.Elastic(20e3, 0.4)), fe.NeedlePath(24e-3, 2e-3, RADIUS), STIFFNESS)
    with pytest.raises(nf.InputError, match="nodes of the path is 2, must be 5"):
        fe.lateral_foundation(gel, fe.NeedlePath(24e-3, 24e-3, RADIUS), STIFFNESS)


MODEL = nf.preset("paper")
DEPTHS = np.concatenate([np.linspace(-1e-3, 35e-3, 721), np.linspace(35e-3, 20e-3, 301)[1:]])
# small slopes: the axial laws feel the depth alone
BEVEL = {"lateral": [nf.LateralLayer(modulus=30e3, tip_force=0.05)], "guide_distance": 20e-3, "small_slopes": True}


def table(compliance, count=41):
    """Tissue that falls off along the path, without a mesh."""
    apart = np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
    return fe.CondensedTissue(1e-3, compliance * np.exp(-0.25 * apart))


@pytest.mark.parametrize("planar", [True, False])
def test_a_needle_in_tissue_that_does_not_give_is_one_on_the_axial_law(planar):
    solid = nf.FlexibleInsertion(MODEL, NEEDLE, planar=planar, tissue=table(1e-9), **BEVEL)
    axial = nf.FlexibleInsertion(MODEL, NEEDLE, planar=planar, **BEVEL)
    here, there = (each.run(DEPTHS, dt=5e-3) for each in (solid, axial))
    inside = DEPTHS > 2e-3
    np.testing.assert_allclose(here["tip"], there["tip"], atol=2e-4 * np.abs(there["tip"][:, 0]).max())
    np.testing.assert_allclose(here["wrench"][inside], there["wrench"][inside], atol=0.02 * here["force"].max())


def test_along_the_axis_it_is_the_insertion_into_the_solid():
    tissue = table(2e-3)
    needle = nf.FlexibleInsertion(MODEL, NEEDLE, tissue=tissue, **BEVEL)
    alone = fe.CondensedInsertion(tissue, MODEL)
    dt = np.full(len(DEPTHS), 5e-3)
    bent = needle.run(DEPTHS, dt=dt)
    np.testing.assert_allclose(bent["force"], alone.run(DEPTHS, dt)["force"], atol=2e-3 * bent["force"].max())
    assert np.abs(needle.shape()[:, 0]).max() > 1e-4


def test_a_needle_in_a_solid_continues_from_its_bytes_and_ends_with_its_path():
    needle = nf.FlexibleInsertion(MODEL, NEEDLE, tissue=table(2e-3), **BEVEL)
    needle.run(DEPTHS, dt=5e-3)
    kept, other = needle.save(), nf.FlexibleInsertion(MODEL, NEEDLE, tissue=table(2e-3), **BEVEL)
    other.restore(kept)
    one, two = (each.step(22e-3, dt=5e-3) for each in (needle, other))
    assert one.force == two.force and np.array_equal(one.wrench, two.wrench)
    with pytest.raises(nf.InputError, match="altered"):
        nf.FlexibleInsertion(MODEL, NEEDLE, tissue=table(3e-3), **BEVEL).restore(kept)
    needle.run(np.linspace(22e-3, 40e-3, 100), dt=5e-3)
    assert needle.step(40.5e-3, dt=5e-3).status == "outside_range"


def test_a_needle_needs_a_model_and_a_condensed_solid(gel):
    with pytest.raises(nf.InputError, match="model is None, needed with a tissue"):
        nf.FlexibleInsertion(None, NEEDLE, lateral=20e3, tissue=table(1e-3))
    with pytest.raises(nf.InputError, match="tissue is Tissue, not a Condensed"):
        nf.FlexibleInsertion(MODEL, NEEDLE, lateral=20e3, tissue=gel)


@pytest.mark.parametrize("stiffness", [1.5e-5, pytest.param(1.5e-4, marks=pytest.mark.long)])
def test_thin_soft_layers_over_stiff_ones_have_moduli_that_grow_with_what_is_below(stiffness):
    mesh = fe.cylinder(15e-3, 30e-3, 0.5e-3, needle_depth=24e-3, growth=0.8, layers=[("a", 2e-3), ("b", 1.0)])
    path, found = fe.NeedlePath(24e-3, 1e-3, RADIUS), []
    for ratio in (3.0, 100.0):
        materials = {"a": fe.Elastic(5e3, 0.49), "b": fe.Elastic(ratio * 5e3, 0.49)}
        tissue = fe.Tissue(mesh, materials, supports={"bottom": "fixed", "sides": "fixed"})
        foundation = fe.lateral_foundation(tissue, path, stiffness)
        found.append([layer.modulus / 5e3 for layer in foundation.layers])
        assert foundation.deflection[-1] == pytest.approx(foundation.solid_deflection[-1], rel=0.12)
    top, below = np.transpose(found)
    assert np.all(top > 1.0) and np.all(top < 8.0)
    # in proportion, but for a decay length that falls to two spacings
    assert np.all(below / [3.0, 100.0] > 1.5) and np.all(below / [3.0, 100.0] < 6.0)


def test_a_needle_on_the_surface_of_a_solid_is_held_as_on_tissue_that_does_not_give():
    thin = nf.Needle(0.35e-3, 0.0, 0.15, 60e9, 0.3)
    settings = {"lateral": 3e4, "guide_distance": 60e-3, "planar": True}
    for tissue in (None, table(2e-3)):
        needle = nf.FlexibleInsertion(MODEL, thin, tissue=tissue, **settings)
        needle.run(np.linspace(-1e-3, 3e-3, 401), dt=5e-3)
        assert not needle.step(3e-3, dt=5e-3).buckled
        assert needle.step(3e-3 + 5e-8, dt=5e-3).status == "ok"


def test_a_needle_that_left_elsewhere_punctures_again():
    peaks = []
    for tissue in (None, table(2e-3)):
        needle = nf.FlexibleInsertion(MODEL, NEEDLE, tissue=tissue, **BEVEL)
        needle.run(np.linspace(-1e-3, 20e-3, 421), dt=5e-3)
        aside = np.stack([np.linspace(0.0, 8e-3, 400), np.zeros(400)], axis=1)
        needle.run(np.linspace(20e-3, 0.0, 401)[1:], aside, dt=5e-3)
        peaks.append(needle.run(np.linspace(0.0, 5e-3, 501)[1:], (8e-3, 0.0), dt=5e-3)["force"][:320].max())
    assert peaks[1] == pytest.approx(peaks[0], rel=1e-3)


def test_wrong_kinds_of_values_are_named(gel, path, found):
    with pytest.raises(nf.InputError, match="tissue is Mesh, not a Tissue"):
        fe.lateral_foundation(gel.mesh, path, STIFFNESS)
    with pytest.raises(nf.InputError, match="path is None"):
        fe.lateral_foundation(gel, None, STIFFNESS)
    for wrong in ("1e-4", None, [1e-4], True, 1e300, 0.0):
        with pytest.raises(nf.InputError, match="bending_stiffness"):
            fe.lateral_foundation(gel, path, wrong)
    with pytest.raises(nf.InputError, match="outside the mesh"):
        fe.lateral_foundation(gel, fe.NeedlePath(60e-3, 2e-3, RADIUS), STIFFNESS)
    with pytest.raises(nf.InputError, match="not a CondensedTissue"):
        nf.FlexibleInsertion(MODEL, NEEDLE, lateral=20e3, tissue=found)
    with pytest.raises(nf.InputError, match="neither a number nor layers"):
        nf.FlexibleInsertion(MODEL, NEEDLE, lateral="20e3")
    wide = fe.CondensedTissue(1e-3, table(1e-3).compliance, radius=2e-3)
    with pytest.raises(nf.InputError, match=r"radius of the needle is 0.5 mm, the tissue is condensed for 2 mm"):
        nf.FlexibleInsertion(MODEL, NEEDLE, lateral=20e3, tissue=wide)
    assert nf.FlexibleInsertion(MODEL, NEEDLE, lateral=found).lateral == list(found.layers)
    assert nf.FlexibleInsertion(MODEL, NEEDLE, lateral=np.float32(2e4)).lateral[0].modulus == 2e4
