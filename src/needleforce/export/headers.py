# SPDX-License-Identifier: Apache-2.0
"""A model as a C++ header with typed laws, or with laws and parameters by name as a C header, C# or JSON: an array of
layers."""

import json
import re
import textwrap
import unicodedata
from functools import cache
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..models.laws import FAMILIES
from ..models.model import Layer, Model
from ..vocabulary import __version__

MAX_KNOTS = 32
MAX_LINE_WIDTH = 106
CONVENTION = "SI units. Depth + inwards from the surface: subtract the fit's contact_depth. Force + opposes insertion."
MAX_NAME_CHARS = 63  # that C distinguishes
_RESERVED_FILE = Path(__file__).with_name("reserved_names.txt")
# that are none of C and C++: a name may be one, with a mark
_CSHARP_KEYWORDS = frozenset(
    "abstract as base byte checked decimal delegate event finally fixed foreach implicit in internal is lock null "
    "object out override params readonly ref sbyte sealed stackalloc string uint ulong unchecked unsafe ushort".split()
)
_RULE = (
    f"at most {MAX_NAME_CHARS} letters, digits and _ that begin with a letter and contain a small one, without __, an "
    "ending _ or _t, or a beginning nf_; no keyword, and no name of a header of C, C++ or POSIX"
)


def header(model: Model, language: str = "c++", name: str | None = None, sources: tuple[str, ...] = ()) -> str:
    """The text of a header with a model as a constant array of layers, from the surface down.

    Parameters
    ----------
    model : Model
        The model.
    language : str
        ``"c++"`` for ``needleforce::Layer`` with typed laws, ``"c"`` for ``nf_layer`` with laws by name, ``"c#"`` for
        ``Layer`` of Needleforce.cs, ``"json"`` for the layers that JavaScript, Octave and MATLAB take.
    name : str, optional
        Name of the constant; default: from the model's name.
    sources : tuple of str
        Lines for the heading on where the model comes from.

    Returns
    -------
    str
        The header. Numbers are in SI and are restored to the last bit by a compiler; the same model gives the same
        text, without a date.

    Raises
    ------
    InputError
        If the language is unknown, or the name is not an identifier in both languages.
    """
    if language not in LANGUAGES:
        next_step = f"Give {' or '.join(LANGUAGES)}."
        raise InputError("language", repr(language), "unknown", next_step=next_step)
    name = identifier(model.name) if name is None else name
    if not _free(name):
        limit = f"not a valid name of a constant in C and C++: {_RULE}"
        raise InputError("name", repr(name[:80]), limit, next_step="Give another name, such as liver_18G.")
    return LANGUAGES[language](model, name, sources)


def identifier(text: str) -> str:
    """Convert a text to the name of a constant.

    Parameters
    ----------
    text : str
        Any text, such as the name of a file.

    Returns
    -------
    str
        The text with ``_`` for characters that are not allowed, and with a prefix if it is not a valid name.
    """
    name = re.sub(r"[^A-Za-z0-9]+", "_", text).strip("_")
    if _free(name):
        return name
    return re.sub("_t$", "_type", f"model_{name}"[: MAX_NAME_CHARS - 4].rstrip("_"))


def _free(name: str) -> bool:
    """Whether a compiler takes the name of a constant, whatever headers precede it: see ``_RULE``."""
    plain = re.fullmatch(rf"(?!nf_)[A-Za-z]\w{{0,{MAX_NAME_CHARS - 1}}}", name, re.ASCII)
    capitals = name == name.upper()  # as those of macros, such as M_PI
    reserved = capitals or name.endswith(("_", "_t")) or "__" in name or re.fullmatch(r"std\d*", name)
    return bool(plain) and not reserved and name not in _reserved_names()


@cache
def _reserved_names() -> frozenset[str]:
    lines = _RESERVED_FILE.read_text(encoding="utf-8").splitlines()
    return frozenset(name for line in lines if not line.startswith("#") for name in line.split())


def _cpp_header(model: Model, name: str, sources: tuple[str, ...]) -> str:
    """The text of the header in this language."""
    top = [f"// {line}" for line in _heading(model, f"needleforce::Insertion insertion({name});", sources)]
    layers = [line for number, layer in enumerate(model.layers, 1) for line in _cpp_layer(layer, number)]
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


