# SPDX-License-Identifier: Apache-2.0
"""A law's C++ header: the comment above its struct, and the name of the struct."""

import re
from functools import cache
from pathlib import Path

HEADERS = Path(__file__).resolve().parents[2] / "include" / "needleforce" / "laws"
NAMES = re.compile(r"const char\* name\s*=([^;]*);")
NAME = re.compile(r'"(\w+)"')
STRUCT = re.compile(r"((?:^///.*\n)+)(?:^template.*\n)?^struct (\w+) \{", re.MULTILINE)
FORMULAS = re.compile(r"(?:^ {4}.*\n?)+", re.MULTILINE)


def comment(law: type) -> str:
    """The comment above the law's struct, as Markdown; its indented lines are formulas."""
    block, _ = _documented(header(law.name).read_text(encoding="utf-8"))
    return FORMULAS.sub(_one_a_line, re.sub("^/// ?", "", block, flags=re.MULTILINE)).strip()


def cpp_name(law: type) -> str:
    """The law's name in C++; for a template, the alias of the chosen case, in the order of the names."""
    text = header(law.name).read_text(encoding="utf-8")
    struct = _documented(text)[1].removeprefix("Basic")  # the template over the kind of number
    aliases = re.findall(rf"^using (\w+) = {struct}<", text, re.MULTILINE)
    return f"laws::{aliases[_names(text).index(law.name)] if aliases else struct}"


def _names(text: str) -> list[str]:
    """The names of the laws that a header defines."""
    found = NAMES.search(text)
    return NAME.findall(found[1]) if found else []


def _one_a_line(block: re.Match) -> str:
    """One formula a line: splits those in one line, joins those broken inside a bracket."""
    lines: list[str] = []
    for line in block[0].splitlines():
        if lines and lines[-1].count("(") > lines[-1].count(")"):
            lines[-1] += " " + line.strip()
        else:
            lines += re.split(r" {4,}", line.strip())
    return "".join(f"    {line}\n" for line in lines)


@cache
def header(name: str) -> Path:
    """The header that defines the law of this name."""
    for path in sorted(HEADERS.glob("*.hpp")):
        if name in _names(path.read_text(encoding="utf-8")):
            return path
    raise LookupError(f"no header below {HEADERS} names a law {name}")


def _documented(text: str) -> tuple[str, str]:
    """The comment and the name of the struct that holds the law's name."""
    named = NAMES.search(text).start()  # a memory of the law may come before the law
    return [each for each in STRUCT.finditer(text) if each.start() < named][-1].groups()
