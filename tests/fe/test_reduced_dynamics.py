# SPDX-License-Identifier: Apache-2.0
"""Few modes against the full model: exact with all, closer with more, the same where motion is slow."""

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.sparse.linalg import eigsh

import needleforce as nf
from needleforce import fe
from needleforce.fe.moving.dynamic_insertion import DynamicInsertion, stroke
from needleforce.fe.moving.dynamics import Newmark, Rayleigh
from needleforce.fe.moving.tissue_dynamics import ReducedTissue, TissueDynamics

PATH = fe.NeedlePath(20e-3, 2e-3, 0.5e-3)
DAMPING = Rayleigh.from_ratios((5.0, 100.0), (0.05, 0.05))
DEPTHS = np.concatenate([stroke(15e-3, 0.1, 1e-3, hold=0.1), stroke(-2e-3, 0.1, 1e-3, start=15e-3, hold=0.1)])


def tissue(cell, order=2):
    mesh = fe.axisymmetric_block(30e-3, 30e-3, cell, needle_depth=15e-3)
    return fe.Tissue(mesh, fe.Elastic(20e3, 0.45), symmetry="axisymmetric", order=order)


def inserted(model, path=PATH):
    needle = DynamicInsertion(model, path, friction=30.0, cutting=0.2, dt=1e-3)
    return needle.run(DEPTHS, targets=[[2e-3, 12e-3]])


FULL = TissueDynamics(tissue(2e-3), DAMPING)


@pytest.mark.parametrize("lumped", [False, True])
def test_all_modes_are_the_full_model(lumped):
    full, path = TissueDynamics(tissue(3e-3, order=1), DAMPING, lumped=lumped), fe.NeedlePath(20e-3, 5e-3, 0.5e-3)
    reduced = ReducedTissue(full, path, full.count - len(path.nodes))
    assert reduced.count == full.count
    one, other = inserted(full, path), inserted(reduced, path)
    np.testing.assert_allclose(other.force, one.force, atol=1e-8)
    np.testing.assert_allclose(other.targets, one.targets, atol=1e-10)
    np.testing.assert_allclose(other.energy.kinetic, one.energy.kinetic, atol=1e-9 * one.energy.work.max())


def test_errors_fall_with_the_number_of_modes():
    full = inserted(FULL)
    mean, forces, targets = [], [], []
    for modes in (0, 10, 40, 160):
        run = inserted(ReducedTissue(FULL, PATH, modes))
        mean.append(np.abs(run.force - full.force).mean() / full.force.max())
        forces.append(np.abs(run.force - full.force).max() / full.force.max())
        targets.append(np.abs(run.targets - full.targets).max() / np.abs(full.targets - full.targets[0]).max())
    for errors in (mean, forces, targets):
        assert np.all(np.diff(errors) < 0.0)
    assert mean[0] < 3e-3 and mean[2] < 3e-4  # the largest are where the needle meets the surface
    assert forces[2] < 0.02 and forces[3] < 3e-3 and targets[2] < 0.01 and targets[3] < 1e-3


def test_slow_motion_needs_no_vibrations():
    reduced, path = ReducedTissue(FULL, PATH, 0), FULL.loads(PATH).toarray()
    static = FULL.tissue.factor.solve(path)
    loads = reduced.loads(PATH)
    np.testing.assert_allclose(loads.T @ (loads / reduced.stiffness[:, None]), path.T @ static, rtol=1e-9)
    depths = np.concatenate([stroke(10e-3, 2e-4, 0.5), stroke(6e-3, 2e-4, 0.5, start=10e-3)])
    runs = [
        DynamicInsertion(model, PATH, friction=30.0, cutting=0.2, dt=0.5, theta=1.0).run(depths)
        for model in (FULL, reduced)
    ]
    np.testing.assert_allclose(runs[1].force, runs[0].force, atol=2e-4)


def test_frequencies_are_those_of_the_body_from_above():
    mass, stiffness = FULL.mass.tocsc(), FULL.stiffness.tocsc()
    exact = np.sqrt(np.sort(eigsh(stiffness, k=10, M=mass, sigma=0.0, return_eigenvectors=False))) / (2.0 * np.pi)
    few, many = (ReducedTissue(FULL, PATH, modes).frequencies[:10] / exact - 1.0 for modes in (10, 40))
    assert few.min() > -1e-9 and many.min() > -1e-9
    assert many.max() < 1e-3 and many.max() < 0.2 * few.max()


def test_vibrations_have_the_path_at_rest():
    full = TissueDynamics(tissue(4e-3), DAMPING)
    loads = full.loads(PATH).toarray()
    # a penalty on the averages along the path in place of the constraint
    stiff = full.stiffness.toarray() + 1e6 * loads @ loads.T
    exact = np.sqrt(eigh(stiff, full.mass.toarray(), eigvals_only=True, subset_by_index=(0, 7))) / (2.0 * np.pi)
    found = ReducedTissue(full, PATH, 8).interface_frequencies
    np.testing.assert_allclose(found, exact, rtol=1e-3)


def test_modes_are_orthonormal_and_project_back():
    reduced = ReducedTissue(FULL, PATH, 12)
    values = np.random.default_rng(0).standard_normal(reduced.count)
    np.testing.assert_allclose(reduced.basis.T @ (FULL.mass @ reduced.basis), np.eye(reduced.count), atol=1e-8)
    np.testing.assert_allclose(reduced.projected(reduced.basis @ values), values, atol=1e-8 * np.abs(values).max())
    point = [[1e-3, 10e-3]]
    np.testing.assert_allclose(
        reduced.displacement(values, point), FULL.displacement(reduced.basis @ values, point), rtol=1e-9
    )


def test_unknowns_do_not_grow_with_the_mesh():
    counts = [(full.count, ReducedTissue(full, PATH, 20).count) for full in (FULL, TissueDynamics(tissue(1e-3)))]
    assert counts[1][0] > 1.8 * counts[0][0] and counts[0][1] == counts[1][1] == 20 + len(PATH.nodes)


def test_a_reduced_model_is_a_system_for_newmark():
    place = np.array([[1e-3, 8e-3]])
    ends = []
    for model in (FULL, ReducedTissue(FULL, PATH, 60)):
        rule, load = Newmark(model, 5e-3), 0.01 * model.loads(PATH)[:, [3]]
        load = np.asarray(load.todense() if hasattr(load, "todense") else load).ravel()
        *_, end = rule.states(rule.start(), [load] * 40)
        ends.append(model.displacement(end.displacement, place))
    np.testing.assert_allclose(ends[1], ends[0], rtol=4e-3)


def test_modes_and_paths_that_do_not_fit_are_named():
    for modes in (-1, FULL.count, 1.5):
        with pytest.raises(nf.InputError, match=f"number of modes is {modes}, must be 0 to {FULL.count - 11}"):
            ReducedTissue(FULL, PATH, modes)
    coarse = TissueDynamics(tissue(4e-3, order=1))
    for refused in (lambda: ReducedTissue(coarse, PATH, 1), lambda: inserted(coarse)):
        with pytest.raises(nf.InputError, match="spacing of the path is 2 mm, is finer than the mesh along the path"):
            refused()
    reduced = ReducedTissue(FULL, PATH, 1)
    with pytest.raises(nf.InputError, match="path is another, than the one of the reduced model"):
        reduced.loads(fe.NeedlePath(20e-3, 1e-3, 0.5e-3))
    assert reduced.loads(fe.NeedlePath(20e-3, 2e-3, 0.5e-3)).shape == (12, 11)
