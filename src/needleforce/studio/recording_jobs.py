# SPDX-License-Identifier: Apache-2.0
"""Recordings that a page gives to the server, and fits of them: received in pieces up to a limit, read and identified
by processes of their own of which few run at a time, ended when nobody asks for them, and forgotten after a time."""

import asyncio
import os
import re
import secrets
import shutil
import sys
import tempfile
import time
from collections.abc import AsyncIterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec

from ..errors import InputError
from .reading_choices import FitChoices

COMMAND = (sys.executable, "-m", f"{__package__}.recording_process")  # it runs in the folder of the job
REQUEST, FILES, RESULT, REPORT = "request.json", "files.json", "result.json", "report.html"
OWN_NAMES = (REQUEST, FILES, RESULT, REPORT, "needleforce.toml")  # of a folder, which no recording may have
MAX_BYTES = 256 * 2**20  # of a recording
MAX_TOTAL_BYTES = 2 * 2**30  # of all that are kept
MAX_RUNNING = 2  # processes at a time
MAX_KEPT = 16  # fits with their results
ABANDONED_S = 180.0  # after which a fit that nobody asks for is ended: a page that is not seen asks once a minute
FORGOTTEN_S = 3600.0  # after which what nobody asks for is removed
UNFINISHED = ("waiting", "running")


class Request(msgspec.Struct, kw_only=True):
    """What a process is asked: the choices of the page, whose keys are the names of the files in its folder, and by
    these the names that the files had."""

    choices: FitChoices
    names: dict[str, str]


@dataclass(kw_only=True)
class Upload:
    """A file: where it is, the name that it had, its length, and when it was used last."""

    file: Path
    name: str
    size: int
    used: float


@dataclass(kw_only=True)
class Job:
    """A fit, and what has become of it: waiting, running, done, failed or cancelled."""

    folder: Path
    files: tuple[str, ...]
    asked: float
    state: str = "waiting"
    stage: str = ""
    process: Any = None
    task: Any = field(default=None, repr=False)


