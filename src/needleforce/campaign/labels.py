# SPDX-License-Identifier: Apache-2.0
"""The fields of a campaign's files, read from the names by a pattern such as ``{specimen}_{speed_mm_s}_{repeat}``, from
a CSV table with a column ``file``, from the cards in the files, or from the names by evidence."""

import csv
import io
import os
import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

from ..errors import InputError
from ..files import csv_original, enough_memory, file_name, read_text
from ..recording.card import Preamble
from ..recording.formats.detect import format_of, tables_of
from .field_inference import infer_fields
from .folder_files import File

_EXAMPLE = "Give for example {specimen}_{speed_mm_s}_{repeat}."
_NEXT = "Give a CSV table with a column named file and one column for each field."
_MAX_MAPPING_BYTES = 1 << 23  # a hundred thousand files
_MAX_FIELDS = 100
COLUMNS = ("file", "pooled", "status", "quantity", "value", "low", "high", "unit", "identifiable", "outlier",
           "residual_over_peak", "r2", "why")  # fmt: skip
"""Columns of the campaign's table, which cannot be names of fields."""
REPEATS = ("repeat", "date", "file", "time", "run", "part")
"""Default fields in which repeats of one condition differ."""

_CARD = ("needle", "tissue", "rig", "speed_mm_s", "pass")
NUMERIC_ENDINGS = ("_mm_s", "_m_s", "_mm_min", "_mm", "_um", "_deg", "_N", "_Hz", "_kPa")
"""Ends of the names of fields whose values are numbers, with their units."""
NO_CONDITION = "It belongs to no condition and is identified by itself: {}."


@dataclass(frozen=True)
class NamePattern:
    """A pattern: its ``fields``, the text before each of them (``between``), and the text after the last one."""

    text: str
    fields: tuple[str, ...]
    between: tuple[str, ...]
    after: str

    def read(self, name: str) -> tuple[dict[str, str], str]:
        """The fields in a file's name, and the reason if it does not match: one of the two is empty.

        Names are read from the end: a field extends back to the last separator of its kind, and the first field is the
        remainder, including separators. A ``_`` within ``__`` is not a separator ``_`` if the pattern has both, and
        only the first field may contain a separator longer than the one before it. The file's ending may be omitted
        from the pattern; a pattern with folders is compared with the same number of the file's folders.
        """
        rest = _comparable(name, self.text)
        if rest is None:
            return {}, f"it is in fewer folders than {self.text} has"
        if not rest.endswith(self.after):
            return {}, f"'{rest}' does not end with '{self.after}'"
        rest, found = rest.removesuffix(self.after), {}
        for name, separator in reversed(list(zip(self.fields[1:], self.between[1:]))):
            place = _last(rest, separator, self.between[1:])
            if place < 0:
                return {}, f"there is no '{separator}' before {{{name}}} in '{rest}'"
            found[name], rest = rest[place + len(separator) :], rest[:place]
            wrong = self._fault(name, found[name], separator)
            if wrong:
                return {}, wrong
        return self._first(rest, found)

    def _first(self, rest: str, found: dict[str, str]) -> tuple[dict[str, str], str]:
        lead, field = self.between[0], self.fields[0]
        if not rest.startswith(lead):
            return {}, f"'{rest}' does not begin with '{lead}'"
        if rest == lead:
            return {}, f"{{{field}}} would be empty"
        found[field] = rest.removeprefix(lead)
        if _no_number(field, found[field]):
            return {}, _no_number(field, found[field])
        return {name: found[name] for name in self.fields}, ""

    def _fault(self, field: str, value: str, separator: str) -> str:
        if not value:
            return f"{{{field}}} would be empty"
        if _no_number(field, value):
            return _no_number(field, value)
        longer = (each for each in self.between[1:] if len(each) > len(separator) and each in value)
        contained = next(longer, "/" if "/" in value else "")
        return f"{{{field}}} would be '{value}', which contains '{contained}'" if contained else ""


def _no_number(field: str, value: str) -> str:
    """Why a value does not fit a field with a unit in its name, so that fields never shift silently."""
    if not field.endswith(NUMERIC_ENDINGS) or re.fullmatch(r"[+-]?\d+([.,]\d+)?([eE][+-]?\d+)?", value):
        return ""
    return f"{{{field}}} would be '{value}', which is not a number"


