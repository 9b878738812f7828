# SPDX-License-Identifier: Apache-2.0
"""Newmark's rule against closed forms: phase, energy, order, critical step, shear waves; masses; damping."""

import numpy as np
import pytest
import reference
from scipy.sparse import csr_array, diags_array
from test_elements import SQUARE, TUBE, VALUES, distorted, tetrahedra, triangles

import needleforce as nf
from needleforce import fe
from needleforce.fe.elastic.supports import unknowns_of
from needleforce.fe.moving.dynamics import DynamicSystem, Newmark, Rayleigh
from needleforce.fe.moving.tissue_dynamics import TissueDynamics

VALUES = VALUES | {each["name"]: each for each in reference.load()}
GEL = fe.Elastic(10e3, 0.45)


def vibration(time, omega=20.0, ratio=0.1, start=0.01):
    """Free vibration of a damped oscillator from rest."""
    damped = omega * np.sqrt(1.0 - ratio**2)
    oscillation = np.cos(damped * time) + ratio * omega / damped * np.sin(damped * time)
    return start * np.exp(-ratio * omega * time) * oscillation


def after(rule, start, steps):
    states = [start, *rule.states(start, np.zeros(steps))]
    return np.array([state.displacement[0] for state in states])


def test_an_oscillator_is_where_the_reference_recurrence_is():
    value = VALUES["newmark_sdof_u50"]
    given = value["inputs"]
    rule = Newmark(DynamicSystem(given["m"], given["c"], given["k"]), given["dt"])
    found = after(rule, rule.start(given["u0"], given["v0"]), given["steps"])[-1]
    assert found == pytest.approx(value["expected"], rel=value["rel_tol"])


def test_average_acceleration_turns_by_the_known_phase_and_keeps_energy():
    value, omega, dt = VALUES["newmark_average_acceleration_phase"], 20.0, 0.005
    assert omega * dt == value["inputs"]["Omega"]
    rule = Newmark(DynamicSystem(1.0, 0.0, omega**2), dt)
    states = [rule.start(0.01)]
    states += rule.states(states[0], np.zeros(1000))
    phase = np.unwrap([np.arctan2(-each.velocity[0] / omega, each.displacement[0]) for each in states])
    assert phase[-1] / 1000 == pytest.approx(value["expected"], rel=1e-12)
    energy = rule.energies(states, np.zeros(1001))
    np.testing.assert_allclose(energy.kinetic + energy.strain, 0.5 * omega**2 * 1e-4, rtol=1e-12)


@pytest.mark.parametrize("beta, gamma, order", [(0.25, 0.5, 2), (0.0, 0.5, 2), (1 / 6, 0.5, 2), (0.3025, 0.6, 1)])
def test_errors_fall_with_the_order_of_the_rule(beta, gamma, order):
    errors = []
    for steps in (100, 200, 400):
        rule = Newmark(DynamicSystem(2.0, 8.0, 800.0), 1.0 / steps, beta=beta, gamma=gamma)
        time = np.arange(steps + 1) / steps
        errors.append(np.abs(after(rule, rule.start(0.01), steps) - vibration(time)).max())
    np.testing.assert_allclose(np.log2(np.array(errors[:-1]) / errors[1:]), order, atol=0.1)


def test_matrices_may_be_diagonal_dense_or_sparse():
    mass, stiffness = np.array([1.0, 2.0, 3.0]), np.array([[5.0, -2.0, 0.0], [-2.0, 5.0, -2.0], [0.0, -2.0, 5.0]])
    ends = []
    for shape in (np.array, lambda each: csr_array(each if each.ndim == 2 else np.diag(each))):
        for damping in (0.3, np.full(3, 0.3), 0.3 * np.eye(3)):
            rule = Newmark(DynamicSystem(shape(mass), damping, shape(stiffness)), 0.1)
            ends.append(list(rule.states(rule.start([0.1, 0.0, 0.0]), np.ones((20, 3))))[-1].displacement)
    np.testing.assert_allclose(ends, np.broadcast_to(ends[0], (6, 3)), rtol=1e-12)


def chain(count=500, mass=2e-3, spring=700.0):
    """Masses between springs, the first held, and the exact highest frequency."""
    main = np.full(count, 2.0 * spring)
    main[-1] = spring
    masses = np.full(count, mass)
    masses[-1] = 0.5 * mass
    stiffness = diags_array([main, np.full(count - 1, -spring), np.full(count - 1, -spring)], offsets=[0, 1, -1])
    return DynamicSystem(masses, 0.0, stiffness), 2.0 * np.sqrt(spring / mass) * np.cos(np.pi / (4 * count))


