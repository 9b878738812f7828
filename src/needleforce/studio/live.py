# SPDX-License-Identifier: Apache-2.0
"""The live view of the server: one run of the recorder at a time, in a process of its own, and the pages that watch it.
A page that reads slowly gets fewer points, and how many readings they stand for; nothing waits for it."""

import asyncio
import json
import secrets
import sys
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..checks import finite_number, one_of
from ..errors import InputError
from ..preset_files import presets

COMMAND = (sys.executable, "-m", f"{__package__}.live_run")
INTERVAL, HEARTBEAT = 1 / 30, 0.5  # [s] between two messages to a page, if there is something new, and if not
MAX_WATCHERS = 16
KEPT_POINTS, WAITING_POINTS, KEPT_EVENTS = 8000, 600, 200
MAX_QUESTION_BYTES, MAX_LINE_BYTES = 4096, 2**20
END_TIME = 12.0  # [s] that a run has to end when the server does
PHANTOM = "phantom"  # the paper's, at a site of its own for each run
_BUSY = ("starting", "running", "stopping")
_VIRTUAL = {
    "sensor": None, "sensor_page": "", "axis": None, "force_limit_n": None, "axial": "fz", "filter_length": 10,
    "bias_s": 0.5, "steady_n": 0.05, "max_force_gap_s": 0.5, "frozen_check": True, "needle": "", "tissue": "",
}  # fmt: skip


@dataclass
class Setup:
    """What the person at the command line gives: a connected rig as ``needleforce record`` names it, or None, models by
    their files, and the folder to which is recorded."""

    folder: Path = Path("recordings")
    rig: dict[str, Any] | None = None
    models: dict[str, str] = field(default_factory=dict)


class Watcher:
    """What a page has not yet been sent."""

    def __init__(self) -> None:
        self.restart()

    def restart(self, past: "Watcher | None" = None) -> None:
        """Begin with a new run, or with what is ``past``."""
        from .live_points import Points

        self.points = Points(WAITING_POINTS) if past is None else Points(KEPT_POINTS, past.points.points)
        self.points.readings = 0 if past is None else past.points.readings
        self.events: list[dict] = [] if past is None else list(past.events)
        self.left_out = 0 if past is None else past.left_out
        self.fresh = self.changed = True

    def add(self, points: list, readings: int, events: list[dict], left_out: int) -> None:
        """Add what came."""
        self.points.add(points, readings)
        self.left_out += left_out + max(0, len(self.events) + len(events) - KEPT_EVENTS)
        self.events = (self.events + events)[-KEPT_EVENTS:]
        self.changed = True

    def take(self) -> dict[str, Any]:
        """What is to be sent now."""
        (points, readings), events = self.points.take(), self.events
        self.points.limit, self.events = WAITING_POINTS, []
        taken = {"points": points, "readings": readings, "events": events, "events_left_out": self.left_out}
        taken["fresh"], self.fresh, self.changed, self.left_out = self.fresh, False, False, 0
        return taken


