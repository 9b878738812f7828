# SPDX-License-Identifier: Apache-2.0
"""What each file of a campaign is of, and which are repeats of one another."""

import re
from collections.abc import Collection
from dataclasses import dataclass, field

from ..errors import InputError
from ..recording.reader import card_texts
from .labels import File, name_pattern, read_mapping, row_of

_CARD = ("needle", "tissue", "rig", "speed_mm_s", "pass")
NO_CONDITION = "Nothing assigns it to a condition, so it is identified by itself: {}."


@dataclass(frozen=True)
class Label:
    """What a file is of: ``fields`` as text, empty where nothing says so, then ``why`` does."""

    file: File
    fields: dict[str, str] = field(default_factory=dict)
    why: str = ""

    def condition(self, repeats: Collection[str]) -> dict[str, str]:
        """The fields that a condition is made of: all but those in which repeats differ."""
        return {name: value for name, value in self.fields.items() if name not in repeats}


def label_files(files: list[File], pattern: str | None, mapping) -> tuple[list[Label], list[str]]:
    """A label for each file, and sentences on rows of the mapping that are of no file.

    The name pattern counts first, then the mapping (a CSV file), then the card in the file. Raises InputError for a
    pattern that no file fits, naming one and what did not fit, and for a mapping that cannot be read.
    """
    form = None if pattern is None else name_pattern(pattern)
    known = {} if mapping is None else read_mapping(mapping)
    rows = {file: row_of(known, file) for file in files}
    labels = [_label(file, form, known.get(rows[file] or ""), mapping is not None) for file in files]
    if form is not None and not any(form.read(file.name)[0] for file in files):
        reason = f"it fits none of {len(files)} files; {files[0].name}: {form.read(files[0].name)[1]}"
        raise InputError("name pattern", repr(pattern), reason, next_step="Mend the pattern, or give a mapping.")
    unused = [name for name in known if name not in rows.values()]
    return labels, [f"The mapping names {name}, which is not among the files." for name in unused]


def grouped(labels: list[Label], repeats: Collection[str]) -> list[list[Label]]:
    """Labels with equal fields but for ``repeats``, in the order of the fields' values; then each without fields
    alone."""
    groups: dict[tuple, list[Label]] = {}
    for label in sorted(labels, key=lambda label: label.file):
        own = tuple(sorted(label.condition(repeats).items()))
        groups.setdefault((bool(label.fields), own) if label.fields else (False, label.file.name), []).append(label)
    return sorted(groups.values(), key=lambda group: _order(group[0], repeats))


def _label(file: File, form, row: dict[str, str] | None, mapped: bool) -> Label:
    fields, misfit = ({}, "") if form is None else form.read(file.name)
    if not fields and row:
        fields = row
    if not fields:
        fields = _of_card(file)
    if fields:
        return Label(file, fields)
    said = [f"its name does not fit {form.text}, as {misfit}"] if misfit else []
    said += ["the mapping does not name it"] if mapped else []
    said += ["it has no card"] if said else ["it has no card; give a name pattern or a mapping"]
    return Label(file, {}, NO_CONDITION.format(", ".join(said)))


def _of_card(file: File) -> dict[str, str]:
    """What the card in the file says of its condition; nothing where it cannot be read, which reading tells."""
    try:
        return card_texts(file.path, _CARD)
    except (InputError, OSError):
        return {}


def _order(label: Label, repeats: Collection[str]) -> tuple:
    """Numbers in names and values by their size: 2 before 10."""
    texts = [*label.condition(repeats).values(), label.file.name]
    return not label.fields, [[_number(part) for part in re.split(r"(\d+)", text)] for text in texts]


def _number(part: str) -> tuple[int, int, str]:
    return (1, int(part), part) if part.isdecimal() else (0, 0, part)
