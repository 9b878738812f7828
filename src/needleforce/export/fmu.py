# SPDX-License-Identifier: Apache-2.0
"""A model as an FMU of FMI 3.0 for co-simulation: its description, its sources, and what a compiler made of them."""

import hashlib
import io
import os
import platform
import re
import shutil
import subprocess
import tempfile
import zipfile
from functools import cache
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as xml

from ..core import Bevel
from ..errors import InputError
from ..models.laws import FAMILIES
from ..models.model import Model
from ..vocabulary import __version__
from .headers import header, identifier

_HERE = Path(__file__).parent
_PLACES = (_HERE / "c_library", Path(__file__).parents[3])  # in a wheel, and in a checkout
_INCLUDE = re.compile(r'^#include "([^"]+)"', re.MULTILINE)
_FLAGS = (
    "-std=c++20",
    "-O2",
    "-fPIC",
    "-fvisibility=hidden",
    "-fno-exceptions",
    "-fno-rtti",
    "-ffp-contract=off",
    "-w",
)
FIRST_PARAMETER = 100
# value reference, name, unit, meaning; as in fmu.c
_OUTPUTS = (
    (20, "force", "N", "+ when it opposes the insertion"),
    (21, "stiffness", "N", "part of the contact"),
    (22, "friction", "N", "part of the shaft"),
    (23, "cutting", "N", "part of the cut"),
    (24, "lateral", "N", "of a bevel"),
    (25, "force_by_depth", "N/m", "derivative along the last step"),
    (26, "force_by_velocity", "N.s/m", "derivative along the last step"),
)
_WORDS = ((40, "phase", "0 free, 1 deformation, 2 insertion, 3 hold, 4 extraction"),)
_WORDS += ((41, "status", "0 ok, 1 outside range, 2 invalid parameter, 3 not finite"),)
_EVENTS = ((42, "contact"), (43, "punctured"), (44, "exit"))
_SETTINGS = (
    (4, "max_speed", 1.0, "m/s"),
    (5, "hold_time", 0.0, "s"),
    (6, "depth_noise", 0.0, "m"),
    *((7 + place, f"bevel_{row['name']}", row["default"], row["unit"]) for place, row in enumerate(Bevel.table())),
)
_UNITS = {
    "m": {"m": "1"}, "s": {"s": "1"}, "m/s": {"m": "1", "s": "-1"}, "N": {"kg": "1", "m": "1", "s": "-2"},
    "N/m": {"kg": "1", "s": "-2"}, "N.s/m": {"kg": "1", "s": "-1"},
}  # fmt: skip


def fmu(model: Model, name: str | None = None, sources: tuple[str, ...] = (), compiler: str | None = None) -> bytes:
    """The file of an FMU: co-simulation, with the C library inside, for the processor and system it is made on.

    Parameters
    ----------
    model : Model
        The model; its parameters can be set in the FMU before the initialization ends.
    name : str, optional
        Of the model in the FMU; default: from the model's name.
    sources : tuple of str
        Lines on where the model comes from.
    compiler : str, optional
        A C++20 compiler; default: ``$CXX``, otherwise ``c++``, ``g++`` or ``clang++``.

    Returns
    -------
    bytes
        A zip of ``modelDescription.xml``, ``sources/`` and one binary.

    Raises
    ------
    InputError
        If there is no compiler, or it refuses the sources.
    """
    name = identifier(model.name) if name is None else name
    text = header(model, "c", name, sources)
    token = hashlib.sha256((__version__ + text).encode()).hexdigest()[:32]
    files = {"model.h": _with_names(text, name, token)} | _library()
    binary = _compiled(files, _compiler(compiler))
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as archive:
        _put(archive, "modelDescription.xml", _description(model, name, token))
        _put(archive, "sources/buildDescription.xml", _build(name))
        for path, content in sorted(files.items()):
            _put(archive, f"sources/{path}", content.encode())
        _put(archive, f"binaries/{_system()}/{name}.so", binary)
    return made.getvalue()


def _put(archive: zipfile.ZipFile, path: str, content: bytes) -> None:
    """The same model gives the same file: no date of today."""
    archive.writestr(zipfile.ZipInfo(path, (2020, 1, 1, 0, 0, 0)), content, zipfile.ZIP_DEFLATED)


