# SPDX-License-Identifier: Apache-2.0
"""A law with the parameter values it is drawn with, and the source of each."""

import math
import tomllib
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import needleforce as nf
from needleforce.errors import InputError
from needleforce.models.laws import FAMILIES, laws_of

TYPICAL = tomllib.loads((Path(__file__).parent / "typical.toml").read_text(encoding="utf-8"))

DEFAULT, MIDDLE = "default", "middle of the range, without a typical value"


class Example(NamedTuple):
    """A law with values, and the source of each value by its name."""

    law: Any
    origin: dict[str, str]


def example(law: type) -> Example:
    """``law`` with a value for every parameter: typical, from a preset, its default, or the middle of its range."""
    chosen = {row["name"]: _chosen(law, row) for row in law.table()}
    parts = {part: getattr(nf.preset("paper").needle, part) for part in getattr(law, "parts", ())}
    values = {name: value for name, (value, _) in chosen.items()}
    return Example(law(**values, **parts), {name: origin for name, (_, origin) in chosen.items()})


def _chosen(law: type, row: dict) -> tuple[float, str]:
    name, found, typical = row["name"], _in_presets(), TYPICAL.get(law.name, {})
    sources = [
        (typical.get(name), typical.get("origin")),
        *found.get((law.name, name), []),
        (row["default"], DEFAULT),
        *found.get((law.family, name), []),
        *found.get(name, []),
    ]
    inside = ((value, origin) for value, origin in sources if value is not None and row["low"] <= value <= row["high"])
    return next(inside, (_middle(row["low"], row["high"]), MIDDLE))


@cache
def _in_presets() -> dict:
    """Every value of the shipped presets: by law and name, by family and name, and by name."""
    found = {}
    for preset in sorted(nf.presets(), key=lambda name: name != "paper"):
        for family in FAMILIES:
            law = getattr(nf.preset(preset), family)
            for name, value in law.parameters().items():
                for key in ((law.name, name), (family, name), name):
                    found.setdefault(key, []).append((value, f"preset `{preset}`"))
    return found


def _middle(low: float, high: float) -> float:
    """The middle of a range, geometric if the range spans decades."""
    return math.sqrt(low * high) if low > 0.0 and high > 100.0 * low else 0.5 * (low + high)


def around(law) -> nf.Model:
    """The paper's model with ``law`` in place of its own; without a cutting law if friction includes the tip."""
    model = nf.preset("paper")
    try:
        return model.replace(**{law.family: law})
    except InputError:
        return model.replace(**{law.family: law, "cutting": without("cutting")})


def without(family: str):
    """The family's law without parameters, whose part of the force is zero."""
    return next(law for law in laws_of(family) if not law.table())()