@pytest.mark.parametrize("count", [20, 500])
def test_central_differences_are_refused_above_the_critical_step(count):
    system, highest = chain(count)
    assert system.highest_frequency == pytest.approx(highest, rel=1e-6)
    words = rf"time step is .* s, must be at most {2 / highest:.4g} s, the critical step of beta=0.*Use a shorter step"
    with pytest.raises(nf.InputError, match=words):
        Newmark(system, 2.002 / highest, beta=0.0)
    rule = Newmark(system, 1.998 / highest, beta=0.0)
    assert rule.critical_step == pytest.approx(2.0 / highest, rel=1e-6)
    state = rule.start(np.random.default_rng(0).standard_normal(count))
    largest = max(np.abs(each.displacement).max() for each in rule.states(state, np.zeros(1000)))
    assert largest < 50.0


def test_central_differences_grow_above_the_critical_step(monkeypatch):
    system, highest = chain(20)
    monkeypatch.setattr(Newmark, "_check_critical", lambda self: None)
    rule = Newmark(system, 2.02 / highest, beta=0.0)
    *_, end = rule.states(rule.start(np.random.default_rng(0).standard_normal(20)), np.zeros(300))
    assert np.abs(end.displacement).max() > 1e6


def shear_column(height, cell, lumped=False, material=GEL):
    """A column in which tissue moves sideways only, as in a shear wave."""
    size, count = 1e-3, round(height / cell)
    tissue = fe.Tissue(
        fe.grid([np.linspace(0.0, size, 2), np.linspace(0.0, height, count + 1)]),
        material, symmetry="plane_strain", order=1, thickness=size,
    )  # fmt: skip
    tissue.held |= unknowns_of(tissue.elements).component == 1
    return TissueDynamics(tissue, lumped=lumped)


def test_a_column_vibrates_at_its_closed_form():
    height, speed = 40e-3, np.sqrt(GEL.shear_modulus / GEL.density)
    for lumped in (False, True):
        errors = []
        for cell in (4e-3, 2e-3, 1e-3):
            system = shear_column(height, cell, lumped)
            across = system.values_at(np.array([[0.0, 0.0], [1e-3, 0.0]])).toarray()[:2]
            shape = np.sin(0.5 * np.pi * (1.0 - system.places[:, 1] / height))
            rule = Newmark(system, 2e-4)
            found = [np.mean(across @ each.displacement) for each in rule.states(rule.start(shape), np.zeros(1200))]
            crossings = np.flatnonzero(np.diff(np.sign(found)))
            between = crossings + np.array([found[k] / (found[k] - found[k + 1]) for k in crossings])
            period = 2.0 * np.mean(np.diff(between)) * 2e-4
            errors.append(abs(period * speed / (4.0 * height) - 1.0))
        assert errors[-1] < 5e-4 and errors[-1] < 0.35 * errors[0]


def test_a_shear_wave_travels_at_the_root_of_modulus_over_density():
    height, cell, pull = 80e-3, 0.5e-3, 1e-6
    speed = np.sqrt(GEL.shear_modulus / GEL.density)
    system = shear_column(height, cell)
    top, place, *_ = system.values_at([[0.5e-3, 0.0], [0.5e-3, 30e-3]]).toarray()
    dt = 0.2 * cell / speed
    rule, steps = Newmark(system, dt), int(1.5 * 30e-3 / speed / dt)
    states = rule.states(rule.start(forces=pull * top), [pull * top] * steps)
    found = np.array([place @ each.displacement for each in states])
    # a constant traction on a half-space: u = traction / (rho c) (t - z / c)
    time = dt * np.arange(1, steps + 1)
    slope = pull / 1e-6 / (GEL.density * speed)
    late = found > 0.2 * found[-1]
    rate, offset = np.polyfit(time[late], found[late], 1)
    assert rate == pytest.approx(slope, rel=2e-3)
    assert -30e-3 * rate / offset == pytest.approx(speed, rel=2e-3)


@pytest.mark.parametrize("lumped", [False, True])
def test_work_is_kinetic_strain_and_damped_energy(lumped):
    tissue = fe.Tissue(fe.axisymmetric_block(10e-3, 10e-3, 2e-3), GEL, symmetry="axisymmetric")
    system = TissueDynamics(tissue, Rayleigh.from_ratios((10.0, 200.0), (0.05, 0.1)), lumped=lumped)
    rule, random = Newmark(system, 1e-3), np.random.default_rng(1)
    forces = np.cumsum(1e-4 * random.standard_normal((201, system.count)), axis=0)
    states = [rule.start(1e-6 * random.standard_normal(system.count), 0.0, forces[0])]
    states += rule.states(states[0], forces[1:])
    energy = rule.energies(states, forces)
    total = energy.kinetic + energy.strain
    lost = energy.work - energy.dissipated - (total - total[0])
    assert np.abs(lost).max() < 1e-11 * np.abs(energy.work).max()
    assert np.all(np.diff(energy.dissipated) >= 0.0) and energy.dissipated[-1] > 0.01 * energy.work[-1]


