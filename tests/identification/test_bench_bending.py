# SPDX-License-Identifier: Apache-2.0
"""Bending beyond small deflections: boundary value problems solved numerically, limits, and fits."""

import numpy as np
import pytest

import needleforce as nf
from needleforce.bench_tests import (
    elastica_deflection,
    needle_estimate,
    needle_modulus,
    three_point_load,
    three_point_modulus,
)
from needleforce.rig.bench_tests import bend_needle, tip_deflection

NEEDLE = nf.Needle(outer_diameter=0.7e-3, length=0.08, young_modulus=14.1e9)
EI = NEEDLE.bending_stiffness
POSITIONS = np.array([8e-3, 12e-3, 16e-3, 20e-3, 40e-3, 60e-3, 80e-3])
FORCE = np.full(len(POSITIONS), 0.1)


@pytest.mark.parametrize("load", [0.5, 1.0, 2.0, 5.0, 10.0])
def test_a_cantilever_agrees_with_the_boundary_value_problem(load):
    """theta'' = -load cos(theta) from the free end, where theta' = 0, with the slope there found by bisection."""
    from scipy.integrate import solve_ivp
    from scipy.optimize import brentq

    def clamped(slope):  # slope, curvature and deflection at the clamp
        rod = lambda s, y: [y[1], -load * np.cos(y[0]), np.sin(y[0])]  # noqa: E731
        return solve_ivp(rod, (1.0, 0.0), [slope, 0.0, 0.0], method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]

    slope = brentq(lambda end: clamped(end)[0], 1e-3, 0.5 * np.pi - 1e-9, xtol=1e-14)
    rod = nf.Needle(outer_diameter=0.7e-3, length=1.0, young_modulus=1e9)
    found = elastica_deflection(load * rod.bending_stiffness, 1.0, rod)
    assert found == pytest.approx(-clamped(slope)[2], rel=1e-9)


@pytest.mark.parametrize("position", [6e-3, 20e-3, 80e-3])
def test_it_is_that_of_the_virtual_rig(position):
    assert elastica_deflection(0.1, position, NEEDLE) == pytest.approx(
        tip_deflection(0.1, position, 0.08, EI), rel=1e-9
    )


def small(force, position, compliance=0.0):
    return force * position**2 * (0.24 - position) / (6.0 * EI) + compliance * force * position * 0.08


@pytest.mark.parametrize("compliance", [0.0, 5.0])
def test_the_departure_from_small_deflections_is_of_second_order_in_the_force(compliance):
    forces = np.array([0.004, 0.002, 0.001])
    exact = elastica_deflection(forces, 0.08, NEEDLE, clamp_compliance=compliance)
    off = exact / small(forces, 0.08, compliance) - 1.0
    assert abs(off[-1]) < 1e-3
    np.testing.assert_allclose(off[:-1] / off[1:], 4.0, rtol=0.02)


def test_an_elastic_clamp_agrees_with_the_boundary_value_problem():
    from scipy.integrate import solve_bvp

    compliance, force, a = 300.0, 0.05, 0.06
    s = np.linspace(0.0, a, 200)
    rod = solve_bvp(lambda s, y: np.vstack([y[1], -force / EI * np.cos(y[0])]),
                    lambda low, high: np.array([low[0] - compliance * EI * low[1], high[1]]), s, np.zeros((2, 200)),
                    tol=1e-10, max_nodes=100_000)  # fmt: skip
    fine = np.linspace(0.0, a, 20_001)
    slope = rod.sol(fine)[0]
    expected = np.trapezoid(np.sin(slope), fine) + (0.08 - a) * np.sin(slope[-1])
    assert elastica_deflection(force, a, NEEDLE, clamp_compliance=compliance) == pytest.approx(expected, rel=1e-7)


