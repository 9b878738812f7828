# SPDX-License-Identifier: Apache-2.0
"""Files: atomic writing of text, documents without the numbers that JSON cannot represent, and the format of a file by
its first bytes, independent of its name."""

import math
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, TextIO

from .errors import InputError

MCAP = b"\x89MCAP0\r\n"  # https://mcap.dev/spec
BAG = "metadata.yaml"  # in the folder of a ROS 2 bag
_MAGIC = {MCAP: "log", b"PAR1": "parquet"}


def checked_target(path: str | os.PathLike) -> Path:
    """The file to write, links resolved; InputError if its folder does not exist or it is a folder or a device."""
    try:
        target = Path(path).resolve()
        os.path.lexists(target) or os.stat(target)
    except FileNotFoundError:
        pass
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError("file to write", repr(str(path)[:80]), reason, next_step="Give another name.") from None
    if str(path) in ("", "."):
        raise InputError("file to write", repr(str(path)), "not the name of a file", next_step="Give a file name.")
    if not target.parent.is_dir():
        raise InputError("file", "not written", "its folder does not exist", str(target), "Make the folder first.")
    if target.exists() and not target.is_file():
        limit = "a folder or device of this name exists"
        raise InputError("file", "not written", limit, str(target), "Give another name.")
    return target


@contextmanager
def atomic_write(path: str | os.PathLike) -> Iterator[TextIO]:
    """A temporary UTF-8 text file that replaces ``path`` when the block ends: a reader finds the old or the new file.

    Raises InputError if it cannot be written; after any error the old file is unchanged.
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


def json_safe(value: Any) -> Any:
    """The same document with None for NaN and infinite numbers, and lists for arrays and tuples."""
    if isinstance(value, dict):
        return {key: json_safe(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [json_safe(each) for each in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return json_safe(value.tolist()) if hasattr(value, "tolist") else value


def format_of(path: Path) -> str:
    """``log`` for MCAP and for the folder of a ROS 2 bag, ``parquet``, otherwise ``text``.

    A file that cannot be read counts as ``text``; the text reader then reports the reason.
    """
    try:
        if (path / BAG).is_file():
            return "log"
        if not path.is_file():  # opening a pipe would block
            return "text"
        with open(path, "rb") as file:
            start = file.read(8)
    except (OSError, ValueError):
        return "text"
    return next((name for magic, name in _MAGIC.items() if start.startswith(magic)), "text")
