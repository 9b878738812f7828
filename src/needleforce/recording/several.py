# SPDX-License-Identifier: Apache-2.0
"""Every recording of a file, every cycle of a recording, and those whose names fit a pattern."""

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from ..files import enough_memory
from .cycles import fitting
from .formats.detect import format_of
from .mappings import completed
from .options import ReadOptions, keywords_of
from .part_choice import asked, fitting_parts
from .parts import recordings_in
from .reader import read_file, read_with_cycles
from .recording import Recording

if TYPE_CHECKING:
    from .look import Look


@keywords_of(ReadOptions)
def read_all(path: str | os.PathLike, options: ReadOptions) -> "list[Recording | Look]":
    """Every recording of a file, in its order, or those that ``part`` stands for, with ``*`` for any text: ``"B*"``;
    ``"cycle *"`` stands for every cycle of each recording.

    Parameters
    ----------
    path : str or os.PathLike
        The file.
    options : ReadOptions
        The keywords.

    Returns
    -------
    list of Recording

    Raises
    ------
    InputError
        As ``read``, for the first part that cannot be read.
    """
    return [read_file(path, replace(options, part=part)) for part, _ in chosen_parts(path, options)]


def chosen_parts(path: str | os.PathLike, options: ReadOptions) -> list[tuple[str | int | None, str]]:
    """The ``part`` of ``read`` and the name of each recording of a file that a name with ``*`` stands for, or ``all``.

    The part of the only recording of a file is None. Raises InputError if the file cannot be read, or none fits.
    """
    path, wanted = Path(path), options.part
    text = "all" if wanted is None else str(wanted).strip()
    if text.casefold() != "all" and "*" not in text:
        return [(wanted, text)]
    given, _ = completed(path, options)
    with enough_memory(path):
        parts = [] if format_of(path).log else recordings_in(path, given.columns)
    names = [each.name for each in parts] or [""]
    known: list[tuple[str | int | None, str]] = [
        (k if len(names) > 1 else None, name) for k, name in enumerate(names, 1)
    ]
    pattern, cycle = asked(text, names)
    if not cycle:
        return _fitting(known, text, path)
    found = []
    for each, name in _fitting(known, pattern or "*", path):
        spans = read_with_cycles(path, replace(options, part=each))[1]
        cycles = [f"{name}: {span.name}" if name else span.name for span in fitting(spans, cycle, str(path))]
        found += [(text, text) for text in cycles]
    return found


def _fitting(
    known: Sequence[tuple[str | int | None, str]], pattern: str, path: Path
) -> list[tuple[str | int | None, str]]:
    """Those of the parts whose name fits a pattern."""
    return [known[number - 1] for number in fitting_parts([name for _, name in known], pattern, str(path))]
