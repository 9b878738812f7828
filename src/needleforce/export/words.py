# SPDX-License-Identifier: Apache-2.0
"""What stands in the comments of an exported header: where the model is from, and what a number is."""

import textwrap
import unicodedata

from ..models.model import Model
from ..vocabulary import __version__

WIDTH = 106
CONVENTION = "SI units. Depth counts from the undeformed surface, + inwards; force is + when it opposes insertion."


def plain(text: str) -> str:
    """``text`` on one line, with nothing that would end or go on with a comment."""
    seen = "".join(" " if unicodedata.category(letter)[0] in "CZ" else letter for letter in text)
    for ends, harmless in (("\\", "/"), ("*/", "* /"), ("/*", "/ *"), ("??", "? ?")):
        seen = seen.replace(ends, harmless)
    return " ".join(seen.split())


def heading(model: Model, use: str, sources: tuple[str, ...]) -> list[str]:
    """The lines on top, without comment marks."""
    told = [
        f"{model.name}: {model.summary}",
        f"Written by needleforce export, version {__version__}: write it anew rather than change it.",
        CONVENTION,
        f"Use: {use}",
        f"Reference: {model.reference}" if model.reference else "",
        *sources,
        *(f"Doubt: {doubt}" for doubt in model.doubts),
        *(f"Unverified: {quantity}" for quantity in model.unverified),
    ]
    return [line for text in map(plain, told) for line in textwrap.wrap(text, WIDTH, subsequent_indent="  ")]


def meaning(row: dict) -> str:
    """Unit and meaning of a parameter."""
    return plain(f"{row['unit']}, {row['meaning']}")


def top_meaning(number: int) -> str:
    """What the top of a layer is."""
    return f"m, where layer {number} begins below the undeformed surface"
