# SPDX-License-Identifier: Apache-2.0
import pytest
from hypothesis import given
from hypothesis import strategies as st

import needleforce as nf
from needleforce.identification.models import implied_poisson_ratio
from needleforce.mechanics.foundation import READINGS

NEEDLE = nf.Needle(outer_diameter=0.7e-3, length=0.08, young_modulus=14.1e9)


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


def test_invalid_input_is_refused():
    with pytest.raises(nf.InputError, match="reading"):
        nf.friction_per_length(NEEDLE, nf.Tissue(1e5, 0.5), 0.3, reading="D")
    with pytest.raises(nf.InputError, match=r"poisson_ratio is missing.*32 %"):
        nf.Tissue(116e3)
    with pytest.raises(nf.InputError, match=r"tissue\.young_modulus is -1"):
        nf.Tissue(-1.0, 0.5)
    with pytest.raises(nf.InputError, match="inner_diameter"):
        NEEDLE.replace(inner_diameter=0.7e-3)
