# SPDX-License-Identifier: Apache-2.0
"""What README, docs/start and docs/howto/controllers.md tell a controller's author to write and to run."""

import os
import re
import shutil
import subprocess
import sys

import pytest
from building import TOOLS, said

import needleforce as nf

LOOP = "docs/start/loop.md"
PYTHON = sys.executable

C_AROUND = """#include <stdio.h>
#include <stdlib.h>
#include "gel.h"
#include "needleforce_guard.h"
double run(double depth, double velocity, double dt) {{
nf_fault why; nf_sample sample; nf_output output; {} return output.force; }}
"""
CPP_AROUND = """#include "gel.hpp"
#include "needleforce/guard.hpp"
double run(double depth, double velocity, double dt) {{ {} return sample.force + output.force; }}
"""


def blocks(page, language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", page.read_text(encoding="utf-8"), re.S)


@pytest.mark.parametrize(
    "page, language, file",
    [("README.md", "cpp", "main.cpp"), (LOOP, "cpp", "main.cpp"), (LOOP, "cmake", "CMakeLists.txt")],
)
def test_a_page_shows_the_program_outside(root, page, language, file):
    shown = blocks(root / page, language)[0]
    assert (root / "examples" / "outside" / "cpp" / file).read_text().endswith(shown)


def test_the_pages_of_the_start_lead_from_a_file_to_a_loop(root, tmp_path):
    """In an empty folder, with the recording and nothing else: the shown text is what is printed."""
    shutil.copy(root / "examples" / "insertion.csv", tmp_path)
    own = root / "docs" / "start" / "own_file.md"
    (needle,), python = blocks(own, "toml"), blocks(own, "python") + blocks(root / LOOP, "python")
    (tmp_path / "needle.toml").write_text(needle)
    commands = [text for page in (own, root / LOOP) for text in blocks(page, "sh")]
    identify, export = (next(text for text in commands if word in text) for word in ("--json", "export"))
    (program,) = blocks(root / LOOP, "cpp")[:1]
    (tmp_path / "main.cpp").write_text(program)
    (compiler,) = (text for text in commands if "g++" in text)
    path = {"PATH": f"{TOOLS}{os.pathsep}/usr/bin{os.pathsep}/bin", "LC_ALL": "C.UTF-8"}
    both = "\n".join([identify, export, compiler.replace("path/to/needleforce", str(root)).replace("-O2", "-O0")])
    done = subprocess.run(["sh", "-e", "-c", both], cwd=tmp_path, capture_output=True, text=True, env=path)
    assert done.returncode == 0, done.stderr
    (in_the_loop,) = blocks(root / LOOP, "text")
    assert done.stdout.endswith(in_the_loop)
    rows = [line.split("|")[2] for line in own.read_text().splitlines() if line.startswith("| `")]
    shown = [" ".join(row.split(" (")[0].split()) for row in rows]  # without the intervals
    printed = " ".join(done.stdout.split())
    assert len(shown) == 6 and [value for value in shown if value not in printed] == []
    ran = subprocess.run([PYTHON, "-c", "\n".join(python)], cwd=tmp_path, capture_output=True, text=True, env=path)
    assert ran.stdout.startswith(blocks(own, "text")[-1].split(",")[0]) and ran.stdout.endswith(in_the_loop), ran.stderr
    assert (tmp_path / "report.html").stat().st_size > 10_000


EVENTS_AROUND = """
static inline void stop(void) {}
void loop(double force, double depth, double dt);
void loop(double force, double depth, double dt) { nf_fault why; %s }
"""


@pytest.mark.parametrize("page", ["online_events", "online_identification"])
def test_the_c_program_that_finds_events_or_learns_compiles(root, page):
    (shown,) = blocks(root / "docs" / "howto" / f"{page}.md", "c")
    header, body = shown.split("\n\n", 1)
    command = ["gcc", "-std=c11", "-fsyntax-only", "-Wall", "-Werror", f"-I{root / 'bindings' / 'c'}", "-x", "c", "-"]
    said(command, input=header + EVENTS_AROUND % body)


@pytest.mark.parametrize(
    "language, around, compiler", [("cpp", CPP_AROUND, "g++ -std=c++20"), ("c", C_AROUND, "gcc -std=c11")]
)
def test_the_lines_of_the_page_compile(root, language, around, compiler):
    shown = "".join(blocks(root / "docs" / "howto" / "controllers.md", language))
    where = [f"-I{root / folder}" for folder in ("include", "bindings/c", f"examples/outside/{language}")]
    command = [*compiler.split(), "-fsyntax-only", "-Wall", "-Werror", "-x", {"cpp": "c++", "c": "c"}[language]]
    said([*command, *where, "-"], input=around.format(shown))


def test_the_lines_for_python_run(root, tmp_path, monkeypatch):
    shown = "import needleforce.control\n" + "".join(blocks(root / "docs" / "howto" / "controllers.md", "python"))
    monkeypatch.chdir(tmp_path)
    shutil.copy(root / "src" / "needleforce" / "presets" / "paper.toml", "mine.toml")
    names = {"nf": nf, "depth": 1e-3, "velocity": 3e-3, "dt": 1e-3}
    exec(shown, names)
    # the cone that has 0.2101 N at 3.237 mm
    assert names["sample"].force == pytest.approx(0.2101 / 3.237**2, rel=1e-3)
    assert names["output"].force == names["sample"].force


SECONDS = [
    ("ok", 1.001e-3, 1e-3, 1e-3),
    ("outside_range", 1.5, None, 1e-3),
    ("outside_range", 1e-3, None, 0.0),
    ("outside_range", 1e-3, None, -1e-3),
    ("outside_range", 0.5, None, 1e-3),
    ("outside_range", 1.001e-3, 0.5, 1e-3),
    ("not_finite", float("nan"), None, 1e-3),
    ("not_finite", 1e-3, float("inf"), 1e-3),
]


@pytest.mark.parametrize("hold_time", [0.0, 0.1])
@pytest.mark.parametrize("status, depth, velocity, dt", SECONDS)
def test_a_status_is_what_the_page_says(status, depth, velocity, dt, hold_time):
    hand = nf.Insertion(nf.preset("paper"), hold_time=hold_time)
    before = hand.step(1e-3, 0.0, 1e-3).force
    sample = hand.step(depth, velocity, dt)
    assert sample.status == status
    if status != "ok":
        held = hold_time > 0.0 and dt > 0.0
        assert sample.force == (before if held else 0.0) and before > 0.0
    again = hand.step(1.001e-3, None, 1e-3)
    assert again.status == "ok" and again.force == pytest.approx(before * 1.001**2, rel=1e-9)