def _cpp_layer(layer: Layer, number: int) -> list[str]:
    laws = [line for family in FAMILIES for line in _member(family, getattr(layer, family))]
    return [
        f"{{.top = {float(layer.top)!r},  // {_top_meaning(number)}",
        " .laws = {",
        *(f"     {line}" for line in laws),
        " }},",
    ]


def _member(name: str, value: Any) -> list[str]:
    """``.name = Type{...},`` with one line for each parameter."""
    inner = _columns(value) if hasattr(value, "columns") else _cpp_numbers(value)
    inner += [line for part in value.parts for line in _part(value, part)]
    start = f".{name} = {value.cpp_name}{{"
    return [f"{start}}},"] if not inner else [start, *(f"    {line}" for line in inner), "},"]


def _cpp_numbers(value: Any) -> list[str]:
    numbers = value.parameters()
    return [f".{row['name']} = {numbers[row['name']]!r},  // {_meaning(row)}" for row in value.table()]


def _part(value: Any, part: str) -> list[str]:
    """A nested value: a tip, or the equivalence of a bevel."""
    inner = getattr(value, part)
    if isinstance(inner, str):
        return [f".{part} = needleforce::tips::BevelEquivalence::{inner},"]
    return _member(part, inner)


def _columns(profile: Any) -> list[str]:
    """The knots of a profile; unused radii are marked as endless."""
    radii, heights = profile.radii, profile.heights
    behind = ["needleforce::tips::endless"] * (MAX_KNOTS - len(radii))
    return [
        f".radius = {{{{{', '.join([*map(repr, map(float, radii)), *behind])}}}}},  // m",
        f".rise = {{{{{', '.join(map(repr, map(float, heights)))}}}}},  // m, height above the apex at each radius",
        f".count = {len(radii)},",
    ]


def _c_header(model: Model, name: str, sources: tuple[str, ...]) -> str:
    """The text of the header in this language."""
    use = f"nf_init(memory, size, {name}, {name}_layers, NULL, &why);"
    top = [f"   {line}" for line in _heading(model, use, sources)]
    tips, layers = [], []
    for number, layer in enumerate(model.layers, 1):
        layers += _c_layer(layer, number, f"{name}_tip_{number}", tips)
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


def _c_layer(layer: Layer, number: int, tip_name: str, tips: list[str]) -> list[str]:
    """The lines of a layer; the definition of the tip of its contact, if it has one, is added to ``tips``."""
    laws = []
    for family in FAMILIES:
        law = getattr(layer, family)
        if "tip" in law.parts:
            tips += _tip(law.tip, tip_name)
        laws += _law(family, law, tip_name)
    return [f"{{.top = {float(layer.top)!r}, /* {_top_meaning(number)} */", *(f" {line}" for line in laws), "},"]


def _law(family: str, law: Any, tip_name: str) -> list[str]:
    tip = f", .tip = &{tip_name}" if "tip" in law.parts else ""
    numbers = _c_numbers(law)
    if not numbers:
        return [f'.{family} = {{.name = "{law.name}"{tip}}},']
    # in the order of the members: which C++ requires
    return [
        f'.{family} = {{.name = "{law.name}", .parameters = {{',
        *(f"    {line}" for line in numbers),
        f"}}{tip}}},",
    ]


def _c_numbers(value: Any) -> list[str]:
    numbers = value.parameters()
    return [f'{{"{row["name"]}", {numbers[row["name"]]!r}}}, /* {_meaning(row)} */' for row in value.table()]


def _tip(tip: Any, name: str) -> list[str]:
    if hasattr(tip, "columns"):
        return _profile(tip, name)
    words = "".join(f', .{part} = "{getattr(tip, part)}"' for part in tip.parts)
    numbers = [f"    {line}" for line in _c_numbers(tip)]
    return [f'static const nf_tip {name} = {{.name = "{tip.name}", .parameters = {{', *numbers, f"}}{words}}};"]


def _profile(tip: Any, name: str) -> list[str]:
    columns = {"radii": tip.radii, "heights": tip.heights}
    arrays = [
        f"static const double {name}_{column}[] = {{{', '.join(map(repr, map(float, values)))}}}; /* m */"
        for column, values in columns.items()
    ]
    pointers = ", ".join(f".{column} = {name}_{column}" for column in columns)
    return [*arrays, f'static const nf_tip {name} = {{.name = "{tip.name}", {pointers}, .knots = {len(tip.radii)}}};']


