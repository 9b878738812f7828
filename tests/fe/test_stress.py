# SPDX-License-Identifier: Apache-2.0
"""Stress of cells against closed forms, and the file for ParaView."""

import meshio
import numpy as np
import pytest
from test_elements import PATCHES, SQUARE, TUBE

import needleforce as nf
from needleforce import fe
from needleforce.fe.elastic.stress import Stress, stress
from needleforce.fe.elastic.supports import unknowns_of
from needleforce.fe.mesh.mesh_file import read_mesh
from needleforce.fe.vtk_file import write_vtk

YOUNG = 10e3


def moved(tissue, displacement):
    """Solution with the displacement of a function of points."""
    unknowns = unknowns_of(tissue.elements)
    return displacement(unknowns.places)[np.arange(len(unknowns.places)), unknowns.component]


def hooke(strain, ratio, symmetry):
    if symmetry == "plane_stress":
        strain = strain.copy()
        strain[2, 2] = -ratio / (1.0 - ratio) * (strain[0, 0] + strain[1, 1])
    return YOUNG / (1.0 + ratio) * (strain + ratio / (1.0 - 2.0 * ratio) * np.trace(strain) * np.eye(3))


@pytest.mark.parametrize("mesh, symmetry, order", PATCHES.values(), ids=PATCHES)
@pytest.mark.parametrize("ratio", [0.0, 0.3, 0.4999])
def test_a_patch_of_even_strain_has_hooke_s_stress_in_each_cell(mesh, symmetry, order, ratio):
    tissue = fe.Tissue(mesh, fe.Elastic(YOUNG, ratio), symmetry=symmetry, order=order)
    gradient = np.random.default_rng(1).normal(0.0, 1e-2, (mesh.dimension,) * 2)
    if symmetry == "axisymmetric":
        gradient = np.diag([0.01, -0.03])
    strain = np.zeros((3, 3))
    strain[: mesh.dimension, : mesh.dimension] = 0.5 * (gradient + gradient.T)
    if symmetry == "axisymmetric":
        strain[2, 2] = 0.01  # around the axis
    found = stress(tissue, moved(tissue, lambda points: points @ gradient.T))
    exact = hooke(strain, ratio, symmetry)
    np.testing.assert_allclose(found.tensor, np.broadcast_to(exact, found.tensor.shape), atol=1e-9 * abs(exact).max())


def test_von_mises_and_pressure_have_their_closed_forms():
    pull, shear, all_round = np.diag([0.0, 0.0, 7.0]), np.zeros((3, 3)), -5.0 * np.eye(3)
    shear[0, 1] = shear[1, 0] = 2.0
    found = Stress(np.array([pull, shear, all_round]))
    np.testing.assert_allclose(found.von_mises, [7.0, 2.0 * np.sqrt(3.0), 0.0], atol=1e-12)
    np.testing.assert_allclose(found.pressure, [-7.0 / 3.0, 0.0, 5.0])


@pytest.mark.parametrize("order, rate", [(1, 1.7), (2, 3.7)])
@pytest.mark.parametrize("ratio", [0.3, 0.49999])
def test_stress_in_lame_s_ring_converges_up_to_incompressible(order, rate, ratio):
    # sigma = p a^2 / (b^2 - a^2) (1 -+ b^2 / r^2): compared with the mean of the exact one over each cell
    a, b, pressure = 1.0, 3.0, 100.0
    share, errors = pressure * a**2 / (b**2 - a**2), []
    for cells in (16, 32, 64):
        mesh = fe.grid([np.linspace(a, b, cells + 1), np.linspace(0.0, 0.5, 2)])
        supports = {"top": "sliding", "bottom": "sliding"}
        tissue = fe.Tissue(mesh, fe.Elastic(YOUNG, ratio), symmetry="axisymmetric", supports=supports, order=order)
        at, weights = np.polynomial.legendre.leggauss(3)
        places = np.column_stack([np.full(3, a), 0.25 * (1.0 + at)])
        pushes = np.concatenate([2.0 * np.pi * a * pressure * 0.25 * weights, np.zeros(3)])
        found = stress(tissue, tissue.solve(tissue.values_at(places).T @ pushes))
        ends = np.linspace(a, b, cells + 1)
        mean = 2.0 * np.log(ends[1:] / ends[:-1]) / (ends[1:] ** 2 - ends[:-1] ** 2)  # of 1 / r^2 over a ring
        exact = share * np.column_stack([1.0 - b**2 * mean, 1.0 + b**2 * mean])
        errors.append(np.abs(found.tensor[:, [0, 2], [0, 2]] - exact).max() / pressure)
    assert np.all(np.log2(np.array(errors[:-1]) / errors[1:]) > rate) and errors[-1] < 1e-3


