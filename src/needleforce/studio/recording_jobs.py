# SPDX-License-Identifier: Apache-2.0
"""Recordings that a page gives to the server: received in pieces up to a limit, identified by processes of their own of
which few run at a time, and forgotten when others need the place or the server ends; and the routes for them."""

import asyncio
import re
import secrets
import shutil
import sys
import tempfile
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..errors import InputError

COMMAND = (sys.executable, "-m", f"{__package__}.recording_process")  # it is given the file, in its own folder
RESULT, REPORT = "result.json", "report.html"
MAX_BYTES = 256 * 2**20  # of a recording
MAX_RUNNING = 2  # processes at a time
MAX_KEPT = 16  # recordings with their results
UNFINISHED = ("waiting", "running")
# a report has its own script and style inside, and may contain what a file contains: it can reach nothing
REPORT_POLICY = (
    "sandbox allow-scripts; default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:"
)


@dataclass
class Job:
    """A recording, and what has become of it: waiting, running, done, failed or cancelled."""

    file: Path
    state: str = "waiting"
    stage: str = ""
    process: Any = None
    task: Any = field(default=None, repr=False)

    @property
    def folder(self) -> Path:
        """Its own folder, with the file and the results."""
        return self.file.parent


class RecordingJobs:
    """All recordings of a server, each by a name that cannot be guessed."""

    def __init__(self) -> None:
        self.folder = Path(tempfile.mkdtemp(prefix="needleforce-studio-"))
        self.jobs: dict[str, Job] = {}
        self.turn = asyncio.Semaphore(MAX_RUNNING)

    async def receive(self, name: str, pieces: AsyncIterator[bytes]) -> str:
        """The name of a new job; InputError for too long a file, or if all places are taken."""
        self._make_room()
        key = secrets.token_urlsafe(16)
        job = Job(self.folder / key / _safe(name))
        job.folder.mkdir()
        size = 0
        try:
            with open(job.file, "wb") as file:
                async for piece in pieces:
                    size += len(piece)
                    if size > MAX_BYTES:
                        step = "Identify it with needleforce identify."
                        limit = "too long for the page"
                        raise InputError("file", f"more than {MAX_BYTES // 2**20} MB", limit, next_step=step)
                    file.write(piece)
        except BaseException:  # also where the browser went away
            shutil.rmtree(job.folder, ignore_errors=True)
            raise
        self.jobs[key] = job
        job.task = asyncio.create_task(self._run(job))
        return key

    def _make_room(self) -> None:
        finished = [key for key, job in self.jobs.items() if job.state not in UNFINISHED]
        if len(self.jobs) >= MAX_KEPT and not finished:
            raise InputError("recordings", len(self.jobs), "all are being identified", next_step="Wait, or cancel one.")
        for key in finished[: max(0, len(self.jobs) - MAX_KEPT + 1)]:
            shutil.rmtree(self.jobs.pop(key).folder, ignore_errors=True)

    async def _run(self, job: Job) -> None:
        async with self.turn:
            if job.state == "cancelled":
                return
            quiet = asyncio.subprocess.DEVNULL
            job.state = "running"
            job.process = await asyncio.create_subprocess_exec(
                *COMMAND, job.file.name, stdin=quiet, stdout=asyncio.subprocess.PIPE, stderr=quiet, cwd=job.folder
            )
            async for line in job.process.stdout:
                job.stage = line.decode("utf-8", "replace").strip()
            ended = await job.process.wait()
            if job.state == "running":
                job.state = "done" if ended == 0 and (job.folder / RESULT).is_file() else "failed"

    def cancel(self, job: Job) -> None:
        """End the process of a job; nothing if it has ended."""
        if job.state in UNFINISHED:
            job.state = "cancelled"
            with suppress(ProcessLookupError):
                if job.process is not None:
                    job.process.kill()

    def text(self, job: Job) -> bytes:
        """The state of a job as JSON, with its result when it is done."""
        result = (job.folder / RESULT).read_bytes() if job.state == "done" else b"null"
        state, stage = (f'"{each}"'.encode() for each in (job.state, re.sub(r"[^\w ]", "", job.stage)))
        return b'{"state":%b,"stage":%b,"result":%b}' % (state, stage, result)

    def report(self, job: Job) -> bytes | None:
        """The report of a job, if there is one."""
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
    plain = re.sub(r"[^\w.-]+", "_", Path(name).name, flags=re.ASCII)[-80:].lstrip(".-")
    return plain if plain not in ("", RESULT, REPORT) else f"recording_{plain}"


def recording_routes() -> tuple[list[Any], Any]:
    """The routes, and the context in which the server runs them: at its end processes and files are gone."""
    from starlette.requests import ClientDisconnect
    from starlette.responses import JSONResponse, PlainTextResponse, Response
    from starlette.routing import Route

    running: dict[str, RecordingJobs] = {}

    @asynccontextmanager
    async def lifespan(app: Any) -> Any:
        running["jobs"] = RecordingJobs()
        app.state.recordings = lambda: running["jobs"]  # for the live view, which hands its recording over
        yield
        await running["jobs"].close()

    async def receive(request: Any) -> Any:
        try:
            key = await running["jobs"].receive(request.query_params.get("name", ""), request.stream())
        except InputError as error:
            return JSONResponse({"error": str(error)}, status_code=413)
        except ClientDisconnect:  # the tab was closed: nobody reads the answer
            return Response(status_code=400)
        return JSONResponse({"key": key}, status_code=202)

    async def one(request: Any) -> Any:
        jobs = running["jobs"]
        job = jobs.jobs.get(request.path_params["key"])
        if job is None:
            return JSONResponse({"error": "The server has no such recording any more."}, status_code=404)
        if request.method == "DELETE":
            jobs.cancel(job)
        return Response(jobs.text(job), media_type="application/json", headers={"cache-control": "no-store"})

    async def report(request: Any) -> Any:
        jobs = running["jobs"]
        job = jobs.jobs.get(request.path_params["key"])
        page = None if job is None else jobs.report(job)
        if page is None:
            return PlainTextResponse("There is no such report.\n", status_code=404)
        return Response(page, media_type="text/html", headers={"content-security-policy": REPORT_POLICY})

    routes = [
        Route("/recordings", receive, methods=["POST"]),
        Route("/recordings/{key}", one, methods=["GET", "DELETE"]),
        Route("/recordings/{key}/report", report, methods=["GET"]),
    ]
    return routes, lifespan
