# SPDX-License-Identifier: Apache-2.0
"""Decisions, ARCHITECTURE.md and entries of CHANGELOG.md stay short; evidence names the command that repeats it."""

import re
from itertools import pairwise
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DECISIONS = sorted((ROOT / "docs" / "decisions").glob("*.md"))
CLAIMS = ("index", "proof", "safety_case")  # these name tests: test_proof.py
EVIDENCE = sorted(path for path in (ROOT / "docs" / "evidence").glob("*.md") if path.stem not in CLAIMS)
HOWTO = sorted(path for path in (ROOT / "docs" / "howto").glob("*.md") if path.stem != "index")
BULLET = re.compile(r"\s*(?:[-*]|\d+\.) ")
MAX_DECISION_WORDS = 350
MAX_SENTENCE_WORDS = 40
MAX_ENTRY_CHARACTERS = 200
MAX_ARCHITECTURE_LINES = 150
MAX_README_LINES = 120
MAX_HOWTO_LINES = 60


def text_blocks(page: str) -> list[str]:
    """The paragraphs, list items and table cells of a page, without its code and formulas."""
    page = re.sub(r"```.*?```|\$\$.*?\$\$", "", page, flags=re.S)
    blocks = [""]
    for line in page.splitlines():
        if line.startswith("|"):
            blocks += [*line.strip("|").split("|"), ""]
        elif not line.strip():
            blocks.append("")
        elif BULLET.match(line):
            blocks.append(line)
        else:
            blocks[-1] += f" {line}"
    return blocks


def longest_sentence(page: str) -> str:
    sentences = [each for block in text_blocks(page) for each in re.split(r"(?<=[.!?])[*)]*\s+(?=[^a-z])", block)]
    return max(sentences, key=lambda sentence: len(sentence.split()))


def faulty_entries(changelog: str) -> list[str]:
    """Entries that are longer than a line, and lines below an entry that continue it."""
    lines = changelog.splitlines()
    continued = [line for above, line in pairwise(lines) if above.startswith("- ") and line.startswith(" ")]
    return continued + [line for line in lines if line.startswith("- ") and len(line) > MAX_ENTRY_CHARACTERS]


@pytest.mark.parametrize("path", DECISIONS, ids=lambda path: path.stem)
def test_a_decision_is_short(path):
    page = path.read_text(encoding="utf-8")
    assert len(page.split()) <= MAX_DECISION_WORDS
    sentence = longest_sentence(page)
    assert len(sentence.split()) <= MAX_SENTENCE_WORDS, sentence


def test_an_entry_of_the_changelog_is_a_line():
    assert faulty_entries((ROOT / "CHANGELOG.md").read_text(encoding="utf-8")) == []


@pytest.mark.parametrize("path", EVIDENCE, ids=lambda path: path.stem)
def test_evidence_names_the_command_that_repeats_it(path):
    page = path.read_text(encoding="utf-8")
    programs = re.findall(r"benchmarks/\w+\.(?:py|cpp)", page)
    parts = re.findall(r"--only (\w+)", page)
    assert programs or parts or re.search("measured once", page, re.I)
    assert [name for name in programs if not (ROOT / name).is_file()] == []
    bench = (ROOT / "benchmarks" / "run.py").read_text(encoding="utf-8")
    assert [name for name in parts if not re.search(rf"\b{name}\b", bench)] == []


def test_the_architecture_is_two_screens():
    lines = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8").splitlines()
    assert len(lines) <= MAX_ARCHITECTURE_LINES


def test_the_readme_is_a_front_page():
    assert len((ROOT / "README.md").read_text(encoding="utf-8").splitlines()) <= MAX_README_LINES


@pytest.mark.parametrize("path", HOWTO, ids=lambda path: path.stem)
def test_a_how_to_is_a_task(path):
    assert len(path.read_text(encoding="utf-8").splitlines()) <= MAX_HOWTO_LINES


def test_the_left_column_has_eight_entries():
    page = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    (column,) = re.findall(r"```{toctree}\n(.*?)```", page, re.S)
    assert len(re.findall(r"<\w+/index>$", column, re.M)) == 8


def test_what_is_too_long_is_found():
    long = "One sentence. Word " + "word " * 40 + ". Another one."
    assert longest_sentence(long).startswith("Word word")
    assert longest_sentence("| short cell | " + "word " * 41 + " |").strip().startswith("word word")
    assert faulty_entries("- first line\n  second line\n- " + "x" * 200) == ["  second line", "- " + "x" * 200]
