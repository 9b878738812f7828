# SPDX-License-Identifier: Apache-2.0
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad, solve_bvp

import needleforce as nf
from needleforce.identification import Estimate
from needleforce.identification.models import derived, implied_poisson_ratio
from needleforce.mechanics.foundation import (
    READINGS,
    bending_length,
    deflection_length,
    foundation_energy,
    foundation_pressure,
)

NEEDLE, TISSUE = nf.Needle(outer_diameter=0.7e-3, length=0.08, young_modulus=14.1e9), nf.Tissue(116e3, 0.45)


@pytest.mark.parametrize("reading", READINGS)
def test_friction_coefficient_is_the_inverse_of_friction_per_length(reading):
    tissue = nf.Tissue(116e3, 0.45)
    force = nf.friction_per_length(NEEDLE, tissue, 0.3, reading=reading)
    assert nf.friction_coefficient(force, NEEDLE, tissue, reading=reading) == pytest.approx(0.3, rel=1e-14)


@given(st.floats(1e8, 1e12), st.floats(1e3, 1e7))
def test_the_foundation_modulus_scales_with_both_moduli(needle_modulus, tissue_modulus):
    base = nf.foundation_modulus(NEEDLE, nf.Tissue(116e3, 0.5))
    other = nf.foundation_modulus(NEEDLE.replace(young_modulus=needle_modulus), nf.Tissue(tissue_modulus, 0.5))
    ratio = (tissue_modulus / 116e3) ** (13 / 12) * (needle_modulus / 14.1e9) ** (-1 / 12)
    assert other == pytest.approx(ratio * base, rel=1e-12)


def test_the_foundation_modulus_of_a_solid_needle_does_not_depend_on_its_diameter():
    tissue = nf.Tissue(116e3, 0.5)
    thick = nf.foundation_modulus(NEEDLE.replace(outer_diameter=2e-3), tissue)
    assert thick == pytest.approx(nf.foundation_modulus(NEEDLE, tissue), rel=1e-12)


def test_measured_friction_implies_the_published_coefficients():
    # the paper's 0.0186 N/mm and nu = 0.5; independent arithmetic on the readings
    expected = {"A": 0.745, "B": 0.237, "C": 0.347, "lame": 0.109, "literal_mm": 0.339}
    for reading, value in expected.items():
        found = nf.friction_coefficient(18.6, NEEDLE, nf.Tissue(116e3, 0.5), reading=reading)
        assert found == pytest.approx(value, abs=6e-4)


def test_reduced_modulus_and_poisson_ratio_are_inverse():
    for ratio in (0.1, 0.3, 0.49):
        found = nf.reduced_modulus(NEEDLE, nf.Tissue(116e3, ratio))
        assert implied_poisson_ratio(found, 116e3, NEEDLE) == pytest.approx(ratio, rel=1e-9)


@pytest.mark.parametrize(
    "ratio, spread, words",
    [
        (0.3, 0.01, "not measured"),
        (0.986, 0.01, "impossible, above the 0.5 of an incompressible tissue"),
        (0.6, 0.5, "outside 0 to 0.5, which the interval does not exclude"),
        (None, 0.01, "no ratio gives this"),
    ],
)
def test_an_implied_ratio_that_no_tissue_has_is_flagged(ratio, spread, words):
    needle = NEEDLE.replace(tip=nf.tips.Cone(half_angle=math.radians(15.0)))
    reduced = 100e3 if ratio is None else 1 / ((1 - needle.poisson_ratio**2) / 14.1e9 + (1 - ratio**2) / 116e3)

    def around(name, value, unit):
        return Estimate(name, value, unit, value * (1 - spread), value * (1 + spread))

    coefficient = 2 / math.pi * reduced * math.tan(math.radians(15.0))  # F = coefficient * h^2
    identified = [around("stiffness_coefficient", coefficient, "N/m^2"), around("friction_per_length", 18.6, "N/m")]
    tissue = around("tissue_young_modulus", 116e3, "Pa")
    found = derived({each.name: each for each in identified}, needle, tissue)["implied_poisson_ratio"]
    assert not found.identifiable and words in found.source and found.low <= found.high
    assert found.value == pytest.approx(math.nan if ratio is None else ratio, rel=1e-9, nan_ok=True)


def test_invalid_input_is_refused():
    with pytest.raises(nf.InputError, match="reading"):
        nf.friction_per_length(NEEDLE, nf.Tissue(1e5, 0.5), 0.3, reading="D")
    with pytest.raises(nf.InputError, match=r"poisson_ratio is missing.*32 %"):
        nf.Tissue(116e3)
    with pytest.raises(nf.InputError, match=r"tissue\.young_modulus is -1"):
        nf.Tissue(-1.0, 0.5)
    with pytest.raises(nf.InputError, match="inner_diameter"):
        NEEDLE.replace(inner_diameter=0.7e-3)


# the settlements [m] and stiffness [Pa/m] of the paper's needle; scale of the order of its settlement
SLOPE, SCALE = 71350.0 / (math.pi * 0.7e-3), 0.4e-3


