# SPDX-License-Identifier: Apache-2.0
"""The files of a campaign: every visible file of its folders, with those that may be recordings apart from the rest."""

import glob
import os
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

from ..errors import InputError
from ..files import file_name, leads_out
from ..recording.formats.detect import ARCHIVE, JSON, TEXT, format_of
from ..state_folder import STATE, is_state_folder

_LINK = "it is a link that leads out of the folder; name it, or follow links"
EXTENSIONS = (".csv", ".tsv", ".txt", ".dat", ".parquet", ".mcap")
_PART = re.compile(r"\.part\d{4}(?=\.mcap$)")


@dataclass(frozen=True, order=True)
class File:
    """A file, or one of several recordings in it; ``name`` is its path relative to the common folder of all files, with
    ``/`` on every system, and after a colon the name of the recording, which ``part`` is for ``nf.read``; ``why`` is
    the reason for which it is not read."""

    name: str
    path: Path
    part: str | int | None = None
    part_name: str = ""
    why: str = ""

    @property
    def file_name(self) -> str:
        """The name of the file alone."""
        return self.name.removesuffix(f": {self.part_name}") if self.part_name else self.name


def find_files(
    source: str | os.PathLike | Iterable[str | os.PathLike], follow_links: bool = False
) -> tuple[list[File], list[File]]:
    """The recordings of a folder (with its subfolders), of a glob, or of a list of files, folders and globs, and the
    other visible files of the folders, both by name.

    Recordings of a folder are the files with one of ``EXTENSIONS`` and those in a format that holds recordings; a file
    that is given by its name is always used, so that a missing one is part of the result. What starts with a dot is not
    visible, a folder that keeps the results of tasks has no files, and links that lead out of a folder are not opened
    unless ``follow_links``. Raises InputError if a folder or glob contains no file.
    """
    given = [source] if isinstance(source, str | os.PathLike) else list(source)
    found: dict[Path, bool] = {}
    links: set[Path] = set()
    for each in given:
        for path, is_named in _expanded(each):
            outside = not is_named and not follow_links and leads_out(path, Path(each))
            path = Path(os.path.abspath(path))
            links |= {path} if outside else set()
            found[path] = found.get(path, False) or is_named or path.suffix.lower() in EXTENSIONS
    first = {path: path.with_name(_PART.sub("", path.name)) for path in found}  # which is read with what continues it
    found = {path: known for path, known in found.items() if first[path] == path or first[path] not in found}
    if not found:
        raise InputError("source", "empty", "no file to identify", next_step="Give a folder, a glob or files.")
    common = Path(os.path.commonpath([path.parent for path in found]))
    used = {path: path not in links and (known or format_of(path) not in (TEXT, JSON, ARCHIVE))
            for path, known in found.items()}  # fmt: skip
    named = {path: File(file_name(path.relative_to(common).as_posix()), path, why=_LINK if path in links else "")
             for path in found}  # fmt: skip
    recordings, others = (sorted(named[path] for path in found if used[path] is wanted) for wanted in (True, False))
    return recordings, others


def _expanded(given: str | os.PathLike) -> list[tuple[Path, bool]]:
    """The files, each with whether it was named by the caller: by its name or by a glob."""
    path, text = Path(given), os.fspath(given)
    if path.is_dir():
        states = [each.parent for each in path.rglob(STATE) if is_state_folder(each.parent)]
        visible = (each for each in path.rglob("*") if _visible(each, path))
        found = [(each, False) for each in visible if not any(state in each.parents for state in states)]
        own = path in states  # of a glob that a shell expanded: the results of the campaign before
        return found if found or own else _refuse(text, f"a folder without recordings ({', '.join(EXTENSIONS)})")
    if path.exists() or not glob.has_magic(text):
        return [(path, True)]
    found = [(Path(each), True) for each in glob.glob(text, recursive=True) if Path(each).is_file()]
    return found or _refuse(text, "no file matches this glob")


def _visible(path: Path, folder: Path) -> bool:
    return path.is_file() and not any(part.startswith(".") for part in path.relative_to(folder).parts)


def _refuse(text: str, reason: str) -> NoReturn:
    raise InputError("source", repr(text), reason, next_step="Check the folder, or name the files.")
