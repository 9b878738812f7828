# SPDX-License-Identifier: Apache-2.0
"""The same insertions in C++, C, Python, WebAssembly in Node and in a browser, C# and Octave give the same values.
Other tests check that these values are right."""

import re
import shutil
import subprocess
import sys

import numpy as np
import pytest
from browser import CHROMIUM, WITHOUT
from case_rows import CASES, NUMBERS, rigid, steps, units

from needleforce import core
from needleforce.models.laws import FAMILIES, laws_of

# relative to the largest value of each column: every language has its own mathematics library. The sweeps of a solid
# end when no node moves by more than 1e-9 m: after as many in every language, as changes differ by last bits alone
TOLERANCE = 1e-12
FACES = ("c++", "c", "python", "wasm", "browser", "mono", "octave")
# of a needle that bends: tip, tangent, wrench, force, lateral, unsupported length; columns of one unit
BENT, POINT = 15, 3
# of a node of a solid: force, displacement
NODE = 2
# relative to the largest of a unit: a linear foundation is solved once; others are iterated until no node moves by more
# than 1e-9 m, with matrices whose rounding moves a tip by 1e-11 m, so that the wrench at the base differs most
LINEAR, ITERATED = 1e-11, 1e-6
BENT_UNITS = ([0, 1, 2], [3, 4, 5], [6, 7, 8, 12, 13], [9, 10, 11], [14])


def compiled(root, folder, compiler: list, source: str, *more):
    binary = folder / source.replace(".", "_")
    path = root / "tests" / "conformance" / source
    subprocess.run([*compiler, "-O1", f"-I{root / 'include'}", path, *more, "-o", binary], check=True)
    return [binary]


def c_trace(root, folder, library):
    """A C program: the library needs no C++ library."""
    where = [library, f"-Wl,-rpath={library.parent}"]
    return compiled(root, folder, ["gcc", "-std=c11", "-Wall", "-Werror"], "trace.c", *where)


def mono_trace(root, folder, library):
    """Needleforce.cs, with the library next to the program."""
    if not shutil.which("mcs"):
        pytest.skip("no Mono: sudo tools/system_packages.sh hosts")
    sources = [root / "integrations" / "unity" / "Needleforce.cs", root / "tests" / "conformance" / "trace.cs"]
    shutil.copy(library, folder)
    subprocess.run(["mcs", "-warnaserror", f"-out:{folder / 'trace.exe'}", *sources], check=True)
    return ["mono", folder / "trace.exe"]


def octave_trace(root, folder, library):
    """A copy of the functions, for a gateway that someone compiled next to them would be taken first."""
    if not shutil.which("mkoctfile"):
        pytest.skip("no Octave: sudo tools/system_packages.sh hosts")
    host = folder / "octave"
    shutil.copytree(root / "integrations" / "octave", host, ignore=shutil.ignore_patterns("*.mex*"))
    where = [f"-I{root / 'bindings' / 'c'}", f"-L{library.parent}", "-lneedleforce", f"-Wl,-rpath={library.parent}"]
    subprocess.run(["mkoctfile", "--mex", "nf_insertion_mex.c", *where], check=True, cwd=host)
    options = ["--quiet", "--norc", "--no-history", "--path", host]
    return ["octave-cli", *options, root / "tests" / "conformance" / "trace.m"]


def in_browser(source, wasm) -> list:
    if CHROMIUM is None:
        pytest.skip(WITHOUT)
    return [sys.executable, source / "in_browser.py", "trace.mjs", wasm]


@pytest.fixture(scope="module")
def trace(root, tmp_path_factory, request):
    """The output of a face for every case, each run once: lines of words by case."""
    folder, outputs = tmp_path_factory.mktemp("traces"), {}
    source = root / "tests" / "conformance"

    def library():
        return request.getfixturevalue("shared_library")

    command = {
        "c++": lambda: compiled(root, folder, ["g++", "-std=c++20", "-Wall", "-Werror"], "trace.cpp"),
        "c": lambda: c_trace(root, folder, library()),
        "python": lambda: [sys.executable, source / "trace.py"],
        "wasm": lambda: ["node", source / "trace.mjs", request.getfixturevalue("wasm") / "needleforce.mjs"],
        "browser": lambda: in_browser(source, request.getfixturevalue("wasm")),
        "mono": lambda: mono_trace(root, folder, library()),
        "octave": lambda: octave_trace(root, folder, library()),
    }

    def of(face: str) -> dict:
        if face not in outputs:
            given = rigid() if face == "octave" else CASES  # nf_insertion has no solid and no needle that bends
            run = [*command[face](), *given]
            first, again = (subprocess.run(run, capture_output=True, text=True, check=True).stdout for _ in range(2))
            assert first == again, f"{face} gives other bits the second time"
            parts = [part.splitlines() for part in first.split("case ")[1:]]
            outputs[face] = {re.search(r"(\w+)\.txt", path).group(1): lines for path, *lines in parts}
            assert outputs[face].keys() == {case.stem for case in given}
        return outputs[face]

    return of


