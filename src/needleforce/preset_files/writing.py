# SPDX-License-Identifier: Apache-2.0
"""Writing of a model as a preset file, with every number in SI and to the last digit."""

import os
from typing import Any

from ..files import atomic_write
from ..models.laws import FAMILIES
from ..models.model import Model
from .schema import si_key


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
    sections += _laws(model, "")
    for layer in model.deeper:
        sections += [["[[layers]]", f"top_m = {float(layer.top)!r}"], *_laws(layer, "layers.")]
    return "\n\n".join("\n".join(lines) for lines in [head, *sections]) + "\n"


def _laws(owner: Any, path: str) -> list[list[str]]:
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
