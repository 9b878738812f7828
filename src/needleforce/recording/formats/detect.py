# SPDX-License-Identifier: Apache-2.0
"""The format of a file by its content, independent of its name, and its tables by the module that declares it."""

import os
import re
from collections.abc import Iterable
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from ...errors import InputError, install_step
from ...files import BAG, open_regular
from . import Format

if TYPE_CHECKING:
    from ..table import Table

# each declares FORMATS; of two that fit a file, the first is its format
MODULES = (
    "excel",
    "jpk",
    "numpy_arrays",
    "parquet",
    "hdf5",
    "tdms",
    "nanosurf",
    "lvm",
    "json_lines",
    "matlab",
    "igor",
    "no_tables",
)
_SEARCHED_BYTES = 1 << 16  # at either end of a zip archive, where the names of its parts are
_ZIP = b"PK\x03\x04"
_PARTS_OF_SECOND = re.compile(r"(n|u|nano|micro)(sec|second)s?\W*$", re.IGNORECASE)  # the end of a header
_STORAGE = ("*.db3", "*.mcap")  # files of a ROS 2 bag


@cache
def declared() -> tuple[Format, ...]:
    """The formats that the modules declare. Raises InputError for one that is incomplete, or declared twice."""
    formats: list[Format] = []
    for module in MODULES:
        for each in import_module(f".{module}", __package__).FORMATS:
            check_declaration(each, formats, f"{module}.py")
            formats.append(each)
    return tuple(formats)


def check_declaration(form: Format, others: Iterable[Format], place: str) -> None:
    """Raise InputError for a format that lacks a part of its declaration, or that one of the ``others`` is, too."""
    step = f"Complete its declaration in recording/formats/{place}; template.py explains the parts."
    missing = {
        "name": not form.name,
        "suffixes": not form.suffixes,
        "starts, member or matches": not (form.starts or form.member or form.matches),
        "tables": not (form.tables or form.log or form.advice),
        "package": form.extra != "" and not form.package,
    }
    for part, is_missing in missing.items():
        if is_missing:
            raise InputError(f"{part} of the format {form.name!r}", "missing", "", place, step)
    for other in others:
        marks = {"name": form.name == other.name, "member": form.member != b"" and form.member == other.member}
        marks["starts"] = any(a.startswith(b) or b.startswith(a) for a in form.starts for b in other.starts)
        for part in (part for part, is_same in marks.items() if is_same):
            value, limit = repr(getattr(form, part)), f"the format {other.name!r} has it, too"
            raise InputError(f"{part} of the format {form.name!r}", value, limit, place, "Declare each format once.")


def format_of(path: Path) -> Format:
    """The format of a file or of the folder of a bag; ``TEXT`` for a file that cannot be read or that no other fits."""
    from .no_tables import ARCHIVE, ROS2_BAG
    from .text import TEXT

    formats = declared()
    try:
        if (path / BAG).is_file():
            return ROS2_BAG
        with open_regular(path) as file:
            start = file.read(_SEARCHED_BYTES)
            if start.startswith(_ZIP):
                file.seek(max(0, os.fstat(file.fileno()).st_size - _SEARCHED_BYTES))
                ends = start, file.read(_SEARCHED_BYTES)
                zipped = (each for each in formats if each.member and any(each.member in end for end in ends))
                return next(zipped, ARCHIVE)
    except (OSError, ValueError):  # InputError is a ValueError
        return TEXT
    fitting = (each for each in formats if start.startswith(each.starts) or (each.matches and each.matches(start)))
    return next(fitting, TEXT)


def tables_of(path: Path) -> "list[Table]":
    """The tables of a file that is not a log, in the order of the file.

    Raises InputError for a format that is recognised and not read, a missing package, and a damaged file.
    """
    form = format_of(path)
    if path.is_dir() and any(next(path.glob(pattern), None) for pattern in _STORAGE):
        limit, step = f"it has no {BAG}", f"Make it with ros2 bag reindex {path}, or name an mcap file in it."
        raise InputError("ROS 2 bag", "without an index", limit, str(path), step)
    if form.tables is None:
        raise InputError("file", form.name, "a table of numbers is needed", str(path), form.advice)
    try:
        tables = _tables(form, path)
    except ImportError as error:
        limit = f"reading {form.name} needs the package {error.name}"
        step = install_step(str(error.name), form.extra)
        raise InputError(f"package {error.name}", "missing", limit, str(path), step) from None
    if any(_PARTS_OF_SECOND.search(header) for table in tables for header in table.headers):
        from .clock_times import join_stamps

        return [join_stamps(table) for table in tables]
    return tables


def _tables(form: Format, path: Path) -> "list[Table]":
    if not form.limited:
        return form.tables(path)
    from .worker import tables_by_worker

    return tables_by_worker(form, path)
