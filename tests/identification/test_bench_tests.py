# SPDX-License-Identifier: Apache-2.0
"""Needle modulus from bending, tissue modulus from tension: closed forms, noise, and published rubber."""

import numpy as np
import pytest

import needleforce as nf
from needleforce.identification.bench_tests import (
    cantilever_deflection,
    needle_estimate,
    needle_modulus,
    nominal_stress,
    tissue_estimate,
    tissue_modulus,
)

NEEDLE = nf.Needle(outer_diameter=0.7e-3, length=0.08, young_modulus=14.1e9)
POSITIONS = np.array([8e-3, 12e-3, 16e-3, 20e-3])


def test_exact_readings_give_the_modulus_and_the_slack():
    deflection = cantilever_deflection(0.1, POSITIONS, NEEDLE) + 0.2e-3
    found = needle_modulus(np.full(4, 0.1), POSITIONS, deflection, NEEDLE)
    assert found.young_modulus == pytest.approx(14.1e9, rel=1e-9)
    assert found.slack == pytest.approx(0.2e-3, rel=1e-6)


def test_the_interval_holds_the_truth():
    random, inside = np.random.default_rng(0), 0
    for _ in range(400):
        reading = cantilever_deflection(0.1, POSITIONS, NEEDLE) * (1.0 + random.normal(0, 0.05, 4))
        found = needle_modulus(np.full(4, 0.1), POSITIONS, reading, NEEDLE)
        inside += found.low <= 14.1e9 <= found.high
    assert 0.92 <= inside / 400 <= 0.98


def test_large_deflections_are_left_out():
    position = np.append(POSITIONS, [40e-3, 80e-3])
    deflection = cantilever_deflection(0.1, position, NEEDLE)
    deflection[-2:] *= 0.7  # what a real needle does there
    found = needle_modulus(np.full(6, 0.1), position, deflection, NEEDLE)
    assert list(found.used) == [True] * 4 + [False] * 2
    assert found.young_modulus == pytest.approx(14.1e9, rel=1e-9)
    with pytest.raises(nf.InputError, match="small deflections"):
        needle_modulus(np.full(3, 0.1), np.array([0.05, 0.06, 0.08]), np.array([0.03, 0.04, 0.05]), NEEDLE)


@pytest.mark.parametrize(
    "law, coefficients, modulus",
    [
        ("linear", [116e3], 116e3),
        ("neo_hookean", [116e3 / 3], 116e3),
        ("mooney", [15e3, 4e3], 6 * 19e3),
        ("yeoh", [19e3, 500.0, 30.0], 6 * 19e3),
    ],
)
def test_each_law_finds_its_own_initial_slope(law, coefficients, modulus):
    stretch = np.linspace(0.9, 1.25, 30)
    found = tissue_modulus(stretch, nominal_stress(law, stretch, coefficients), law=law)
    assert found.young_modulus == pytest.approx(modulus, rel=1e-6)
    step = 1e-6
    slope = np.diff(nominal_stress(law, [1 - step, 1 + step], coefficients))[0] / (2 * step)
    assert slope == pytest.approx(modulus, rel=1e-6)


def test_a_law_that_softens_on_the_data_is_refused():
    stretch = np.linspace(1.01, 1.3, 30)
    with pytest.raises(nf.InputError, match="softens"):
        tissue_modulus(stretch, 1e5 * (stretch - 1) * (1.2 - stretch) + 1e3, law="mooney")


def test_published_rubber(recordings):
    # Treloar 1944: his shear modulus of 0.39 N/mm^2 fits small and moderate strains of this rubber; E = 3 G
    stress, stretch = np.loadtxt(recordings / "tension" / "Treloar_1944_UT_stress_stretch.txt").T
    found = tissue_modulus(stretch, 1e6 * stress, largest_strain=0.6)
    assert found.young_modulus == pytest.approx(3 * 0.39e6, rel=0.1)


def test_tables(tmp_path):
    bending, tension = tmp_path / "needle.csv", tmp_path / "tissue.csv"
    rows = np.column_stack([1e3 * POSITIONS, np.full(4, 100.0), 1e3 * cantilever_deflection(0.1, POSITIONS, NEEDLE)])
    np.savetxt(bending, rows, delimiter=",", header="position_mm,force_mN,tip_deflection_mm", comments="")
    assert needle_estimate(bending, NEEDLE).value == pytest.approx(14.1e9, rel=1e-6)
    stretch = np.linspace(1.0, 1.2, 20)
    rows = np.column_stack([stretch, 1e-3 * nominal_stress("neo_hookean", stretch, [116e3 / 3])])
    np.savetxt(tension, rows, delimiter=",", header="stretch,stress_kPa", comments="")
    assert tissue_estimate(tension).value == pytest.approx(116e3, rel=1e-6)


@pytest.mark.parametrize(
    "text, message",
    [
        ("", "No columns"),
        ("stretch,stress\n1,2\n", "stress_"),
        ("stress_kPa\n1\n", "stretch"),
        ("stretch,stress_kPa\n1,x\n2,3\n", "stress_kPa"),
        ("stretch,stress_kPa\n1,\n2,3\n", "must be finite"),
        ("stretch,stress_kPa\n1,0\n1.1,3\n", "at least 3 are needed"),
    ],
)
def test_invalid_tables_raise_an_error(tmp_path, text, message):
    (tmp_path / "t.csv").write_text(text)
    with pytest.raises(nf.InputError, match=message):
        tissue_estimate(tmp_path / "t.csv")
