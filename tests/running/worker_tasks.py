# SPDX-License-Identifier: Apache-2.0
"""Functions that workers import."""

import os
import signal
import time
from multiprocessing.connection import Connection
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


def torn(task: tuple[str, str]) -> bytes:
    """An answer of which half is sent: then its process is killed, or it leaves a file and waits for ever."""
    end, made = task

    def half(pipe: Connection, content: bytes) -> None:
        os.write(pipe.fileno(), content[: len(content) // 2])
        if end == "killed":
            os.kill(os.getpid(), signal.SIGKILL)
        Path(made).touch()
        signal.pause()

    if end != "whole":
        Connection._send = half
    return bytes(100_000)
