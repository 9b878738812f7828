# SPDX-License-Identifier: Apache-2.0
"""The report of a solid: its figures, tables and sentences are what was solved; one file, offline, reproducible."""

import re

import numpy as np
import pytest

import needleforce as nf
from needleforce import fe
from needleforce.display.page import script
from needleforce.fe.solid_report import facts

pytest.importorskip("matplotlib")
NEEDLE = 0.35e-3
HELD = {"bottom": "fixed", "sides": "fixed"}


@pytest.fixture(scope="module")
def solved():
    """A needle that pushes with 0.25 N along its path, in two layers."""
    mesh = fe.axisymmetric_block(15e-3, 20e-3, 2.0 * NEEDLE, needle_depth=10e-3, layers=[("skin", 4e-3), ("fat", 1.0)])
    materials = {"skin": fe.Elastic(80e3, 0.45), "fat": fe.Elastic(20e3, 0.45)}
    tissue = fe.Tissue(mesh, materials, symmetry="axisymmetric", supports=HELD)
    path = fe.NeedlePath(10e-3, 2e-3, NEEDLE)
    return tissue, tissue.solve(path.loads(tissue) @ (0.25 * path.lengths / path.lengths.sum())), path


@pytest.fixture(scope="module")
def run():
    depth = np.linspace(0.0, 10e-3, 501)
    return {"depth": depth, "force": np.where(depth < 4.01e-3, 100.0 * depth, 0.2)}


@pytest.fixture(scope="module")
def page(solved, run, tmp_path_factory):
    file = tmp_path_factory.mktemp("report") / "cup.html"
    fe.report(file, *solved, tip=8e-3, **run, title="A cup <1>")
    return file.read_text(encoding="utf-8")


def test_the_page_has_each_section_with_its_figures_and_alternative_texts(page):
    titles = re.findall(r"<h2>(.*?)</h2>", page)
    assert titles == [
        "Displacement and stress", "The surface", "Force over depth", "What was solved", "Materials and supports",
    ]  # fmt: skip
    texts = re.findall(r'<svg viewBox="[^"]*" role="img" aria-label="([^"]*)"', page)
    assert len(texts) == page.count("<svg") == 8  # four drawings, each wide and narrow
    assert all(len(text) > 40 and re.search(r"\d", text) for text in texts)
    assert "<h1>A cup &lt;1&gt;</h1>" in page and "displacement along the needle [" in page


def test_nothing_is_loaded_and_it_is_the_same_each_time(page, solved, run, tmp_path):
    assert not re.search(r"https?://|<script|<link|<iframe|@import", page.replace(str(script()), ""))
    links = re.findall(r'(?:src|href)="([^"]{1,22})', page)
    assert all(link.startswith(("#", "data:image/png;base64,")) for link in links)
    assert len(page) < 1_000_000
    again = tmp_path / "again.html"
    fe.report(again, *solved, tip=8e-3, **run, title="A cup <1>")
    assert again.read_text(encoding="utf-8") == page


def test_sentences_have_the_force_and_the_extremes(page, solved):
    tissue, solution, path = solved
    outcome = re.search(r'<p class="outcome">(.*?)</p>', page)[1]
    vertical = np.abs(solution[tissue.elements.dofs.nodal_dofs[1]]).max()
    found = float(re.search(r"along the needle by up to ([\d.]+)\s*mm", outcome)[1])
    assert found == pytest.approx(1e3 * vertical, rel=0.02)
    found = float(re.search(r"von Mises stress is ([\d.]+)\s*kPa", outcome)[1])
    assert found == pytest.approx(1e-3 * fe.stress(tissue, solution).von_mises.max(), rel=0.01)
    assert re.search(r"along the depth is 0\.25\sN\.", outcome)
    assert facts(tissue, solution, path).force == pytest.approx(0.25, rel=1e-9)


