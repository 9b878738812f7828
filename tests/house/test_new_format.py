# SPDX-License-Identifier: Apache-2.0
"""A new format is one file, filled in from the template, and one row: added in a copy of the package, it reads a file.
Declarations that are not complete, or there twice, are refused with their place."""

import importlib.metadata
import json
import shutil
import struct
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from needleforce.errors import InputError, install_step
from needleforce.recording.formats import Format
from needleforce.recording.formats.detect import check_declaration, declared

# a place of the template -> what a new format has there; its files have a mark, the number of columns, and for each its
# header, unit, number of values, and values
COLUMNS = """    file.seek(8)
    found = {}
    for _ in range(int.from_bytes(file.read(4), "little")):
        name, unit, count = _COLUMN.unpack(file.read(_COLUMN.size))
        values = np.frombuffer(file.read(8 * count), "<f8", count)
        found[name.strip(b"\\0").decode()] = values, unit.strip(b"\\0").decode()
    return found
"""
FILLED = {
    "\nfrom pathlib import Path": "\nimport struct\nfrom pathlib import Path",
    '_FORMAT = ""': '_COLUMN = struct.Struct("<16s4sI")\n_FORMAT = "a needle log"',
    "    return {}": COLUMNS,
}
ROW = """    Format(
        module=".needle_log", name="a needle log", suffixes=(".needle",), starts=(b"NEEDLE 1",), limited=True
    ),
"""
# without the finder of an installed needleforce, in this process and in the one that reads
READ = """
import json, sys
alone = "import sys; sys.meta_path[:] = [each for each in sys.meta_path if 'editable' not in type(each).__module__]\\n"
exec(alone)
sys.path.insert(0, sys.argv[1])
import needleforce as nf
from needleforce.recording.formats import worker
from needleforce.recording.formats.detect import format_of
from pathlib import Path
worker._START = alone + worker._START
try:
    run = nf.read(sys.argv[2], baseline=False)
    found = [run.time.tolist(), run.depth.tolist(), run.force.tolist()]
except nf.InputError as error:
    found = str(error)
print(json.dumps([nf.__file__, format_of(Path(sys.argv[2])).name, found]))
"""
TIME, DEPTH, FORCE = [0.01 * k for k in range(50)], [0.2 * k for k in range(50)], [0.125 * k for k in range(50)]


def needle_log(columns: dict[str, tuple[list[float], str]]) -> bytes:
    parts = [
        struct.pack("<16s4sI", name.encode(), unit.encode(), len(values)) + struct.pack(f"<{len(values)}d", *values)
        for name, (values, unit) in columns.items()
    ]
    return b"NEEDLE 1" + struct.pack("<I", len(parts)) + b"".join(parts)


@pytest.fixture(scope="module")
def tree(root, tmp_path_factory) -> Path:
    """A copy of the package with a new format: one file, and one row."""
    made = tmp_path_factory.mktemp("new_format")
    shutil.copytree(root / "src" / "needleforce", made / "needleforce", ignore=shutil.ignore_patterns("__pycache__"))
    formats = made / "needleforce" / "recording" / "formats"
    text = (formats / "template.py").read_text(encoding="utf-8")
    for place, filling in FILLED.items():
        assert text.count(place) == 1, place
        text = text.replace(place, filling)
    (formats / "needle_log.py").write_text(text, encoding="utf-8")
    detect = (formats / "detect.py").read_text(encoding="utf-8")
    last = '    Format(name="MCAP"'
    assert detect.count(last) == 1
    (formats / "detect.py").write_text(detect.replace(last, f"{ROW}{last}"), encoding="utf-8")
    return made


