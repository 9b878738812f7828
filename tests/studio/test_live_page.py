# SPDX-License-Identifier: Apache-2.0
"""The live view in a browser: a virtual rig is watched, stopped, lost and handed over. The recorder's process has a
simulated clock of its own."""

import http.client
import json
import re
import sys
import time
from contextlib import closing
from pathlib import Path

import pytest
from browser import shows
from studio_server import running

from needleforce.recording.log import read_log
from needleforce.studio import live, server
from needleforce.studio.live import Setup

RUN = (sys.executable, str(Path(__file__).with_name("simulated_run.py")))
PATIENT, IMPATIENT = ("3600",), ("2",)  # [s] of the simulated clock without a page


# orders to stop get no answer, and do not reach the server
UNANSWERED = """() => {
  const own = window.fetch;
  window.fetch = (place, options) => (place === "live/stop" ? new Promise(() => {}) : own(place, options));
}"""


@pytest.fixture
def served(wasm, tmp_path, monkeypatch):
    """Starts a server, on the given port or any; its recorder has these arguments."""

    def starts(arguments=PATIENT, port=0):
        monkeypatch.setattr(live, "COMMAND", (*RUN, *arguments))
        listening = server.listening_socket(port)
        made = server.make_server(listening, wasm, live=Setup(folder=tmp_path / "recordings"))
        return running(made, listening)

    return starts


@pytest.fixture
def page_at(browser):
    """Opens the live view of a server; what its console reports of a server that is away is no error here."""
    with closing(browser.new_context()) as context:

        def opens(port):
            page = context.new_page()
            page.goto(f"http://127.0.0.1:{port}/")
            page.wait_for_selector("#simulator:not([hidden])")
            page.click("#to-live")
            shows(page, "#live-connection", "connected to the server")
            return page

        yield opens


def begin(page, depth="12", speed="0.5"):
    for name, value in {"start": "−4", "depth": depth, "speed": speed, "hold": "0"}.items():
        page.fill(f"#live-{name}", value)
    page.click("#live-begin")
    shows(page, "#live-facts", "insertion")


def state_of(port):
    """What the server streams first to a page that comes."""
    with closing(http.client.HTTPConnection("127.0.0.1", port, timeout=30)) as connection:
        connection.request("GET", "/live/stream")
        return json.loads(connection.getresponse().readline().removeprefix(b"data: "))


def accounted(page, log):
    """Whether every reading of the file is drawn or counted, and the events are the recorder's."""
    (counts,) = re.findall(r"(\d+) readings, (\d+) drawn", page.inner_text("#live-drawn"))
    readings, drawn = map(int, counts)
    assert readings == len(log.wrench) and 0 < drawn <= readings
    shown = [re.split(r"s\s+", line, maxsplit=1)[1] for line in page.inner_text("#live-events ol").splitlines()]
    assert [each.split(":")[0] for each in shown] == [mark.kind for mark in log.marks]


def test_a_run_is_watched_by_two_pages_stopped_by_the_second_and_opened_in_analyse(served, page_at, tmp_path):
    with served() as port:
        first, second = page_at(port), page_at(port)
        begin(first)
        shows(second, "#live-facts", "insertion")
        assert first.is_visible("#stop") and second.is_disabled("#live-begin")
        asked = {"method": "POST", "body": json.dumps({"rig": "virtual"})}
        again = second.evaluate("async (asked) => (await fetch('live/start', asked)).json()", asked)
        assert "there is one at a time" in again["error"]
        second.keyboard.press("Space")
        for page in (first, second):
            shows(page, "#live-outcome", "Stopped (stop button): at rest at ")
            assert not page.is_visible("#stop") and not page.is_visible("#alarm")
        (file,) = (tmp_path / "recordings").iterdir()
        log = read_log(file)
        assert log.complete and log.end["ended"] == "interrupted" and float(log.end["stop_depth"]) < 11e-3
        for page in (first, second):
            accounted(page, log)
        first.click("#live-analyse")
        first.wait_for_selector("#analyse:not([hidden])")
        shows(first, "#files", file.name)


@pytest.mark.long
def test_thirty_seconds_are_drawn_or_counted_with_the_events_of_the_recorder(served, page_at, tmp_path):
    with served() as port:
        page = page_at(port)
        begin(page, speed="1.2")
        page.wait_for_selector("#live-analyse", timeout=300_000)
        (file,) = (tmp_path / "recordings").iterdir()
        log = read_log(file)
        assert log.end["ended"] == "done" and float(log.end["seconds"]) > 26.0
        accounted(page, log)


def test_a_rig_that_stops_answering_is_an_alarm_with_what_to_do(served, page_at):
    with served((*PATIENT, "axis_silent_at_s=2.5")) as port:
        page = page_at(port)
        begin(page)
        shows(page, "#live-outcome", "Ended early: axis silent")
        shows(page, "#alarm", "The axis was not seen to stop: ordered to stop")
        shows(page, "#alarm", "Press the emergency stop of the rig, or switch the axis off.")


def test_a_stop_without_an_answer_is_an_alarm_and_a_closed_page_stops_the_axis(served, page_at):
    with served(IMPATIENT) as port:
        page = page_at(port)
        page.evaluate(UNANSWERED)
        page.click("#live-begin")
        page.click("#stop")
        shows(page, "#alarm", "The server has not answered the stop within 1 s. Press the emergency stop")
        page.close()
        end = time.monotonic() + 60
        while (state := state_of(port))["state"] != "ended":
            assert time.monotonic() < end
            time.sleep(0.2)
        assert state["stopping"]["why"] == "no page looks on" and state["confirmed"]


def test_a_server_that_ends_stops_the_axis_and_the_page_waits_for_the_next_one(served, page_at, tmp_path):
    with served() as port:
        page = page_at(port)
        begin(page)
    (file,) = (tmp_path / "recordings").iterdir()  # closed when the server had ended
    assert read_log(file).complete and read_log(file).end["ended"] == "interrupted"
    shows(page, "#live-connection", "The server does not answer")
    shows(page, "#alarm", "No word from the server")
    with served(port=port):
        shows(page, "#live-connection", "connected to the server")
        shows(page, "#live-outcome", "The server was started again")
        assert not page.is_visible("#alarm") and page.is_enabled("#live-begin")
