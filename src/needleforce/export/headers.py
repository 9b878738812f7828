# SPDX-License-Identifier: Apache-2.0
"""A model as a C++ header: an array of layers whose laws are the core's own types."""

from ..models.laws import FAMILIES
from ..models.model import Model
from .words import heading, meaning, top_meaning

MOST_KNOTS = 32


def header(model: Model, name: str, sources: tuple[str, ...]) -> str:
    """The text of the header."""
    top = [f"// {line}" for line in heading(model, f"needleforce::Insertion insertion({name});", sources)]
    layers = [line for number, layer in enumerate(model.layers, 1) for line in _layer(layer, number)]
    lines = [
        *top,
        "// clang-format off",
        "#pragma once",
        '#include "needleforce/insertion.hpp"',
        "",
        f"inline constexpr needleforce::Layer {name}[] = {{",
        *(f"    {line}" for line in layers),
        "};",
    ]
    return "\n".join(lines) + "\n"


def _layer(layer, number: int) -> list[str]:
    laws = [line for family in FAMILIES for line in _member(family, getattr(layer, family))]
    return [
        f"{{.top = {float(layer.top)!r},  // {top_meaning(number)}",
        " .laws = {",
        *(f"     {line}" for line in laws),
        " }},",
    ]


def _member(name: str, value) -> list[str]:
    """``.name = Type{...},`` with a line for each number."""
    inner = _columns(value) if hasattr(value, "columns") else _numbers(value)
    inner += [line for part in value.parts for line in _part(value, part)]
    start = f".{name} = {value.cpp_name}{{"
    return [f"{start}}},"] if not inner else [start, *(f"    {line}" for line in inner), "},"]


def _numbers(value) -> list[str]:
    numbers = value.parameters()
    return [f".{row['name']} = {numbers[row['name']]!r},  // {meaning(row)}" for row in value.table()]


def _part(value, part: str) -> list[str]:
    """A value within, such as a tip, or the reading of a bevel."""
    inner = getattr(value, part)
    if isinstance(inner, str):
        return [f".{part} = needleforce::tips::BevelEquivalence::{inner},"]
    return _member(part, inner)


def _columns(profile) -> list[str]:
    """A profile is endless behind its last knot."""
    radii, heights = profile.radii, profile.heights
    behind = ["needleforce::tips::endless"] * (MOST_KNOTS - len(radii))
    return [
        f".radius = {{{{{', '.join([*map(repr, map(float, radii)), *behind])}}}}},  // m",
        f".rise = {{{{{', '.join(map(repr, map(float, heights)))}}}}},  // m, height above the apex at each radius",
        f".count = {len(radii)},",
    ]