def _csharp(model: Model, name: str, sources: tuple[str, ...]) -> str:
    """The text of a class with the layers."""
    layers = [line for number, layer in enumerate(model.layers, 1) for line in _csharp_layer(layer, number)]
    lines = [
        *(f"// {line}" for line in _heading(model, f"new Insertion({name}.Layers);", sources)),
        f"public static class {'@' if name in _CSHARP_KEYWORDS else ''}{name} {{",
        "  public static readonly Needleforce.Layer[] Layers = {",
        *(f"    {line}" for line in layers),
        "  };",
        "}",
    ]
    return "\n".join(lines) + "\n"


def _csharp_layer(layer: Layer, number: int) -> list[str]:
    lines = ["new Needleforce.Layer {", f"  Top = {float(layer.top)!r},  // {_top_meaning(number)}"]
    for family in FAMILIES:
        law = getattr(layer, family)
        tip = _csharp_tip(law.tip) if "tip" in law.parts else []
        start = f'  {family.capitalize()} = new Needleforce.Law("{law.name}"'
        first, *rest = [f"{start}, {tip[0]}", *(f"    {line}" for line in tip[1:])] if tip else [start]
        lines += [first, *rest]
        lines[-1] += ") {"
        lines += [*(f"    {line}" for line in _csharp_numbers(law)), "  },"]
    return [*lines, "},"]


def _csharp_tip(tip: Any) -> list[str]:
    if hasattr(tip, "columns"):
        radii, heights = (", ".join(map(repr, map(float, each))) for each in (tip.radii, tip.heights))
        return [f"new Needleforce.Tip(new[] {{ {radii} }}, new[] {{ {heights} }})"]
    words = "".join(f', "{getattr(tip, part)}"' for part in tip.parts)
    return [f'new Needleforce.Tip("{tip.name}"{words}) {{', *(f"  {line}" for line in _csharp_numbers(tip)), "}"]


def _csharp_numbers(value: Any) -> list[str]:
    numbers = value.parameters()
    return [f'{{ "{row["name"]}", {numbers[row["name"]]!r} }},  // {_meaning(row)}' for row in value.table()]


def _json(model: Model, name: str, sources: tuple[str, ...]) -> str:
    """The text of an array of layers, on as few lines as there are laws; JSON has no comments."""
    layers = [{"top": float(layer.top), **{f: by_name(getattr(layer, f)) for f in FAMILIES}} for layer in model.layers]
    return json.dumps(layers, indent=2) + "\n"


def by_name(value: Any) -> dict:
    """A law or tip as the hosts take it.

    Parameters
    ----------
    value : law or tip
        Any of ``nf.laws`` and ``nf.tips``.

    Returns
    -------
    dict
        Its name, its parameters in SI, and its parts: a tip, or the equivalence of a bevel.
    """
    parts = {part: getattr(value, part) for part in value.parts}
    columns = {"radii": list(value.radii), "heights": list(value.heights)} if hasattr(value, "columns") else {}
    return {
        "name": value.name,
        **value.parameters(),
        **columns,
        **{key: part if isinstance(part, str) else by_name(part) for key, part in parts.items()},
    }


def _plain(text: str) -> str:
    """``text`` on one line, without sequences that end or continue a comment."""
    line = "".join(" " if unicodedata.category(letter)[0] in "CZ" else letter for letter in text)
    for ends, harmless in (("\\", "/"), ("*/", "* /"), ("/*", "/ *"), ("??", "? ?")):
        line = line.replace(ends, harmless)
    return " ".join(line.split())


def _heading(model: Model, use: str, sources: tuple[str, ...]) -> list[str]:
    """The lines of the heading, without comment marks."""
    texts = [
        f"{model.name}: {model.summary}",
        f"Written by needleforce export, version {__version__}: export it again instead of editing it.",
        CONVENTION,
        f"Use: {use}",
        f"Reference: {model.reference}" if model.reference else "",
        *sources,
        *(f"Doubt: {doubt}" for doubt in model.doubts),
        *(f"Unverified: {quantity}" for quantity in model.unverified),
    ]
    return [line for text in map(_plain, texts) for line in textwrap.wrap(text, MAX_LINE_WIDTH, subsequent_indent="  ")]


def _meaning(row: dict) -> str:
    """Unit and meaning of a parameter."""
    return _plain(f"{row['unit']}, {row['meaning']}")


def _top_meaning(number: int) -> str:
    """Unit and meaning of the top of a layer."""
    return f"m, where layer {number} begins below the undeformed surface"


LANGUAGES = {"c++": _cpp_header, "c": _c_header, "c#": _csharp, "json": _json}
