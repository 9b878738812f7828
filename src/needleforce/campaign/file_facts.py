# SPDX-License-Identifier: Apache-2.0
"""What a campaign knows of a file before it identifies anything: whether it can be read, its recordings, the fields in
its card, and the speed of its strokes. A worker reads the file for it, and only this comes back."""

import math
import os
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..files import digest
from ..recording.options import ReadOptions
from ..recording.reader import chosen_parts, open_file
from ..segmentation.strokes import cycles
from .folder_files import File
from .labels import card_entries

SETTLED_S = 2.0  # [s] a file changed later than this before it was read may change again within its time stamp


@dataclass(frozen=True, kw_only=True)
class FileFacts:
    """What is known of a file.

    Parameters
    ----------
    parts : tuple of (part, str or None)
        The ``part`` of ``read`` and the name of each recording, or of those that the options stand for; the name is
        None if the file cannot be opened, which is reported when it is read.
    speed : float
        The median speed [m/s] of its first insertion; NaN without one, or if it is not needed.
    card : dict
        The fields in its card.
    motion : str
        The file of the same folder with its motion; empty without one.
    problem : str
        Why it is not a recording; empty if it is used.
    content : str
        The digest of its content; empty if it cannot be read, or is not needed.
    stamp : tuple of int
        Size and times of change when it was read; empty if it may have changed since without a trace.
    is_there : bool
        Whether the worker found it.
    seconds : float
        How long it took to read it [s].
    """

    parts: tuple[tuple[str | int | None, str | None], ...] = ()
    speed: float = math.nan
    card: dict[str, str] = field(default_factory=dict)
    motion: str = ""
    problem: str = ""
    content: str = ""
    stamp: tuple[int, ...] = ()
    is_there: bool = True
    seconds: float = 0.0

    def recordings(self, file: File) -> list[File]:
        """Every recording of the file as a file; the file itself if it has one."""
        return [
            replace(file, part=part) if name is None
            else File(f"{file.name}: {name}", file.path, part, name) if part else file
            for part, name in self.parts
        ]  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class FileTask:
    """What a worker needs to read a file: where it is, how it is read, whether it is used also if it cannot be, whether
    the speed of a file without card is needed, and whether what is found is kept."""

    file: File
    reading: ReadOptions
    is_used: bool
    speeds: bool
    kept: bool


def facts_of(task: FileTask) -> FileFacts:
    """Read a file. No content raises an error."""
    path, began = task.file.path, time.time_ns()
    before = stamp_of(path) if task.kept else ()
    content = content_of(path) if task.kept else ""
    problem = "" if task.is_used else _problem(path, replace(task.reading, part=None))
    if problem:
        known = FileFacts(problem=problem)
    else:
        card, motion = _readable(lambda: card_entries(path), ({}, ""))
        parts = _readable(lambda: tuple(chosen_parts(path, task.reading)), ((task.reading.part, None),))
        bare = task.speeds and not card and len(parts) == 1 and not parts[0][1]
        speed = _speed(path, replace(task.reading, part=parts[0][0])) if bare else math.nan
        known = FileFacts(parts=parts, speed=speed, card=card, motion=motion)
    settled = before and began - max(before[1:]) > SETTLED_S * 1e9 and before == stamp_of(path)
    return replace(
        known,
        content=content,
        stamp=before if content and settled else (),
        is_there=os.path.exists(path),
        seconds=1e-9 * (time.time_ns() - began),
    )


def content_of(path: Path) -> str:
    """The digest of a file; empty if it cannot be read."""
    return _readable(lambda: digest(path) if path.is_file() else "", "")


def _readable(read: Callable[[], Any], otherwise: Any) -> Any:
    """What is read of a file, or what stands for it if it cannot be read."""
    try:
        return read()
    except (InputError, OSError):
        return otherwise


def stamp_of(path: Path) -> tuple[int, ...]:
    """Size and times of change [ns]; empty if the file is not there."""
    try:
        found = os.stat(path)
    except (OSError, ValueError):
        return ()
    return found.st_size, found.st_mtime_ns, found.st_ctime_ns


def _problem(path: Path, options: ReadOptions) -> str:
    """Why a file cannot be read as a recording; empty if it can."""
    try:
        opened = open_file(path, options)
        opened.read(opened.chosen()[0][0])
    except (InputError, OSError) as error:
        return str(error).replace(f"{path}: ", "").replace(f"{path}, ", "")
    return ""


def _speed(path: Path, options: ReadOptions) -> float:
    """The median speed [m/s] of the first insertion; NaN without one."""
    try:
        recording = open_file(path, options).read(options.part)[0]
    except (InputError, OSError):
        return math.nan
    strokes = cycles(recording.time, recording.depth)
    return float(np.median(recording.velocity[strokes[0].start : strokes[0].stop])) if strokes else math.nan