SHAPES = {
    "quad 1": (distorted(SQUARE), "plane_strain", 1),
    "quad 2": (distorted(SQUARE), "plane_strain", 2),
    "triangle 2": (triangles(distorted(SQUARE)), "plane_strain", 2),
    "hexahedron 1": (fe.block((4e-3, 4e-3, 4e-3), 2e-3), "solid", 1),
    "tetra 2": (tetrahedra(fe.block((4e-3, 4e-3, 4e-3), 2e-3)), "solid", 2),
    "axisymmetric 2": (TUBE, "axisymmetric", 2),
}


@pytest.mark.parametrize("mesh, symmetry, order", SHAPES.values(), ids=SHAPES)
def test_a_lumped_mass_is_positive_and_that_of_the_body(mesh, symmetry, order):
    tissue = fe.Tissue(mesh, GEL, symmetry=symmetry, order=order, supports={"bottom": "fixed", "sides": "sliding"})
    tissue.held[:] = False
    lumped, consistent = (TissueDynamics(tissue, lumped=each).mass for each in (True, False))
    size = np.ptp(mesh.points, axis=0)
    volume = np.pi * size[0] ** 2 * size[1] if symmetry == "axisymmetric" else size.prod()
    for axis in range(mesh.dimension):
        along = (unknowns_of(tissue.elements).component == axis).astype(float)
        assert along @ lumped == pytest.approx(1000.0 * volume, rel=1e-9)
        assert along @ consistent @ along == pytest.approx(1000.0 * volume, rel=1e-9)
    assert lumped.min() > 0.0


def test_damping_has_the_ratios_that_were_given():
    damping = Rayleigh.from_ratios((5.0, 80.0), (0.1, 0.04))
    np.testing.assert_allclose(damping.ratio([5.0, 80.0]), [0.1, 0.04], rtol=1e-12)
    angular = 2.0 * np.pi * 5.0
    rule = Newmark(DynamicSystem(1.0, damping.mass + damping.stiffness * angular**2, angular**2), 1e-4)
    found = after(rule, rule.start(0.01), 10000)
    np.testing.assert_allclose(found, vibration(1e-4 * np.arange(10001), angular, 0.1), atol=1e-7)
    with pytest.raises(nf.InputError, match=r"damping ratios is .*, need a negative damping"):
        Rayleigh.from_ratios((5.0, 80.0), (0.5, 0.01))
    with pytest.raises(nf.InputError, match="must be two different frequencies"):
        Rayleigh.from_ratios((5.0, 5.0), (0.5, 0.01))
    with pytest.raises(nf.InputError, match=r"share of stiffness in the damping is -0.1 s, must be at least 0"):
        Rayleigh(0.0, -0.1)


@pytest.mark.parametrize(
    "change, words",
    [
        ({"dt": 0.0}, "time step is 0.0 s, must be above 0"),
        ({"dt": np.nan}, "time step is nan s"),
        ({"beta": -0.1}, "beta is -0.1, outside 0 to 1"),
        ({"gamma": 0.4}, "gamma is 0.4, outside 0.5 to 2"),
    ],
)
def test_rules_that_do_not_work_are_named(change, words):
    options = {"dt": 0.01} | change
    with pytest.raises(nf.InputError, match=words):
        Newmark(DynamicSystem(1.0, 0.0, 1.0), options.pop("dt"), **options)


@pytest.mark.parametrize(
    "mass, stiffness, words",
    [
        (0.0, 1.0, "mass is 0.0, must be above 0"),
        (1.0, np.nan, "stiffness is not finite"),
        (np.ones(2), np.eye(3), r"mass is of shape \(2,\), must be \(3,\) or \(3, 3\)"),
    ],
)
def test_matrices_that_do_not_fit_are_named(mass, stiffness, words):
    with pytest.raises(nf.InputError, match=words):
        DynamicSystem(mass, 0.0, stiffness)


def test_forces_that_do_not_fit_are_named():
    rule = Newmark(DynamicSystem(np.ones(2), 0.0, np.eye(2)), 0.1)
    with pytest.raises(nf.InputError, match=r"forces is of shape \(3,\), must be 2 finite numbers"):
        rule.step(rule.start(), np.ones(3))
    with pytest.raises(nf.InputError, match="forces is nan, must be 2 finite numbers"):
        rule.step(rule.start(), np.nan)
