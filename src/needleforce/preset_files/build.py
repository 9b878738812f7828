# SPDX-License-Identifier: Apache-2.0
"""From a decoded preset file to a model, from a section of a file to a needle or a tissue, and a model written as such
a file."""

import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec

from .. import core
from ..errors import InputError
from ..files import as_type, atomic_write, decode_toml, read_bytes
from ..models.laws import FAMILIES, Surroundings, law_called, make_laws
from ..models.model import Layer, Model
from .schema import TOP, NeedleSection, PresetFile, TissueSection, keys, si_key, tips, to_si

NO_POISSON = (
    "It is never assumed: with the paper's values, 0.5 (an incompressible gel) puts the peak force 32 % above the "
    "measured one, and the measured peak implies 0.115 (0 to 0.42 within two standard deviations). Give poisson_ratio, "
    "or the stiffness law's reduced_modulus."
)
OTHER_SECTIONS = {field.name for field in msgspec.structs.fields(PresetFile)} - {"needle", "reference"}


def build(file: Any) -> Model:
    """The model of a decoded preset file; InputError, with the path inside the file, for missing or invalid values."""
    needle = make_needle(file.needle)
    parts = _laws(file, file, needle, "$")
    deeper = tuple(_layer(section, file, needle, f"$.layers[{i}]") for i, section in enumerate(file.layers))
    tissue = make_tissue(file.tissue) if file.tissue is not None and file.tissue.poisson_ratio is not None else None
    description = {key: getattr(file, key) for key in ("name", "summary", "reference", "doubts", "unverified")}
    try:
        return Model(**parts, **description, needle=needle, tissue=tissue, deeper=deeper)
    except InputError as error:
        raise error.at(_place_of_layer(error)) from None


def _place_of_layer(error: InputError) -> str:
    """Path inside the file of an error in "layer 1", "layer 2" …: the first layer is the file's own sections."""
    found = re.match(r"layer ([2-9]),", error.quantity)
    return f"$.layers[{int(found[1]) - 2}]" if found else "$"


def _laws(section: Any, file: Any, needle: core.Needle | None, place: str) -> dict:
    tissue = None if file.tissue is None else lambda: make_tissue(file.tissue)
    chosen = {}
    for family in FAMILIES:
        numbers = getattr(section, family)
        if numbers is not None:
            law = law_called(family, numbers.__struct_config__.tag)
            values = si_values(numbers, law.table(), f"{place}.{family}")
            if getattr(numbers, "tip", None) is not None:
                values["tip"] = make_tip(numbers.tip, f"{place}.{family}.tip")
            chosen[family] = (law, values)
    return make_laws(chosen, Surroundings(needle, tissue, file.foundation), f"{place}.")


def _layer(section: Any, file: Any, needle: core.Needle | None, place: str) -> Layer:
    top = si_values(section, TOP, place)
    if not top:
        raise InputError("top", "missing", "needed in m", place, "Give the depth at which the layer begins.")
    return Layer(**top, **_laws(section, file, needle, place))


def si_values(section: Any, table: list[dict], place: str) -> dict[str, float]:
    """The parameters in a section, in SI; InputError for one that is given twice in different units."""
    values = {}
    for row in table:
        units = keys(row["name"], row["unit"]).items()
        found = {
            key: to_si(getattr(section, key), factor) for key, factor in units if getattr(section, key) is not None
        }
        if len(found) > 1:
            raise InputError(row["name"], " and ".join(found), "given twice", place, "Keep one of the two.")
        for key, value in found.items():
            _check_range(key, getattr(section, key), value, row, place)
            values[row["name"]] = value
    return values


def _check_range(key: str, written: Any, value: Any, row: dict, place: str) -> None:
    """InputError for a number outside its range, with both in the unit in which the file has it."""
    if isinstance(value, tuple) or "low" not in row or row["low"] <= value <= row["high"]:
        return
    factor = to_si(1.0, keys(row["name"], row["unit"])[key])
    limit = f"outside {row['low'] / factor:.4g} to {row['high'] / factor:.4g}"
    raise InputError(key, f"{written:g}", limit, place, f"It is the {row['meaning']}.")


def _make(kind: Callable, values: dict, place: str) -> Any:
    """The value of a class, with ``place`` added to its InputError."""
    try:
        return kind(**values)
    except InputError as error:
        raise error.at(place) from None


def make_needle(section: Any) -> core.Needle | None:
    """The needle of a decoded section, or None without a section."""
    if section is None:
        return None
    tip = make_tip(section.tip, "$.needle.tip")
    return _make(core.Needle, si_values(section, core.Needle.table(), "$.needle") | {"tip": tip}, "$.needle")