@pytest.mark.parametrize("slope", [0.1, 0.5, 1.0])
def test_three_point_bending_agrees_with_the_boundary_value_problem(slope):
    """Half the rod from the middle: clamped there, at the end a force R at right angles to it and no moment."""
    from scipy.integrate import solve_ivp

    length = 0.7  # of half the rod, E I = 1; R such that the end has the slope

    def end(reaction):
        def rod(s, y):  # slope, curvature, x, y from the end, where slope and curvature are known
            return [y[1], -reaction * np.cos(y[0] - slope), np.cos(y[0]), np.sin(y[0])]

        return solve_ivp(rod, (0.0, -length), [slope, 0.0, 0.0, 0.0], rtol=1e-11, atol=1e-12).y[:, -1]

    from scipy.optimize import brentq

    reaction = brentq(lambda r: end(r)[0], 0.01, 20.0, xtol=1e-13)
    _, _, x, y = end(reaction)
    span, force = -2.0 * x, 2.0 * reaction * np.cos(slope)
    assert three_point_load(-y / span) == pytest.approx(force * span**2, rel=1e-7)


def test_three_point_bending_has_the_limit_of_small_deflections():
    share = np.array([4e-3, 2e-3, 1e-3])
    off = three_point_load(share) / (48.0 * share) - 1.0
    assert abs(off[-1]) < 2e-5
    np.testing.assert_allclose(off[:-1] / off[1:], 4.0, rtol=0.01)
    with pytest.raises(nf.InputError, match="it must be 0 to"):
        three_point_load(0.6)


def test_large_deflections_give_the_modulus_and_small_deflection_theory_is_warned_of():
    deflection = np.array([tip_deflection(0.1, a, 0.08, EI) for a in POSITIONS]) + 0.2e-3
    found = needle_modulus(FORCE, POSITIONS, deflection, NEEDLE)
    assert found.young_modulus == pytest.approx(14.1e9, rel=1e-7)
    assert found.slack == pytest.approx(0.2e-3, rel=1e-4)
    # the formula for small deflections and a slack, with errors that are proportional to the deflection
    columns = np.column_stack([14.1e9 * small(FORCE, POSITIONS), np.ones(len(FORCE))]) / deflection[:, None]
    inverse, _ = np.linalg.lstsq(columns, np.ones(len(FORCE)), rcond=None)[0]
    assert found.used.all() and found.small_deflection_modulus == pytest.approx(1.0 / inverse, rel=1e-9)
    assert found.small_deflection_modulus > found.high
    assert any("outside the interval" in note for note in found.notes)
    near = needle_modulus(FORCE[:4], POSITIONS[:4], small(FORCE, POSITIONS)[:4] * [1.01, 0.99, 1.0, 1.01], NEEDLE)
    assert near.low <= near.small_deflection_modulus <= near.high and not near.notes


def test_the_interval_holds_the_truth(many):
    random, inside, count = np.random.default_rng(0), 0, many(12, 60)
    exact = elastica_deflection(FORCE, POSITIONS, NEEDLE)
    for _ in range(count):
        reading = exact * (1.0 + random.normal(0, 0.03, len(exact)))
        found = needle_modulus(FORCE, POSITIONS, reading, NEEDLE)
        inside += found.low <= 14.1e9 <= found.high
    assert 0.91 <= inside / count <= many(1.0, 0.99)


@pytest.mark.parametrize("slack", [0.0, 1e-18, -2e-14, 1e-9])
def test_exact_readings_with_next_to_no_slack_have_a_modulus(slack):
    # a derivative by a step that is a share of the slack would be none
    exact = elastica_deflection(FORCE, POSITIONS, NEEDLE, clamp_compliance=60.0) + slack
    found = needle_modulus(FORCE, POSITIONS, exact, NEEDLE, clamp_compliance=60.0)
    assert found.young_modulus == pytest.approx(14.1e9, rel=1e-6)
    assert found.high - found.low < 1e-4 * found.young_modulus


