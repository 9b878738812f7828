# SPDX-License-Identifier: Apache-2.0
"""Which files a campaign is made of, and what is known of each: fields read from its name by a pattern such as
``{specimen}_{speed_mm_s}_{repeat}``, or from a CSV table with a column ``file``."""

import csv
import glob
import os
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from ..errors import InputError

EXTENSIONS = (".csv", ".tsv", ".txt", ".dat", ".parquet", ".mcap")
_EXAMPLE = "Write for example {specimen}_{speed_mm_s}_{repeat}."
_NEXT = "Give a CSV table with a column file, and one column for each field."
COLUMNS = ("file", "pooled", "status", "quantity", "value", "low", "high", "unit", "identifiable", "outlier", "why")
"""The table's own columns: a field of the same name would hide one."""
REPEATS = ("repeat", "date", "file", "time", "run")
"""Fields in which repeats of one condition differ."""


@dataclass(frozen=True, order=True)
class File:
    """A file by its ``name``: its path below the folder that all files share, with ``/`` on every system."""

    name: str
    path: Path


def find_files(source: str | os.PathLike | Iterable[str | os.PathLike]) -> list[File]:
    """The files of a folder (with its subfolders), of a glob, or of a list of files, folders and globs; each once.

    Of a folder only those with one of ``EXTENSIONS`` count; a file that is named counts whatever it is called, so that
    one that is not there is told with the rest. Sorted by name. Raises InputError where a folder or glob holds none.
    """
    given = [source] if isinstance(source, str | os.PathLike) else list(source)
    paths = sorted({Path(os.path.abspath(path)) for each in given for path in _expanded(each)})
    if not paths:
        raise InputError("source", "empty", "nothing to identify", next_step="Give a folder, a glob or files.")
    common = Path(os.path.commonpath([path.parent for path in paths]))
    return sorted(File(path.relative_to(common).as_posix(), path) for path in paths)


def _expanded(given: str | os.PathLike) -> list[Path]:
    path, text = Path(given), os.fspath(given)
    if path.is_dir():
        found = [each for each in path.rglob("*") if each.suffix.lower() in EXTENSIONS and _visible(each, path)]
        return found or _refuse(text, f"a folder without recordings: {', '.join(EXTENSIONS)} are looked for")
    if path.exists() or not glob.has_magic(text):
        return [path]
    found = [Path(each) for each in glob.glob(text, recursive=True) if Path(each).is_file()]
    return found or _refuse(text, "a pattern that no file fits")


def _visible(path: Path, folder: Path) -> bool:
    return path.is_file() and not any(part.startswith(".") for part in path.relative_to(folder).parts)


def _refuse(text: str, why: str):
    raise InputError("source", repr(text), why, next_step="Check the place, or name the files themselves.")


@dataclass(frozen=True)
class NamePattern:
    """The ``fields`` of a pattern, the text before each of them in ``between``, and the text after the last one."""

    text: str
    fields: tuple[str, ...]
    between: tuple[str, ...]
    after: str

    def read(self, name: str) -> tuple[dict[str, str], str]:
        """The fields in a file's name below the campaign's folder, and why there are none: one of the two is empty.

        Names are read from their end: a field goes back to the last separator of its kind, and the first field takes
        what is left, separators and all. A ``_`` within a ``__`` is no ``_`` where the pattern has both, and no field
        but the first holds a separator longer than the one before it. The ending of a file need not be in the pattern;
        a pattern with folders is held against as many of the file's.
        """
        rest = _comparable(name, self.text)
        if rest is None:
            return {}, f"it lies in fewer folders than {self.text}"
        if not rest.endswith(self.after):
            return {}, f"'{rest}' does not end with '{self.after}'"
        rest, found = rest.removesuffix(self.after), {}
        for field, separator in reversed(list(zip(self.fields[1:], self.between[1:]))):
            place = _last(rest, separator, self.between[1:])
            if place < 0:
                return {}, f"there is no '{separator}' before {{{field}}} in '{rest}'"
            found[field], rest = rest[place + len(separator) :], rest[:place]
            wrong = self._fault(field, found[field], separator)
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
        return {name: found[name] for name in self.fields}, ""

    def _fault(self, field: str, value: str, separator: str) -> str:
        if not value:
            return f"{{{field}}} would be empty"
        longer = (each for each in self.between[1:] if len(each) > len(separator) and each in value)
        held = next(longer, "/" if "/" in value else "")
        return f"{{{field}}} would be '{value}', which holds a '{held}'" if held else ""


