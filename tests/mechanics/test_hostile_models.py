# SPDX-License-Identifier: Apache-2.0
"""Invalid and extreme input to models, layers, motions and contacts."""

import numpy as np
import pytest

import needleforce as nf

PAPER = nf.preset("paper")


def test_a_velocity_of_minus_zero_counts_as_insertion():
    for name in ("paper", "lugre", "okamura_liver", "stick_slip"):
        model = nf.preset(name)
        assert model.force([20e-3], [-0.0])[0] == model.force([20e-3], [0.0])[0] > 0.0


@pytest.mark.parametrize(
    "make",
    [
        lambda: nf.laws.Coulomb(18.6),
        lambda: nf.preset("paper").needle,
        lambda: nf.tips.LancetBevel(0.26, "equal_length"),
        lambda: nf.tips.Profile([0.0, 1e-4, 3e-4], [0.0, 1e-4, 5e-4]),
        lambda: nf.preset("blunted_cone"),
        lambda: nf.preset("layered"),
    ],
)
def test_equal_values_have_equal_hashes(make):
    assert make() == make() and len({make(), make()}) == 1


@pytest.mark.parametrize("change", [{"stiffness": None}, {"stiffness": PAPER.friction}, {"relaxation": "prony"}])
def test_a_law_of_another_family_is_refused_with_the_name_of_the_family(change):
    with pytest.raises(nf.InputError, match=f"{next(iter(change))}.*not a law of"):
        PAPER.replace(**change)


def test_deeper_layers_are_stored_as_a_tuple_and_checked():
    layer = nf.Layer(5e-3, PAPER.stiffness, nf.laws.PunctureDepth(0.0), PAPER.friction, PAPER.cutting)
    assert PAPER.replace(deeper=[layer]) == PAPER.replace(deeper=(layer,))
    with pytest.raises(nf.InputError, match="not a Layer"):
        PAPER.replace(deeper=(1,))
    for top in ("5", None, True):
        with pytest.raises(nf.InputError, match="top"):
            nf.Layer(top, PAPER.stiffness, PAPER.puncture, PAPER.friction, PAPER.cutting)


@pytest.mark.parametrize(
    "bad", [{"max_speed": -1.0}, {"max_speed": np.nan}, {"hold_time": -1.0}, {"hold_time": np.inf}]
)
def test_invalid_limits_of_an_insertion_are_refused_before_the_loop(bad):
    with pytest.raises(nf.InputError, match=next(iter(bad))):
        nf.Insertion(PAPER, **bad)


@pytest.mark.parametrize("moves", [((np.nan, 1.0),), ((np.inf, 1.0),), ((1e-3, -1.0),)])
def test_impossible_motions_are_refused(moves):
    with pytest.raises(nf.InputError, match="motion"):
        nf.Motion(0.0, moves)


def test_the_contact_of_the_second_layer_is_checked_too():
    deep = nf.Layer(6e-3, nf.laws.Cone(1e5, 0.26), nf.laws.PunctureDepth(5e-3), PAPER.friction, PAPER.cutting)
    model = nf.preset("physical").replace(deeper=(deep,))
    assert any("0.847 mm" in warning for warning in model.warnings)


def test_the_pressure_at_one_radius_is_one_number():
    contact = nf.contact(nf.tips.Cone(0.5), reduced_modulus=1e5, depth=1e-3)
    # p = E_r cot(alpha) / 2 arccosh(a / r), Sneddon 1965
    expected = 0.5e5 / np.tan(0.5) * np.arccosh(contact.contact_radius / 1e-4)
    assert float(contact.pressure(1e-4)) == pytest.approx(expected, rel=1e-7)


def test_functions_that_return_no_slopes_are_refused():
    for slope in (lambda r: "steep", lambda r: np.ones(3), lambda r: 1j * r):
        with pytest.raises(nf.InputError, match="slope"):
            nf.contact(slope, reduced_modulus=1e5, contact_radius=1e-3)
    with pytest.raises(nf.InputError, match="deeper than the profile"):
        nf.contact(lambda r: 1e-6 / (r * r + 1e-6), reduced_modulus=1e5, depth=[1e-4, 2e-3])


def test_travel_above_the_tissue_loads_no_friction():
    model = nf.preset("physical").replace(friction=nf.laws.Coulomb(40.0, presliding=1e-2))
    forces = []
    for start in (0.0, -1e-3, -20e-3):
        depth = np.linspace(start, 3.3e-3, 5000)
        forces.append(nf.Insertion(model).run(depth, None, np.full(5000, 1e-2))["force"][-1])
    assert np.ptp(forces) < 1e-12
