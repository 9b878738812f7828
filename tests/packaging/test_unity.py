# SPDX-License-Identifier: Apache-2.0
"""The C library from C#, by Mono: a program outside the tree, Unity's component over a stub of Unity, limits, errors.
The conformance set is in tests/mechanics/test_conformance.py."""

import os
import re
import shutil
import subprocess

import pytest
from building import said
from test_installed_package import SAID
from traced_models import models

import needleforce as nf
from needleforce.export import header, model_source

pytestmark = pytest.mark.skipif(not shutil.which("mcs"), reason="no Mono: sudo tools/system_packages.sh hosts")

# reached, the library: the file next to the program, as C
WRONG = {
    "was not found, or is for another processor": None,
    "has ABI 3, and Needleforce.cs is for ABI 2": "int nf_abi_version(void) { return 3; }",
    "has no number of its ABI": "int nf_version(void) { return 0; }",
}


@pytest.fixture(scope="module")
def program(root, tmp_path_factory):
    """Compiles C# next to Needleforce.cs; the program."""

    def of(name: str, *sources):
        path = tmp_path_factory.mktemp(name) / f"{name}.exe"
        host = root / "integrations" / "unity" / "Needleforce.cs"
        said(["mcs", "-warnaserror", "-nowarn:649", f"-out:{path}", host, *sources])
        return path

    return of


@pytest.fixture(scope="module")
def where(shared_library):
    return os.environ | {"LD_LIBRARY_PATH": str(shared_library.parent)}


@pytest.fixture(scope="module")
def lines(root, program, where):
    stub = sorted((root / "tests" / "packaging" / "unity").glob("*.cs"))
    component = root / "integrations" / "unity" / "NeedleInTissue.cs"
    checks = program("checks", component, *stub, root / "examples" / "outside" / "dotnet" / "Gel.cs")
    return said(["mono", checks], env=where).splitlines()


def test_a_program_of_dotnet_has_the_force_of_that_in_c(root, program, where):
    folder = root / "examples" / "outside" / "dotnet"
    assert said(["mono", program("controller", folder / "Program.cs", folder / "Gel.cs")], env=where) == SAID
    # after a change: needleforce export paper --name gel --language c# -o examples/outside/dotnet/Gel.cs
    assert (folder / "Gel.cs").read_text() == header(model_source("paper").model, "c#", "gel")


def test_a_step_is_guarded_and_allocates_nothing(lines):
    # 18.6 N/m * 8 mm + 0.0776 N, more than the limit; after 5 ms held and 20 ms falling nothing
    assert lines[:2] == ["guarded 0.15 Clamped of 0.2264", "missed 0 Stale"]
    # a needle that is not bent carries the same along itself, and nothing across
    assert lines[3:6] == ["base 0.15 0 Clamped of 0.2264", "base missed 0 Stale", "base reset 0 Rejected"]
    assert "nan 0 NotFinite" in lines and "collections 0" in lines
    assert lines[2].startswith("ObjectDisposedException: ")


def test_the_component_pushes_its_body_back(lines):
    assert lines[-1] == "component 0.2264 -0.2264 Ok, Nothing"


def test_what_is_refused_is_named(lines):
    refused = [line.split(": ", 1)[1] for line in lines if line.startswith("NeedleforceException: ")]
    expected = [
        "layer 1, guard max_torque (1) is no parameter of it",
        "layer 2, coulomb per_length (-1) is outside its range: 0 to 100000",
        "layer 1, conus stiffness (0) is of no known name",
        "layer 1, layers count (0) is outside its range: 1 to 8",
        "layer 1, layers count (9) is outside its range: 1 to 8",
        "coulomb has 13 parameters, at most 12 have room: give each once",
        "layer 1, guard max_forse (1) is no parameter of it",
    ]
    assert [text[: len(begin)] for text, begin in zip(refused, expected, strict=True)] == expected


@pytest.mark.parametrize("reached", WRONG)
def test_another_library_or_none_is_refused_with_what_to_do(root, program, reached):
    folder = root / "examples" / "outside" / "dotnet"
    path = program("wrong", folder / "Program.cs", folder / "Gel.cs")
    if source := WRONG[reached]:
        library = path.with_name("libneedleforce.so")
        said(["gcc", "-shared", "-fPIC", "-x", "c", "-", "-o", library], input=source)
    done = subprocess.run(["mono", path], capture_output=True, text=True)
    assert done.returncode != 0
    assert reached in done.stderr and re.search("take both from the same version|Assets/Plugins", done.stderr)


EVERY = """
static class Every {
  static void Run(string name, Needleforce.Layer[] layers) {
    Needleforce.Insertion insertion = new Needleforce.Insertion(layers);
    Needleforce.Sample sample = default(Needleforce.Sample);
    for (int i = 0; i <= 500; ++i) sample = insertion.Step(2e-5 * i, Needleforce.No.Velocity, 1e-2);
    var plain = System.Globalization.CultureInfo.InvariantCulture;
    System.Console.WriteLine(name + " " + sample.Force.ToString("R", plain));
  }
"""


def test_every_exported_preset_and_tip_has_its_force(program, where, tmp_path):
    every = models()
    for name, model in every.items():
        (tmp_path / f"{name}.cs").write_text(header(model, "c#", name), encoding="utf-8")
    runs = "".join(f'Run("{name}", {name}.Layers); ' for name in every)
    (tmp_path / "main.cs").write_text(f"{EVERY}  static void Main() {{ {runs}}}\n}}\n", encoding="utf-8")
    rows = said(["mono", program("models", *tmp_path.glob("*.cs"))], env=where).splitlines()
    found = {name: float(force) for name, force in map(str.split, rows)}
    assert found.keys() == every.keys()
    for name, model in every.items():
        insertion = nf.Insertion(model)
        force = [insertion.step(2e-5 * i, None, 1e-2).force for i in range(501)][-1]
        assert found[name] == pytest.approx(force, rel=1e-9), name
