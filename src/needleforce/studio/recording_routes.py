# SPDX-License-Identifier: Apache-2.0
"""What the page asks the server for recordings: to take one, how far it is, to cancel it, and its report."""

from contextlib import asynccontextmanager
from typing import Any

from starlette.responses import JSONResponse, PlainTextResponse, Response
from starlette.routing import Route

from ..errors import InputError
from .recording_jobs import RecordingJobs

# a report has its own script and style inside, and may contain what a file contains: it can reach nothing
REPORT_POLICY = (
    "sandbox allow-scripts; default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:"
)


def recording_routes() -> tuple[list[Route], Any]:
    """The routes, and the context in which the server runs them: at its end processes and files are gone."""
    running: dict[str, RecordingJobs] = {}

    @asynccontextmanager
    async def lifespan(app: Any) -> Any:
        running["jobs"] = RecordingJobs()
        yield
        await running["jobs"].close()

    async def receive(request: Any) -> Response:
        try:
            key = await running["jobs"].receive(request.query_params.get("name", ""), request.stream())
        except InputError as error:
            return JSONResponse({"error": str(error)}, status_code=413)
        return JSONResponse({"key": key}, status_code=202)

    async def one(request: Any) -> Response:
        jobs = running["jobs"]
        job = jobs.jobs.get(request.path_params["key"])
        if job is None:
            return JSONResponse({"error": "The server has no such recording any more."}, status_code=404)
        if request.method == "DELETE":
            jobs.cancel(job)
        return Response(jobs.text(job), media_type="application/json", headers={"cache-control": "no-store"})

    async def report(request: Any) -> Response:
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
