# SPDX-License-Identifier: Apache-2.0
"""The places of docs/maintainers/adding_a_law.md: which laws are missing from which, for the tree and its copies."""

import json
import re
from contextlib import contextmanager
from pathlib import Path

from needleforce import references

ALL = "include/needleforce/laws/all.hpp"
BIBLIOGRAPHY = "src/needleforce/bibliography.toml"
GLOSSARY = "tests/house/test_vocabulary.py"
CASES = "tests/conformance/cases"
RULES = ("tests/reference_law_rules.py", "tests/reference_bench_rules.py", "tests/reference_rules.py")
HERE = "tests/house/law_places.py"

# laws without a closed form to compare with, or compared with one elsewhere
WITHOUT_REFERENCE = {
    "cone_cylinder": "tests/mechanics/test_contact.py has its vectors, by nf.contact",
    "tip_contact": "quadrature by SciPy in tests/mechanics/test_tips.py",
    "power_law": "its formula is the definition; the cone is its exponent 2, tests/cpp/laws_stiffness.cpp",
    "puncture_force": "the inverse of the stiffness, tests/cpp/laws_puncture.cpp",
    "puncture_energy": "the energy of the stiffness, tests/cpp/laws_puncture.cpp",
    "relaxing_surface": "its static balance in tests/cpp/friction.cpp",
    "cubic_foundation": "quadrature of the pressure along the shaft, tests/cpp/nonlinear_foundation.cpp",
    "hyperbolic_foundation": "quadrature of the pressure along the shaft, tests/cpp/nonlinear_foundation.cpp",
    "tanh_foundation": "quadrature of the pressure along the shaft, tests/cpp/nonlinear_foundation.cpp",
    "yielding_coulomb": "its formula is the definition: tests/mechanics/test_rupture.py",
    "dragged_tissue": "an independent transcription in tests/cpp/layered_law.cpp",
    "dragged_tissue_as_fitted": "an independent transcription in tests/cpp/layered_law.cpp",
    "no_cutting": "zero by definition",
    "no_relaxation": "one by definition",
    "prony": "ramp and hold in tests/cpp/laws_relaxation.cpp",
    "prony_locked": "ramp and hold in tests/cpp/laws_relaxation.cpp",
    "prony_at_rest": "ramp and hold in tests/cpp/laws_relaxation.cpp",
}


def unnamed_parts(source: str) -> list[str]:
    """The parts of a source string that name no work and do not begin with ``free`` or ``by definition``."""
    parts = [part.strip() for part in source.split(";")]
    return [part for part in parts if not part.startswith(("free", "by definition")) and not references.keys_in(part)]


def unlisted_headers(root: Path) -> list[str]:
    """Headers of laws that the list does not include."""
    text = (root / ALL).read_text(encoding="utf-8")
    headers = sorted(path.name for path in (root / ALL).parent.glob("*.hpp") if path.name != "all.hpp")
    return [f"{ALL}: {name} is not included" for name in headers if f'#include "{name}"' not in text]


@contextmanager
def bibliography(path: Path):
    """The bibliography of another tree."""
    own = references.BIBLIOGRAPHY
    references.BIBLIOGRAPHY = path
    references.works.cache_clear()
    try:
        yield
    finally:
        references.BIBLIOGRAPHY = own
        references.works.cache_clear()


def missing_places(root: Path, law: dict) -> list[str]:
    """The places without a law of ``name``, ``family``, ``sources`` and ``parameters``: a message each."""

    def text(*names: str) -> str:
        return "\n".join((root / name).read_text(encoding="utf-8") for name in names)

    name = law["name"]
    with bibliography(root / BIBLIOGRAPHY):
        unnamed = [part for source in law["sources"] for part in unnamed_parts(source)]
    glossary = text(GLOSSARY).partition("GLOSSARY = {")[2].partition("}")[0]
    unknown = [word for word in law["parameters"] if f'"{word}"' not in glossary]
    cases = "\n".join(path.read_text(encoding="utf-8") for path in sorted((root / CASES).glob("*.txt")))
    found = [f"{BIBLIOGRAPHY}: {name} names {part!r}, which is no work there" for part in dict.fromkeys(unnamed)]
    found += [f"{GLOSSARY}: parameter {word!r} of {name} is not in GLOSSARY" for word in unknown]
    if not re.search(rf"^{law['family']} {name}\b", cases, re.M):
        found.append(f"{CASES}: no case has the {law['family']} law {name}")
    python_name = "".join(word.capitalize() for word in name.split("_"))
    referenced = re.search(rf"\blaws\.{python_name}\b", text(*RULES))
    if not referenced and name not in WITHOUT_REFERENCE:
        found.append(f"{RULES[0]}: no rule uses {python_name}; without a closed form, WITHOUT_REFERENCE in {HERE}")
    return found


def described(lines: str) -> list[dict]:
    """The laws as a C++ program prints them, a JSON object a line."""
    return [json.loads(line) for line in lines.splitlines()]
