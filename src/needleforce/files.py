# SPDX-License-Identifier: Apache-2.0
"""Files that are written whole or not at all, and documents without numbers that JSON cannot represent."""

import math
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TextIO

from .errors import InputError


def checked_target(path) -> Path:
    """The file that would be written, links followed; InputError if it cannot be: no folder, a folder itself, a
    device."""
    try:
        target = Path(path).resolve()
        os.path.lexists(target) or os.stat(target)
    except FileNotFoundError:
        pass
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError("file to write", repr(str(path)[:80]), reason, next_step="Give another name.") from None
    if str(path) in ("", "."):
        raise InputError("file to write", repr(str(path)), "has no name", next_step="Give a file.")
    if not target.parent.is_dir():
        raise InputError("file", "not written", "there is no such folder", str(target), "Make the folder first.")
    if target.exists() and not target.is_file():
        raise InputError(
            "file", "not written", "there is something that is no plain file", str(target), "Name another."
        )
    return target


@contextmanager
def atomic_write(path) -> Iterator[TextIO]:
    """A UTF-8 text file beside ``path`` that takes its place when the block ends: a reader sees the old file or the
    new one.

    Raises InputError where it cannot be written; after any error the old file stands as it was.
    """
    target = checked_target(path)
    part = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        with open(part, "w", encoding="utf-8", newline="\n", errors="replace") as file:
            yield file
        os.replace(part, target)
    except OSError as error:
        raise InputError("file", "not written", error.strerror or "", str(target), "Check the folder.") from None
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)


def json_safe(value):
    """The same document with None for what JSON cannot say."""
    if isinstance(value, dict):
        return {key: json_safe(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [json_safe(each) for each in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return json_safe(value.tolist()) if hasattr(value, "tolist") else value
