# SPDX-License-Identifier: Apache-2.0
"""The studio's server in a thread of the tests, and requests to it."""

import http.client
import threading
import time
from contextlib import closing, contextmanager

ENDS_S = 300.0  # after which a server is taken to hang


@contextmanager
def running(made, listening):
    """A server of uvicorn's in a thread, until the block ends."""
    thread = threading.Thread(target=made.run, kwargs={"sockets": [listening]}, daemon=True)
    thread.start()
    while not made.started:
        assert thread.is_alive()
        time.sleep(0.01)
    yield listening.getsockname()[1]
    made.should_exit = True
    thread.join(ENDS_S)
    assert not thread.is_alive()


def answer(port: int, path: str = "/", method: str = "GET", body: bytes = b"", **headers):
    """Status, body and headers of the answer to a request."""
    with closing(http.client.HTTPConnection("127.0.0.1", port, timeout=30)) as connection:
        connection.putrequest(method, path, skip_host=True)
        length = {"Content-Length": str(len(body))} if body else {}
        for name, value in {"Host": f"127.0.0.1:{port}", **length, **headers}.items():
            connection.putheader(name, value)
        connection.endheaders(body or None)
        got = connection.getresponse()
        return got.status, got.read(), got.headers
