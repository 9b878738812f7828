# SPDX-License-Identifier: Apache-2.0
"""Every law of the core has a page of its own, made from its table, with a curve and lines that work."""

import re
import subprocess
import sys

import pytest

import needleforce as nf
from needleforce.models.laws import FAMILIES, laws_of
from needleforce.preset_files.build import as_toml

LAWS = [law for family in FAMILIES for law in laws_of(family)]


@pytest.fixture(scope="module")
def law_pages(root):
    sys.path.insert(0, str(root / "docs"))
    import law_pages

    yield law_pages
    sys.path.remove(str(root / "docs"))


@pytest.fixture(scope="module")
def files(law_pages):
    """Page and figure of every law by the file's name."""
    return {name: text for law in LAWS for name, text in law_pages.law_files(law).items()}


def block(page: str, language: str) -> str:
    return re.search(rf"```{language}\n(.*?)```", page, re.S)[1]


def test_one_page_for_each_law_and_no_other(law_pages, monkeypatch):
    monkeypatch.setattr(law_pages.page, "figure", lambda example: "")
    monkeypatch.setattr(law_pages.side_by_side, "comparison", lambda family: "")
    contents, around = law_pages.contents(), {"index", "side_by_side", "layers"}
    assert {name.removesuffix(".md") for name in contents if name.endswith(".md")} == {x.name for x in LAWS} | around
    assert all(f"({law.name}.md)" in contents["index.md"] for law in LAWS)
    assert all(f":file: all_{family}.html" in contents["side_by_side.md"] for family in FAMILIES)
    assert all(figure in contents for page in contents.values() for figure in re.findall(r":file: (.*)", page))


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.name)
def test_a_page_has_what_the_table_says_and_a_figure(files, law):
    page, figure = files[f"{law.name}.md"], files[f"{law.name}.html"]
    for text in (law.summary, law.source, law.validity, f":file: {law.name}.html"):
        assert text in page
    for row in law.table():
        line = next(line for line in page.splitlines() if line.startswith(f"| `{row['name']}` |"))
        assert all(row[key] in line for key in ("symbol", "unit", "meaning", "source"))
    assert figure.count("<svg") == 2 and len(figure) < 60_000
    assert "nan" not in figure.lower()


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.name)
def test_the_lines_of_a_page_make_the_law(files, law_pages, law):
    page, drawn = files[f"{law.name}.md"], law_pages.typical.example(law).law
    assert eval(block(page, "python").removeprefix("law = "), {"nf": nf}) == drawn
    assert block(page, "toml").strip() in as_toml(law_pages.typical.around(drawn))


def test_a_formula_has_every_symbol_of_its_law(law_pages):
    entries = law_pages.formulas.FORMULAS
    assert set(entries) <= {law.name for law in LAWS}
    for law in LAWS:
        for row in law.table() if law.name in entries else ():
            symbol = law_pages.formulas.latex(row["symbol"])
            alone = re.escape(symbol) if symbol.startswith("\\") else rf"(?<![A-Za-z]){re.escape(symbol)}"
            assert re.search(rf"{alone}(?![A-Za-z])", law_pages.formulas.text(law)), (law.name, symbol)


def test_a_law_without_a_formula_shows_its_header(law_pages, monkeypatch):
    monkeypatch.setattr(law_pages.formulas, "FORMULAS", {})
    assert "tan(alpha)" in law_pages.formulas.text(nf.laws.Cone)


def test_the_lines_for_cpp_compile(files, root):
    laws = "".join(f"{{ {block(files[f'{law.name}.md'], 'cpp')} (void)law; }}\n" for law in LAWS)
    code = f'#include "needleforce/laws/all.hpp"\nusing namespace needleforce;\nint main() {{ {laws} }}\n'
    command = ["g++", "-std=c++20", "-fsyntax-only", "-x", "c++", f"-I{root / 'include'}", "-"]
    done = subprocess.run(command, input=code, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_the_comparison_draws_every_law_of_a_family(law_pages):
    figure = law_pages.side_by_side.comparison("relaxation")
    assert all(f"{law.name}, force [N]" in figure for law in laws_of("relaxation"))


def test_a_law_without_typical_numbers_has_an_example(law_pages, monkeypatch):
    monkeypatch.setattr(law_pages.typical, "TYPICAL", {})
    monkeypatch.setattr(law_pages.typical, "_in_presets", dict)
    assert law_pages.typical.example(nf.laws.PowerLaw).origin["exponent"].startswith("middle")


def test_what_did_not_change_is_not_written_again(law_pages, monkeypatch, tmp_path):
    (tmp_path / "gone.md").write_text("a law that is no more")
    monkeypatch.setattr(law_pages, "contents", lambda: {"cone.md": "text"})
    law_pages.write(tmp_path)
    before = (tmp_path / "cone.md").stat().st_mtime_ns
    law_pages.write(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["cone.md"]
    assert (tmp_path / "cone.md").stat().st_mtime_ns == before
