# SPDX-License-Identifier: Apache-2.0
"""A model becomes a preset file again, every number in SI and to the last digit."""

from ..model import Model
from ..whole_file import whole_file
from .schema import FAMILIES
from .units_in_keys import si_key


def save(model: Model, path) -> None:
    """Writes ``model`` as a preset file that ``preset(path)`` reads back equal."""
    with whole_file(path) as file:
        file.write(as_toml(model))


def as_toml(model: Model) -> str:
    """The text of the preset file."""
    head = [
        f"name = {_text(model.name)}",
        f"summary = {_text(model.summary)}",
        f"reference = {_text(model.reference)}",
        "doubts = [" + "".join(f"\n  {_text(doubt)}," for doubt in model.doubts) + ("\n]" if model.doubts else "]"),
    ]
    sections = [_needle(model.needle)] if model.needle is not None else []
    if model.tissue is not None:
        sections.append(["[tissue]", *_numbers(model.tissue)])
    for family in FAMILIES:
        law = getattr(model, family)
        sections.append([f"[{family}]", f'law = "{law.name}"', *_numbers(law)])
    return "\n\n".join("\n".join(lines) for lines in [head, *sections]) + "\n"


def _needle(needle) -> list[str]:
    lines = ["[needle]", *_numbers(needle)]
    if needle.tip is not None:
        lines += ["", "[needle.tip]", f'shape = "{needle.tip.name}"', *_numbers(needle.tip)]
    return lines


def _numbers(value) -> list[str]:
    numbers = value.parameters()
    return [f"{si_key(row['name'], row['unit'])} = {numbers[row['name']]!r}" for row in value.table()]


def _text(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(f"\\u{ord(c):04X}" if ord(c) < 32 or ord(c) == 127 else c for c in escaped) + '"'
