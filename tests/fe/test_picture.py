# SPDX-License-Identifier: Apache-2.0
"""What a picture shows is what was solved: values on the grid, extremes, surface, needle, materials and colours."""

import subprocess
import sys

import numpy as np
import pytest
from test_elements import PATCHES, tetrahedra
from test_stress import hooke, moved

import needleforce as nf
from needleforce import fe
from needleforce.fe.section import section

pytest.importorskip("matplotlib")
GEL = fe.Elastic(10e3, 0.3)
HELD = {"bottom": "fixed", "sides": "fixed"}
NEEDLE = 0.35e-3


@pytest.mark.parametrize("mesh, symmetry, order", PATCHES.values(), ids=PATCHES)
def test_an_even_strain_is_shown_exactly_in_cells_of_any_shape(mesh, symmetry, order):
    tissue = fe.Tissue(mesh, GEL, symmetry=symmetry, order=order)
    gradient = np.random.default_rng(1).normal(0.0, 1e-2, (mesh.dimension,) * 2)
    if symmetry == "axisymmetric":
        gradient = np.diag([0.01, -0.03])
    middle = 0.5 * (mesh.low + mesh.high)
    path = None
    if mesh.dimension == 3:
        path = fe.NeedlePath(
            4.0 * mesh.high[2], mesh.high[2], 1e-4, entry=tuple(middle[:2]), direction=(3.0, 4.0, 12.0)
        )
    shown = section(tissue, moved(tissue, lambda points: points @ gradient.T), path)
    across, depth = np.meshgrid(shown.across, shown.depth)
    places = np.stack([across, depth], axis=-1)
    if mesh.dimension == 3:
        places = np.stack([middle[0] + 0.6 * across, middle[1] + 0.8 * across, depth], axis=-1)
    if symmetry == "axisymmetric":
        places = np.abs(places)
    field = shown.field("displacement")
    inside = np.isfinite(field.values)
    assert inside.mean() > 0.7
    exact = places @ gradient.T @ shown.along
    np.testing.assert_allclose(field.values[inside], exact[inside], atol=1e-8 * np.abs(exact).max())
    size = np.linalg.norm(places @ gradient.T, axis=-1)[inside]
    np.testing.assert_allclose(shown.field("magnitude").values[inside], size, atol=0.1 * size.max())
    strain = np.zeros((3, 3))
    strain[: mesh.dimension, : mesh.dimension] = 0.5 * (gradient + gradient.T)
    if symmetry == "axisymmetric":
        strain[2, 2] = 0.01
    tensor = hooke(strain, 0.3, symmetry)
    deviator = tensor - np.trace(tensor) / 3.0 * np.eye(3)
    np.testing.assert_allclose(shown.field("von_mises").values[inside], np.sqrt(1.5 * np.sum(deviator**2)), rtol=1e-9)
    pull = shown.along @ tensor[: mesh.dimension, : mesh.dimension] @ shown.along
    np.testing.assert_allclose(shown.field("stress").values[inside], pull, rtol=1e-6)


@pytest.fixture(scope="module")
def cup():
    """A needle that pushes with 0.1 N along 10 mm, in skin on fat."""
    mesh = fe.axisymmetric_block(15e-3, 20e-3, NEEDLE, needle_depth=10e-3, layers=[("skin", 4e-3), ("fat", 1.0)])
    materials = {"skin": fe.Elastic(80e3, 0.45), "fat": fe.Elastic(20e3, 0.45)}
    tissue = fe.Tissue(mesh, materials, symmetry="axisymmetric", supports=HELD)
    path = fe.NeedlePath(10e-3, 1e-3, NEEDLE)
    return tissue, tissue.solve(path.loads(tissue) @ (0.01 * path.lengths / path.lengths.max())), path


def solids():
    """In space, of hexahedra and of tetrahedra, with a needle off the middle."""
    entry = (2e-3, 1e-3)
    path = fe.NeedlePath(5e-3, 1.25e-3, 0.7e-3, entry=entry)
    round_one = fe.cylinder(8e-3, 10e-3, 0.7e-3, needle_depth=5e-3, entry=entry)
    return {"hexahedra": (round_one, path), "tetrahedra": (tetrahedra(fe.block((16e-3, 16e-3, 10e-3), 3e-3)), path)}


@pytest.mark.parametrize("mesh, path", solids().values(), ids=solids())
def test_a_section_in_space_has_the_displacements_of_the_solid(mesh, path):
    tissue = fe.Tissue(mesh, GEL, supports=HELD)
    solution = tissue.solve(path.loads(tissue) @ np.full(5, 0.02))
    shown = section(tissue, solution, path)
    rng = np.random.default_rng(0)
    rows, columns = rng.integers(0, len(shown.depth), 60), rng.integers(0, len(shown.across), 60)
    points = np.column_stack([2e-3 + shown.across[columns], np.full(60, 1e-3), shown.depth[rows]])
    exact = tissue.displacement(solution, points)[:, 2]
    values = shown.field("displacement").values
    share = 0.02 if mesh.shape == "hexahedron" else 0.06  # linear in parts of tetrahedra of second order
    np.testing.assert_allclose(values[rows, columns], exact, atol=share * exact.max())
    distance, dimple = shown.surface
    there = np.column_stack([2e-3 + distance, np.full(len(distance), 1e-3), np.zeros(len(distance))])
    there[:, :2] *= 1.0 - 1e-6
    np.testing.assert_allclose(dimple, tissue.displacement(solution, there)[:, 2], atol=share * dimple.max())