class Live:
    """The run, if there is one, and who watches."""

    def __init__(self, setup: Setup):
        self.setup, self.server = setup, secrets.token_hex(4)
        self.state: dict[str, Any] = {"state": "idle", "run": 0}
        self.watchers: list[Watcher] = []
        self._past, self._process, self._task, self._closed = Watcher(), None, None, False
        self._past.points.limit = KEPT_POINTS

    def choices(self) -> dict[str, Any]:
        """What a page may choose from."""
        rig = None if self.setup.rig is None else self.setup.rig["words"]
        axis = self.setup.rig is not None and self.setup.rig["axis"] is not None
        models = [*self.setup.models, *presets()]
        return {"rig": rig, "has_axis": axis, "virtual": [PHANTOM, *presets()], "models": models}

    async def start(self, asked: dict[str, Any]) -> None:
        """Begin a run; InputError if one is in progress, or for what the page may not choose."""
        if self.state["state"] in _BUSY:
            raise InputError("run", "in progress", "there is one at a time", next_step="Stop it, or wait for its end.")
        job = self._job(asked)
        self.state = {"state": "starting", "run": self.state["run"] + 1, "file": job["file"], "model": asked["model"]}
        self._past.restart()
        self._past.points.limit = KEPT_POINTS
        for each in self.watchers:
            each.restart()
        pipe = asyncio.subprocess.PIPE
        self._process = await asyncio.create_subprocess_exec(*COMMAND, stdin=pipe, stdout=pipe, limit=MAX_LINE_BYTES)
        if self._closed:  # while it began: it has no job yet, and moves nothing
            self._process.kill()
            await self._process.communicate()
            return
        self._send(json.dumps(job))
        self._task = asyncio.create_task(self._follow(self._process))

    def stop(self) -> None:
        """Pass on the order to stop; nothing without a run."""
        self._send("stop")

    def alive(self) -> None:
        """Pass on that a page looks on."""
        self._send("alive")

    def join(self) -> Watcher:
        """Begin to watch, with what is past of the run. InputError if too many do."""
        if len(self.watchers) >= MAX_WATCHERS:
            raise InputError("pages", len(self.watchers), "watch already", next_step="Close one of them.")
        watcher = Watcher()
        watcher.restart(self._past)
        self.watchers.append(watcher)
        return watcher

    async def close(self) -> None:
        """End the run: the axis is stopped, the file is closed. A process that does not end is killed."""
        self._closed = True
        if self._task is None or self._task.done():
            return
        self._process.stdin.close()  # the end of its input stops the axis
        done, _ = await asyncio.wait([self._task], timeout=END_TIME)
        if not done:
            self._process.kill()  # the axis stops by itself, as nobody speaks to it
            await self._task

    def _job(self, asked: dict[str, Any]) -> dict[str, Any]:
        """The job of the process, from what the page asks for: no name of it is opened as a file."""
        one_of("rig", asked.get("rig"), ("virtual",) if self.setup.rig is None else ("virtual", "connected"))
        rig = self.setup.rig
        if asked["rig"] == "virtual":
            one_of("tissue", asked.get("tissue"), (PHANTOM, *presets()))
            tissue, seed = asked["tissue"], self.state["run"] + 1
            preset = None if tissue == PHANTOM else tissue
            rig = _VIRTUAL | {"preset": preset, "seed": seed, "words": f"virtual rig, {tissue}"}
        model = asked.setdefault("model", None)
        if model is not None:
            one_of("model", model, (*self.setup.models, *presets()))
        motion = asked.get("motion")
        if motion is not None:
            step = "Give a number."
            motion = {name: finite_number(name, motion.get(name), step) for name in ("start", "depth", "speed", "hold")}
        surface = finite_number("surface", asked.get("surface"), "Give a number.")
        model = self.setup.models.get(model, model)
        return {"file": str(self._new_file()), "rig": rig, "motion": motion, "model": model, "surface": surface}

    def _new_file(self) -> Path:
        try:
            self.setup.folder.mkdir(exist_ok=True)
        except OSError as error:
            step = "Start needleforce studio with another --folder."
            raise InputError("folder", str(self.setup.folder), error.strerror or str(error), next_step=step) from None
        name = f"live_{time.strftime('%Y%m%d_%H%M%S')}"
        return self.setup.folder.resolve() / f"{name}_{secrets.token_hex(2)}.mcap"

    def _send(self, line: str) -> None:
        process = self._process
        if process is None or process.returncode is not None or process.stdin.is_closing():
            return
        if process.stdin.transport.get_write_buffer_size() < MAX_QUESTION_BYTES:
            process.stdin.write(f"{line}\n".encode())

    async def _follow(self, process: Any) -> None:
        async for line in process.stdout:
            self._take(json.loads(line))
        await process.wait()
        if self.state["state"] in _BUSY:
            text = "The recorder's process ended by itself. The axis stops when nobody speaks to it: look at it."
            self._change(state="ended", refused=text, confirmed=False)

    def _take(self, message: dict[str, Any]) -> None:
        """What the process wrote."""
        kind = message.pop("kind")
        if kind == "points":
            for each in (self._past, *self.watchers):
                parts = message["points"], message["readings"], message["events"], message["events_left_out"]
                each.add(*parts)
            self._change(progress=message["progress"])
        elif kind == "refused":
            self._change(state="ended", refused=message["text"], confirmed=not message["unconfirmed"])
        else:
            state = {"opened": "running", "stopping": "stopping"}.get(kind, "ended")
            stays = self.state["state"] == "stopping" and kind == "opened"
            self._change(**{kind: message, "state": "stopping" if stays else state})
        if kind == "end":
            self._change(confirmed=message["confirmed"])

    def _change(self, **facts: Any) -> None:
        self.state |= facts
        for each in self.watchers:
            each.changed = True