class RecordingJobs:
    """All recordings and fits of a server, each by a name that cannot be guessed."""

    def __init__(self) -> None:
        self.folder = Path(tempfile.mkdtemp(prefix="needleforce-studio-"))
        self.uploads: dict[str, Upload] = {}
        self.jobs: dict[str, Job] = {}
        self.turn = asyncio.Semaphore(MAX_RUNNING)

    async def receive(self, name: str, pieces: AsyncIterator[bytes]) -> str:
        """The name of a new recording; InputError for too long a file."""
        key = secrets.token_urlsafe(16)
        file = self.folder / f"file-{key}"
        size = 0
        try:
            with open(file, "wb") as target:
                async for piece in pieces:
                    size += len(piece)
                    if size > MAX_BYTES:
                        step = "Identify it with needleforce identify."
                        limit = "too long for the page"
                        raise InputError("file", f"more than {MAX_BYTES // 2**20} MB", limit, next_step=step)
                    target.write(piece)
            self._make_room_for(size)
        except BaseException:  # also where the browser went away
            file.unlink(missing_ok=True)
            raise
        self.uploads[key] = Upload(file=file, name=name[-255:], size=size, used=time.monotonic())
        return key

    def _make_room_for(self, size: int) -> None:
        """Forget the files that were not used for longest, but none of a fit that runs."""
        needed = {key for job in self.jobs.values() if job.state in UNFINISHED for key in job.files}
        for key in sorted(self.uploads.keys() - needed, key=lambda each: self.uploads[each].used):
            if size + sum(each.size for each in self.uploads.values()) <= MAX_TOTAL_BYTES:
                return
            self._drop(key)
        if size + sum(each.size for each in self.uploads.values()) > MAX_TOTAL_BYTES:
            limit, step = "more than the page keeps", "Wait until a fit has ended, or cancel it."
            raise InputError("recordings", f"{MAX_TOTAL_BYTES // 2**20} MB", limit, next_step=step)

    def _drop(self, key: str) -> None:
        self.uploads.pop(key).file.unlink(missing_ok=True)

    def start(self, choices: FitChoices) -> str:
        """The name of a new fit; KeyError for a file that the server does not have, InputError if all places are
        taken."""
        uploads = {key: self.uploads[key] for each in choices.files for key in (each.key, each.motion) if key}
        self._make_place()
        key = secrets.token_urlsafe(16)
        folder = self.folder / f"fit-{key}"
        folder.mkdir()
        now, names = time.monotonic(), dict[str, str]()
        placed = {"": ""}
        for own, upload in uploads.items():
            upload.used = now
            placed[own] = _free(_safe(upload.name), names)
            names[placed[own]] = upload.name
            os.link(upload.file, folder / placed[own])
        for each in choices.files:
            each.key, each.motion = placed[each.key], placed[each.motion]
        (folder / REQUEST).write_bytes(msgspec.json.encode(Request(choices=choices, names=names)))
        job = Job(folder=folder, files=tuple(uploads), asked=now)
        self.jobs[key] = job
        job.task = asyncio.create_task(self._run(job))
        return key

    def _make_place(self) -> None:
        finished = [key for key, job in self.jobs.items() if job.state not in UNFINISHED]
        if len(self.jobs) >= MAX_KEPT and not finished:
            step = "Wait until one has ended, or cancel it."
            raise InputError("fits", len(self.jobs), "all of them wait or run", next_step=step)
        for key in finished[: max(0, len(self.jobs) - MAX_KEPT + 1)]:
            self._forget(key)

    def _forget(self, key: str) -> None:
        shutil.rmtree(self.jobs.pop(key).folder, ignore_errors=True)

    async def _run(self, job: Job) -> None:
        async with self.turn:
            if job.state == "cancelled":
                return
            quiet = asyncio.subprocess.DEVNULL
            job.state = "running"
            job.process = await asyncio.create_subprocess_exec(
                *COMMAND, stdin=quiet, stdout=asyncio.subprocess.PIPE, stderr=quiet, cwd=job.folder
            )
            if job.state == "cancelled":  # while its process began
                self._kill(job)
            async for line in job.process.stdout:
                job.stage = line.decode("utf-8", "replace").strip()
            ended = await job.process.wait()
            if job.state == "running":
                job.state = "done" if ended == 0 and (job.folder / RESULT).is_file() else "failed"

    def cancel(self, job: Job) -> None:
        """End the process of a fit; nothing if it has ended."""
        if job.state in UNFINISHED:
            job.state = "cancelled"
            if job.process is not None:
                self._kill(job)

    @staticmethod
    def _kill(job: Job) -> None:
        with suppress(ProcessLookupError):
            job.process.kill()

    def sweep(self, now: float) -> None:
        """End the fits that nobody asks for, and forget what nobody asked for in a long time."""
        for key, job in list(self.jobs.items()):
            if now - job.asked > ABANDONED_S:
                self.cancel(job)
            if now - job.asked > FORGOTTEN_S:
                self._forget(key)
        needed = {key for job in self.jobs.values() for key in job.files}
        for key in [key for key in self.uploads.keys() - needed if now - self.uploads[key].used > FORGOTTEN_S]:
            self._drop(key)

    def text(self, job: Job, *, with_files: bool) -> bytes:
        """The state of a fit as JSON, with its result when it is done, or with what was read if that is wanted."""
        job.asked = time.monotonic()
        read = job.folder / FILES
        files = read.read_bytes() if with_files and job.state == "running" and read.is_file() else b"null"
        result = (job.folder / RESULT).read_bytes() if job.state == "done" else b"null"
        state, stage = (f'"{each}"'.encode() for each in (job.state, re.sub(r"[^\w ,]", "", job.stage)))
        return b'{"state":%b,"stage":%b,"read":%b,"result":%b}' % (state, stage, files, result)

    def report(self, job: Job) -> bytes | None:
        """The report of a fit, if there is one."""
        path = job.folder / REPORT
        return path.read_bytes() if job.state == "done" and path.is_file() else None

    async def close(self) -> None:
        """End all processes and remove all files."""
        for job in self.jobs.values():
            self.cancel(job)
        await asyncio.gather(*(job.task for job in self.jobs.values()), return_exceptions=True)
        shutil.rmtree(self.folder, ignore_errors=True)


def _safe(name: str) -> str:
    """The name of a file, of letters, digits and ``_ . -`` alone, for what the reader may learn from it."""
    plain = re.sub(r"[^\w.-]+", "_", re.split(r"[/\\]", name)[-1], flags=re.ASCII)[-80:].lstrip(".-")
    return plain if plain not in ("", *OWN_NAMES) else f"recording_{plain}"


def _free(name: str, taken: dict[str, str]) -> str:
    """The name, with a number in front if a file of the same fit has it; case does not tell two apart."""
    names, found, number = {each.casefold() for each in taken}, name, 1
    while found.casefold() in names:
        number += 1
        found = f"{number}_{name}"
    return found
