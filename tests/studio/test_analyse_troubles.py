# SPDX-License-Identifier: Apache-2.0
"""What goes wrong with recordings on the page is stated in words, and nothing that was done is lost."""

import json
import sys
import time
import urllib.request

import pytest
from browser import shows
from studio_server import running
from test_analyse import FIT, dropped, ended, given_away, parameters

from needleforce.studio import recording_jobs, server

SLOW = (sys.executable, "-c", "import time; print('identifying 2 of 50', flush=True); time.sleep(60)")
ENDS = (sys.executable, "-c", "import os; os.abort()")
NAME = '<img src=x onerror="window.ran = 1">.csv'


@pytest.fixture
def slow(monkeypatch):
    monkeypatch.setattr(recording_jobs, "COMMAND", SLOW)


def test_a_running_fit_of_many_files_is_cancelled(opened, slow):
    page = dropped(opened(), {f"{k}.csv": "1" for k in range(50)})
    shows(page, "#progress", "identifying 2 of 50")
    assert page.locator("#files li").count() == 50 and page.inner_text("#files li:last-child .state") == "reading"
    page.click("#cancel")
    shows(page, "#progress", "Cancelled")
    assert not page.is_visible("#cancel") and not page.is_visible("#found")


def test_a_tab_that_is_closed_ends_its_fit_and_no_other(opened, address, slow):
    pages, keys = [opened(), opened()], []
    for page in pages:
        with page.expect_response("**/fits") as answer:
            dropped(page, {"a.csv": "1"})
        keys.append(answer.value.json()["key"])
        shows(page, "#progress", "identifying")
    pages[0].goto("about:blank")
    for _ in range(100):
        states = []
        for key in keys:
            with urllib.request.urlopen(f"{address}fits/{key}") as answer:
                states.append(json.load(answer)["state"])
        if states == ["cancelled", "running"]:
            break
        time.sleep(0.05)
    assert states == ["cancelled", "running"]
    pages[1].click("#cancel")
    shows(pages[1], "#progress", "Cancelled")


def test_a_process_that_dies_is_stated_and_names_are_text(opened, monkeypatch):
    monkeypatch.setattr(recording_jobs, "COMMAND", ENDS)
    page = dropped(opened(), {NAME: "1"})
    page.wait_for_selector("#progress.wrong")
    assert page.inner_text("#progress").startswith("The process ended without a result")
    assert page.inner_text("#files .name") == NAME
    assert page.query_selector("#files img") is None and page.evaluate("window.ran") is None


def test_a_server_that_is_stopped_and_started_loses_nothing(browser, wasm, root, tmp_path):
    listening = server.listening_socket(0)
    page = browser.new_context().new_page()
    try:
        with running(server.make_server(listening, wasm), listening) as port:
            page.goto(f"http://127.0.0.1:{port}/")
            page.wait_for_selector("#simulator:not([hidden])")
            page.click("#to-analyse")
            page.set_input_files("#file", root / "examples" / "insertion.csv")
            page.wait_for_selector("#found:not([hidden])", timeout=FIT)
            before = parameters(page)
        page.click("#identify")
        shows(page, "#progress", "Start needleforce studio again")
        assert parameters(page) == before
        assert "nf.read('insertion.csv')" in given_away(page, "py", tmp_path).read_text(encoding="utf-8")
        listening = server.listening_socket(port)
        with running(server.make_server(listening, wasm), listening):
            page.click("#identify")
            shows(page, "#progress", "1 recording: model")
            assert parameters(ended(page)) == before
    finally:
        page.context.close()
