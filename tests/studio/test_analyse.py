# SPDX-License-Identifier: Apache-2.0
"""A recording dropped on the page is identified as by the command line; it can be cancelled, and nothing in it runs."""

import json
import sys

import pytest
from browser import shows
from command_line import run as command

from needleforce.display.quantities import quantity
from needleforce.studio import recording_jobs

SLOW = (sys.executable, "-c", "import time; print('identifying', flush=True); time.sleep(60)")


def dropped(page, name: str, text: str):
    """The page after a file was dropped on its view."""
    page.click("#to-analyse")
    make = "([name, text]) => { const one = new DataTransfer(); one.items.add(new File([text], name)); return one; }"
    page.dispatch_event("#analyse", "drop", {"dataTransfer": page.evaluate_handle(make, [name, text])})
    return page


def test_a_dropped_recording_is_identified_as_by_the_command_line(opened, root, tmp_path):
    file = root / "examples" / "insertion.csv"
    page = dropped(opened(), "insertion.csv", file.read_text(encoding="utf-8"))
    page.wait_for_selector("#found:not([hidden])", timeout=120_000)
    assert command("identify", file, "--json", tmp_path / "fit.json").returncode == 0
    fit = json.loads((tmp_path / "fit.json").read_text(encoding="utf-8"))
    rows = [row.split("\t") for row in page.inner_text("#parameters tbody").splitlines()]
    assert [row[0].replace(" ", "_") for row in rows] == [each["name"] for each in fit["parameters"]]
    wanted = [quantity(each["value"], each["low"], each["high"], each["unit"]) for each in fit["parameters"]]
    assert [row[1] for row in rows] == [str(each) for each in wanted]
    (puncture,) = fit["recordings"][0]["events"]["punctures"]
    curve = page.evaluate(RESULT)
    assert curve["events"] == ["contact", "puncture", "exit"]
    assert curve["puncture"] == pytest.approx([puncture["depth_m"], puncture["force_N"]])
    assert page.inner_text("#warnings").splitlines() == fit["warnings"]
    with page.expect_popup() as popup:
        page.click("#report")
    popup.value.wait_for_load_state()
    assert popup.value.title() == "Needle force: insertion.csv" and popup.value.query_selector("svg [data-panel]")


# what the server gave the page last
RESULT = """async () => {
  const { result } = await (await fetch(document.getElementById("report").href.replace("/report", ""))).json();
  const { depth, force } = result.events.find((one) => one.kind === "puncture");
  return { events: result.events.map((one) => one.kind), puncture: [depth, force] };
}"""


def test_names_and_messages_are_text(opened):
    page = dropped(
        opened(), '<img src=x onerror="window.ran = 1">.csv', "<script>window.ran = 1</script>,b\n1,2\n3,4\n"
    )
    page.wait_for_selector("#progress.wrong", timeout=120_000)
    message = page.inner_text("#progress")
    assert "no column holds" in message and "cannot be chosen in the page yet" in message
    assert "/" not in message.split(":")[0]  # no place of the server
    assert page.query_selector("#progress img, #progress script") is None and page.evaluate("window.ran") is None


def test_a_running_fit_is_cancelled(opened, monkeypatch):
    monkeypatch.setattr(recording_jobs, "COMMAND", SLOW)
    page = dropped(opened(), "slow.csv", "1")
    shows(page, "#progress", "identifying")
    page.click("#cancel")
    shows(page, "#progress", "cancelled")
    assert not page.is_visible("#cancel") and not page.is_visible("#found")


def test_a_process_that_dies_is_said(opened, monkeypatch):
    monkeypatch.setattr(recording_jobs, "COMMAND", (sys.executable, "-c", "import os; os.abort()"))
    name = '<img src=x onerror="window.ran = 1">.csv'
    page = dropped(opened(), name, "1")
    page.wait_for_selector("#progress.wrong")
    assert page.inner_text("#progress").startswith(f"{name}: its process ended without a result")
    assert page.query_selector("#progress img") is None and page.evaluate("window.ran") is None