def make_tip(section: Any, place: str) -> Any:
    """The tip of a decoded section, or None without a section."""
    if section is None:
        return None
    shape = next(tip for tip in tips() if tip.name == section.__struct_config__.tag)
    words = {part: getattr(section, part) for part in shape.parts if getattr(section, part) is not None}
    values = si_values(section, shape.table(), place)
    missing = [row for row in shape.table() if row["name"] not in values and row.get("default") is None]
    for row in missing[:1]:
        limit = f"needed as {' or '.join(keys(row['name'], row['unit']))}"
        raise InputError(f"{shape.name}.{row['name']}", "missing", limit, place, f"Give the {row['meaning']}.")
    return _make(shape, values | words, place)


def make_tissue(section: Any) -> core.Tissue:
    """The tissue of a decoded section; InputError if the Poisson ratio is missing."""
    values = si_values(section, core.Tissue.table(), "$.tissue")
    if "poisson_ratio" not in values:
        raise InputError("tissue.poisson_ratio", "missing", "needed for the reduced modulus", "$.tissue", NO_POISSON)
    return _make(core.Tissue, values, "$.tissue")


class NeedleFile(msgspec.Struct, forbid_unknown_fields=True):
    """The sections of a needle file; ``reference`` is the source of its values."""

    needle: NeedleSection
    reference: str = ""


def read_needle(path: str | os.PathLike) -> core.Needle:
    """The needle of a TOML file with a section ``[needle]`` and, for the tip, ``[needle.tip]``.

    Other sections of a preset are ignored. Raises InputError, with the path inside the file.
    """
    what, next_step = "needle file", "Give a file with a [needle] section, such as a preset."
    path, text = Path(path), read_bytes(path, what)
    try:
        document = decode_toml(text, what, next_step=next_step)
        document = document if "needle" in document else {"needle": document}
        known = {key: value for key, value in document.items() if key not in OTHER_SECTIONS}
        return make_needle(as_type(known, NeedleFile, what, next_step).needle)
    except InputError as error:
        raise error.at(path.name) from None


def read_tissue(path: str | os.PathLike, required: bool = True) -> core.Tissue | None:
    """The tissue of a TOML file with a section ``[tissue]``; other sections are ignored.

    None without such a section if it is not ``required``. Raises InputError, with the path inside the file.
    """
    what, next_step = "tissue file", "Give a file with a [tissue] section, such as a preset that has one."
    path, text = Path(path), read_bytes(path, what)
    try:
        section = decode_toml(text, what, next_step=next_step).get("tissue")
        if section is None and required:
            raise InputError("section [tissue]", "missing", next_step="Give a file or preset that has one.")
        return None if section is None else make_tissue(as_type(section, TissueSection, what, next_step))
    except InputError as error:
        raise error.at(path.name) from None


def save(model: Model, path: str | os.PathLike) -> None:
    """Write ``model`` as a preset file that ``preset(path)`` reads as an equal model."""
    with atomic_write(path) as file:
        file.write(as_toml(model))


def as_toml(model: Model) -> str:
    """The text of the preset file."""
    head = [
        f"name = {_text(model.name)}",
        f"summary = {_text(model.summary)}",
        f"reference = {_text(model.reference)}",
        f"doubts = {_list(model.doubts)}",
        f"unverified = {_list(model.unverified)}",
    ]
    sections = [needle_lines(model.needle)] if model.needle is not None else []
    if model.tissue is not None:
        sections.append(["[tissue]", *_numbers(model.tissue)])
    sections += _law_sections(model, "")
    for layer in model.deeper:
        sections += [["[[layers]]", f"top_m = {float(layer.top)!r}"], *_law_sections(layer, "layers.")]
    return "\n\n".join("\n".join(lines) for lines in [head, *sections]) + "\n"


def _law_sections(owner: Any, path: str) -> list[list[str]]:
    sections = []
    for family in FAMILIES:
        law = getattr(owner, family)
        sections.append([f"[{path}{family}]", f'law = "{law.name}"', *_numbers(law)])
        if "tip" in law.parts:
            sections.append(_tip(law.tip, f"{path}{family}"))
    return sections


def _list(texts: tuple[str, ...]) -> str:
    return "[" + "".join(f"\n  {_text(text)}," for text in texts) + ("\n]" if texts else "]")


def needle_lines(needle: Any) -> list[str]:
    """The section ``[needle]`` of a file, line by line."""
    lines = ["[needle]", *_numbers(needle)]
    if needle.tip is not None:
        lines += ["", *_tip(needle.tip, "needle")]
    return lines


def _tip(tip: Any, owner: str) -> list[str]:
    words = [f"{part} = {_text(getattr(tip, part))}" for part in tip.parts]
    return [f"[{owner}.tip]", f'shape = "{tip.name}"', *_numbers(tip), *words]


def _numbers(value: Any) -> list[str]:
    numbers = value.parameters()
    return [f"{si_key(row['name'], row['unit'])} = {_number(numbers[row['name']])}" for row in value.table()]


def _number(value: Any) -> str:
    return f"[{', '.join(repr(each) for each in value)}]" if isinstance(value, tuple) else repr(value)


def _text(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(f"\\u{ord(c):04X}" if ord(c) < 32 or ord(c) == 127 else c for c in escaped) + '"'
