# SPDX-License-Identifier: Apache-2.0
"""docs/maintainers/adding_a_law.md: its places suffice for two new laws in a copy of the tree, one with a memory of its
own, and a law that is missing from one of them is refused with the name of the place. Needs g++ and GoogleTest."""

import shutil
import subprocess
from pathlib import Path

import law_places
import pytest
from law_places import ALL, BIBLIOGRAPHY, CASES, GLOSSARY, RULES, missing_places, unlisted_headers

from needleforce.models.laws import FAMILIES, laws_of

NEW = Path(__file__).parent / "new_law"
LAWS = {"elastic_grip": "ElasticGrip", "linear_spring": "LinearSpring"}
CONTRACTS = ("laws", "laws_friction", "laws_stiffness")


def inserted(path: Path, before: str, text: str) -> None:
    """Puts a text in front of another one, which the file has once."""
    whole = path.read_text(encoding="utf-8")
    assert whole.count(before) == 1, (path, before)
    path.write_text(whole.replace(before, text + before), encoding="utf-8")


def add_header(root: Path) -> None:
    for name in LAWS:
        shutil.copy(NEW / f"{name}.hpp", (root / ALL).parent)


def add_list(root: Path) -> None:
    for name in LAWS:
        inserted(root / ALL, '#include "exponential.hpp"\n', f'#include "{name}.hpp"\n')
    inserted(root / ALL, ">;\ntemplate <class Real>\nusing BasicCutting", ", laws::BasicElasticGrip<Real>")
    inserted(root / ALL, ">;\ntemplate <class Real>\nusing BasicPuncture", ", laws::BasicLinearSpring<Real>")


def add_bibliography(root: Path) -> None:
    work = '["Test law 2026"]\nreference = "Two laws of this test, 2026."\n\n'
    inserted(root / BIBLIOGRAPHY, '["Sneddon 1965"]\n', work)


def add_glossary(root: Path) -> None:
    inserted(root / GLOSSARY, '"presliding"', '"grip_travel", ')


def add_case(root: Path) -> None:
    shutil.copy(NEW / "case.txt", root / CASES / "new_laws.txt")


def add_reference(root: Path) -> None:
    rules = root / RULES[0]
    uses = "".join(f"nf.laws.{name}\n" for name in LAWS.values())
    rules.write_text(rules.read_text(encoding="utf-8") + uses, encoding="utf-8")


PLACES = {
    ALL: add_list,
    BIBLIOGRAPHY: add_bibliography,
    GLOSSARY: add_glossary,
    CASES: add_case,
    RULES[0]: add_reference,
}


def copied(root: Path, target: Path, without: str = "") -> Path:
    """The parts of the tree that the places are in, with both laws in each place but one."""
    for name in ("include", "tests/cpp", CASES, "tests/conformance/trace.cpp", BIBLIOGRAPHY, GLOSSARY, *RULES):
        path = target / name
        path.parent.mkdir(parents=True, exist_ok=True)
        (shutil.copytree if (root / name).is_dir() else shutil.copy)(root / name, path)
    add_header(target)
    for place, add in PLACES.items():
        if place != without:
            add(target)
    return target


def compiled(tree: Path, source: Path, *options: str) -> Path:
    target = tree / f"{source.stem}.out"
    command = ["g++", "-std=c++20", "-O0", f"-I{tree / 'include'}", str(source), "-o", str(target), *options]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return target


@pytest.fixture(scope="module")
def tree(root, tmp_path_factory) -> Path:
    if shutil.which("g++") is None:
        pytest.skip("no g++: tools/system_packages.sh tests installs it")
    return copied(root, tmp_path_factory.mktemp("new_law"))


@pytest.fixture(scope="module")
def described(tree) -> dict[str, dict]:
    """The new laws as the compiled list has them."""
    lines = subprocess.run([compiled(tree, NEW / "describe.cpp")], capture_output=True, text=True, check=True).stdout
    return {law["name"]: law for law in law_places.described(lines) if law["name"] in LAWS}


def tables():
    for family in FAMILIES:
        for law in laws_of(family):
            rows = law.table()
            yield {
                "name": law.name,
                "family": family,
                "sources": [law.source, *(row["source"] for row in rows)],
                "parameters": [row["name"] for row in rows],
            }


@pytest.mark.parametrize("law", list(tables()), ids=lambda law: law["name"])
def test_every_law_is_in_every_place(root, law):
    assert missing_places(root, law) == []


def test_every_header_of_a_law_is_on_the_list(root):
    assert unlisted_headers(root) == []


def test_no_reason_is_left_for_a_law_that_is_gone():
    assert set(law_places.WITHOUT_REFERENCE) <= {law["name"] for law in tables()}


@pytest.mark.parametrize("name", LAWS)
def test_a_new_law_is_complete_with_the_stated_places(tree, described, name):
    assert unlisted_headers(tree) == []
    assert missing_places(tree, described[name]) == []


@pytest.mark.parametrize("place", [place for place in PLACES if place != ALL])
def test_a_new_law_without_a_place_is_refused_with_its_name(root, described, tmp_path, place):
    tree = copied(root, tmp_path, without=place)
    found = [message for law in described.values() for message in missing_places(tree, law)]
    assert found and all(message.startswith(place) for message in found)


def test_a_header_that_is_not_on_the_list_is_refused_with_its_name(root, tmp_path):
    tree = copied(root, tmp_path, without=ALL)
    assert unlisted_headers(tree) == [f"{ALL}: {name}.hpp is not included" for name in sorted(LAWS)]


@pytest.mark.long
def test_a_new_law_earns_the_contract_tests(tree):
    together = tree / "tests" / "cpp" / "contracts.cpp"  # the compiler reads the engine once
    together.write_text("".join(f'#include "{name}.cpp"\n' for name in CONTRACTS), encoding="utf-8")
    program = compiled(tree, together, "-lgtest", "-lgtest_main", "-lpthread")
    listed = subprocess.run([program, "--gtest_list_tests"], capture_output=True, text=True, check=True).stdout
    suites = {
        (line.split("/")[0], law)
        for line in listed.splitlines()
        for law in LAWS.values()
        if line.endswith(f"TypeParam = needleforce::laws::{law}")
    }
    assert suites == {
        ("EveryLaw", "ElasticGrip"),
        ("EveryLaw", "LinearSpring"),
        ("EveryFriction", "ElasticGrip"),
        ("EveryStiffness", "LinearSpring"),
    }
    done = subprocess.run([program, "--gtest_brief=1"], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout


def test_a_new_law_runs_in_an_insertion(tree):
    program = compiled(tree, tree / "tests/conformance/trace.cpp")
    lines = subprocess.run(
        [program, tree / CASES / "new_laws.txt"], capture_output=True, text=True, check=True
    ).stdout.splitlines()
    rows = [line.split() for line in lines[1:]]
    # deformation by k h, and withdrawal against f' l without a dimple
    pressed = next(row for row in rows if 1e-3 < float(row[0]) < 3e-3)
    assert float(pressed[3]) == pytest.approx(60 * float(pressed[0]), rel=1e-12)
    assert float(rows[-1][4]) == pytest.approx(-18.6 * float(rows[-1][0]), rel=1e-12)
