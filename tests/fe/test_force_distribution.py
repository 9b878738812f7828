# SPDX-License-Identifier: Apache-2.0
"""Forces along a shaft from markers seen by a camera: a virtual experiment on another mesh than that of the fit."""

import numpy as np
import pytest

import needleforce as nf
from needleforce import fe

LENGTH, RADIUS = 50e-3, 0.4e-3
NODES = fe.NeedlePath(LENGTH, 2e-3, RADIUS)


def phantom(cell, shape="quad"):
    """A slab, 100 x 80 x 20 mm, in which a camera sees markers."""
    mesh = fe.block((0.1, 0.08), cell, needle_depth=LENGTH, growth=0.15)
    if shape == "triangle":
        cells = np.concatenate([mesh.cells[:, [0, 1, 2]], mesh.cells[:, [0, 2, 3]]])
        mesh = fe.Mesh(mesh.points, cells, "triangle")
    held = {"bottom": "fixed", "sides": "fixed"}
    return fe.Tissue(mesh, fe.Elastic(15e3, 0.45), symmetry="plane_stress", supports=held, thickness=20e-3)


@pytest.fixture(scope="module")
def coarse():
    return phantom(2.2e-3)


@pytest.fixture(scope="module")
def truth():
    """Markers, their displacements, and densities at the nodes of the fit, of a fine mesh of triangles."""
    fine, path = phantom(1.2e-3, "triangle"), fe.NeedlePath(LENGTH, 0.5e-3, RADIUS)
    x, z = np.linspace(-30e-3, 30e-3, 13), np.linspace(4e-3, 64e-3, 13)
    markers = np.array([(a, b) for a in x for b in z if abs(a) > 1e-3])
    cases = {
        "peak": 12.0 + 120.0 * np.maximum(0.0, 1.0 - (LENGTH - path.nodes) / 8e-3),
        "wave": 15.0 + 8.0 * np.cos(2.0 * np.pi * path.nodes / LENGTH),
        "even": np.full(len(path.nodes), 20.0),
    }
    loads = path.loads(fine).toarray()
    found = {}
    for name, density in cases.items():
        forces = density * path.lengths
        moved = fine.displacement(fine.solve(loads @ forces), markers)
        found[name] = moved, np.interp(NODES.nodes, path.nodes, density), forces.sum()
    return markers, found


@pytest.mark.parametrize("noise", [0.1e-3, 0.3e-3])
@pytest.mark.parametrize("case, profile", [("peak", "peak"), ("peak", "smooth"), ("wave", "smooth"), ("even", "peak")])
def test_density_and_base_force_are_within_their_intervals(coarse, truth, case, profile, noise):
    markers, (moved, density, total) = truth[0], truth[1][case]
    inside, base, error, sigma = [], [], [], []
    for seed in range(12):
        seen = moved + np.random.default_rng(seed).normal(0.0, noise, moved.shape)
        found = fe.force_distribution(coarse, NODES, markers, seen, profile=profile)
        inside.append(np.mean((found.density_low <= density) & (density <= found.density_high)))
        base.append(found.base_low <= total <= found.base_high)
        error.append(found.base_force / total - 1.0)
        sigma.append(found.noise)
    assert np.mean(inside) >= 0.9 and np.mean(base) >= 0.8
    assert np.sqrt(np.mean(np.square(error))) <= 0.05
    assert np.mean(sigma) == pytest.approx(noise, rel=0.15)


def test_the_force_follows_the_modulus_and_the_noise_may_be_given(coarse, truth):
    markers, (moved, _, total) = truth[0], truth[1]["even"]
    seen = moved + np.random.default_rng(0).normal(0.0, 0.1e-3, moved.shape)
    stiff = fe.Tissue(
        coarse.mesh, fe.Elastic(30e3, 0.45), symmetry="plane_stress", supports=coarse.supports, thickness=20e-3
    )
    one, other = (fe.force_distribution(each, NODES, markers, seen) for each in (coarse, stiff))
    assert other.base_force == pytest.approx(2.0 * one.base_force, rel=1e-6)
    widths = []
    for noise in (0.1e-3, 0.2e-3):
        found = fe.force_distribution(coarse, NODES, markers, seen, profile="peak", noise=noise)
        assert found.noise == pytest.approx(noise) and found.base_force == pytest.approx(total, rel=0.05)
        widths.append(found.base_high - found.base_low)
    assert 1.3 < widths[1] / widths[0] < 2.7


def test_markers_that_were_not_seen_are_left_out(coarse, truth):
    markers, (moved, _, total) = truth[0], truth[1]["even"]
    seen = moved.copy()
    seen[::3] = np.nan
    found = fe.force_distribution(coarse, NODES, markers, seen)
    assert (
        np.isnan(found.residuals[::3]).all() and np.isfinite(np.delete(found.residuals, slice(None, None, 3), 0)).all()
    )
    assert found.base_force == pytest.approx(total, rel=0.03)


def test_no_force_is_found_where_there_is_none(coarse, truth):
    noise = np.random.default_rng(5).normal(0.0, 0.1e-3, truth[0].shape)
    for profile in ("smooth", "peak"):
        found = fe.force_distribution(coarse, NODES, truth[0], noise, profile=profile)
        assert found.base_low < 0.0 < found.base_high and abs(found.base_force) < 0.05


@pytest.mark.parametrize(
    "change, words",
    [
        ({"markers": [[0.2, 0.01]], "displacements": [[0.0, 0.0]]}, "is outside the mesh"),
        ({"markers": [[0.01, 0.01]], "displacements": [[0.0, 0.0, 0.0]]}, "two arrays of shape"),
        ({"markers": [[0.01, np.nan]], "displacements": [[0.0, 0.0]]}, "place of a marker is not finite"),
        ({"markers": [[0.01, 0.01]], "displacements": [[0.0, 1e-3]]}, "is 2 coordinates, 27 numbers.*peak"),
        ({"markers": [[0.01, 0.01]], "displacements": [[0.0, 1e-3]], "profile": "peak"}, "Use more markers"),
        ({"markers": np.zeros((0, 2)), "displacements": np.zeros((0, 2))}, "markers is none"),
        ({"markers": [[0.01, 0.01]] * 20, "displacements": [[0.0, 1e-3]] * 20}, "markers is at one place"),
        ({"markers": [[0.01, 0.01]], "displacements": [[0.0, 1.0]]}, "Give them in m"),
        ({"profile": "steep"}, "must be smooth or peak"),
        ({"noise": 0.0}, "noise is 0.0 m, must be above 0"),
    ],
)  # fmt: skip
def test_markers_that_do_not_suffice_are_named(coarse, truth, change, words):
    arguments = {"markers": truth[0], "displacements": truth[1]["even"][0]} | change
    with pytest.raises(nf.InputError, match=words):
        fe.force_distribution(coarse, NODES, **arguments)
