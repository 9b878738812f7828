# SPDX-License-Identifier: Apache-2.0
"""Fields of files from a CSV table with a column ``file``."""

import csv
import os
from pathlib import Path, PurePosixPath

from ..errors import InputError
from .field_names import check_fields
from .files import File

_NEXT = "Give a CSV table with a column file, and one column for each field."


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