def rows_of(lines: list[str], kind: str, count: int) -> tuple[np.ndarray, list]:
    """Numbers (n, count) of the rows of a kind, and their words."""
    rows = [line.split()[1:] for line in lines if line.startswith(f"{kind} ")]
    numbers = np.array([row[:count] for row in rows], float).reshape(-1, count)
    return numbers, [row[count:] for row in rows]


def bent_units(numbers: np.ndarray) -> np.ndarray:
    """Scale of each column: the largest value of those with its unit."""
    unit = np.abs(numbers).max(axis=0, initial=0.0)
    for columns in BENT_UNITS:
        unit[columns] = unit[columns].max()
    return unit


@pytest.mark.parametrize("face", FACES[1:])
def test_every_face_gives_the_same_insertion(trace, face):
    ours, theirs = trace("c++"), trace(face)
    for case, lines in theirs.items():
        numbers, words = steps(ours[case])
        others, other_words = steps(lines)
        assert words == other_words, f"{face}, {case}: phases, status or events differ"
        error = np.abs(others - numbers)
        assert np.all(error <= TOLERANCE * units(numbers)), f"{face}, {case}: {error.max(axis=0)}"


@pytest.mark.parametrize("face", FACES[1:-1])
def test_every_face_bends_the_needle_in_the_same_way(root, trace, face):
    for case, lines in trace("c++").items():
        text = (root / "tests" / "conformance" / "cases" / f"{case}.txt").read_text(encoding="utf-8")
        tolerance = ITERATED if re.search(r"^lateral .*(form|yielding_modulus)", text, re.M) else LINEAR
        numbers, words = rows_of(lines, "bent", BENT)
        others, other_words = rows_of(trace(face)[case], "bent", BENT)
        assert words == other_words, f"{face}, {case}: status or buckling differ"
        error = np.abs(others - numbers)
        assert np.all(error <= tolerance * bent_units(numbers)), f"{face}, {case}: {error.max(axis=0)}"
        points, other_points = (rows_of(each, "point", POINT)[0] for each in (lines, trace(face)[case]))
        assert points.shape == other_points.shape, f"{face}, {case}: shapes have other numbers of points"
        error = np.abs(other_points - points)
        assert np.all(error <= tolerance * np.abs(points).max(initial=0.0)), f"{face}, {case}: {error.max(axis=0)}"


@pytest.mark.parametrize("face", FACES[1:-1])
def test_every_face_drags_the_solid_in_the_same_way(trace, face):
    cases = {case: lines for case, lines in trace("c++").items() if case.startswith("solid_")}
    assert len(cases) == 6
    for case, lines in cases.items():
        for kind, count in (("tip", 1), ("node", NODE)):
            numbers, others = (rows_of(each, kind, count)[0] for each in (lines, trace(face)[case]))
            assert numbers.shape == others.shape and len(numbers), f"{face}, {case}: other numbers of rows"
            error, unit = np.abs(others - numbers), np.abs(numbers).max(axis=0)
            assert np.all(error <= TOLERANCE * unit), f"{face}, {case}, {kind}: {error.max(axis=0)}"


SHAFT = """[{ stiffness: { name: "polynomial", linear: 100, quadratic: 0 },
  puncture: { name: "puncture_force", force: 0.2 }, friction: { name: "coulomb", per_length: 20 },
  cutting: { name: "constant_cutting", force: 0.1 } }]"""
LENGTHS = "lateral: [{ modulus: 2e4 }], sections: [{ stiffness: 0.02 }], needle_length: 0.3"


