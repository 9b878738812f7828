# SPDX-License-Identifier: Apache-2.0
"""Which files a campaign is made of, in an order that does not depend on how they were given."""

import glob
import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from ..errors import InputError

EXTENSIONS = (".csv", ".tsv", ".txt", ".dat", ".parquet", ".mcap")


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
