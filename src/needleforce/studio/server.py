# SPDX-License-Identifier: Apache-2.0
"""The server of the studio: the files of the page, recordings that are identified, and the live view.

It listens on loopback, or where it is asked to, and then only a token opens it; ``access`` has who is answered. No path
that a client gives is opened: a name is looked up among the files that were read at the start. A recording that the
page gives is written under a name of letters and digits into a folder of its own.
"""

import errno
import ipaddress
import re
import socket
import threading
import webbrowser
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING, Any

from ..errors import InputError
from .access import LOOPBACK, Access, OwnPageOnly, is_loopback
from .page_files import TYPES, page_files

if TYPE_CHECKING:
    from starlette.applications import Starlette

    from .live import Setup

GRACE_S = 3  # for an answer that a slow page reads, when the server ends
HEADERS = {
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "cache-control": "no-cache",
}
_POLICY = re.compile(rb'http-equiv="Content-Security-Policy" content="([^"]*)"')


def make_app(files: dict[str, bytes], access: Access, live: "Setup | None" = None) -> "Starlette":
    """The server as an ASGI application.

    Parameters
    ----------
    files : dict of str to bytes
        The files of the page by name, as ``page_files`` gives them.
    access : Access
        Who is answered.
    live : Setup, optional
        The rig, the models and the folder of the live view; default: the virtual rig.

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
    from .live import Setup, live_routes
    from .planning import steering_routes
    from .recording_routes import recording_routes

    async def give(request: Any) -> Any:
        name = request.path_params["name"] or "index.html"
        if name not in files:
            return PlainTextResponse("The studio has no such page.\n", status_code=404)
        kind = TYPES[name[name.rindex(".") :]]
        return Response(files[name], headers={"content-type": kind})

    files = files | {"index.html": files["index.html"].replace(b'<html lang="en"', b'<html lang="en" data-server')}
    own_page = Middleware(OwnPageOnly, access=access, headers=HEADERS | {"content-security-policy": _policy(files)})
    (routes, recordings), (live_ones, watched) = recording_routes(), live_routes(live or Setup())

    @asynccontextmanager
    async def lifespan(app: Any) -> AsyncIterator[None]:
        async with recordings(app), watched(app):  # the rig is stopped first
            yield

    all_routes = [*routes, *live_ones, *steering_routes(), Route("/{name:path}", give)]
    app = Starlette(routes=all_routes, middleware=[own_page], lifespan=lifespan)
    app.state.ending = lambda: False
    return app


def _policy(files: dict[str, bytes]) -> str:
    """What the page itself states that it may do, with what only a header can say: that no page may frame it."""
    return f"{_POLICY.findall(files['index.html'])[0].decode()}; frame-ancestors 'none'"


def listening_socket(port: int, host: str = LOOPBACK) -> socket.socket:
    """A socket of this computer; InputError if another program has the port, or the host is not its own. Port 0 is any
    that is free."""
    family, kind, _, _, address = _address(host, port)
    listening = socket.socket(family, kind)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listening.bind(address)
    except OSError as error:
        listening.close()
        step = "Close the studio that is open, or give --port 0 for any that is free."
        if host != LOOPBACK and error.errno != errno.EADDRINUSE:
            step = "Give --host an address of this computer."
        raise InputError("port", port, error.strerror or str(error), next_step=step) from None
    listening.listen()
    return listening


def _address(host: str, port: int) -> tuple:
    """The first address of a host; InputError for one without, and for one that stands for all: no request names it."""
    step = "Give the name or address by which other computers reach this one, such as --host 192.168.1.5."
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
    except (OSError, UnicodeError) as error:
        raise InputError("host", host, getattr(error, "strerror", "") or str(error), next_step=step) from None
    if ipaddress.ip_address(found[4][0].partition("%")[0]).is_unspecified:
        raise InputError("host", host, "stands for every address, and a request has to name one", next_step=step)
    return found


def make_server(
    listening: socket.socket, core: Any = None, *, access: Access | None = None, live: "Setup | None" = None
) -> Any:
    """The uvicorn server of the page on that socket's port; ``run(sockets=[listening])`` serves until it is stopped.

    Raises InputError if uvicorn is not installed, and as ``page_files``, which takes ``core``.
    """
    try:
        import uvicorn
    except ImportError:
        raise _not_installed("uvicorn") from None
    access = access or Access(LOOPBACK, listening.getsockname()[1])
    app = make_app(page_files(*([] if core is None else [core])), access, live)
    config = uvicorn.Config(
        app, http="h11", ws="none", log_level="warning", server_header=False, timeout_graceful_shutdown=GRACE_S
    )
    server = uvicorn.Server(config)
    app.state.ending = lambda: server.should_exit  # streams end then: the server waits for them
    return server


def serve(
    port: int, *, browser: bool, say: Callable[[str], None], host: str = LOOPBACK, live: "Setup | None" = None
) -> None:
    """Serve the page until Ctrl+C; ``say`` is given its address, which a browser is asked to open."""
    listening = listening_socket(port, host)
    try:
        own, port = listening.getsockname()[:2]
        access = Access.opened(host, port, loopback=is_loopback(own))
        server = make_server(listening, access=access, live=live)
        say(f"studio: {access.address} (Ctrl+C ends it)")
        if access.token:
            say("whoever has this address can read, and move what is connected; the network between is not encrypted")
        if browser:
            threading.Thread(target=webbrowser.open, args=(access.address,), daemon=True).start()
        server.run(sockets=[listening])
    finally:
        listening.close()


def _not_installed(name: str) -> InputError:
    return InputError(
        "studio", f"without {name}", "it serves the page", next_step='Run pip install "needleforce[studio]".'
    )