def _with_names(text: str, name: str, token: str) -> str:
    """The exported header with what fmu.c is written in."""
    defined = f'#define MODEL_LAYERS {name}_layers\n#define MODEL_LAYER_VALUES {name}\n#define MODEL_TOKEN "{token}"\n'
    return text.rstrip().removesuffix("#endif") + defined + "#endif\n"


def _library() -> dict[str, str]:
    """The C library's sources that the insertion needs, by their path in the FMU."""
    root = next((place for place in _PLACES if (place / "bindings" / "c" / "needleforce.cpp").is_file()), None)
    if root is None:
        raise InputError("sources of the C library", str(_PLACES[0]), "missing", next_step="Install needleforce again.")
    found: dict[str, str] = {"fmu.c": (_HERE / "fmu.c").read_text(encoding="utf-8")}
    waiting = [root / "bindings" / "c" / "needleforce.cpp"]
    while waiting:
        path = waiting.pop()
        place = _place(path, root)
        if place in found:
            continue
        found[place] = path.read_text(encoding="utf-8")
        for other in _INCLUDE.findall(found[place]):
            near = (path.parent / other).resolve()
            waiting.append(near if near.is_file() else root / "include" / other)
    return found


def _place(path: Path, root: Path) -> str:
    """So that the folder ``sources`` is the only one that a compiler has to be given."""
    in_c = path.parent == root / "bindings" / "c"
    return path.name if in_c else path.resolve().relative_to((root / "include").resolve()).as_posix()


def _compiler(given: str | None) -> str:
    names = [given or os.environ.get("CXX"), "c++", "g++", "clang++"]
    found = next((name for name in names if name and shutil.which(name)), None)
    if (given and found != given) or found is None:
        raise InputError(
            "C++ compiler", given or "none", "not found",
            next_step="Install g++ 12 or clang 19 (Debian: apt install g++), or let the variable CXX name one.",
        )  # fmt: skip
    return found


def _compiled(files: dict[str, str], compiler: str) -> bytes:
    """The shared library; what no model changes is compiled once for all that are exported together."""
    with tempfile.TemporaryDirectory() as folder:
        _write(files, folder)
        Path(folder, "needleforce.o").write_bytes(_library_object(compiler))
        _run(
            [compiler, *_FLAGS, "-shared", "-Wl,--as-needed", "-x", "c++", "fmu.c", "-x", "none", "needleforce.o"],
            folder,
        )
        return Path(folder, "made").read_bytes()


@cache
def _library_object(compiler: str) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        _write(_library(), folder)
        _run([compiler, *_FLAGS, "-c", "-I.", "needleforce.cpp"], folder)
        return Path(folder, "made").read_bytes()


def _write(files: dict[str, str], folder: str) -> None:
    for path, content in files.items():
        target = Path(folder, path)
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(content, encoding="utf-8")


def _run(command: list[str], folder: str) -> None:
    done = subprocess.run([*command, "-o", "made"], cwd=folder, capture_output=True, text=True)
    if done.returncode:
        first = next((line for line in done.stderr.splitlines() if "error" in line), done.stderr[:200])
        step = "It has to compile C++20: g++ 12 or clang 19; let the variable CXX name it."
        raise InputError("C++ compiler", command[0], f"refused the sources: {first.strip()}", next_step=step)


def _system() -> str:
    """The name of FMI 3.0 for a processor and a system."""
    machine = {"AMD64": "x86_64", "arm64": "aarch64"}.get(platform.machine(), platform.machine())
    if platform.system() != "Linux":
        raise InputError(
            "system", platform.system(), "not Linux, the one for which an FMU is compiled here",
            next_step="Export on Linux; the sources in the FMU are those for a compiler elsewhere.",
        )  # fmt: skip
    return f"{machine}-linux"


def parameters_of(model: Model) -> list[tuple[str, float, str, str]]:
    """Name, value, unit and meaning of each parameter of an FMU, in the order of its value references."""
    found = []
    for number, layer in enumerate(model.layers, 1):
        found.append((f"layer{number}.top", float(layer.top), "m", "where the layer begins"))
        for family in FAMILIES:
            law = getattr(layer, family)
            values = law.parameters()
            found += [
                (f"layer{number}.{family}.{row['name']}", values[row["name"]], row["unit"], row["meaning"])
                for row in law.table()
            ]
    return found


