# SPDX-License-Identifier: Apache-2.0
"""A process of its own for libraries that never return, crash, or take all memory, on some damaged files: nothing
within one process can end a library that is written in C or Rust.

The process is started once, reads one file after another, and is started again after a file that it does not survive.
A request is a line of JSON; the answer is its length in eight bytes, a line of JSON, and the values of a column.
"""

import atexit
import contextlib
import json
import os
import select
import signal
import struct
import subprocess
import sys
import threading
from collections.abc import Iterator
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from ...errors import InputError
from ...files import enough_memory, open_regular
from ..recording import Note
from ..table import Table
from . import Format

_TIME_S = 5.0  # of the processor for one file, and more for a large one
_MEMORY_BYTES = 3 << 29  # address space for one file, beyond that of the process
_MEMORY_PER_BYTE = 60  # more for each byte of it
_KEPT_S = 5.0  # that a file stays open after the last request
_WALL_FACTOR = 8.0  # on a computer that is busy with other things
_POLLS = hasattr(select, "poll")  # elsewhere a thread waits; to start one takes longer than to read a small column
_LENGTH = struct.Struct("<Q")
_PARTS = ("quantity", "value", "limit", "place", "next_step")
_PLAIN = ("headers", "units", "name", "sha256", "row_name", "first_row", "has_header", "preamble")  # parts of a table
_START = f"import json, sys; sys.path[:] = json.loads(sys.argv[1]); from {__name__} import serve; serve()"


def tables_by_worker(form: Format, path: Path) -> list[Table]:
    """The tables of a file that the module of its format gives in the other process.

    Raises InputError as it does, and for a file with which the process ends, or takes too much time or memory;
    ImportError without the package of the format.
    """
    if form.package and find_spec(form.package) is None:
        raise ImportError(name=form.package)
    if not sys.executable:  # within a program that cannot start a second Python
        return import_module(form.module, __package__).tables(path)
    path = Path(os.path.abspath(path))
    request = {"module": form.module, "bytes_per_s": form.bytes_per_s}
    answer, _ = _worker.ask(path, form.name, request)
    return [_table(path, form.name, request | {"table": number}, each) for number, each in enumerate(answer["tables"])]


def _table(path: Path, what: str, request: dict[str, Any], stated: dict[str, Any]) -> Table:
    """A table whose values are asked for when they are used."""

    def read_from(index: int, first: int) -> np.ndarray:
        asked = request | {"column": index, "first": first}
        return np.frombuffer(_worker.ask(path, what, asked)[1])  # of its own and writable

    def read_texts(index: int) -> list[str]:
        return _worker.ask(path, what, request | {"texts": index})[0]["texts"]

    facts = {name: stated[name] for name in _PLAIN}
    return Table(
        path=path,
        comments=[(line, text) for line, text in stated["comments"]],
        notes=[Note(*note) for note in stated["notes"]],
        text_columns=frozenset(stated["text_columns"]),
        read_column=lambda index: read_from(index, 0),
        read_from=read_from,
        read_texts=read_texts if stated["has_texts"] else None,
        **facts,
    )


class _Worker:
    """The other process, as this one sees it."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._process: subprocess.Popen | None = None
        self._owner = 0

    def ask(self, path: Path, what: str, request: dict[str, Any]) -> tuple[dict, bytearray]:
        """The answer to a request, and the bytes that follow it. Raises InputError."""
        with open_regular(path) as file:
            size = os.fstat(file.fileno()).st_size
        seconds, memory = _TIME_S + size / request["bytes_per_s"], _MEMORY_BYTES + _MEMORY_PER_BYTE * size
        request = request | {"path": os.fsencode(path).decode("utf-8", "surrogateescape")}
        request |= {"seconds": seconds, "memory": memory}
        with self._lock:
            answer, rest = self._exchange(request, seconds * _WALL_FACTOR)
        if answer is None:
            limit = f"the library that reads it failed, or took more than {seconds:.0f} s or the memory it may have"
            step = "Check that the file is complete, or export it again, if it is large as parts."
            raise InputError("file", f"not readable as {what}", limit, str(path), step)
        if "error" in answer:
            raise InputError(**answer["error"])
        if "missing" in answer:
            raise ImportError(name=answer["missing"])
        return answer, rest

    def _exchange(self, request: dict, wall_s: float) -> tuple[dict | None, bytearray]:
        try:
            process = self._running()
        except OSError:
            return None, bytearray()
        timer = threading.Timer(wall_s, process.kill)
        if not _POLLS:
            timer.start()
        try:
            process.stdin.write(json.dumps(request).encode() + b"\n")
            process.stdin.flush()
            if _POLLS and not _comes(process.stdout, wall_s):
                raise EOFError
            (length,) = _LENGTH.unpack(process.stdout.read(_LENGTH.size))
            answer = json.loads(process.stdout.readline())
            rest = bytearray(length)
            if process.stdout.readinto(rest) < length:
                raise EOFError
            return answer, rest
        except (OSError, EOFError, struct.error, ValueError):
            self.close()
            return None, bytearray()
        except BaseException:  # an interrupt leaves an answer behind
            self.close()
            raise
        finally:
            timer.cancel()

    def _running(self) -> subprocess.Popen:
        if self._owner != os.getpid():  # after a fork the process belongs to the parent
            self._process = None
        if self._process is None or self._process.poll() is not None:
            self.close()
            places = [each for each in sys.path if isinstance(each, str)]  # Python itself passes over the others
            command = [sys.executable, "-I", "-c", _START, json.dumps(places)]
            pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
            self._process, self._owner = subprocess.Popen(command, **pipes), os.getpid()
        return self._process

    def close(self) -> None:
        """End the process."""
        process, self._process = self._process, None
        if process is not None and self._owner == os.getpid():
            process.kill()
            process.wait()
            for pipe in (process.stdin, process.stdout):
                with contextlib.suppress(OSError):
                    pipe.close()


def _comes(pipe: Any, wall_s: float) -> bool:
    """Whether something comes through a pipe in this time, its end included."""
    poll = select.poll()
    poll.register(pipe, select.POLLIN)
    return bool(poll.poll(1e3 * wall_s))


_worker = _Worker()
atexit.register(_worker.close)


def serve() -> None:
    """Answer requests until standard input ends; the other process calls this."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent ends this process
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # what a library prints is no answer
    opened: tuple[Any, list[Table]] = None, []
    while True:
        if opened[1] and not _asked_soon():
            opened = None, []  # what was read takes memory
        line = sys.stdin.buffer.readline()
        if not line:
            return
        request = json.loads(line)
        _limit_time(request["seconds"])
        with _limited_memory(request["memory"]):
            opened = _answer(request, opened, answers)
        _limit_time(0.0)
        answers.flush()