def name_pattern(text: str) -> NamePattern:
    """Parse a pattern. Raises InputError for a pattern without fields, or without a separator between two fields."""
    pieces = re.split(r"\{([^{}]*)\}", text)
    fields, literals = tuple(pieces[1::2]), pieces[0::2]
    if not fields or any("{" in literal or "}" in literal for literal in literals):
        limit = "it needs at least one field in braces"
        raise InputError("name pattern", repr(text), limit, next_step=_EXAMPLE)
    if "" in literals[1:-1]:
        field = fields[literals.index("", 1)]
        limit = f"there is no separator between {{{field}}} and the field before it"
        raise InputError("name pattern", repr(text), limit, next_step="Add a separator, such as _.")
    check_fields(fields, f"name pattern {text!r}")
    return NamePattern(text, fields, tuple(literals[:-1]), literals[-1])


def _comparable(name: str, pattern: str) -> str | None:
    """The end of a file's path with as many folders as the pattern; None if the path has fewer."""
    path = PurePosixPath(name)
    parts = path.parts if path.suffix and pattern.endswith(path.suffix) else (*path.parts[:-1], path.stem)
    wanted = pattern.count("/") + 1
    return "/".join(parts[-wanted:]) if wanted <= len(parts) else None


def _last(text: str, separator: str, separators: tuple[str, ...]) -> int:
    """The index of the last ``separator`` in ``text`` that is not part of a longer one; -1 if there is none."""
    longer = {each for each in separators if separator in each and each != separator}
    for each in sorted(longer, key=len, reverse=True):
        text = text.replace(each, "\0" * len(each))
    return text.rfind(separator)


def read_mapping(path: str | os.PathLike) -> dict[str, dict[str, str]]:
    """Read a mapping: file name as given in the table -> its fields that are not empty.

    Columns are separated by comma, semicolon or tab. Raises InputError for a table without the column ``file``, a row
    with another number of cells, or a file in two rows.
    """
    place, rows = str(path), _rows(Path(path))
    head = [cell.strip() for cell in rows[0][1]] if rows else []
    if "file" not in head:
        raise InputError("column file", "missing", f"the columns are {', '.join(head) or 'none'}", place, _NEXT)
    check_fields([name for name in head if name != "file"], place)
    found: dict[str, dict[str, str]] = {}
    for line, cells in rows[1:]:
        if len(cells) != len(head):
            limit = f"the header has {len(head)}"
            raise InputError("number of cells", len(cells), limit, f"{place}, line {line}", "Correct the row.")
        fields = {name: csv_original(cell.strip()) for name, cell in zip(head, cells)}
        name = fields.pop("file").replace("\\", "/").removeprefix("./")
        if name in found:
            raise InputError("file", repr(name), "is in two rows", f"{place}, line {line}", "Keep one of the two.")
        found[name] = {field: value for field, value in fields.items() if value}
    return found


def row_of(mapping: dict[str, dict[str, str]], file: File) -> str | None:
    """The file's name in the table: its full path, the end of its path, or either without the ending."""
    name = PurePosixPath(file_name(file.path.as_posix()))
    for path in (name, name.with_suffix("")):
        parts = path.parts
        for first in range(len(parts)):
            ending = "/".join(parts[first:])
            if ending in mapping:
                return ending
    return None


def _rows(path: Path) -> list[tuple[int, list[str]]]:
    """The rows that are not empty, with their line numbers."""
    text = read_text(path, "mapping", _MAX_MAPPING_BYTES)
    head = text.split("\n", 1)[0]
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=max(",;\t", key=head.count))
    try:
        rows = [(reader.line_num, row) for row in reader if any(cell.strip() for cell in row)]
    except csv.Error as error:
        raise InputError("mapping", "not readable", str(error), f"{path}, line {reader.line_num}", _NEXT) from None
    if rows and len(rows[0][1]) > _MAX_FIELDS:
        raise InputError("number of columns", len(rows[0][1]), f"at most {_MAX_FIELDS} can be read", str(path), _NEXT)
    return rows


