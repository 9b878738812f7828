# SPDX-License-Identifier: Apache-2.0
"""One session at a time in a folder: a second one would take the first one's open recording for an interrupted one."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ..errors import InputError


@contextmanager
def alone(folder: Path) -> Iterator[None]:
    """Hold the folder until the block, or the program, ends. Raises InputError where another session holds it.

    The lock is the system's and leaves no file; where the system has none for folders, nothing is held.
    """
    try:
        import fcntl
    except ImportError:
        yield
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            said = "another session records into it"
            raise InputError("folder", str(folder), said, next_step="Wait for its end, or end it.") from None
        yield
    finally:
        os.close(handle)
