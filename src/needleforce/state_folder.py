# SPDX-License-Identifier: Apache-2.0
"""A folder that keeps the result of each task, so that work continues where it was stopped.

``results`` has the results one after the other, ``tasks.jsonl`` a line for each: its key, what it is, how long it took,
and where its result is. A line is written after its result, so that a program killed at any moment loses at most the
task it was writing. The key is a digest of all that the result depends on: what has changed has another key.
"""

import hashlib
import json
import logging
import os
import secrets
import socket
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from .errors import InputError
from .files import MAX_RESULT_BYTES, atomic_write, read_bytes
from .vocabulary import __version__

STATE = "state.json"
_FORMAT = 1
_TASKS, _RESULTS, _LOCK = "tasks.jsonl", "results", "lock"
_MAX_TASKS_BYTES = 1 << 30  # a million tasks
_MAX_SHOWN = 60  # characters of an option in a message
_log = logging.getLogger(__name__)


def key_of(*parts: Any) -> str:
    """The digest of values that JSON has."""
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()


def is_state_folder(path: Path) -> bool:
    """Whether it is a folder that keeps the results of tasks."""
    return (path / STATE).is_file() and (path / _TASKS).is_file()


class StateFolder:
    """The results that are kept in a folder.

    Parameters
    ----------
    path : str or os.PathLike
        The folder; a new one is made.
    kind : str
        What is done in it, such as ``campaign``.
    settings : mapping of str to str, optional
        The options that the results depend on, as text: those that differ from the last ones are reported. None to read
        what is kept, also while another program writes; otherwise the folder is locked for this one.

    Raises
    ------
    InputError
        A folder of something else, one in which another program works, or one that cannot be written.
    """

    def __init__(self, path: str | os.PathLike, kind: str, settings: Mapping[str, str] | None = None):
        self.path, self._kind, self._is_full = Path(path), kind, False
        self._lock = None
        try:
            found = self._checked(new=settings is not None)
            if settings is not None:
                self._lock = _Lock(self.path / _LOCK)
                self._write_head(found, dict(settings))
                _drop_torn_line(self.path / _TASKS)
            self._results = open(self.path / _RESULTS, "rb" if settings is None else "ab+")
            self._lines = None if settings is None else open(self.path / _TASKS, "ab")
            self._kept = {each["key"]: each for each in self._read_lines()}
        except OSError as error:
            self.close()
            raise self._refusal("not usable", error.strerror or str(error), "Give another folder.") from None
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> "StateFolder":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Let another program use the folder."""
        for file in (getattr(self, "_results", None), getattr(self, "_lines", None)):
            with suppress(OSError):
                file and file.close()
        if self._lock is not None:
            self._lock.release()

    def result(self, key: str) -> bytes | None:
        """What was kept with this key; None if nothing was, or if it is not whole."""
        line = self._kept.get(key)
        if line is None:
            return None
        try:
            self._results.seek(line["at"])
            content = self._results.read(line["bytes"])
        except OSError:
            return None
        return content if _digest(content) == line["sha256"] else None

    def results(self, task: str) -> list[bytes]:
        """All that was kept of tasks of one kind, later ones last."""
        found = (self.result(key) for key, line in self._kept.items() if line["task"] == task)
        return [content for content in found if content is not None]

    def keep(self, key: str, content: bytes, **line: Any) -> None:
        """Keep a result with what ``tasks.jsonl`` is to have of it, of which ``task`` is its kind.

        On a disk that is full, this is reported once and no more is kept: the work continues.
        """
        if self._is_full:
            return
        try:
            at = self._results.seek(0, os.SEEK_END)
            self._results.write(content)
            self._results.flush()
            line = {"key": key, **line, "at": at, "bytes": len(content), "sha256": _digest(content)}
            self._lines.write(json.dumps(line).encode() + b"\n")
            self._lines.flush()
            self._kept[key] = line
        except OSError as error:
            self._is_full = True
            reason = error.strerror or str(error)
            _log.warning("%s: %s. The work continues, but its further results are not kept.", self.path, reason)

    def replace(self, name: str, content: bytes) -> None:
        """Write a file of the folder. Raises InputError if it cannot be written."""
        with atomic_write(self.path / name) as file:
            file.buffer.write(content)

    def read(self, name: str) -> bytes:
        """A file of the folder. Raises InputError if it is absent."""
        return read_bytes(self.path / name, "file of the state folder", _MAX_TASKS_BYTES)

    def _checked(self, new: bool) -> dict[str, Any] | None:
        """The head of the folder; None of a new one."""
        if not is_state_folder(self.path):
            if not new:
                raise self._refusal("nothing kept yet", "", f"Give the {self._kind} that is to be kept in it.")
            self.path.mkdir(exist_ok=True)
            if any(each.name not in (_LOCK, _TASKS, _RESULTS) for each in self.path.iterdir()):
                raise self._refusal("a folder with other files", "", "Give a new folder, or an empty one.")
            return None
        try:
            head = json.loads(read_bytes(self.path / STATE, "state folder", MAX_RESULT_BYTES))
            kind, form, _ = head["kind"], head["format"], (head["version"], dict(head["settings"]))
        except (ValueError, KeyError, TypeError):
            raise self._refusal("damaged", f"{STATE} is not readable", "Give a new folder.") from None
        if kind != self._kind or form != _FORMAT:
            of_what = f"of a {kind}" if kind != self._kind else f"of another version, {head.get('version')}"
            raise self._refusal(of_what, f"it is to be of a {self._kind}", "Give another folder.")
        return head

    def _write_head(self, last: dict[str, Any] | None, settings: dict[str, str]) -> None:
        """Write the options, and report those that differ from the last ones."""
        head = {"kind": self._kind, "format": _FORMAT, "version": __version__, "settings": settings}
        before = {} if last is None else {"version": last["version"], **last["settings"]}
        for name, value in {"version": __version__, **settings}.items():
            if last is not None and before.get(name) != value:
                old, now = (str(each)[:_MAX_SHOWN] for each in (before.get(name), value))
                _log.warning("%s: %s was %s and is now %s. What depends on it is done again.",
                             self.path, name, old, now)  # fmt: skip
        (self.path / _TASKS).touch()
        (self.path / _RESULTS).touch()
        self.replace(STATE, json.dumps(head, indent=1).encode())

    def _read_lines(self) -> list[dict[str, Any]]:
        """The tasks that are done; a line that is not whole, of a program killed while it wrote, is none."""
        whole = read_bytes(self.path / _TASKS, "state folder", _MAX_TASKS_BYTES).rpartition(b"\n")[0]
        found = []
        for text in whole.splitlines():
            with suppress(ValueError, TypeError, KeyError):
                line = json.loads(text)
                known = {"key", "task", "at", "bytes", "sha256"} <= line.keys()
                found += [line] if known and isinstance(line["at"], int) and isinstance(line["bytes"], int) else []
        return found

    def _refusal(self, value: str, limit: str, next_step: str) -> InputError:
        return InputError("state folder", value, limit, str(self.path), next_step)


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:16]


def _drop_torn_line(path: Path) -> None:
    """Cut off what a program that was killed had written of a line."""
    with open(path, "rb+") as file:
        file.truncate(file.read().rfind(b"\n") + 1)


class _Lock:
    """A file that names the program that works in the folder; of one that ended without removing it, it is taken."""

    def __init__(self, path: Path):
        self._path = path
        self._own = {"pid": os.getpid(), "host": socket.gethostname(), "token": secrets.token_hex(8)}
        if not self._made():
            self._take()

    def release(self) -> None:
        """Remove the file, if it is still that of this program."""
        if _read_lock(self._path) == self._own:
            self._path.unlink(missing_ok=True)

    def _made(self) -> bool:
        try:
            with open(self._path, "x", encoding="utf-8") as file:
                json.dump(self._own, file)
        except FileExistsError:
            return False
        return True

    def _take(self) -> None:
        """Raises InputError if the program is not known to have ended."""
        other = _read_lock(self._path)
        if other.get("host") != self._own["host"] or _is_alive(other.get("pid")):
            raise self._refusal(other)
        aside = self._path.with_name(f"{_LOCK}.{self._own['token']}")
        with suppress(FileNotFoundError):
            os.replace(self._path, aside)
            if _read_lock(aside) != other:  # another program was faster: it has its lock back
                os.replace(aside, self._path)
            aside.unlink(missing_ok=True)
        if not self._made():
            raise self._refusal(_read_lock(self._path))
        _log.warning("%s: process %s ended without leaving the folder. It is used from here on.",
                     self._path.parent, other.get("pid"))  # fmt: skip

    def _refusal(self, other: dict[str, Any]) -> InputError:
        owner = f"in use by process {other.get('pid', '?')} on {other.get('host', '?')}"
        step = f"Wait for it. If it is known to have ended, remove the file {_LOCK} in the folder."
        return InputError("state folder", owner, "one program at a time can use it", str(self._path.parent), step)


def _read_lock(path: Path) -> dict[str, Any]:
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


def _is_alive(pid: Any) -> bool:
    """Whether a process of this computer runs; where that cannot be asked, it is taken to."""
    if os.name == "nt" or not isinstance(pid, int) or pid <= 0:
        return True
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True