def check_fields(names: Iterable[str], place: str) -> None:
    """Raise InputError for an invalid field name, one that occurs twice, or one that is a column of the table."""
    found = set()
    for name in names:
        if not re.fullmatch(r"[^\W\d][\w -]*", name):
            limit = "a name of letters, digits and _ that starts with a letter is needed"
            raise InputError("field", repr(name), limit, place, "Rename it.")
        if name in COLUMNS:
            raise InputError("field", repr(name), "the table has a column of this name", place, "Rename it.")
        if name in found:
            raise InputError("field", repr(name), "occurs twice", place, "Give each field its own name.")
        found.add(name)


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
    files: list[File],
    pattern: str | None,
    mapping: str | os.PathLike | None,
    cards: Mapping[Path, dict[str, str]],
) -> tuple[list[Label], list[str]]:
    """A label for each file, and sentences on rows of the mapping without a file.

    The fields come from the name by the pattern, otherwise from the mapping (a CSV file), otherwise from the ``cards``:
    path -> fields in the card of the file. Raises InputError for a pattern that matches no file, with an example and
    the reason, and for a mapping that cannot be read.
    """
    form = None if pattern is None else name_pattern(pattern)
    known = {} if mapping is None else read_mapping(mapping)
    rows = {file: row_of(known, file) for file in files}
    labels = [
        _label(file, form, known.get(rows[file] or "") or cards.get(file.path, {}), mapping is not None)
        for file in files
    ]
    if form is not None and not any(form.read(file.file_name)[0] for file in files):
        reason = f"it matches none of {len(files)} files; {files[0].name}: {form.read(files[0].name)[1]}"
        raise InputError("name pattern", repr(pattern), reason, next_step="Correct the pattern, or give a mapping.")
    unused = [name for name in known if name not in rows.values()]
    return labels, [f"The mapping contains {name}, which is not among the files." for name in unused]


def inferred(labels: list[Label], speeds: Mapping[Path, float]) -> tuple[list[Label], list[str]]:
    """The labels with fields by evidence from the names for files without fields, and a note on what was decided.

    ``speeds`` are the insertion speeds [m/s] of the files, NaN for one that cannot be read.
    """
    bare = {label.file.name: label.file for label in labels if not label.fields}
    if len(bare) < 2:
        return labels, []
    found, note = infer_fields(list(bare), {name: speeds[file.path] for name, file in bare.items()})
    other = NO_CONDITION.format(
        "its name has another form than most, and it has no card; give a name pattern or a mapping"
    )
    made = {name: Label(file, found[name]) if name in found else Label(file, {}, other) for name, file in bare.items()}
    return [made.get(label.file.name, label) for label in labels] if found else labels, [note] * bool(found)


def grouped(labels: list[Label], repeats: Collection[str]) -> list[list[Label]]:
    """Groups of labels with equal fields except ``repeats``, sorted by the fields' values; then each label without
    fields in a group of its own."""
    groups: dict[tuple, list[Label]] = {}
    for label in sorted(labels, key=lambda label: label.file):
        own = tuple(sorted(label.condition(repeats).items()))
        groups.setdefault((bool(label.fields), own) if label.fields else (False, label.file.name), []).append(label)
    return sorted(groups.values(), key=lambda group: _order(group[0], repeats))


def _label(file: File, form: NamePattern | None, known: dict[str, str], mapped: bool) -> Label:
    """The label by the name, otherwise with the fields that are ``known`` from the mapping or the card."""
    fields, mismatch = ({}, "") if form is None else form.read(file.file_name)
    fields = fields or known
    if fields or file.part_name:  # the recordings of one file are repeats
        return Label(
            file, (fields or {"source": file.file_name}) | ({"part": file.part_name} if file.part_name else {})
        )
    reasons = [f"its name does not match {form.text}, because {mismatch}"] if mismatch else []
    reasons += ["it is not in the mapping"] if mapped else []
    reasons += ["it has no card"] if reasons else ["it has no card; give a name pattern or a mapping"]
    return Label(file, {}, NO_CONDITION.format(", ".join(reasons)))


def card_entries(path: Path) -> tuple[dict[str, str], str]:
    """Those of the entries in the card of a file of any format that are fields, and the file with its motion, empty
    without one. Raises InputError for a file that cannot be read."""
    if format_of(path).log:
        from ..recording.log.reader import card_and_end

        card = card_and_end(path)[0] if path.is_file() else {}  # the folder of a bag has no card
        return {key: card[key] for key in _CARD if card.get(key)}, ""
    with enough_memory(path):
        preamble = Preamble(tables_of(path)[0].comments, str(path))
    return {key: preamble.text(key) for key in _CARD if preamble.text(key)}, preamble.text("motion")


def _order(label: Label, repeats: Collection[str]) -> tuple:
    """A sort key with numbers in names and values ordered by size: 2 before 10."""
    texts = [*label.condition(repeats).values(), label.file.name]
    return not label.fields, [[_number(part) for part in re.split(r"(\d+)", text)] for text in texts]


def _number(part: str) -> tuple[int, int, str]:
    return (1, int(part), part) if part.isdecimal() else (0, 0, part)