@pytest.mark.parametrize("form", ("cubic", "hyperbolic", "tanh"))
def test_a_nonlinear_foundation_is_linear_for_small_settlements(form):
    for settlement in (1e-9, -1e-9):
        linear = SLOPE * settlement
        assert foundation_pressure(settlement, SLOPE, form=form, scale=SCALE) == pytest.approx(linear, rel=1e-5)
    assert foundation_pressure(1e-3, SLOPE, form=form) == pytest.approx(SLOPE * 1e-3)


def test_pressures_are_the_formulas_of_their_forms():
    u, k3, pu = 0.35e-3, SLOPE / SCALE**2, SLOPE * SCALE
    expected = {
        "linear": SLOPE * u,
        "cubic": SLOPE * u + k3 * u**3,
        "hyperbolic": SLOPE * u / (1 + SLOPE * u / pu),
        "tanh": pu * math.tanh(SLOPE * u / pu),
    }
    for form, pressure in expected.items():
        assert foundation_pressure(u, SLOPE, form=form, scale=SCALE) == pytest.approx(pressure, rel=1e-14)
        # friction per length grows with the pressure at the settlement D/2
        ratio = nf.friction_per_length(NEEDLE, TISSUE, 0.3, form=form, scale=SCALE)
        linear = nf.friction_per_length(NEEDLE, TISSUE, 0.3)
        assert ratio / linear == pytest.approx(pressure / (SLOPE * u), rel=1e-14)


def cubic_beam(stiffness, cubic, modulus, force, length):
    """Deflection [m] and its derivatives (4, n) along a beam on the core's cubic foundation, loaded at its tip and
    clamped at its base; solved in lengths of 1/beta and in deflections of a linear semi-infinite beam."""
    scale, beta = math.sqrt(modulus / cubic), (modulus / (4 * stiffness)) ** 0.25
    unit = 2 * force * beta / modulus

    def slope(_, y):
        pressure = [foundation_pressure(unit * each, modulus, form="cubic", scale=scale) for each in y[0]]
        return np.vstack([y[1:], -np.array(pressure)[None] / (stiffness * beta**4 * unit)])

    def ends(tip, base):
        return np.array([tip[2], tip[3] - 2.0, base[0], base[1]])

    places = beta * length * np.linspace(0.0, 1.0, 201)
    start = np.exp(-places) * np.array([np.cos(places), -np.cos(places), 0.0 * places, 2.0 * np.cos(places)])
    found = solve_bvp(slope, ends, places, start, tol=1e-8, max_nodes=20000)
    assert found.success, found.message
    return found.sol(places) * (unit * beta ** np.arange(4))[:, None]


# clamped beams under a load at the tip, computed independently to 1e-7: tip displacement [m]
BEAMS = (
    (14.1e9 * math.pi * 0.7e-3**4 / 64, 1e12, None, 0.05, 0.04, 0.00012980058880327056),
    (1.662e-4, 5e10, 71350.0, 0.0776, 0.12, 0.00021834895111897114),
)


@pytest.mark.parametrize("stiffness, cubic, modulus, force, length, tip", BEAMS)
def test_a_beam_on_the_cubic_foundation_bends_as_published_and_keeps_its_first_integral(
    stiffness, cubic, modulus, force, length, tip
):
    modulus = modulus or nf.foundation_modulus(NEEDLE, nf.Tissue(116e3, 0.5))
    y = cubic_beam(stiffness, cubic, modulus, force, length)
    assert y[0, 0] == pytest.approx(tip, rel=2e-7)
    scale = math.sqrt(modulus / cubic)
    energy = [foundation_energy(each, modulus, form="cubic", scale=scale) for each in y[0]]
    integral = stiffness * (y[1] * y[3] - 0.5 * y[2] ** 2) + np.array(energy)
    assert np.ptp(integral) < 1e-6 * max(energy)


def test_the_offset_of_the_law_has_the_mean_square_of_steady_steering():
    """w = (angle / beta) exp(-beta x) sin(beta x) of a beam attached to its path: its integral by quadrature."""
    modulus, force = nf.foundation_modulus(NEEDLE, TISSUE), 0.0776
    stiffness = NEEDLE.bending_stiffness
    beta, angle = (modulus / (4 * stiffness)) ** 0.25, force / math.sqrt(modulus * stiffness)
    squared = quad(lambda x: (angle / beta * math.exp(-beta * x) * math.sin(beta * x)) ** 2, 0.0, 30 / beta)[0]
    deflection, bending = deflection_length(NEEDLE, modulus, force), bending_length(NEEDLE, modulus)
    slope = NEEDLE.radius / deflection
    assert slope == pytest.approx(angle, rel=1e-12)
    assert slope**2 * bending**3 / 3 == pytest.approx(squared, rel=1e-9)


def test_unknown_forms_scales_and_forces_are_refused():
    with pytest.raises(nf.InputError, match="form"):
        foundation_pressure(1e-4, SLOPE, form="quadratic", scale=SCALE)
    with pytest.raises(nf.InputError, match="scale"):
        foundation_energy(1e-4, SLOPE, form="tanh", scale=0.0)
    with pytest.raises(nf.InputError, match="lateral_force"):
        deflection_length(NEEDLE, 71350.0, 0.0)
