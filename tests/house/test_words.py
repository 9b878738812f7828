# SPDX-License-Identifier: Apache-2.0
"""Names, messages and pages use the words of the field: what may not come back, and what to write instead."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

# a word that may not be part of a name -> what to use
NAMES = {
    "told": "reported, identifiable, distinguishable",
    "tells": "identifies, states",
    "telling": "diagnostics",
    "said": "sentences, text, message: what it is",
    "says": "states, reports",
    "foretold": "predicted",
    "foretell": "predict",
    "unseen": "held_out, cross_validation",
    "beside": "next_to, others",
    "swing": "oscillation",
    "fading": "relaxing, autocorrelated",
    "fades": "relaxes, autocorrelated",
    "oddity": "anomaly",
    "oddities": "anomalies",
    "odd": "anomalous",
    "unread": "unreadable",
    "keeper": "run_writer",
    "spoiled": "invalid, corrupted",
    "spoilt": "invalid, corrupted",
    "mend": "fix",
    "alike": "similar, correlated",
    "lacks": "missing",
    "most": "max",
    "least": "min",
    "gave": "ruptured",
    "faded": "relaxation",
}
# in these the word has its plain meaning
TERMS = {"least_squares", "at_least", "at_most", "outermost", "odd_quantiles", "max_unread_bytes"}
# a phrase that may not be in a message, a docstring, a comment or a page -> what to write
PHRASES = {
    r"foret(?:ell|old)\w*": "predict",
    r"\bunseen\b": "held-out",
    r"\bbesides?\b": "next to, compared with, in addition to",
    r"\bg(?:ive|ives|ave|iving) way\b": "ruptures, punctures",
    r"\bfrom cold\b": "without a warm start",
    r"\b(?:un)?told\b": "reported, determined, known",
    r"\btells\b": "reports, states, identifies, distinguishes",
    r"\bsa(?:id|ys)\b": "reports, prints, states",
    r"\bmend(?:s|ed)?\b": "fix, repair",
    r"\bspoil(?:t|ed|s)\b": "corrupted, invalid",
    r"\bgoes on\b|\bgo on\b|\bwent on\b": "continues",
    r"\bswings?\b": "oscillation, oscillates",
    r"\boddit(?:y|ies)\b": "anomaly",
    r"\bfad(?:es?|ing)\b": "relaxes; autocorrelated",
    r"\bway (?:in|out)\b": "insertion stroke, withdrawal stroke",
    r"\blog alone\b": "a force-depth recording",
    r"\bstands? there\b": "is in",
}
ANY_PHRASE = re.compile("|".join(PHRASES), re.I)
PYTHON = sorted((ROOT / "src").rglob("*.py"))
CPP = sorted(
    path
    for folder in ("include", "bindings", "integrations")
    for ending in ("*.hpp", "*.cpp", "*.h", "*.c", "*.mjs")
    for path in (ROOT / folder).rglob(ending)
)
GENERATED = ("api.md", "commands.md", "needle_file.md", "presets.md", "laws")
PAGES = sorted(
    path
    for path in [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]
    if path.name not in GENERATED and path.parent.name not in GENERATED
)


def words_of(name: str) -> list[str]:
    """The words of an identifier: snake_case, CamelCase and CONSTANTS."""
    parts = re.sub(r"([a-z0-9])([A-Z])", r"\1_\2", name)
    return parts.lower().strip("_").split("_")


def python_names(tree: ast.Module) -> set[str]:
    """Every name that a module defines: functions, classes, parameters, variables, attributes."""
    names = {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.ClassDef)}
    names |= {node.arg for node in ast.walk(tree) if isinstance(node, ast.arg)}
    names |= {node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
    stored = (node for node in ast.walk(tree) if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store))
    return names | {node.attr for node in stored}


def foreign(text: str) -> list[str]:
    """The phrases of a text that are on the list, with what to write."""
    return [
        f"{found[0]!r}: write {instead}"
        for phrase, instead in PHRASES.items()
        if (found := re.search(phrase, text, re.I))
    ]


def foreign_lines(path: Path, text: str) -> list[str]:
    """The same of a file, with its lines; in most files there is none, which one search finds."""
    lines = text.splitlines() if ANY_PHRASE.search(text) else []
    return [f"{path.name}:{number} {found}" for number, line in enumerate(lines, 1) for found in foreign(line)]


def shown(path: Path) -> str:
    return str(path.relative_to(ROOT))


@pytest.mark.parametrize("path", PYTHON, ids=shown)
def test_names_are_the_fields(path):
    names = python_names(ast.parse(path.read_text(encoding="utf-8")))
    named = [(name, word) for name in names if name.strip("_").lower() not in TERMS for word in words_of(name)]
    wrong = {name: NAMES[word] for name, word in named if word in NAMES}
    assert wrong == {}


@pytest.mark.parametrize("path", [*PYTHON, *CPP], ids=shown)
def test_messages_and_comments_are_in_plain_words(path):
    assert foreign_lines(path, path.read_text(encoding="utf-8")) == []


@pytest.mark.parametrize("path", PAGES, ids=shown)
def test_pages_are_in_plain_words(path):
    assert foreign_lines(path, re.sub(r"`[^`\n]*`", "", path.read_text(encoding="utf-8"))) == []  # names are above


@pytest.mark.parametrize(
    "text, count", [("the law foretells repeats", 1), ("the file says so", 1), ("a held-out repeat is predicted", 0)]
)
def test_dialect_is_found(text, count):
    assert len(foreign(text)) == count
