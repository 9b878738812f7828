# SPDX-License-Identifier: Apache-2.0
from contextlib import contextmanager

import pytest
from browser import CHROMIUM, WITHOUT, chromium
from studio_server import running

from needleforce.studio import server


@pytest.fixture(scope="module")
def browser():
    """Of a file: left open behind the last test of the studio, it would end amid the last test of the process."""
    if CHROMIUM is None:
        pytest.skip(WITHOUT)
    with chromium() as opened:
        yield opened


@pytest.fixture(scope="module")
def address(wasm):
    """The page as the studio's own server gives it."""
    listening = server.listening_socket(0)
    with running(server.make_server(listening, wasm), listening) as port:
        yield f"http://127.0.0.1:{port}/"


@contextmanager
def _pages(browser, address):
    """Opens pages; at the end nothing came from elsewhere, and no page reported an error."""
    context, foreign, errors = browser.new_context(), [], []

    def opens(link=address, more=None):
        page = context.new_page()
        own = ("blob:", address)
        page.on("request", lambda each: foreign.append(each.url) if not each.url.startswith(own) else None)
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
        if more:
            page.add_init_script(more)
        page.goto(link)
        page.wait_for_selector("#simulator:not([hidden]), #trouble:not([hidden])")
        return page

    yield opens
    context.close()
    assert foreign == [] and errors == []


@pytest.fixture
def opened(browser, address):
    """Opens a page of this test's own."""
    with _pages(browser, address) as opens:
        yield opens


@pytest.fixture(scope="module")
def opened_once(browser, address):
    """Opens a page for all tests of a file."""
    with _pages(browser, address) as opens:
        yield opens
