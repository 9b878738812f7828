# SPDX-License-Identifier: Apache-2.0
"""Every claim points at a test that is there."""

import re

import pytest

FILE = re.compile(r"(?<!{doc})`([\w./]+/[\w.]+|Makefile)`")
TEST = re.compile(r"`([A-Z]\w+|test_\w+|proof-\w+)`")


def claims(root, page: str) -> list[tuple[str, str]]:
    """(claim, what shows it), the rows of the tables; what shows it is the last cell."""
    text = (root / "docs" / page).read_text(encoding="utf-8").split("## Measured")[0]
    rows = re.findall(r"^\| (.+?) \| (?:.+ \| )?(.+) \|$", text, re.M)
    return [row for row in rows if not row[1].startswith(("shown by", "is shown by", "---"))]


def missing(root, shown: str) -> list[str]:
    """The files that are not there, and the tests that are in none of them."""
    files = FILE.findall(shown)
    absent = [name for name in files if not (root / name).is_file()]
    text = "\n".join((root / name).read_text(encoding="utf-8") for name in files if name not in absent)
    tests = [name for name in TEST.findall(shown) if name != "Makefile"]
    return absent + [name for name in tests if not re.search(rf"\b{name}\b", text)]


def test_every_claim_points_at_what_shows_it(root):
    rows = claims(root, "evidence/proof.md")
    assert len(rows) >= 15
    for claim, shown in rows:
        assert FILE.search(shown) or "the fuzzer" in shown, claim
        assert missing(root, shown) == [], claim


def test_every_hazard_points_at_what_shows_it(root):
    rows = claims(root, "evidence/safety_case.md")
    shown = [each for _, each in rows if FILE.search(each)]
    assert len(shown) >= 15
    for each in shown:
        assert missing(root, each) == []
    others = {each for _, each in rows} - set(shown)
    assert all(each == "–" or "{doc}" in each or each.startswith("`python benchmarks/") for each in others), others


def test_every_cpp_program_is_run_each_day(root):
    programs = re.findall(r"^add_executable\((\w+_tests)", (root / "tests/cpp/CMakeLists.txt").read_text(), re.M)
    fifths = re.search(r"^CXX_FIFTHS := (.*)$", (root / "Makefile").read_text(), re.M)[1]
    assert sorted(re.split("[ +]", fifths)) == sorted(programs) and fifths.count(" ") == 4


@pytest.mark.parametrize(
    "shown", ["`tests/cpp/nowhere.cpp`", "`NoSuchTest` in `tests/cpp/insertion.cpp`", "`proof-nothing` in `Makefile`"]
)
def test_a_claim_that_points_nowhere_is_found(root, shown):
    assert len(missing(root, shown)) == 1
