# SPDX-License-Identifier: Apache-2.0
"""The blocks of the page on solids run in their order, as a reader would paste them."""

import re

import numpy as np

import needleforce as nf
from needleforce import fe


def test_the_blocks_of_the_page_run(root, tmp_path, monkeypatch):
    import meshio

    monkeypatch.chdir(tmp_path)
    block = fe.block((20e-3, 20e-3, 10e-3), 4e-3)
    points = 1e3 * block.points * [1.0, 1.0, -1.0]  # millimetres, z upwards
    numbers = np.where(np.arange(len(block.cells)) % 3 == 0, 2, 1)
    data = {"gmsh:physical": [numbers], "gmsh:geometrical": [numbers]}
    meshio.write("liver.msh", meshio.Mesh(points, [("hexahedron", block.cells)], cell_data=data), file_format="gmsh22")
    rng = np.random.default_rng(0)
    indentation = np.linspace(-2e-4, 4e-4, 601)
    force = nf.contact(nf.tips.Sphere(radius=2e-3), depth=np.maximum(indentation, 0.0), reduced_modulus=1e4).force
    names = {
        "markers": np.column_stack([rng.uniform(2e-3, 20e-3, 60), rng.uniform(1e-3, 45e-3, 60)]),
        "displacements": rng.normal(0.0, 1e-4, (60, 2)),
        "depth": indentation,
        "force": force + rng.normal(0.0, 1e-3 * force.max(), len(force)),
    }
    page = (root / "docs" / "solid.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```python\n(.*?)```", page, re.S)
    assert len(blocks) >= 6
    for code in blocks:
        exec(compile(code, "docs/solid.md", "exec"), names)
    assert set(names["liver"].labels) == {"liver", "vessel"} and (tmp_path / "cup.vtu").stat().st_size > 10_000
    assert names["condensed"].nodes[-1] == 40e-3
