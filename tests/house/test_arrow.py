# SPDX-License-Identifier: Apache-2.0
"""Data flows one way: no file includes or imports what lies further down the arrow."""

import ast
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "src" / "needleforce"

# each place with what it may see of the package beside itself; the order is the arrow's
CORE = {"checks", "core", "display", "errors", "files", "vocabulary", "units", "references"}
MODELS = CORE | {"mechanics", "models", "preset_files"}
ALLOWED = {
    "checks": {"errors"},
    "display": {"errors", "files", "vocabulary"},
    "mechanics": CORE,
    "models": CORE | {"mechanics", "recording"},
    "preset_files": CORE | {"mechanics", "models"},
    "recording": CORE,
    "segmentation": CORE | {"recording"},
    "identification": MODELS | {"recording", "segmentation"},
    "bench_tests": MODELS | {"recording", "segmentation", "identification"},
    "wire": CORE,
    "rig": MODELS | {"recording", "wire"},
    "acquisition": CORE | {"recording", "wire"},
    "events": CORE | {"recording", "segmentation", "acquisition", "online"},
    "protocol": MODELS | {"recording", "wire", "acquisition"},
    "mujoco": MODELS | {"fe"},
    "running": {"checks", "errors", "vocabulary"},
    "state_folder": {"errors", "files", "vocabulary"},
    "campaign": MODELS | {"recording", "segmentation", "identification", "running", "state_folder"},
    "control": MODELS,
    "online": MODELS | {"recording", "segmentation", "identification", "campaign"},
    "fe": MODELS | {"recording", "segmentation", "identification"},
    "steering": MODELS | {"display", "recording"},
    "studies": MODELS | {"recording", "identification", "rig", "control", "fe", "running", "state_folder"},
    "references": set(),
    "export": MODELS,
    "simulators": MODELS,
    "studio": MODELS
    | {"recording", "segmentation", "identification", "campaign", "export", "wire", "acquisition", "rig"}
    | {"steering", "fe"},
}
# the step back: identify() reads the bench tests it is given
EXCEPTIONS = {("identification", "bench_tests")}
# what may not be imported when needleforce is
SLOW = {"pandas", "scipy", "matplotlib", "typer", "rich", "jinja2"}


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


# each C++ header with what it may see: what stands before it in its row; laws/ is one place but for its list,
# tips/ is one
SIMULATED = ["version", "fingerprint", "scalar", "dual", "parameter", "dispatch", "sneddon", "tips", "tip", "needle",
             "tissue", "contact", "tip_table", "foundation", "bevel", "sample", "state_check", "returnable_slip",
             "noisy_depth", "relaxation", "memory", "rupture", "force_sums", "law", "laws", "laws/all",
             "layer_contact", "model", "model_fingerprint", "state_bytes", "limits", "state", "layer", "model_swap",
             "prepared_insertion", "insertion_definitions", "gradient", "insertion", "batch", "bending", "sliding",
             "solid", "exchange", "live", "guard_settings", "energy_controller", "guard", "flight_recorder",
             "base_guard"]  # fmt: skip
# what looks for events depends on no engine
WATCHED = ["version", "fingerprint", "state_bytes", "sample", "state_check", "parameter", "events"]
LEARNT = [*SIMULATED, "events", "online"]
FITTED = ["fit/normal", "fit/pair", "fit/stroke", "fit/lagged", "fit/gain", "fit/search", "fit/punctures", "fit/polish",
          "fit/cycle", "fit/dead_band", "fit/loading_curves", "fit/loading", "fit/median", "fit/depth_noise",
          "fit/origin", "fit/lag", "fit/outliers", "fit/sliding_start", "fit/windows"]  # fmt: skip
FITTED_IN_LAYERS = [*SIMULATED, "fit/pair", "fit/layered", "fit/layered_problem", "fit/layered_search"]
CORE_HEADERS, FIT_HEADERS = Path("include", "needleforce"), Path("bindings", "python", "fit")


def headers(root: Path) -> list[Path]:
    """The headers of the core and those of the fits in the Python module."""
    return sorted([*(root / CORE_HEADERS).rglob("*.hpp"), *(root / FIT_HEADERS).rglob("*.hpp")])


def place(path: Path, root: Path) -> str:
    """Where a header stands: its name without ending, or its folder."""
    above = CORE_HEADERS if path.is_relative_to(root / CORE_HEADERS) else FIT_HEADERS.parent
    name = path.relative_to(root / above).with_suffix("").as_posix()
    one_place = (
        name.startswith(("laws/", "tips/", "batch/", "gradient/", "bending/", "solid/", "events/", "online/"))
        and name != "laws/all"
    )
    return name.split("/")[0] if one_place else name


def included(path: Path, root: Path) -> list[Path]:
    """The headers that a file includes, written from its own folder or from the include paths."""
    names = re.findall(r'^\s*#\s*include\s*["<]([^">]+)[">]', path.read_text(encoding="utf-8"), re.M)
    from_path = {"needleforce": root / CORE_HEADERS.parent, "fit": root / FIT_HEADERS.parent}
    inside = [name for name in names if name.endswith(".hpp")]
    return [(from_path.get(name.split("/")[0], path.parent) / name).resolve() for name in inside]


def upward_includes(root: Path) -> list[str]:
    """The includes of these headers that go against the arrow, or nowhere."""
    wrong = []
    for path in headers(root):
        here = place(path, root)
        row = next(row for row in (SIMULATED, WATCHED, LEARNT, FITTED, FITTED_IN_LAYERS) if here in row)
        seen = row[: row.index(here) + 1]
        for target in included(path, root):
            if not target.is_file() or place(target, root) not in seen:
                wrong.append(f"{here} includes {target.relative_to(root)}")
    return wrong


def test_includes_follow_the_arrow():
    assert upward_includes(ROOT) == []


@pytest.mark.parametrize("form", ['#include "{}"', "#include <{}>"])
@pytest.mark.parametrize(
    "at, name, found",
    [
        ("fit/gain", "needleforce/insertion.hpp", CORE_HEADERS / "insertion.hpp"),
        ("fit/gain", "cycle.hpp", FIT_HEADERS / "cycle.hpp"),
        ("fit/gain", "fit/cycle.hpp", FIT_HEADERS / "cycle.hpp"),
        ("fit/gain", "nowhere.hpp", FIT_HEADERS / "nowhere.hpp"),
        ("contact", "insertion.hpp", CORE_HEADERS / "insertion.hpp"),
        ("contact", "fit/stroke.hpp", FIT_HEADERS / "stroke.hpp"),
    ],
)
def test_an_include_against_the_arrow_is_found(tmp_path, form, at, name, found):
    for folder in (CORE_HEADERS, FIT_HEADERS):
        shutil.copytree(ROOT / folder, tmp_path / folder)
    header = next(path for path in headers(tmp_path) if place(path, tmp_path) == at)
    header.write_text(header.read_text(encoding="utf-8") + form.format(name) + "\n", encoding="utf-8")
    assert upward_includes(tmp_path) == [f"{at} includes {found}"]


def test_core_and_fits_do_no_input_output_and_take_no_heap():
    forbidden = r"\b(new|malloc|throw|std::vector|std::string|std::mutex|iostream|cstdio|fstream|Python\.h)\b"
    for path in headers(ROOT):
        # problems of any size, outside every loop; any number of insertions, whose steps take none
        if path.name in ("layered_problem.hpp", "layered_search.hpp") or path.parent.name == "batch":
            continue
        code = re.sub(r"//.*", "", path.read_text(encoding="utf-8"))
        code = re.sub(r'"[^"]*"', '""', code)
        assert not re.search(forbidden, code), path