def test_the_surface_under_a_point_force_is_boussinesq_s():
    # u = (1 - nu) F / (2 pi G r), less what the far end of the block holds back
    mesh = fe.axisymmetric_block(1.0, 1.0, 0.5e-3)
    tissue = fe.Tissue(mesh, GEL, symmetry="axisymmetric", supports=HELD)
    solution = tissue.solve(tissue.values_at(np.zeros((1, 2))).toarray()[1] * 0.2)
    distance, dimple = section(tissue, solution, fe.NeedlePath(0.02, 0.01, NEEDLE)).surface
    near = (np.abs(distance) > 3e-3) & (np.abs(distance) < 20e-3)
    exact = 0.7 * 0.2 / (2.0 * np.pi * GEL.shear_modulus * np.abs(distance[near]))
    assert near.sum() >= 12
    np.testing.assert_allclose(dimple[near], exact, rtol=0.04)


def test_a_picture_has_values_extremes_and_units(cup):
    tissue, solution, path = cup
    figure = fe.picture(tissue, solution, path)
    left, right = figure.axes[:2]
    data = left.images[0].get_array()
    points = np.array([[3.1e-3, 5.2e-3], [1.7e-3, 0.3e-3], [9e-3, 14e-3]])
    low, high, bottom, top = left.images[0].get_extent()
    for point, moved_there in zip(points, tissue.displacement(solution, points)[:, 1]):
        row = int((1e3 * point[1] - top) / (bottom - top) * data.shape[0])
        for side in (1.0, -1.0):  # the mirror shows the same
            column = int((side * 1e3 * point[0] - low) / (high - low) * data.shape[1])
            assert data[row, column] == pytest.approx(1e3 * moved_there, rel=0.03)
    assert left.images[0].norm.vmax == pytest.approx(
        1e3 * (solution[tissue.elements.dofs.nodal_dofs[1]]).max(), rel=0.01
    )
    assert right.images[0].norm.vmax == pytest.approx(1e-3 * fe.stress(tissue, solution).von_mises.max())
    assert (low, high, bottom, top) == pytest.approx((-15.0, 15.0, 15.0, 0.0), abs=0.1)  # 1.5 times the path
    for axes in (left, right):
        assert axes.get_xlabel() == "distance from the needle [mm]" and axes.get_ylabel() == "depth [mm]"
        assert {text.get_text() for text in axes.texts} == {"skin", "fat"}
    bars = [axes.get_xlabel() for axes in figure.axes[2:]]
    assert "displacement along the needle [mm]\n" in bars[0] and "von Mises stress [kPa]\n" in bars[1]


def test_the_needle_is_drawn_to_its_tip_in_its_width(cup):
    tissue, solution, path = cup
    corners = fe.picture(tissue, solution, path, tip=6e-3).axes[0].patches[0].get_xy()
    assert np.ptp(corners[:, 0]) == pytest.approx(0.7) and corners[:, 1].max() == pytest.approx(6.0)
    assert corners[:, 1].min() < 0.0  # above the surface
    mesh = fe.block((20e-3, 10e-3), 1e-3)
    plane = fe.Tissue(mesh, GEL, symmetry="plane_strain")
    oblique = fe.NeedlePath(5e-3, 1e-3, NEEDLE, entry=(3e-3,), direction=(-3.0, 4.0))
    axes = fe.picture(plane, np.zeros(plane.elements.count), oblique).axes[0]
    corners = axes.patches[0].get_xy()
    tip = corners[1:3].mean(axis=0)
    np.testing.assert_allclose(tip, [-3.0, 4.0], atol=1e-9)
    assert "zero everywhere" in "".join(each.get_xlabel() for each in axes.figure.axes)


def test_colours_clip_nothing_above_and_mark_what_is_below(cup):
    tissue, solution, path = cup
    figure = fe.picture(tissue, solution, path, quantities=("von_mises", "stress", "displacement", "magnitude"))
    for axes in figure.axes[:4]:
        image = axes.images[0]
        assert image.get_array().max() <= image.norm.vmax * (1.0 + 1e-9)
    signed = figure.axes[1].images[0].norm
    assert signed.vmin == -signed.vmax and signed(0.0) == pytest.approx(0.5)
    # what is lower than a thousandth of the largest stress has an arrow
    small = fe.Tissue(fe.axisymmetric_block(0.1, 0.1, NEEDLE), GEL, symmetry="axisymmetric", supports=HELD)
    shallow = fe.NeedlePath(80e-3, 20e-3, NEEDLE)
    figure = fe.picture(small, small.solve(small.values_at(np.zeros((1, 2))).toarray()[1]), shallow)
    norm = figure.axes[1].images[0].norm
    assert norm.vmin == pytest.approx(1e-3 * norm.vmax)
    assert figure.axes[1].images[0].colorbar.extend == "min"


def test_what_cannot_be_shown_is_named(cup):
    tissue, solution, path = cup
    with pytest.raises(nf.InputError, match=r"quantity is .shear., unknown. Give one of displacement, magnitude"):
        fe.picture(tissue, solution, path, quantities=("shear",))
    with pytest.raises(nf.InputError, match="solution is of shape"):
        fe.picture(tissue, solution[:-1], path)
    with pytest.raises(nf.InputError, match="tip is nan m, must be finite"):
        fe.picture(tissue, solution, path, tip=np.nan)
    solid = fe.Tissue(fe.block((4e-3,) * 3, 2e-3), GEL)
    off = fe.NeedlePath(2e-3, 1e-3, NEEDLE, entry=(0.0, 5e-3))
    with pytest.raises(nf.InputError, match="plane of the section is outside the mesh"):
        fe.picture(solid, np.zeros(solid.elements.count), off)


def test_importing_elements_does_not_load_matplotlib():
    code = "import sys; from needleforce import fe; fe.picture, fe.report; sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
