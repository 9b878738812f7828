# SPDX-License-Identifier: Apache-2.0
"""Every recording of a file, every cycle of a recording, and those whose names fit a pattern."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..files import enough_memory
from .cycles import fitting
from .formats.detect import format_of
from .mappings import with_mapping
from .parts import asked, fitting_parts, recordings_in
from .reader import read, read_with_cycles
from .recording import Recording


def read_all(path: str | os.PathLike, *, part: str | int | None = None, **options: Any) -> list[Recording]:
    """Every recording of a file, in its order.

    Parameters
    ----------
    path : str or os.PathLike
        The file.
    part : str or int, optional
        Which of them, with ``*`` for any text: ``"B*"``. ``"cycle *"`` stands for every cycle of each recording.
    **options
        As for ``read``.

    Returns
    -------
    list of Recording

    Raises
    ------
    InputError
        As ``read``, for the first part that cannot be read.
    """
    return [read(path, part=each, **options) for each, _ in chosen_parts(path, part, **options)]


def chosen_parts(
    path: str | os.PathLike, wanted: str | int | None = None, **options: Any
) -> list[tuple[str | int | None, str]]:
    """The ``part`` of ``read`` and the name of each recording of a file that a name with ``*`` stands for, or ``all``.

    The part of the only recording of a file is None. Raises InputError if the file cannot be read, or none fits.
    """
    path, text = Path(path), "all" if wanted is None else str(wanted).strip()
    if text.casefold() != "all" and "*" not in text:
        return [(wanted, text)]
    given, _ = with_mapping(path, options.get("mapping"), {"columns": options.get("columns")})
    with enough_memory(path):
        parts = [] if format_of(path).log else recordings_in(path, given["columns"])
    names = [each.name for each in parts] or [""]
    known: list[tuple[str | int | None, str]] = [
        (k if len(names) > 1 else None, name) for k, name in enumerate(names, 1)
    ]
    pattern, cycle = asked(text, names)
    if not cycle:
        return _fitting(known, text, path)
    found = []
    for each, name in _fitting(known, pattern or "*", path):
        spans = read_with_cycles(path, **options | {"part": each})[1]
        cycles = [f"{name}: {span.name}" if name else span.name for span in fitting(spans, cycle, str(path))]
        found += [(text, text) for text in cycles]
    return found


def _fitting(
    known: Sequence[tuple[str | int | None, str]], pattern: str, path: Path
) -> list[tuple[str | int | None, str]]:
    """Those of the parts whose name fits a pattern."""
    return [known[number - 1] for number in fitting_parts([name for _, name in known], pattern, str(path))]
