# SPDX-License-Identifier: Apache-2.0
"""Plans for a needle that the page steers: one question a process, whose lines the answer streams; a page that stops
listening ends it.

``python -m needleforce.studio.planning`` takes a question as JSON on its input and prints a line of JSON for each
evaluation, then the plan or what is wrong with the question.
"""

import asyncio
import itertools
import json
import sys
from collections.abc import AsyncIterator, Callable
from contextlib import suppress
from typing import Any

import msgspec
import numpy as np

from ..errors import InputError
from ..files import json_safe
from .solid_example import SOLID, SOLID_FILE, solid_example
from .steering_presets import steering_presets

COMMAND = (sys.executable, "-m", __name__ if __name__ != "__main__" else __spec__.name)
MAX_BYTES = 16 * 2**10  # of a question
MAX_LINE = 4 * 2**20  # of an answer
MAX_RUNNING = 2  # processes at a time
MAX_OBSTACLES = 8
EVERY = 5  # evaluations from one line to the next


class Question(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What the page asks: a needle by name, target (3,), spheres (k, 4) [m], and whether the needle may roll."""

    preset: str
    target: tuple[float, float, float]
    obstacles: list[tuple[float, float, float, float]]
    rolls: bool


def answer(text: bytes) -> dict[str, Any]:
    """The plan as the page draws it, or ``error`` as a sentence; a line is printed on the way."""
    from ..steering import plan
    from ..steering.obstacles import Sphere
    from ..steering.plan_problem import SteeringLimits

    try:
        question = _question(text)
        found = plan(
            _insertion(question.preset),
            question.target,
            obstacles=[Sphere((x, y, z), radius) for x, y, z, radius in question.obstacles],
            limits=SteeringLimits(rolls=question.rolls),
            progress=_progress(),
        )
    except InputError as error:
        return {"error": str(error)}
    motion = found.motion
    return {
        "moves": np.column_stack([motion.depth, motion.lateral, np.unwrap(motion.roll)]),
        "path": found.path,
        "force": found.force,
        "wrench": found.wrench,
        "miss": found.miss,
        "clearance": found.clearance,
        "radius": float(found.tube()[-1]),
        "faults": found.faults,
    }


def _question(text: bytes) -> Question:
    step = "Ask from the studio's page."
    try:
        question = msgspec.json.decode(text, type=Question)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise InputError("question", "not of the page", str(error), next_step=step) from None
    if len(question.obstacles) > MAX_OBSTACLES:
        limit = f"must be at most {MAX_OBSTACLES}"
        raise InputError("obstacles", len(question.obstacles), limit, next_step="Remove some.")
    return question


def _insertion(name: str) -> Any:
    if name == SOLID:
        return solid_example().preset.insertion()
    presets = steering_presets()
    if name not in presets:
        limit = f"must be {', '.join(presets)} or {SOLID}"
        raise InputError("needle", repr(name[:40]), limit, next_step="Load the page again.")
    return presets[name].insertion()


def _progress() -> Callable[[int, float], None]:
    """Prints a line for some of the evaluations, counted over all starts of the search."""
    numbers = itertools.count(1)

    def show(_: int, cost: float) -> None:
        if (count := next(numbers)) % EVERY == 1:
            print(json.dumps(json_safe({"count": count, "cost": cost})), flush=True)

    return show


async def lines_of(question: bytes, turn: asyncio.Semaphore) -> AsyncIterator[bytes]:
    """The lines of a process of its own, which ends when nobody takes them any more."""
    async with turn:
        pipe, quiet = asyncio.subprocess.PIPE, asyncio.subprocess.DEVNULL
        process = await asyncio.create_subprocess_exec(*COMMAND, stdin=pipe, stdout=pipe, stderr=quiet, limit=MAX_LINE)
        try:
            assert process.stdin is not None and process.stdout is not None
            with suppress(ConnectionError):
                process.stdin.write(question)
                await process.stdin.drain()
                process.stdin.close()
            async for line in process.stdout:
                yield line
            await process.wait()
        finally:
            if process.returncode is None:
                with suppress(ProcessLookupError):
                    process.kill()


def steering_routes() -> list[Any]:
    """The routes of plans, and of the solid, which is made when a page asks for it."""
    from starlette.concurrency import run_in_threadpool
    from starlette.requests import ClientDisconnect
    from starlette.responses import PlainTextResponse, Response, StreamingResponse
    from starlette.routing import Route

    turn = asyncio.Semaphore(MAX_RUNNING)

    async def ask(request: Any) -> Any:
        question = b""
        try:
            async for piece in request.stream():
                question += piece
                if len(question) > MAX_BYTES:
                    return PlainTextResponse("The question is too long.\n", status_code=413)
        except ClientDisconnect:
            return Response(status_code=400)
        return StreamingResponse(lines_of(question, turn), media_type="application/x-ndjson")

    async def solid(request: Any) -> Any:
        return Response(await run_in_threadpool(solid_text), media_type="application/json")

    return [Route("/plans", ask, methods=["POST"]), Route(f"/{SOLID_FILE}", solid, methods=["GET"])]


def solid_text() -> bytes:
    """The solid as the page takes it, or why there is none."""
    try:
        return solid_example().text()
    except InputError as error:
        return json.dumps({"error": str(error)}).encode()


if __name__ == "__main__":
    print(json.dumps(json_safe(answer(sys.stdin.buffer.read(MAX_BYTES)))), flush=True)
