# SPDX-License-Identifier: Apache-2.0
"""The routes of recordings: a file is sent, a fit of files is started, asked for, ended, and its report opened."""

import asyncio
import json
import time
from contextlib import asynccontextmanager
from typing import Any

from ..errors import InputError
from .reading_choices import checked_choices, choices
from .recording_jobs import RecordingJobs

SWEPT_EVERY_S = 10.0
MAX_REQUEST_BYTES = 2**20
UNKNOWN_FILE = "The server has no such recording any more."
UNKNOWN_FIT = "The server has no such fit any more."
# a report has its own script and style inside, and may contain what a file contains: it can reach nothing
REPORT_POLICY = (
    "sandbox allow-scripts; default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:"
)


def recording_routes() -> tuple[list[Any], Any]:
    """The routes, and the context in which the server runs them: at its end processes and files are gone."""
    from starlette.requests import ClientDisconnect
    from starlette.responses import JSONResponse, PlainTextResponse, Response
    from starlette.routing import Route

    running: dict[str, RecordingJobs] = {}
    offered = json.dumps(choices()).encode()

    @asynccontextmanager
    async def lifespan(app: Any) -> Any:
        running["jobs"] = RecordingJobs()
        app.state.recordings = lambda: running["jobs"]  # for the live view, which hands its recording over
        sweeper = asyncio.create_task(_sweep(running["jobs"]))
        yield
        sweeper.cancel()
        await running["jobs"].close()

    def wrong(text: Any, status: int) -> Any:
        return JSONResponse({"error": str(text)}, status_code=status)

    async def offer(request: Any) -> Any:
        return Response(offered, media_type="application/json")

    async def receive(request: Any) -> Any:
        try:
            key = await running["jobs"].receive(request.query_params.get("name", ""), request.stream())
        except InputError as error:
            return wrong(error, 413)
        except ClientDisconnect:  # the tab was closed: nobody reads the answer
            return Response(status_code=400)
        return JSONResponse({"key": key}, status_code=202)

    async def start(request: Any) -> Any:
        text = bytearray()
        async for piece in request.stream():
            text += piece
            if len(text) > MAX_REQUEST_BYTES:
                return wrong("The request is too long: it is not one of the page.", 413)
        try:
            return JSONResponse({"key": running["jobs"].start(checked_choices(bytes(text)))}, status_code=202)
        except KeyError:
            return wrong(UNKNOWN_FILE, 404)
        except InputError as error:
            return wrong(error, 422)

    async def one(request: Any) -> Any:
        jobs = running["jobs"]
        job = jobs.jobs.get(request.path_params["key"])
        if job is None:
            return wrong(UNKNOWN_FIT, 404)
        if request.method == "DELETE":
            jobs.cancel(job)
        text = jobs.text(job, with_files="files" in request.query_params)
        return Response(text, media_type="application/json", headers={"cache-control": "no-store"})

    async def report(request: Any) -> Any:
        jobs = running["jobs"]
        job = jobs.jobs.get(request.path_params["key"])
        page = None if job is None else jobs.report(job)
        if page is None:
            return PlainTextResponse("There is no such report.\n", status_code=404)
        return Response(page, media_type="text/html", headers={"content-security-policy": REPORT_POLICY})

    routes = [
        Route("/recordings", receive, methods=["POST"]),
        Route("/choices", offer, methods=["GET"]),
        Route("/fits", start, methods=["POST"]),
        Route("/fits/{key}", one, methods=["GET", "DELETE"]),
        Route("/fits/{key}/report", report, methods=["GET"]),
    ]
    return routes, lifespan


async def _sweep(jobs: RecordingJobs) -> None:
    while True:
        await asyncio.sleep(SWEPT_EVERY_S)
        jobs.sweep(time.monotonic())