def name_pattern(text: str) -> NamePattern:
    """The pattern that ``text`` spells. Raises InputError for one without fields, or whose fields cannot be told
    apart."""
    pieces = re.split(r"\{([^{}]*)\}", text)
    fields, literals = tuple(pieces[1::2]), pieces[0::2]
    if not fields or any("{" in literal or "}" in literal for literal in literals):
        raise InputError("name pattern", repr(text), "fields stand in braces", next_step=_EXAMPLE)
    if "" in literals[1:-1]:
        where = fields[literals.index("", 1)]
        raise InputError("name pattern", repr(text), f"nothing parts {{{where}}} from the field before it")
    check_fields(fields, f"name pattern {text!r}")
    return NamePattern(text, fields, tuple(literals[:-1]), literals[-1])


def _comparable(name: str, pattern: str) -> str | None:
    """As much of a file's name as the pattern speaks of; None if that is more than it has."""
    path = PurePosixPath(name)
    parts = path.parts if path.suffix and pattern.endswith(path.suffix) else (*path.parts[:-1], path.stem)
    wanted = pattern.count("/") + 1
    return "/".join(parts[-wanted:]) if wanted <= len(parts) else None


def _last(text: str, separator: str, separators: tuple[str, ...]) -> int:
    """Where the last ``separator`` in ``text`` stands that is no part of a longer one; -1 if there is none."""
    longer = {each for each in separators if separator in each and each != separator}
    for each in sorted(longer, key=len, reverse=True):
        text = text.replace(each, "\0" * len(each))
    return text.rfind(separator)


def read_mapping(path: str | os.PathLike) -> dict[str, dict[str, str]]:
    """File name, as it stands in the table -> its fields, those that are not empty.

    Comma, semicolon or tab between the columns. Raises InputError for a table without the column ``file``, a row of
    another length, or a file in two rows.
    """
    place, rows = str(path), _rows(Path(path))
    head = [cell.strip() for cell in rows[0][1]] if rows else []
    if "file" not in head:
        raise InputError("column file", "missing", f"the columns are {', '.join(head) or 'none'}", place, _NEXT)
    check_fields([name for name in head if name != "file"], place)
    found: dict[str, dict[str, str]] = {}
    for line, cells in rows[1:]:
        if len(cells) != len(head):
            raise InputError("row", f"{len(cells)} cells", f"the header has {len(head)}", f"{place}, line {line}")
        fields = {name: cell.strip() for name, cell in zip(head, cells)}
        name = fields.pop("file").replace("\\", "/").removeprefix("./")
        if name in found:
            raise InputError("file", repr(name), "stands in two rows", f"{place}, line {line}", "Keep one of the two.")
        found[name] = {field: value for field, value in fields.items() if value}
    return found


def row_of(mapping: dict[str, dict[str, str]], file: File) -> str | None:
    """The file as the table names it: by its whole name, the end of its path, or either without the ending."""
    name = PurePosixPath(file.path.as_posix())
    for path in (name, name.with_suffix("")):
        parts = path.parts
        for first in range(len(parts)):
            ending = "/".join(parts[first:])
            if ending in mapping:
                return ending
    return None


def _rows(path: Path) -> list[tuple[int, list[str]]]:
    """The rows that hold something, with their lines."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError("mapping", "not read", str(getattr(error, "strerror", error)), str(path), _NEXT) from None
    head = text.split("\n", 1)[0]
    reader = csv.reader(text.splitlines(), delimiter=max(",;\t", key=head.count))
    return [(reader.line_num, row) for row in reader if any(cell.strip() for cell in row)]


def check_fields(names: Iterable[str], place: str) -> None:
    """Raises InputError for a field without a proper name, named twice, or named like a column of the table."""
    seen = set()
    for name in names:
        if not re.fullmatch(r"[^\W\d][\w -]*", name):
            raise InputError("field", repr(name), "a name of letters, digits and _ is needed", place)
        if name in COLUMNS:
            raise InputError("field", repr(name), "the table has a column of this name", place, "Name it otherwise.")
        if name in seen:
            raise InputError("field", repr(name), "stands there twice", place, "Give each field its own name.")
        seen.add(name)
