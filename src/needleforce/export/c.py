# SPDX-License-Identifier: Apache-2.0
"""A model as a C header: an array of layers for ``nf_init``, laws and numbers by name."""

from ..models.laws import FAMILIES
from ..models.model import Model
from .words import heading, meaning, top_meaning


def header(model: Model, name: str, sources: tuple[str, ...]) -> str:
    """The text of the header."""
    use = f"nf_init(memory, size, {name}, {name}_layers, NULL, &why);"
    top = [f"   {line}" for line in heading(model, use, sources)]
    tips, layers = [], []
    for number, layer in enumerate(model.layers, 1):
        layers += _layer(layer, number, f"{name}_tip_{number}", tips)
    lines = [
        f"/* {top[0].lstrip()}",
        *top[1:-1],
        f"{top[-1]} */",
        "/* clang-format off */",
        f"#ifndef NEEDLEFORCE_MODEL_{name}",
        f"#define NEEDLEFORCE_MODEL_{name}",
        '#include "needleforce.h"',
        "",
        *tips,
        f"static const nf_layer {name}[] = {{",
        *(f"    {line}" for line in layers),
        "};",
        f"enum {{ {name}_layers = {len(model.layers)} }};",
        "",
        "#endif",
    ]
    return "\n".join(lines) + "\n"


def _layer(layer, number: int, tip_name: str, tips: list[str]) -> list[str]:
    """The lines of a layer; the tip of its contact, if it has one, goes before the array, to ``tips``."""
    laws = []
    for family in FAMILIES:
        law = getattr(layer, family)
        if "tip" in law.parts:
            tips += _tip(law.tip, tip_name)
        laws += _law(family, law, tip_name)
    return [f"{{.top = {float(layer.top)!r}, /* {top_meaning(number)} */", *(f" {line}" for line in laws), "},"]


def _law(family: str, law, tip_name: str) -> list[str]:
    tip = f", .tip = &{tip_name}" if "tip" in law.parts else ""
    numbers = _numbers(law)
    if not numbers:
        return [f'.{family} = {{.name = "{law.name}"{tip}}},']
    # in the order of the members: C++ takes no other
    return [f'.{family} = {{.name = "{law.name}", .numbers = {{', *(f"    {line}" for line in numbers), f"}}{tip}}},"]


def _numbers(value) -> list[str]:
    numbers = value.parameters()
    return [f'{{"{row["name"]}", {numbers[row["name"]]!r}}}, /* {meaning(row)} */' for row in value.table()]


def _tip(tip, name: str) -> list[str]:
    if hasattr(tip, "columns"):
        return _profile(tip, name)
    words = "".join(f', .{part} = "{getattr(tip, part)}"' for part in tip.parts)
    numbers = [f"    {line}" for line in _numbers(tip)]
    return [f'static const nf_tip {name} = {{.name = "{tip.name}", .numbers = {{', *numbers, f"}}{words}}};"]


def _profile(tip, name: str) -> list[str]:
    columns = {"radii": tip.radii, "heights": tip.heights}
    arrays = [
        f"static const double {name}_{column}[] = {{{', '.join(map(repr, map(float, values)))}}}; /* m */"
        for column, values in columns.items()
    ]
    pointers = ", ".join(f".{column} = {name}_{column}" for column in columns)
    return [*arrays, f'static const nf_tip {name} = {{.name = "{tip.name}", {pointers}, .knots = {len(tip.radii)}}};']