def live_routes(setup: Setup) -> tuple[list[Any], Any]:
    """The routes, and the context in which the server runs them: at its end a run is stopped."""
    from starlette.responses import JSONResponse, StreamingResponse
    from starlette.routing import Route

    running: dict[str, Live] = {}

    @asynccontextmanager
    async def lifespan(app: Any) -> Any:
        running["live"] = Live(setup)
        yield
        await running["live"].close()

    async def about(request: Any) -> Any:
        return JSONResponse(running["live"].choices())

    async def stream(request: Any) -> Any:
        try:
            watcher = running["live"].join()
        except InputError as error:
            return JSONResponse({"error": str(error)}, status_code=503)
        messages = _messages(running["live"], watcher, request.app.state.ending)
        return StreamingResponse(messages, media_type="text/event-stream", headers={"cache-control": "no-store"})

    async def act(request: Any) -> Any:
        live, action = running["live"], request.url.path.rpartition("/")[2]
        try:
            if action == "start":
                await live.start(await _question(request))
            else:
                {"stop": live.stop, "alive": live.alive}[action]()
        except InputError as error:
            return JSONResponse({"error": str(error)}, status_code=409)
        return JSONResponse({"state": live.state["state"]}, status_code=202)

    async def hand_over(request: Any) -> Any:
        file = running["live"].state.get("file")
        if file is None or running["live"].state["state"] in _BUSY:
            return JSONResponse({"error": "There is no finished recording."}, status_code=404)
        try:
            key = await request.app.state.recordings().receive(Path(file).name, _pieces(Path(file)))
        except (InputError, OSError) as error:
            return JSONResponse({"error": str(error)}, status_code=409)
        return JSONResponse({"key": key, "name": Path(file).name}, status_code=202)

    routes = [
        Route("/live", about, methods=["GET"]),
        Route("/live/stream", stream, methods=["GET"]),
        Route("/live/analyse", hand_over, methods=["POST"]),
        *(Route(f"/live/{name}", act, methods=["POST"], name=name) for name in ("start", "stop", "alive")),
    ]
    return routes, lifespan


async def _messages(live: Live, watcher: Watcher, ending: Callable[[], bool]) -> AsyncIterator[str]:
    """Server-sent events: what is new, thirty times a second at most, and a sign of life."""
    sent = 0.0
    try:
        while not ending():
            if watcher.changed or time.monotonic() - sent > HEARTBEAT:
                sent = time.monotonic()
                yield f"data: {json.dumps({'server': live.server, **live.state, **watcher.take()})}\n\n"
            await asyncio.sleep(INTERVAL)
    finally:
        with suppress(ValueError):
            live.watchers.remove(watcher)


async def _question(request: Any) -> dict[str, Any]:
    """The JSON that a page sends, of limited length."""
    text = b""
    async for piece in request.stream():
        text += piece
        if len(text) > MAX_QUESTION_BYTES:
            raise InputError(
                "question", f"more than {MAX_QUESTION_BYTES} bytes", "too long", next_step="Reload the page."
            )
    try:
        asked = json.loads(text)
    except (ValueError, RecursionError):
        asked = None
    if not isinstance(asked, dict) or not isinstance(asked.get("motion"), dict | None):
        raise InputError("question", "not understood", "an object is needed", next_step="Reload the page.")
    return asked


async def _pieces(file: Path) -> AsyncIterator[bytes]:
    with open(file, "rb") as opened:
        while piece := opened.read(2**20):
            yield piece
