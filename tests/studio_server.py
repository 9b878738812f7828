# SPDX-License-Identifier: Apache-2.0
"""The studio's server in a thread of the tests."""

import threading
import time
from contextlib import contextmanager


@contextmanager
def running(made, listening):
    """A server of uvicorn's in a thread, until the block ends."""
    thread = threading.Thread(target=made.run, kwargs={"sockets": [listening]})
    thread.start()
    while not made.started:
        time.sleep(0.01)
    yield listening.getsockname()[1]
    made.should_exit = True
    thread.join()
