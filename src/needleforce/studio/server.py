# SPDX-License-Identifier: Apache-2.0
"""The server of the studio: the files of the page, on loopback alone.

A page of another site must not reach it: a request whose ``Host`` is not this server's own is refused, which a name
that was pointed at loopback would have, and so is one whose ``Origin`` is another. No path that a client gives is
opened: a name is looked up among the files that were read at the start. A recording that the page gives is written
under a name of letters and digits into a folder of its own.
"""

import re
import socket
import threading
import webbrowser
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from ..errors import InputError
from .page_files import TYPES, page_files

if TYPE_CHECKING:
    from starlette.applications import Starlette

LOOPBACK = "127.0.0.1"
NAMES = (LOOPBACK, "localhost", "[::1]")
HEADERS = {
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "cache-control": "no-cache",
}
_POLICY = re.compile(rb'http-equiv="Content-Security-Policy" content="([^"]*)"')


def make_app(files: dict[str, bytes], port: int) -> "Starlette":
    """The server as an ASGI application.

    Parameters
    ----------
    files : dict of str to bytes
        The files of the page by name, as ``page_files`` gives them.
    port : int
        The port that a request has to name in its ``Host``.

    Returns
    -------
    starlette.applications.Starlette

    Raises
    ------
    InputError
        If Starlette is not installed.
    """
    try:
        from starlette.applications import Starlette
        from starlette.middleware import Middleware
        from starlette.responses import PlainTextResponse, Response
        from starlette.routing import Route
    except ImportError:
        raise _not_installed("starlette") from None
    from .planning import steering_routes
    from .recording_jobs import recording_routes

    async def give(request: Any) -> Any:
        name = request.path_params["name"] or "index.html"
        if name not in files:
            return PlainTextResponse("The studio has no such page.\n", status_code=404)
        kind = TYPES[name[name.rindex(".") :]]
        return Response(files[name], headers={"content-type": kind})

    files = files | {"index.html": files["index.html"].replace(b'<html lang="en"', b'<html lang="en" data-server')}
    own_page = Middleware(_OwnPageOnly, port=port, headers=HEADERS | {"content-security-policy": _policy(files)})
    routes, lifespan = recording_routes()
    routes = [*routes, *steering_routes(), Route("/{name:path}", give)]
    return Starlette(routes=routes, middleware=[own_page], lifespan=lifespan)


def _policy(files: dict[str, bytes]) -> str:
    """What the page itself states that it may do, with what only a header can say: that no page may frame it."""
    return f"{_POLICY.findall(files['index.html'])[0].decode()}; frame-ancestors 'none'"


class _OwnPageOnly:
    """Refuses what does not come from the studio's own page, and puts the headers of safety on every answer."""

    def __init__(self, app: Callable, port: int, headers: dict[str, str]):
        self.app, self.headers = app, headers
        self.hosts = {f"{name}:{port}" for name in NAMES} | (set(NAMES) if port == 80 else set())
        self.origins = {f"http://{host}" for host in self.hosts}

    async def __call__(self, scope: dict, receive: Callable, send: Callable) -> None:
        if scope["type"] == "lifespan":
            await self.app(scope, receive, send)
            return
        if reason := self._refusal(scope["method"], scope["headers"]):
            from starlette.responses import PlainTextResponse

            await PlainTextResponse(reason, status_code=403, headers=self.headers)(scope, receive, send)
            return

        async def send_with_headers(message: dict) -> None:
            if message["type"] == "http.response.start":
                given = {name.lower() for name, _ in message["headers"]}
                own = [(name.encode(), value.encode()) for name, value in self.headers.items()]
                more = [header for header in own if header[0] not in given]
                message = {**message, "headers": [*message["headers"], *more]}
            await send(message)

        await self.app(scope, receive, send_with_headers)

    def _refusal(self, method: str, headers: list[tuple[bytes, bytes]]) -> str:
        """Why a request is refused, or nothing."""
        hosts = [value.decode("latin-1").lower() for name, value in headers if name == b"host"]
        origins = [value.decode("latin-1").lower() for name, value in headers if name == b"origin"]
        if len(hosts) != 1 or hosts[0] not in self.hosts:
            return "The request names another host than the studio's.\n"
        if any(origin not in self.origins for origin in origins) or not (origins or method in ("GET", "HEAD")):
            return "The request comes from the page of another site.\n"
        return ""


def listening_socket(port: int) -> socket.socket:
    """A socket of loopback; InputError if another program has the port. Port 0 is any that is free."""
    listening = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listening.bind((LOOPBACK, port))
    except OSError as error:
        listening.close()
        step = "Close the studio that is open, or give --port 0 for any that is free."
        raise InputError("port", port, error.strerror or str(error), next_step=step) from None
    listening.listen()
    return listening


def make_server(listening: socket.socket, core: Any = None) -> Any:
    """The uvicorn server of the page on that socket's port; ``run(sockets=[listening])`` serves until it is stopped.

    Raises InputError if uvicorn is not installed, and as ``page_files``, which takes ``core``.
    """
    try:
        import uvicorn
    except ImportError:
        raise _not_installed("uvicorn") from None
    app = make_app(page_files(*([] if core is None else [core])), listening.getsockname()[1])
    config = uvicorn.Config(app, http="h11", ws="none", log_level="warning", server_header=False)
    return uvicorn.Server(config)


def serve(port: int, *, browser: bool, say: Callable[[str], None]) -> None:
    """Serve the page until Ctrl+C; ``say`` is given its address, which a browser is asked to open."""
    listening = listening_socket(port)
    try:
        server = make_server(listening)
        address = f"http://{LOOPBACK}:{listening.getsockname()[1]}/"
        say(f"studio: {address} (Ctrl+C ends it)")
        if browser:
            threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()
        server.run(sockets=[listening])
    finally:
        listening.close()


def _not_installed(name: str) -> InputError:
    return InputError(
        "studio", f"without {name}", "it serves the page", next_step='Run pip install "needleforce[studio]".'
    )