@pytest.mark.parametrize(
    ("spacing", "compliance", "message"),
    [
        ("1e-3", "[[1, 0], [0]]", "compliance[1] (1 numbers) is not as long as there are rows, 2"),
        ("1e-3", "[[1, '0'], [0, 1]]", "compliance[0][1] (0) is not a number"),
        ("1e-3", "7", "compliance (7) is no array of rows"),
        ("1e-3", "Array(66).fill([])", "compliance (66 rows) has too many"),
        ("1e-3", "[[1]]", "solid nodes (1 nodes, 0.001 m apart) is outside its range"),
        ("1e-3", "[[1, 0.5], [0, 1]]", "(2 nodes, 0.001 m apart) the compliance is not symmetric"),
        ("1", "[[1, 0], [0, 1]]", "(2 nodes, 1 m apart) the spacing is not 1e-6 to 0.1 m"),
        ("'1'", "[[1, 0], [0, 1]]", "spacing (1) is not a number"),
    ],
)
def test_webassembly_names_what_is_wrong_with_a_solid(wasm, spacing, compliance, message):
    tissue = f"{{ spacing: {spacing}, compliance: {compliance} }}"
    for made in (
        f"CondensedInsertion({tissue}, {SHAFT})",
        f"FlexibleInsertion({SHAFT}, {{ {LENGTHS}, tissue: {tissue} }})",
    ):
        program = f"""import {{ load }} from "{(wasm / "needleforce.mjs").as_uri()}";
          const {{ CondensedInsertion, FlexibleInsertion }} = await load();
          try {{ new {made}; }} catch (error) {{ console.log(error.name, error.message); }}"""
        run = ["node", "--input-type=module", "-e", program]
        output = subprocess.run(run, capture_output=True, text=True, check=True).stdout
        assert output.startswith("RangeError ") and message in output


def test_the_cases_include_every_law_and_tip(root):
    text = "\n".join(path.read_text(encoding="utf-8") for path in root.glob("tests/conformance/cases/*.txt"))
    for family in FAMILIES:
        for law in laws_of(family):
            assert re.search(rf"^{family} {law.name}\b", text, re.M), law.name
    for tip in (tip for tip in vars(core.tips).values() if isinstance(tip, type)):
        assert re.search(rf"^tip {tip.name}\b", text, re.M), tip.name


def test_the_cases_include_every_parameter_and_form_of_a_needle_that_bends(root):
    text = "\n".join(path.read_text(encoding="utf-8") for path in root.glob("tests/conformance/cases/bend_*.txt"))
    lateral = "\n".join(re.findall(r"^lateral .*", text, re.M))
    names = {table: [row["name"] for row in table.table()] for table in (core.LateralLayer, core.Support, core.Bending)}
    for name in names[core.LateralLayer]:
        assert name == "top" or re.search(rf" {name} ", lateral), name
    for name in (*names[core.Support], *names[core.Bending], "elements"):
        assert re.search(rf"^bending {name} ", text, re.M), name
    assert set(re.findall(r"form (\w+)", lateral)) == {"cubic", "hyperbolic", "tanh"}


def test_the_cases_bend_buckle_and_refuse(trace):
    words = {tuple(row) for lines in trace("c++").values() for row in rows_of(lines, "bent", BENT)[1]}
    assert {("ok", "0"), ("outside_range", "0"), ("outside_range", "1"), ("not_finite", "0")} == words


def test_the_cases_include_every_phase_status_event_and_refusal(trace):
    rows = [line.split() for lines in trace("c++").values() for line in lines]
    steps_taken = [row for row in rows if len(row) > NUMBERS and row[0] != "bent"]
    assert {row[9] for row in steps_taken} == set(core.phase_names())
    assert {row[10] for row in steps_taken} == set(core.status_names()) - {
        "invalid_parameter"
    }  # such models are refused before
    assert all(any(row[column] == "1" for row in steps_taken) for column in (11, 12, 13))
    assert ["taken"] in rows and ["refused"] in rows
    finite = np.isfinite(np.array([row[:NUMBERS] for row in steps_taken], float))
    assert finite.all()


@pytest.mark.parametrize("face", FACES)
def test_invalid_cases_are_refused(trace, face):
    refused = {case for case, lines in trace(face).items() if lines == ["refused"]}
    assert refused == {case for case in trace(face) if case.startswith("refused_")}