def test_the_compliance_of_the_clamp_is_found_from_several_positions(many):
    random, inside, seen, count = np.random.default_rng(4), 0, 0, many(6, 30)
    exact = elastica_deflection(FORCE, POSITIONS, NEEDLE, clamp_compliance=60.0)
    for _ in range(count):
        found = needle_modulus(FORCE, POSITIONS, exact * (1.0 + random.normal(0, 0.005, len(exact))), NEEDLE)
        seen += found.clamp_low > 0.0
        inside += found.low <= 14.1e9 <= found.high
    assert seen >= 0.93 * count and inside >= 0.86 * count
    given = needle_modulus(FORCE, POSITIONS, exact, NEEDLE, clamp_compliance=60.0)
    assert given.young_modulus == pytest.approx(14.1e9, rel=1e-6)
    rigid = needle_modulus(FORCE, POSITIONS, exact, NEEDLE, clamp_compliance=0.0)
    assert rigid.young_modulus < 0.9 * 14.1e9


def test_one_position_does_not_show_the_clamp():
    forces = np.array([0.01, 0.02, 0.03, 0.04, 0.05, 0.06])
    exact = elastica_deflection(forces, 0.02, NEEDLE, clamp_compliance=60.0)
    found = needle_modulus(forces, np.full(6, 0.02), exact * [1.01, 0.99, 1.0, 1.01, 0.99, 1.0], NEEDLE)
    assert found.clamp_compliance == 0.0 and any("one position" in note for note in found.notes)


def test_the_rigs_bending_test_gives_its_modulus(tmp_path, many):
    inside, count = 0, many(5, 20)
    for seed in range(count):
        test, _ = bend_needle(np.random.default_rng(seed))
        found = needle_estimate(test.write(tmp_path), NEEDLE)
        inside += found.low <= 14.1e9 <= found.high
    assert inside >= 0.85 * count  # each reading has a needle of its own, spread by 11 %


def test_three_point_bending_gives_the_stiffness_and_the_slack():
    random, inside = np.random.default_rng(2), 0
    deflection = np.linspace(0.0, 8e-3, 60)
    load = EI / 0.04**2 * three_point_load(np.maximum(deflection - 0.5e-3, 0.0)[7:] / 0.04)
    for _ in range(100):
        found = three_point_modulus(
            load + random.normal(0, 0.005, len(load)), deflection[7:], 0.04, NEEDLE.second_moment
        )
        inside += found.low <= 14.1e9 <= found.high
    assert 0.88 <= inside / 100
    assert found.slack == pytest.approx(0.5e-3, abs=0.05e-3)
    assert found.small_deflection_modulus < found.low and found.notes
    stiffness = three_point_modulus(load, deflection[7:], 0.04)
    assert stiffness.bending_stiffness == pytest.approx(EI, rel=1e-6) and np.isnan(stiffness.young_modulus)


@pytest.mark.parametrize(
    "force, position, deflection, message",
    [
        ([0.1, 0.1], [0.01, 0.02], [1e-3, 2e-3], "at least 3"),
        ([0.1] * 3, [0.01, 0.02, 0.09], [1e-3, 2e-3, 3e-3], "at most the needle's length"),
        ([0.1] * 3, [0.01, 0.02, 0.03], [1e-3, 0.0, 3e-3], "a loaded needle bends"),
        ([0.1] * 3, [0.01, 0.02, 0.03], [-1e-3, -2e-3, -3e-3], "not growing with the load"),
    ],
)
def test_impossible_readings_are_refused(force, position, deflection, message):
    with pytest.raises(nf.InputError, match=message):
        needle_modulus(force, position, deflection, NEEDLE)


def test_a_real_three_point_test_is_read_and_fitted(recordings):
    from needleforce.bench_tests import read_bending

    file = recordings / "other-labs" / "bending-bluehill" / "WSR8002_july25_medial.csv"
    readings, _ = read_bending(file, three_point=True)
    assert len(readings["force"]) > 2000 and readings["force"].max() == pytest.approx(544.5, abs=0.1)
    found = three_point_modulus(readings["force"], readings["deflection"], 0.1)  # its span is not in the file
    secant = np.ptp(readings["force"]) / np.ptp(readings["deflection"])
    assert found.bending_stiffness == pytest.approx(secant * 0.1**3 / 48.0, rel=0.5)
    assert found.misfit > 0.0
