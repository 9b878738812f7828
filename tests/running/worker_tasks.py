# SPDX-License-Identifier: Apache-2.0
"""Functions that workers import."""

import os
import signal
import time
from pathlib import Path

import needleforce as nf


def square(number: int) -> int:
    if number == 5:
        raise nf.InputError("number", 5, "it is five", "here", "Give another.")
    if number == 6:
        raise KeyError("six")
    return number * number


def deadly(number: int) -> int:
    """Ends the process that does number 7."""
    if number == 7:
        os.kill(os.getpid(), signal.SIGKILL)
    return number * number


def slow(folder: str) -> int:
    """Leaves a file with the name of its process, and takes a while."""
    Path(folder, str(os.getpid())).touch()
    time.sleep(0.3)
    return os.getpid()


def large(number: int) -> object:
    return lambda: number  # which cannot be sent back