def _asked_soon() -> bool:
    """Whether another request comes while the last file is of use; where this cannot be known, it is assumed."""
    return os.name != "posix" or bool(select.select([sys.stdin], [], [], _KEPT_S)[0])


def _limit_time(seconds: float) -> None:
    """End this process after so much of the processor's time, also within a library; 0 for no limit."""
    if hasattr(signal, "setitimer"):
        signal.signal(signal.SIGPROF, signal.SIG_DFL)
        signal.setitimer(signal.ITIMER_PROF, seconds)


@contextlib.contextmanager
def _limited_memory(size: int) -> Iterator[None]:
    """No more than ``size`` bytes of address space beyond those that the process has; nothing on systems that cannot
    state or limit it."""
    try:
        import resource

        pages = int(Path("/proc/self/statm").read_text().split()[0])
        soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    except (ImportError, OSError):
        yield
        return
    limit = pages * resource.getpagesize() + size
    lowest = min([limit, *(each for each in (soft, hard) if each != resource.RLIM_INFINITY)])
    resource.setrlimit(resource.RLIMIT_AS, (lowest, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


def _answer(request: dict, opened: tuple[Any, list[Table]], answers: BinaryIO) -> tuple[Any, list[Table]]:
    path = Path(os.fsdecode(request["path"].encode("utf-8", "surrogateescape")))
    try:
        state = os.stat(path)
        key = request["module"], path, state.st_ino, state.st_size, state.st_mtime_ns
        with enough_memory(path):
            if not {"column", "texts"} & request.keys() or opened[0] != key:
                opened = (None, [])
                opened = key, import_module(request["module"], __package__).tables(path)
            if "column" in request:
                _send(answers, {}, _column(opened[1][request["table"]], request["column"], request["first"]))
            elif "texts" in request:
                _send(answers, {"texts": opened[1][request["table"]].texts(request["texts"])})
            else:
                _send(answers, {"tables": [_stated(table) for table in opened[1]]})
    except InputError as error:
        parts = {part: getattr(error, part) for part in _PARTS}
        _send(answers, {"error": {part: str(each) for part, each in parts.items()}})
    except ImportError as error:
        _send(answers, {"missing": error.name or ""})
    except (OSError, IndexError) as error:
        facts = {"quantity": "file", "value": "not readable", "limit": str(error), "place": str(path)}
        _send(answers, {"error": facts | {"next_step": "Check that the file is complete, or export it again."}})
    return opened


def _column(table: Table, index: int, first: int) -> np.ndarray:
    values = table.read_from(index, first) if table.read_from else table.read_column(index)[first:]
    return np.ascontiguousarray(values, dtype=float)


def _stated(table: Table) -> dict[str, Any]:
    notes = [(note.kind, note.message, note.count) for note in table.notes]
    facts = {name: getattr(table, name) for name in _PLAIN}
    facts |= {"comments": table.comments, "notes": notes, "has_texts": table.read_texts is not None}
    return facts | {"text_columns": sorted(table.text_columns)}


def _send(answers: BinaryIO, answer: dict, values: np.ndarray | None = None) -> None:
    """Send an answer, and the values after it without a copy of them."""
    rest = memoryview(values).cast("B") if values is not None and values.size else b""
    answers.write(_LENGTH.pack(len(rest)) + json.dumps(answer).encode() + b"\n")
    answers.write(rest)
