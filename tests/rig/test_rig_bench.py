# SPDX-License-Identifier: Apache-2.0
"""The bench tests: the exact rod against limits, and the small-deflection formula against the exact rod."""

import numpy as np
import pytest

from needleforce import InputError
from needleforce.rig.bench_tests import bend_needle, pull_tissue, tip_deflection

LENGTH, STIFFNESS = 80e-3, 1.6618e-4


def stream(seed):
    return np.random.Generator(np.random.PCG64(seed))


def small(force, position, length=LENGTH, stiffness=STIFFNESS):
    return force * position**2 * (3.0 * length - position) / (6.0 * stiffness)


def test_the_tip_deflection_of_the_papers_needle_is_that_of_the_elastica():
    assert tip_deflection(0.1, LENGTH, LENGTH, STIFFNESS) / LENGTH == pytest.approx(0.662, abs=5e-4)  # of the elastica
    assert small(0.1, LENGTH) > LENGTH  # the formula exceeds the length of the needle


@pytest.mark.parametrize(
    ("load", "deflection"),
    # Bisshopp and Drucker's curve, tabulated in textbooks on large deflections: F L^2 / EI and deflection / L
    [(1.0, 0.30172), (2.0, 0.49346), (3.0, 0.60325), (5.0, 0.71379), (10.0, 0.81061)],
)
def test_the_deflection_follows_the_published_curve_of_the_cantilever(load, deflection):
    assert tip_deflection(load, 1.0, 1.0, 1.0) == pytest.approx(deflection, abs=1e-5)


@pytest.mark.parametrize("position", [10e-3, 40e-3, 80e-3])
def test_small_forces_give_the_small_deflection_formula(position):
    forces = [load * STIFFNESS / position**2 for load in (0.1, 0.01)]
    over = [tip_deflection(force, position, LENGTH, STIFFNESS) / small(force, position) - 1.0 for force in forces]
    assert abs(over[1]) < 1e-4
    assert over[0] / over[1] == pytest.approx(100.0, rel=0.02)  # the first departure is of second order in the force


@pytest.mark.parametrize("position", [20e-3, 60e-3, 80e-3])
def test_numerical_integration_of_the_rod_agrees(position):
    from scipy.integrate import solve_bvp

    def slope(s, y):
        return np.vstack([y[1], -0.1 / STIFFNESS * np.cos(y[0])])

    s = np.linspace(0.0, position, 200)
    rod = solve_bvp(slope, lambda a, b: np.array([a[0], b[1]]), s, np.zeros((2, 200)), tol=1e-10, max_nodes=100_000)
    fine = np.linspace(0.0, position, 20_001)
    theta = rod.sol(fine)[0]
    expected = np.trapezoid(np.sin(theta), fine) + (LENGTH - position) * np.sin(theta[-1])
    assert tip_deflection(0.1, position, LENGTH, STIFFNESS) == pytest.approx(expected, rel=1e-7)


@pytest.mark.parametrize("bad", [(0.0, 1e-2), (np.nan, 1e-2), (0.1, 0.0), (0.1, 0.1)])
def test_impossible_loads_are_refused(bad):
    with pytest.raises(InputError, match="bending"):
        tip_deflection(*bad, LENGTH, STIFFNESS)


def test_the_readings_agree_with_small_deflections_and_the_needles_modulus():
    second_moment = np.pi * 0.7e-3**4 / 64.0
    tests = [bend_needle(stream(seed)) for seed in range(200)]
    ratios = np.array([small(t.force, t.position, LENGTH, second_moment) / t.tip_deflection / e for t, e in tests])
    np.testing.assert_allclose(ratios.mean(axis=0), 1.0, atol=0.03)
    drawn = np.concatenate([moduli for _, moduli in tests])
    assert drawn.mean() == pytest.approx(14.1e9, abs=4 * 1.6e9 / np.sqrt(1000))
    assert drawn.std() == pytest.approx(1.6e9, rel=0.1)


def test_the_initial_slope_of_the_tension_test_is_the_tissues_modulus():
    curves = [pull_tissue(stream(seed)) for seed in range(200)]
    slopes = [np.polyfit(c.stretch[:11] - 1.0, c.stress[:11], 2)[1] for c in curves]
    assert np.mean(slopes) == pytest.approx(116e3, rel=0.02)
    ends = np.mean([c.stress[-1] for c in curves])
    assert ends == pytest.approx(116e3 / 3.0 * (1.2 - 1.2**-2), rel=0.005)


def test_the_tables_are_small_csv_files(tmp_path):
    bending, tension = bend_needle(stream(1))[0].write(tmp_path), pull_tissue(stream(1)).write(tmp_path)
    assert bending.name == "needle_bending.csv" and tension.name == "tissue_tension.csv"
    assert bending.read_text().splitlines()[0] == "position_mm,force_N,tip_deflection_mm"
    assert tension.read_text().splitlines()[0] == "stretch,stress_kPa"
    table = np.loadtxt(bending, delimiter=",", skiprows=1)
    np.testing.assert_allclose(table[:, 0], [6, 9, 12, 16, 20])


def test_a_table_in_a_missing_folder_is_refused(tmp_path):
    with pytest.raises(InputError, match="absent"):
        bend_needle(stream(1))[0].write(tmp_path / "absent")
