# SPDX-License-Identifier: Apache-2.0
"""The figures of the package's structure: generated into ARCHITECTURE.md, and within their bars."""

import os
import re
import runpy
import sys

import pytest

# figure -> largest value; ARCHITECTURE.md has what is measured
BARS = {
    "Python files": 403,
    "lines": 78_140,
    "modules with one importer": 57,
    "modules in the largest import circle": 4,
    "functions with eight or more parameters": 15,
    "files that run in `nf.read(file)`": 26,
    "files that run in `nf.identify(recording)`": 40,
    "stays in files on the path through `read`": 113,
    "returns to a file on the path through `read`": 81,
    "calls with six or more positional arguments": 9,  # of functions of Warp, which takes no keywords
}


@pytest.fixture(scope="module")
def structure(root):
    sys.path.insert(0, str(root / "tools"))
    return runpy.run_path(str(root / "tools" / "structure.py"))


@pytest.fixture(scope="module")
def figures(root, structure):
    return structure["figures"](root / "src" / "needleforce", dict(os.environ))


def test_the_table_in_the_pages_is_the_generated_one(root, structure, figures):
    page = (root / "ARCHITECTURE.md").read_text(encoding="utf-8")
    found = structure["TABLE"].search(page)
    assert found and structure["table"](figures) in found[0], "run: python tools/structure.py --write"


@pytest.mark.parametrize("name", BARS)
def test_the_structure_stays_within_its_bars(figures, name):
    value = dict(figures)[name]
    assert int(re.match(r"\d+", value)[0]) <= BARS[name]


def test_import_circles_are_of_a_result_and_its_page(root, structure):
    package = root / "src" / "needleforce"
    known = structure["modules"](package)
    graph = {name: set(structure["imports_of"](name, path, known)) for name, path in known.items()}
    for circle in structure["circles"](graph):
        # lazy, inside a method: a result makes its own page, and writes its own files
        assert len(circle) <= 4 and any(name.endswith("page") for name in circle), circle


def test_the_path_of_a_call_is_followed_through_imports_and_back(tmp_path, structure):
    (tmp_path / "a.py").write_text(
        "from .b import second\n\ndef first():\n    return last(second())\n\ndef last(x): ...\n"
    )
    (tmp_path / "b.py").write_text("def second():\n    return first_helper()\n\ndef first_helper(): ...\n")
    known = {"p.a": tmp_path / "a.py", "p.b": tmp_path / "b.py"}
    # first in a, second and its helper in b, last in a
    assert structure["call_path"](known, "p.a", "first") == (4, 3, 2, 1)


def test_the_path_of_a_call_enters_methods_of_annotated_values(tmp_path, structure):
    (tmp_path / "a.py").write_text("from .b import opened\n\ndef first(path):\n    return opened(path).read()\n")
    (tmp_path / "b.py").write_text(
        "class File:\n    def read(self):\n        return self.rows()\n    def rows(self): ...\n\n"
        "def opened(path) -> File: ...\n"
    )
    known = {"p.a": tmp_path / "a.py", "p.b": tmp_path / "b.py"}
    assert structure["call_path"](known, "p.a", "first") == (4, 2, 2, 0)


def test_a_circle_is_found(structure):
    assert structure["circles"]({"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": {"a"}}) == [["a", "b", "c"]]
