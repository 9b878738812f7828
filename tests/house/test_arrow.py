# SPDX-License-Identifier: Apache-2.0
"""Data flows one way: no file includes or imports what lies further down the arrow."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "src" / "needleforce"

# each place with what it may see of the package beside itself; the order is the arrow's
CORE = {"core", "errors", "vocabulary", "version", "units"}
MECHANICS = CORE | {
    "indentation",
    "foundation",
    "needle_mechanics",
    "validity",
    "model",
    "energy",
    "motion",
    "preset_files",
}
ALLOWED = {
    "recording": CORE,
    "segmentation": CORE | {"recording"},
    "identification": MECHANICS | {"recording", "segmentation"},
    "simulation": MECHANICS | {"recording"},
    "rig": MECHANICS | {"recording", "simulation"},
    "report": MECHANICS | {"recording", "segmentation", "identification"},
    "model": CORE | {"validity"},
    "validity": CORE | {"needle_mechanics"},
    "preset_files": MECHANICS,
    "indentation": CORE,
    "foundation": CORE,
    "needle_mechanics": CORE,
    "energy": CORE,
    "motion": CORE,
}
# the one step back: a fit writes its own report when it is asked to
EXCEPTIONS = {("identification", "report")}
# what may not be imported when needleforce is
SLOW = {"pandas", "scipy", "matplotlib", "typer", "rich"}


def imports(path: Path):
    """(level, module, line, inside a function) of every import."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    inner = {id(node) for f in ast.walk(tree) if isinstance(f, ast.FunctionDef) for node in ast.walk(f)}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom):
            names = [node.module] if node.module else [alias.name for alias in node.names]
            for name in names:
                yield node.level, name, node.lineno, id(node) in inner
        elif isinstance(node, ast.Import):
            for alias in node.names:
                yield 0, alias.name, node.lineno, id(node) in inner


def home(path: Path) -> str:
    part = path.relative_to(PACKAGE).parts[0]
    return part.removesuffix(".py")


@pytest.mark.parametrize("place", sorted(ALLOWED))
def test_imports_follow_the_arrow(place):
    files = sorted(PACKAGE.glob(f"{place}/**/*.py")) or [PACKAGE / f"{place}.py"]
    for path in files:
        depth = len(path.relative_to(PACKAGE).parts)
        for level, name, line, _ in imports(path):
            if level != depth:
                continue
            target = name.split(".")[0]
            known = target in ALLOWED[place] or target == place or (place, target) in EXCEPTIONS
            assert known, f"{path.relative_to(ROOT)}:{line} imports {target}"


def test_heavy_libraries_are_loaded_when_used():
    code = "import sys, needleforce as nf; nf.preset; nf.Insertion; nf.Motion; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not SLOW & set(done.stdout.split())


ORDER = ["version", "parameter", "tip", "needle", "tissue", "contact", "foundation", "law", "laws", "model", "sample",
         "insertion", "sliding", "fit"]  # fmt: skip


def test_includes_follow_the_arrow():
    include = ROOT / "include" / "needleforce"
    for path in include.rglob("*.hpp"):
        here = path.relative_to(include).parts[0].removesuffix(".hpp")
        for name in re.findall(r'#include "([^"]+)"', path.read_text(encoding="utf-8")):
            target = (path.parent / name).resolve().relative_to(include).parts[0].removesuffix(".hpp")
            assert ORDER.index(target) <= ORDER.index(here), f"{path.relative_to(ROOT)} includes {name}"


def test_the_core_does_no_input_output_and_takes_no_heap():
    forbidden = r"\b(new|malloc|throw|std::vector|std::string|std::mutex|iostream|cstdio|fstream|Python\.h)\b"
    for path in (ROOT / "include").rglob("*.hpp"):
        code = re.sub(r"//.*", "", path.read_text(encoding="utf-8"))
        code = re.sub(r'"[^"]*"', '""', code)
        assert not re.search(forbidden, code), path
