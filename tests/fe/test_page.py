# SPDX-License-Identifier: Apache-2.0
"""The blocks of the pages on solids run in their order, as a reader would paste them."""

import re

import numpy as np

import needleforce as nf
from needleforce import fe


def run(root, page, names):
    blocks = re.findall(r"```python\n(.*?)```", (root / "docs" / page).read_text(encoding="utf-8"), re.S)
    assert blocks
    for code in blocks:
        exec(compile(code, f"docs/{page}", "exec"), names)
    return names


def test_the_blocks_of_the_solid_run(root, tmp_path, monkeypatch):
    import meshio

    monkeypatch.chdir(tmp_path)
    block = fe.block((20e-3, 20e-3, 10e-3), 4e-3)
    points = 1e3 * block.points * [1.0, 1.0, -1.0]  # millimetres, z upwards
    numbers = np.where(np.arange(len(block.cells)) % 3 == 0, 2, 1)
    data = {"gmsh:physical": [numbers], "gmsh:geometrical": [numbers]}
    meshio.write("liver.msh", meshio.Mesh(points, [("hexahedron", block.cells)], cell_data=data), file_format="gmsh22")
    names = {}
    for page in ("solid", "solid_meshes", "solid_large"):
        run(root, f"howto/{page}.md", names)
    assert set(names["liver"].labels) == {"liver", "vessel"} and (tmp_path / "cup.vtu").stat().st_size > 10_000
    assert names["condensed"].nodes[-1] == 40e-3
    assert (tmp_path / "cup.html").stat().st_size > 50_000 and (tmp_path / "cup.png").exists()


def test_the_blocks_of_the_moduli_run(root):
    rng = np.random.default_rng(0)
    indentation = np.linspace(-2e-4, 4e-4, 601)
    force = nf.contact(nf.tips.Sphere(radius=2e-3), depth=np.maximum(indentation, 0.0), reduced_modulus=1e4).force
    names = {
        "markers": np.column_stack([rng.uniform(2e-3, 20e-3, 60), rng.uniform(1e-3, 45e-3, 60)]),
        "displacements": rng.normal(0.0, 1e-4, (60, 2)),
        "depth": indentation,
        "force": force + rng.normal(0.0, 1e-3 * force.max(), len(force)),
        "insertion_recording": inserted(rng),
    }
    found = run(root, "howto/moduli_large_strain.md", run(root, "howto/solid_moduli.md", names))
    assert found["cup"].mesh.high[-1] == 22e-3


def inserted(rng):
    """Time, depth and force of an insertion with a withdrawal into a cup of 30 kPa."""
    mesh = fe.axisymmetric_block(14e-3, 22e-3, 0.18e-3, needle_depth=15e-3)
    supports = {"bottom": "fixed", "sides": "fixed"}
    cup = fe.Tissue(mesh, fe.Elastic(30e3, 0.49), symmetry="axisymmetric", supports=supports)
    condensed = cup.condense(fe.NeedlePath(depth=15e-3, spacing=0.6e-3, radius=0.35e-3))
    depth = np.concatenate([np.linspace(-1e-3, 12e-3, 2601), np.linspace(12e-3, -1e-3, 2601)[1:]])
    insertion = fe.CondensedInsertion(condensed, nf.preset("paper"))
    force = insertion.run(depth, np.full(len(depth), 1e-3))["force"]
    return 1e-3 * np.arange(len(depth)), depth, force + rng.normal(0.0, 1e-3, len(depth))
