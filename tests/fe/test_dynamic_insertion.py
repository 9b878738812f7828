# SPDX-License-Identifier: Apache-2.0
"""A needle in tissue with mass: Coulomb's oscillator, slow motion as quasi-static, energy, convergence in the step."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import BSpline
from scipy.optimize import brentq, lsq_linear
from test_elements import VALUES, reference

import needleforce as nf
from needleforce import fe
from needleforce.fe.moving.dynamic_insertion import DynamicInsertion, bounded_forces, stroke
from needleforce.fe.moving.dynamics import DynamicSystem, Rayleigh
from needleforce.fe.moving.tissue_dynamics import ReducedTissue, TissueDynamics

VALUES = VALUES | {each["name"]: each for each in reference.load()}
RADIUS, SPACING = 0.5e-3, 2e-3
PATH = fe.NeedlePath(24e-3, SPACING, RADIUS)


def body(young=40e3, damping=None, cell=1.5e-3):
    mesh = fe.axisymmetric_block(30e-3, 30e-3, cell, needle_depth=24e-3)
    tissue = fe.Tissue(mesh, fe.Elastic(young, 0.45), symmetry="axisymmetric")
    return TissueDynamics(tissue, damping or Rayleigh(5.0, 2e-4))


BODY = body()
REDUCED = ReducedTissue(BODY, PATH, 20)


def insertion(model=BODY, dt=1e-3, friction=30.0, cutting=0.2, theta=0.55):
    return DynamicInsertion(model, PATH, friction=friction, cutting=cutting, dt=dt, theta=theta)


def in_and_out(dt, speed=20e-3, depth=20e-3):
    strokes = stroke(depth, speed, dt, hold=0.1), stroke(-2e-3, speed, dt, start=depth, hold=0.1)
    return np.concatenate(strokes)


class Oscillators(DynamicSystem):
    """Two of them, each at a node of a path."""

    def loads(self, path):
        return np.eye(2)


def test_dry_friction_takes_four_force_over_stiffness_from_each_cycle():
    mass, stiffness, force, start, dt = 2.0, 800.0, 4e-5, 1e-6, 1e-3
    model = Oscillators(mass * np.ones(2), 0.0, stiffness * np.ones(2))
    path = fe.NeedlePath(0.1, 0.1, 1e-3)  # each node has 50 mm of it
    needle = DynamicInsertion(model, path, friction=force / 0.05, cutting=0.0, dt=dt, theta=0.5)
    state = replace(needle.start(0.1), displacement=np.full(2, start), dragged=np.full(2, start))
    period = 2.0 * np.pi * np.sqrt(mass / stiffness)
    found = []
    for _ in range(round(6.0 * period / dt)):
        state = needle.step(state, 0.1)
        found.append(state.displacement[0])
    time = dt * np.arange(1, len(found) + 1)
    # between reversals a cosine about +-force / stiffness, smaller by twice that at each
    shift, half = force / stiffness, np.floor(2.0 * time / period)
    left = start - (2.0 * half + 1.0) * shift
    sign = np.where(half % 2, -1.0, 1.0)
    exact = sign * shift + left * np.cos(2.0 * np.pi * time / period)
    stopped = left < 0.0
    np.testing.assert_allclose(np.array(found)[~stopped], exact[~stopped], atol=0.01 * start)
    rest = np.array(found)[time > (np.ceil(0.5 * start / shift) * 0.5 + 0.5) * period]
    assert np.ptp(rest) < 1e-3 * start and np.abs(rest).max() <= shift


def test_the_compliance_of_a_long_step_is_that_of_the_condensed_chain():
    value = VALUES["condensed_spring_chain"]
    a, b, c = value["inputs"]["k"]
    springs = np.array([[a + b, -b, 0.0], [-b, b + c, -c], [0.0, -c, c]])
    model = Oscillators(np.ones(3), 0.0, springs)
    model.loads = lambda path: np.eye(3)[:, 1:]
    needle = DynamicInsertion(model, fe.NeedlePath(0.1, 0.1, 1e-3), friction=1.0, cutting=0.0, dt=1e6, theta=1.0)
    assert 1.0 / needle.compliance[1, 1] == pytest.approx(value["expected"], rel=1e-10)


@pytest.mark.parametrize("seed", range(5))
def test_bounded_forces_are_those_of_scipy(seed):
    random, size = np.random.default_rng(seed), 30
    root = random.standard_normal((size, size))
    matrix = root @ root.T + 0.1 * np.eye(size)
    wanted, high = 30.0 * random.standard_normal(size), random.uniform(0.0, 0.5, size)
    high[::7] = 0.0
    forces, slip = bounded_forces(matrix, wanted, (-high, high), random.integers(-1, 2, size))
    factor = np.linalg.cholesky(matrix)
    inner = high > 0.0
    exact = lsq_linear(
        factor.T[:, inner], np.linalg.solve(factor, wanted), (-high[inner], high[inner]), method="bvls", tol=1e-14
    )  # fmt: skip
    np.testing.assert_allclose(forces[inner], exact.x, atol=1e-8)
    assert not forces[~inner].any()
    assert np.all(np.where(slip == 0, True, np.abs(forces) == high))
    assert set(slip) == {-1, 0, 1}


class QuasiStatic:
    """The same needle without inertia, by SciPy: nodes, then the place of the tip, until both agree."""

    def __init__(self, model, friction, cutting):
        loads = model.loads(PATH).toarray()
        self.compliance = loads.T @ model.tissue.factor.solve(loads)
        self.friction, self.cutting = friction, cutting
        self.nodes, self.tip, self.cut, self.depth = PATH.nodes, 0.0, 0.0, 0.0
        self.dragged = np.zeros(len(self.nodes))

    def shares(self, tip):
        spline = BSpline.basis_element(SPACING * np.arange(-2, 3), extrapolate=False)
        first, last = -self.nodes[1], 2 * self.nodes[-1] - self.nodes[-2]
        value = np.nan_to_num(spline(np.concatenate([[first], self.nodes, [last]]) - tip))
        value[2] += value[0]
        value[-3] += value[-1]
        return value[1:-1]

    def limits(self, tip):
        at = np.linspace(0.0, tip, 2001)
        hats = np.maximum(1.0 - np.abs(at - self.nodes[:, None]) / SPACING, 0.0)
        return self.friction * np.trapezoid(hats, at, axis=1) if tip > 0.0 else np.zeros(len(self.nodes))

    def balanced(self, depth, tip, lowest, largest):
        """Forces, displacements and gap when the tip is at a place along the path, its force within bounds."""
        columns = np.column_stack([np.eye(len(self.nodes)), self.shares(tip)])
        matrix = columns.T @ self.compliance @ columns + 1e-7 * self.compliance[0, 0] * np.eye(len(columns.T))
        wanted = np.append(self.dragged + depth - self.depth, depth - tip)
        bounds = np.append(-self.limits(tip), lowest) - 1e-12, np.append(self.limits(tip), largest) + 1e-12
        factor = np.linalg.cholesky(matrix)
        forces = lsq_linear(factor.T, np.linalg.solve(factor, wanted), bounds, method="bvls").x
        dragged = self.compliance @ (columns @ forces)
        return forces, dragged, depth - tip - self.shares(tip) @ dragged

    def move(self, depth):
        largest = self.cutting if self.tip >= self.cut else 0.0
        forces, dragged, gap = self.balanced(depth, self.tip, 0.0, largest)
        if abs(gap) > 1e-6:
            lowest = largest if gap > 0.0 else 0.0
            end = max(self.tip + 3.0 * gap, 0.0) if largest or gap < 0.0 else min(self.tip + 3.0 * gap, self.cut)
            offset = lambda tip: self.balanced(depth, tip, lowest, lowest)[2]  # noqa: E731
            self.tip = brentq(offset, self.tip, end, xtol=1e-8) if offset(self.tip) * offset(end) < 0.0 else end
            forces, dragged, _ = self.balanced(depth, self.tip, lowest, lowest)
        self.cut, self.depth, self.dragged = max(self.cut, self.tip), depth, dragged
        return forces.sum()


def test_a_slow_needle_has_the_quasi_static_force():
    needle, other = insertion(dt=0.5, theta=1.0), QuasiStatic(BODY, 30.0, 0.2)
    stops = [(10e-3, 0.0), (6e-3, 10e-3), (13e-3, 6e-3)]
    depths = np.concatenate([stroke(end, 0.2e-3, 0.5, start=start) for end, start in stops])
    found = needle.run(depths).force
    exact = np.array([other.move(depth) for depth in depths])
    assert exact.max() > 0.35 and exact.min() < -0.2
    np.testing.assert_allclose(found, exact, atol=0.01 * exact.max())
    assert np.mean(np.abs(found - exact)) < 5e-3 * exact.max()


def test_a_slow_needle_has_the_force_of_the_condensed_loop():
    laws = nf.laws
    parts = laws.Polynomial(linear=1e4, quadratic=0.0), laws.PunctureForce(force=0.2)
    shaft = laws.Coulomb(per_length=30.0, presliding=1e-7, dimple_ratio=0.0)
    model = nf.Model(*parts, shaft, laws.ConstantCutting(force=0.2, unloading=1e-7))
    loop = fe.CondensedInsertion(BODY.tissue.condense(PATH), model)
    depths = np.concatenate([stroke(16e-3, 0.1e-3, 0.5), stroke(6e-3, 0.1e-3, 0.5, start=16e-3)])
    exact = np.array([loop.step(depth, None, 0.5).force for depth in depths])
    found = insertion(dt=0.5, theta=1.0).run(depths).force
    # its tip is spread over one spacing at the surface, here over two
    assert np.mean(np.abs(found - exact)) < 1e-2 * exact.max()


def test_inertia_matters_less_the_slower_the_needle():
    forces = []
    for speed in (0.8, 0.2, 0.05, 1e-3):
        run = insertion(REDUCED, dt=0.05e-3 / speed).run(stroke(10e-3, speed, 0.05e-3 / speed))
        forces.append(run.force[100:])
    away = [np.abs(each - forces[-1]).mean() for each in forces[:-1]]
    assert away[0] > 3.0 * away[1] > 9.0 * away[2] and away[2] < 0.002


def test_in_stiff_tissue_the_force_is_friction_of_the_embedded_length_and_cutting():
    run = insertion(body(young=10e6), dt=2e-3).run(in_and_out(2e-3))
    moving_in, out = (run.time > 0.1) & (run.time < 1.0), (run.time > 1.15) & (run.time < 2.0)
    np.testing.assert_allclose(run.force[moving_in], 30.0 * run.depth[moving_in] + 0.2, rtol=0.01)
    np.testing.assert_allclose(run.force[out], -30.0 * run.depth[out], atol=3e-3)
    np.testing.assert_allclose(run.tip, np.maximum(run.depth, 0.0), atol=0.1e-3)
    assert not run.tip_force[out].any()


@pytest.mark.parametrize("theta", [0.5, 0.55, 1.0])
@pytest.mark.parametrize("young, lowest", [(40e3, -1e-9), (8e3, -2e-5)])
def test_work_is_kinetic_strain_damped_and_dissipated_energy(theta, young, lowest):
    run = insertion(body(young), dt=1e-3, theta=theta).run(in_and_out(1e-3, speed=50e-3))
    energy = run.energy
    stored = energy.kinetic + energy.strain
    lost = energy.work - stored - energy.damped - energy.friction - energy.numerical
    assert np.abs(lost).max() < 1e-12 * energy.work.max()
    assert np.diff(energy.friction).min() > lowest and np.diff(energy.damped).min() >= 0.0
    assert (energy.numerical == 0.0).all() if theta == 0.5 else np.diff(energy.numerical).min() >= 0.0
    assert energy.numerical[-1] < 0.06 * energy.work[-1]
    assert stored[-1] < 0.01 * stored.max()  # the tissue is at rest again, the needle is outside


def test_forces_converge_with_the_step():
    finest = insertion(REDUCED, dt=0.125e-3).run(in_and_out(0.125e-3, speed=50e-3))
    errors = []
    for dt in (4e-3, 2e-3, 1e-3, 0.5e-3):
        run = insertion(REDUCED, dt=dt).run(in_and_out(dt, speed=50e-3))
        errors.append(np.mean(np.abs(run.force - np.interp(run.time, finest.time, finest.force))))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert errors[-1] < 0.005 * finest.force.max() and orders.min() > 0.6


def test_a_needle_sticks_slips_and_is_free():
    needle = insertion(body(young=8e3), friction=80.0)
    state = needle.run(stroke(12e-3, 20e-3, 1e-3)).end
    inside = PATH.nodes < state.tip
    assert (state.slip[:-1][~inside][1:] == 0).all() and not state.friction[~inside][1:].any()
    assert 0 < np.sum(state.slip[:-1] == 1) < inside.sum()
    assert state.slip[-1] == 1 and state.tip_force == pytest.approx(0.2)
    out = needle.run(stroke(-12e-3, 40e-3, 1e-3, start=12e-3), start=state)
    assert np.sum(out.friction < 0.0) and out.end.tip == 0.0 and not out.end.friction.any()
    above = needle.run(np.linspace(-2e-3, -1e-3, 20), start=needle.start(-2e-3))
    assert not above.force.any() and not above.end.displacement.any()


def test_a_cut_is_not_cut_again():
    needle, dt = insertion(), 2e-3
    first = needle.run(np.concatenate([stroke(12e-3, 20e-3, dt), stroke(6e-3, 20e-3, dt, start=12e-3)]))
    again = needle.run(stroke(16e-3, 20e-3, dt, start=6e-3), start=first.end)
    recut = again.tip < first.end.cut - 1e-9
    assert recut.sum() > 50 and not again.tip_force[recut].any()
    assert again.tip_force[-1] == pytest.approx(0.2)
    whole = np.concatenate([first.force, again.force])
    depths = np.concatenate([first.depth, again.depth])
    np.testing.assert_array_equal(needle.run(depths).force, whole)


def test_forces_per_layer_are_given_by_node():
    cutting = np.where(PATH.nodes < 10e-3, 0.1, 0.4)
    run = insertion(body(young=1e6), cutting=cutting, dt=2e-3).run(stroke(20e-3, 20e-3, 2e-3))
    assert run.tip_force[run.tip < 7e-3][5:] == pytest.approx(0.1)
    assert run.tip_force[run.tip > 11e-3] == pytest.approx(0.4)


@pytest.mark.parametrize(
    "change, words",
    [
        ({"dt": 0.0}, "time step is 0.0 s, must be above 0"),
        ({"friction": -1.0}, "friction per length is -1 N/m, must be at least 0"),
        ({"friction": np.nan}, "friction per length is nan N/m"),
        (
            {"friction": np.ones(3)},
            r"friction per length is of shape \(3,\), must be a number, or one for each of the 13",
        ),
        ({"cutting": -0.1}, "cutting force is -0.1 N, must be at least 0"),
        ({"theta": 0.4}, "theta is 0.4, outside 0.5 to 1"),
    ],
)
def test_values_of_a_needle_are_checked(change, words):
    with pytest.raises(nf.InputError, match=words):
        insertion(**change)


def test_depths_and_targets_that_do_not_fit_are_named():
    needle = insertion()
    with pytest.raises(nf.InputError, match="depth 1 is 30 mm, must be finite and at most 24 mm, the end of the path"):
        needle.run([1e-3, 30e-3])
    with pytest.raises(nf.InputError, match="depth 0 is nan mm"):
        needle.step(needle.start(), np.nan)
    with pytest.raises(nf.InputError, match=r"point is \(50, 1\) mm, is outside the mesh"):
        needle.run([1e-3], targets=[[50e-3, 1e-3]])
    with pytest.raises(nf.InputError, match=r"targets is .*, must be finite"):
        needle.run([1e-3], targets=[[np.nan, 1e-3]])
    with pytest.raises(nf.InputError, match="is outside the mesh"):
        DynamicInsertion(BODY, fe.NeedlePath(40e-3, 2e-3, RADIUS), friction=1.0, cutting=0.0, dt=1e-3)
    with pytest.raises(nf.InputError, match="settling is"):
        DynamicInsertion(BODY, PATH, friction=1.0, cutting=0.0, dt=1e-3, settling=0.0)
    for change, words in (
        ({"speed": 0.0}, "speed is 0.0"),
        ({"hold": -1.0}, "hold is -1.0"),
        ({"depth": np.nan}, "depth"),
    ):
        with pytest.raises(nf.InputError, match=words):
            stroke(**{"depth": 1e-3, "speed": 1e-3, "dt": 1e-3} | change)