def _description(model: Model, name: str, token: str) -> bytes:
    root = xml.Element("fmiModelDescription", {
        "fmiVersion": "3.0", "modelName": name, "instantiationToken": token,
        "generationTool": f"needleforce {__version__}", "description": model.summary or model.name,
        "variableNamingConvention": "structured",
    })  # fmt: skip
    xml.SubElement(root, "CoSimulation", {
        "modelIdentifier": name, "canHandleVariableCommunicationStepSize": "true", "canGetAndSetFMUState": "true",
        "canSerializeFMUState": "true", "providesDirectionalDerivatives": "true", "providesAdjointDerivatives": "true",
    })  # fmt: skip
    units = xml.SubElement(root, "UnitDefinitions")
    for unit, bases in _UNITS.items():
        xml.SubElement(xml.SubElement(units, "Unit", {"name": unit}), "BaseUnit", bases)
    xml.SubElement(xml.SubElement(root, "LogCategories"), "Category", {"name": "logStatusError"})
    xml.SubElement(root, "DefaultExperiment", {"startTime": "0", "stopTime": "1", "stepSize": "0.001"})
    _variables(xml.SubElement(root, "ModelVariables"), model)
    structure = xml.SubElement(root, "ModelStructure")
    known = {"dependencies": "1 2"}
    for reference, *_ in (*_OUTPUTS, *_WORDS, *_EVENTS):
        xml.SubElement(structure, "Output", {"valueReference": str(reference), **known})
    for reference, *_ in (*_OUTPUTS, *_WORDS, *_EVENTS):
        xml.SubElement(structure, "InitialUnknown", {"valueReference": str(reference), "dependencies": ""})
    xml.indent(root)
    return xml.tostring(root, encoding="utf-8", xml_declaration=True)


def _variables(parent: xml.Element, model: Model) -> None:
    def variable(kind: str, reference: int, name: str, **more: Any) -> None:
        given = {key: str(value) for key, value in more.items()}
        xml.SubElement(parent, kind, {"name": name, "valueReference": str(reference), **given})

    def parameter(reference: int, name: str, start: float, unit: str, meaning: str) -> None:
        units = {"unit": unit} if unit in _UNITS else {}
        text = meaning if unit in _UNITS else f"{unit}, {meaning}"
        shown = {"description": text, "causality": "parameter", "variability": "fixed", "initial": "exact"}
        variable("Float64", reference, name, **shown, **units, start=repr(start))

    variable("Float64", 0, "time", causality="independent", variability="continuous", unit="s")
    depth = "of the tip at the end of the next step, + inwards from the undeformed surface"
    inputs = {"causality": "input", "variability": "continuous", "start": "0.0"}
    variable("Float64", 1, "depth", description=depth, unit="m", **inputs)
    variable("Float64", 2, "velocity", description="taken if measured_velocity is true", unit="m/s", **inputs)
    measured = "false: the velocity is the change of depth"
    variable("Boolean", 3, "measured_velocity", description=measured, causality="parameter", variability="fixed",
             initial="exact", start="false")  # fmt: skip
    for reference, name, value, unit in _SETTINGS:
        parameter(reference, name, value, unit, "as of nf.Insertion")
    output = {"causality": "output", "initial": "calculated"}
    for reference, name, unit, meaning in _OUTPUTS:
        variable("Float64", reference, name, description=meaning, unit=unit, variability="continuous", **output)
    for reference, name, meaning in _WORDS:
        variable("Int32", reference, name, description=meaning, variability="discrete", **output)
    for reference, name in _EVENTS:
        text = "true in the one step that touches, breaks through or leaves"
        variable("Boolean", reference, name, description=text, variability="discrete", **output)
    for number, (name, value, unit, meaning) in enumerate(parameters_of(model)):
        parameter(FIRST_PARAMETER + number, name, value, unit, meaning)


def _build(name: str) -> bytes:
    root = xml.Element("fmiBuildDescription", {"fmiVersion": "3.0"})
    made = xml.SubElement(root, "BuildConfiguration", {"modelIdentifier": name})
    files = xml.SubElement(made, "SourceFileSet", {"language": "C++20", "compilerOptions": "-x c++"})
    for source in ("needleforce.cpp", "fmu.c"):
        xml.SubElement(files, "SourceFile", {"name": source})
    xml.SubElement(files, "IncludeDirectory", {"name": "."})
    xml.indent(root)
    return xml.tostring(root, encoding="utf-8", xml_declaration=True)
