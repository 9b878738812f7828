# SPDX-License-Identifier: Apache-2.0
"""Labels of the files of a campaign, and their grouping into repeats of one condition."""

import os
import re
from collections.abc import Collection
from dataclasses import dataclass, field

from ..errors import InputError
from ..recording.reader import card_texts
from .labels import File, NamePattern, name_pattern, read_mapping, row_of

_CARD = ("needle", "tissue", "rig", "speed_mm_s", "pass")
NO_CONDITION = "It belongs to no condition and is identified by itself: {}."


@dataclass(frozen=True)
class Label:
    """The label of a file: its ``fields`` as text; if they are empty, ``why`` gives the reason."""

    file: File
    fields: dict[str, str] = field(default_factory=dict)
    why: str = ""

    def condition(self, repeats: Collection[str]) -> dict[str, str]:
        """The fields that define a condition: all except those in which repeats differ."""
        return {name: value for name, value in self.fields.items() if name not in repeats}


def label_files(
    files: list[File], pattern: str | None, mapping: str | os.PathLike | None
) -> tuple[list[Label], list[str]]:
    """A label for each file, and sentences on rows of the mapping without a file.

    The fields come from the name by the pattern, otherwise from the mapping (a CSV file), otherwise from the card in
    the file. Raises InputError for a pattern that matches no file, with an example and the reason, and for a mapping
    that cannot be read.
    """
    form = None if pattern is None else name_pattern(pattern)
    known = {} if mapping is None else read_mapping(mapping)
    rows = {file: row_of(known, file) for file in files}
    labels = [_label(file, form, known.get(rows[file] or ""), mapping is not None) for file in files]
    if form is not None and not any(form.read(file.name)[0] for file in files):
        reason = f"it matches none of {len(files)} files; {files[0].name}: {form.read(files[0].name)[1]}"
        raise InputError("name pattern", repr(pattern), reason, next_step="Correct the pattern, or give a mapping.")
    unused = [name for name in known if name not in rows.values()]
    return labels, [f"The mapping contains {name}, which is not among the files." for name in unused]


def grouped(labels: list[Label], repeats: Collection[str]) -> list[list[Label]]:
    """Groups of labels with equal fields except ``repeats``, sorted by the fields' values; then each label without
    fields in a group of its own."""
    groups: dict[tuple, list[Label]] = {}
    for label in sorted(labels, key=lambda label: label.file):
        own = tuple(sorted(label.condition(repeats).items()))
        groups.setdefault((bool(label.fields), own) if label.fields else (False, label.file.name), []).append(label)
    return sorted(groups.values(), key=lambda group: _order(group[0], repeats))


def _label(file: File, form: NamePattern | None, row: dict[str, str] | None, mapped: bool) -> Label:
    fields, mismatch = ({}, "") if form is None else form.read(file.name)
    if not fields and row:
        fields = row
    if not fields:
        fields = _of_card(file)
    if fields:
        return Label(file, fields)
    reasons = [f"its name does not match {form.text}, because {mismatch}"] if mismatch else []
    reasons += ["it is not in the mapping"] if mapped else []
    reasons += ["it has no card"] if reasons else ["it has no card; give a name pattern or a mapping"]
    return Label(file, {}, NO_CONDITION.format(", ".join(reasons)))


def _of_card(file: File) -> dict[str, str]:
    """The fields of the card in the file; empty if it cannot be read, which is reported when the file is read."""
    try:
        return card_texts(file.path, _CARD)
    except (InputError, OSError):
        return {}


def _order(label: Label, repeats: Collection[str]) -> tuple:
    """A sort key with numbers in names and values ordered by size: 2 before 10."""
    texts = [*label.condition(repeats).values(), label.file.name]
    return not label.fields, [[_number(part) for part in re.split(r"(\d+)", text)] for text in texts]


def _number(part: str) -> tuple[int, int, str]:
    return (1, int(part), part) if part.isdecimal() else (0, 0, part)