def read(tree: Path, path: Path) -> list:
    done = subprocess.run([sys.executable, "-I", "-c", READ, tree, path], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    file, name, found = json.loads(done.stdout)
    assert Path(file).is_relative_to(tree) and name == "a needle log"
    return found


def test_a_file_of_a_new_format_is_read(tree, tmp_path):
    columns = {"time": (TIME, "s"), "depth": (DEPTH, "mm"), "force": (FORCE, "N")}
    (tmp_path / "run.needle").write_bytes(needle_log(columns))
    time, depth, force = read(tree, tmp_path / "run.needle")
    assert time == TIME and force == FORCE
    assert depth == pytest.approx([1e-3 * each for each in DEPTH], rel=1e-15)


def test_a_damaged_file_of_a_new_format_is_refused(tree, tmp_path):
    (tmp_path / "run.needle").write_bytes(needle_log({"time": (TIME, "s"), "force": (FORCE, "N")})[:-9])
    assert "run.needle: file is not readable as a needle log, ValueError: buffer is smaller" in read(
        tree, tmp_path / "run.needle"
    )


@pytest.mark.parametrize("form", [form for form in declared() if form.module], ids=lambda form: form.name)
def test_every_format_stands_on_the_page_of_formats(root, form):
    page = (root / "docs" / "reference" / "recordings.md").read_text(encoding="utf-8")
    assert [suffix for suffix in form.suffixes if f"`{suffix}`" not in page] == []


def test_a_text_is_read_without_the_modules_of_other_formats(tmp_path):
    """Which take a twentieth of the time of the first recording."""
    (tmp_path / "run.csv").write_text("time [s],depth [mm],force [N]\n" + "".join(f"{k},{k},{k}\n" for k in range(9)))
    code = (
        f"import sys, needleforce as nf; nf.read({str(tmp_path / 'run.csv')!r});"
        "print(*(name.removeprefix('needleforce.recording.formats') for name in sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert {form.module for form in declared() if form.module} & set(done.stdout.split()) == set()


COMPLETE = Format(module=".needle_log", name="a needle log", suffixes=(".needle",), starts=(b"NEEDLE 1",), limited=True)


def test_a_complete_declaration_is_accepted():
    check_declaration(COMPLETE, declared())


@pytest.mark.parametrize("form, others, message", [
    (replace(COMPLETE, name=""), (), "name of the format '' is missing"),
    (replace(COMPLETE, suffixes=()), (), "suffixes of the format 'a needle log' is missing"),
    (replace(COMPLETE, starts=()), (), "starts, member or matches of the format 'a needle log' is missing"),
    (replace(COMPLETE, module=""), (), "module of the format 'a needle log' is missing"),
    (replace(COMPLETE, extra="labs"), (), "package of the format 'a needle log' is missing"),
    (COMPLETE, (replace(COMPLETE, starts=(b"OTHER",)),), "name of the format 'a needle log' is 'a needle log', "),
    (COMPLETE, (replace(COMPLETE, name="another"),), "starts of the format 'a needle log' is .*'another' has it, too"),
    (replace(COMPLETE, starts=(b"NEED",)), (replace(COMPLETE, name="another"),), ".*'another' has it, too"),
    (replace(COMPLETE, member=b"a"), (replace(COMPLETE, name="b", starts=(), member=b"a"),), "member of the format"),
])  # fmt: skip
def test_an_incomplete_or_repeated_declaration_is_refused_with_its_place(form, others, message):
    with pytest.raises(InputError, match=f"^recording/formats/detect.py: {message}") as caught:
        check_declaration(form, others)
    assert caught.value.next_step


def test_what_installs_a_missing_package_names_the_python_that_runs(monkeypatch):
    """And an extra only where pip knows the needleforce that is installed; the extra is one of it."""
    metadata = importlib.metadata.metadata("needleforce")
    assert {form.extra for form in declared() if form.extra} <= set(metadata.get_all("Provides-Extra"))
    monkeypatch.setattr(sys, "executable", "/a b/python")
    assert install_step("h5py", "labs") == """Install it with '/a b/python' -m pip install "needleforce[labs]"."""
    assert install_step("python_calamine") == "Install it with '/a b/python' -m pip install python_calamine."

    def missing(name):
        raise importlib.metadata.PackageNotFoundError(name)

    monkeypatch.setattr(importlib.metadata, "version", missing)
    assert install_step("h5py", "labs") == "Install it with '/a b/python' -m pip install h5py."
