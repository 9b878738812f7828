# SPDX-License-Identifier: Apache-2.0
"""The formula of a law in LaTeX with its text, from ``formulas.toml``; otherwise the comment of its header."""

import re
import tomllib
from pathlib import Path

from . import header

FORMULAS = tomllib.loads((Path(__file__).parent / "formulas.toml").read_text(encoding="utf-8"))
GREEK = re.compile(r"\b(alpha|beta|gamma|delta|zeta|eta|mu|nu|rho|sigma|tau|Lambda)(?![a-z])")


def text(law: type) -> str:
    """Formula and meaning of a law, as Markdown."""
    if law.name not in FORMULAS:
        return header.comment(law)
    entry = FORMULAS[law.name]
    return "\n\n".join([*(f"$$\n{line}\n$$" for line in entry["formula"]), entry["text"].strip()])


def latex(symbol: str) -> str:
    """A symbol of a parameter table in LaTeX: ``sigma_0`` as ``\\sigma_0``."""
    return GREEK.sub(r"\\\1", symbol)