def test_tables_have_mesh_materials_supports_and_path(page, solved):
    tissue = solved[0]
    text = re.sub(r"<[^>]+>", "|", page[page.index("What was solved") :])
    text = re.sub(r"[|\s]+", " ", text.replace("\N{NO-BREAK SPACE}", " "))
    for words in (
        "symmetry axisymmetric", "size 15 × 20 mm (r × depth)",
        f"cells {len(tissue.mesh.cells)} of shape quad and second order", f"unknown displacements {tissue.unknowns}",
        "radius of the needle 0.35 mm", "path 10 mm with 6 nodes 2 mm apart", "tip 8 mm",
        f"skin 80 kPa 0.45 1000 kg/m³ {np.sum(tissue.mesh.labels == 'skin')}",
        f"fat 20 kPa 0.45 1000 kg/m³ {np.sum(tissue.mesh.labels == 'fat')}", "bottom fixed", "sides fixed", "top free",
    ):  # fmt: skip
        assert words in text


def test_captions_have_the_dimple_and_the_largest_force(page, solved, run):
    tissue, solution, _ = solved
    text = re.search(r"displaced inwards.*?Largest: ([\d.]+)\s*mm at", page)[1]
    # the tissue within the needle moves with it: the largest dimple is there
    inner = tissue.displacement(solution, [[0.0, 0.0], [NEEDLE, 0.0], [2.0 * NEEDLE, 0.0]])[:, 1]
    assert float(text) == pytest.approx(1e3 * inner.max(), rel=0.02)
    assert re.search(r"Largest: 0\.4\sN at 4 mm; at the end 0\.2\sN", page)


def test_a_solid_in_space_without_a_needle_has_a_page_without_one(tmp_path):
    tissue = fe.Tissue(fe.cylinder(5e-3, 5e-3, 1e-3), fe.Elastic(10e3, 0.3))
    fe.report(tmp_path / "plain.html", tissue, np.zeros(tissue.elements.count))
    page = (tmp_path / "plain.html").read_text(encoding="utf-8")
    assert "Force over depth" not in page and "radius of the needle" not in page
    assert "The tissue is not displaced." in page and "x [mm]" in page


def test_what_does_not_fit_is_named_and_no_file_is_written(solved, tmp_path):
    file = tmp_path / "cup.html"
    for options, words in (
        ({"depth": [0.0, 1e-3]}, "force is missing, of the insertion. Give both, or none."),
        ({"force": [0.0, 1.0]}, "depth is missing"),
        (
            {"depth": [0.0, 1e-3], "force": [0.0]},
            r"force of the insertion is of shape \(1,\), must be as long as depth",
        ),
        ({"tip": np.inf}, "tip is inf m, must be finite"),
    ):
        with pytest.raises(nf.InputError, match=words):
            fe.report(file, *solved, **options)
    with pytest.raises(nf.InputError, match="solution is of shape"):
        fe.report(file, solved[0], np.zeros(3))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "depth, force, words",
    [
        ([0.0, np.nan], [0.0, 1.0], "depth in row 2 is nan m, not finite"),
        ([0.0, 1e308], [0.0, 1.0], "depth in row 2"),
        ([0.0, 0.01], [0.0, np.inf], "force in row 2 is inf"),
    ],
)
def test_an_insertion_with_numbers_that_no_needle_has_is_named(solved, tmp_path, depth, force, words):
    with pytest.raises(nf.InputError, match=words):
        nf.fe.report(tmp_path / "page.html", *solved[:2], depth=depth, force=force)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda: nf.fe.Elastic(1e308), "young_modulus is 1e[+]308 Pa, outside"),
        (lambda: nf.fe.Elastic(1e4, density=1e308), "density"),
        (lambda: nf.fe.NeoHookean(1e308), "shear_modulus"),
        (lambda: nf.fe.MooneyRivlin(1e307, 1e307), "c10 . c01"),
        (lambda: nf.fe.NeedlePath(0.02, 5e-324, 1e-3), "spacing of the path"),
        (lambda: nf.fe.NeedlePath(1e308, 1e-3, 1e-3), "depth of the path"),
        (lambda: nf.fe.CondensedTissue(1e-3, np.eye(3), np.nan), "radius is nan"),
    ],
)
def test_numbers_of_solids_have_ranges(make, words):
    with pytest.raises(nf.InputError, match=words):
        make()