def test_a_solution_that_does_not_fit_is_named():
    tissue = fe.Tissue(SQUARE, fe.Elastic(YOUNG), symmetry="plane_strain")
    for wrong in (np.zeros(3), np.full(tissue.elements.count, np.nan), np.zeros((tissue.elements.count, 2))):
        with pytest.raises(nf.InputError, match=r"solution is of shape .*must be finite, with .* displacements"):
            stress(tissue, wrong)


@pytest.mark.parametrize("mesh, symmetry, order", PATCHES.values(), ids=PATCHES)
def test_a_file_for_paraview_has_what_was_solved(tmp_path, mesh, symmetry, order):
    mesh = mesh.labelled("tumour", lambda points: points[:, -1] > 2e-3)
    materials = {"tissue": fe.Elastic(YOUNG, 0.45), "tumour": fe.Elastic(5.0 * YOUNG, 0.45)}
    tissue = fe.Tissue(mesh, materials, symmetry=symmetry, order=order)
    solution = moved(tissue, lambda points: 1e-3 * points**2 + 0.1 * points[:, ::-1])
    path = tmp_path / "solved.vtu"
    labels = write_vtk(path, tissue, solution)
    assert labels == {0: "tissue", 1: "tumour"}
    found, d = meshio.read(path), mesh.dimension
    np.testing.assert_array_equal(found.points[:, :d], mesh.points)
    exact = 1e-3 * mesh.points**2 + 0.1 * mesh.points[:, ::-1]
    np.testing.assert_allclose(found.point_data["displacement"][:, :d], exact, atol=1e-15)
    cells, data = stress(tissue, solution), found.cell_data
    np.testing.assert_array_equal(data["stress"][0].reshape(-1, 3, 3), cells.tensor)
    np.testing.assert_array_equal(data["von_mises"][0], cells.von_mises)
    np.testing.assert_array_equal(data["pressure"][0], cells.pressure)
    again = read_mesh(path, depth_axis="xyz"[d - 1], labels=labels)
    np.testing.assert_array_equal(again.points, mesh.points)
    np.testing.assert_array_equal(again.cells, mesh.cells)
    assert list(again.labels) == list(mesh.labels) and again.shape == mesh.shape


def test_files_that_cannot_be_written_are_named_and_leave_the_old_one(tmp_path):
    tissue = fe.Tissue(TUBE, fe.Elastic(YOUNG), symmetry="axisymmetric")
    solution = np.zeros(tissue.elements.count)
    with pytest.raises(nf.InputError, match=r"ending of the file is \.vtk, must be \.vtu"):
        write_vtk(tmp_path / "a.vtk", tissue, solution)
    with pytest.raises(nf.InputError, match="its folder does not exist"):
        write_vtk(tmp_path / "none" / "a.vtu", tissue, solution)
    path = tmp_path / "a.vtu"
    path.write_text("old")
    with pytest.raises(nf.InputError, match=r"solution is of shape"):
        write_vtk(path, tissue, solution[:-1])
    assert path.read_text() == "old" and [each.name for each in tmp_path.iterdir()] == ["a.vtu"]
