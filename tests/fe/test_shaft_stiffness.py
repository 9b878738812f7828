# SPDX-License-Identifier: Apache-2.0
"""The stiffness of dragged tissue: closed forms, a recording made by the condensed solid, and trends."""

import numpy as np
import pytest
from closed_forms import bonded_shaft_stiffness

import needleforce as nf
from needleforce import fe

RADIUS = 0.35e-3
GEL = fe.Elastic(10e3, 0.49)
LENGTHS = np.array([10e-3, 20e-3, 30e-3])


def test_on_a_half_space_it_is_that_of_a_pile():
    found = fe.shaft_stiffness(LENGTHS, RADIUS, GEL)
    np.testing.assert_allclose(found, bonded_shaft_stiffness(GEL, RADIUS, LENGTHS), rtol=0.08)
    np.testing.assert_allclose(fe.shaft_stiffness(LENGTHS, RADIUS, fe.Elastic(20e3, 0.49)), 2.0 * found, rtol=1e-9)


def test_specimens_that_are_held_closer_are_stiffer():
    small = {"block_radius": 20e-3, "block_depth": 35e-3}
    infinite = fe.shaft_stiffness(LENGTHS, RADIUS, GEL)
    free, cup = (
        fe.shaft_stiffness(LENGTHS, RADIUS, GEL, **small),
        fe.shaft_stiffness(LENGTHS, RADIUS, GEL, **small, sides="fixed"),
    )
    assert np.all(cup > 1.1 * free) and np.all(cup > 1.15 * infinite)
    near = fe.shaft_stiffness(LENGTHS, RADIUS, GEL, block_radius=10e-3, block_depth=35e-3, sides="fixed")
    assert np.all(near > cup)


def test_the_modulus_that_explains_a_stiffness_is_the_one_that_made_it():
    made = fe.shaft_stiffness(LENGTHS, RADIUS, fe.Elastic(37e3, 0.49), block_radius=20e-3, block_depth=35e-3)
    found = fe.modulus_of_shaft_stiffness(made, LENGTHS, RADIUS, block_radius=20e-3, block_depth=35e-3)
    np.testing.assert_allclose(found, 37e3, rtol=1e-9)
    assert np.all(fe.modulus_of_shaft_stiffness(made, LENGTHS, RADIUS) != pytest.approx(37e3, rel=0.02))


def test_a_recorded_reversal_has_the_modulus_of_its_block_with_the_right_geometry():
    for wide, error in ((10e-3, 0.20), (20e-3, 0.10), (40e-3, 0.0)):
        mesh = fe.axisymmetric_block(wide, 45e-3, 0.5 * RADIUS, needle_depth=30e-3)
        held = {"bottom": "fixed", "sides": "fixed"}
        tissue = fe.Tissue(mesh, fe.Elastic(30e3, 0.49), symmetry="axisymmetric", supports=held)
        model = nf.Model(
            nf.laws.Polynomial(linear=500.0, quadratic=0.0), nf.laws.PunctureForce(force=0.1),
            nf.laws.Coulomb(per_length=40.0, presliding=1e-9), nf.laws.ConstantCutting(force=0.0, unloading=1e-6),
        )  # fmt: skip
        insertion = fe.CondensedInsertion(tissue.condense(fe.NeedlePath(30e-3, 0.5e-3, RADIUS)), model)
        depth = np.concatenate([np.arange(-1e-3, 25e-3, 5e-6), np.arange(25e-3, 24.9e-3, -5e-6)])
        force = insertion.run(depth, np.full(len(depth), 1e-3))["force"]
        slope = np.polyfit(depth[-15:], force[-15:], 1)[0]
        embedded, geometry = insertion.tip, {"block_radius": wide, "block_depth": 45e-3, "sides": "fixed"}
        right = fe.modulus_of_shaft_stiffness(slope, embedded, RADIUS, **geometry)
        wrong = fe.modulus_of_shaft_stiffness(slope, embedded, RADIUS)
        assert right == pytest.approx(30e3, rel=0.06)
        assert wrong > (1.0 + error) * right


@pytest.mark.parametrize(
    "arguments, words",
    [
        ((1e-3, RADIUS, GEL), "must be at least four radii"),
        ((np.nan, RADIUS, GEL), "must be at least four radii"),
        ((10e-3, 0.0, GEL), "radius is 0.0 m, must be above 0"),
    ],
)
def test_lengths_out_of_range_are_named(arguments, words):
    with pytest.raises(nf.InputError, match=words):
        fe.shaft_stiffness(*arguments)
    with pytest.raises(nf.InputError, match=r"block is .*, the shaft is 30 mm"):
        fe.shaft_stiffness(LENGTHS, RADIUS, GEL, block_depth=20e-3)
    with pytest.raises(nf.InputError, match="support is missing"):
        fe.shaft_stiffness(LENGTHS, RADIUS, GEL, base="free")
