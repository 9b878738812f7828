# SPDX-License-Identifier: Apache-2.0
"""``needleforce watch``: a replay, lines of a program, a stream that stalls, and what other programs read of it."""

import io
import json
import os
import subprocess
import sys
import threading

import numpy as np
import pytest
from typer.testing import CliRunner

import needleforce as nf
from needleforce.acquisition.sources.standard_input import StandardInput
from needleforce.cli import app
from needleforce.commands.watch_view import view_of
from needleforce.events import Row, Watch, rows, rows_of_lines

CODE = "from needleforce.cli import main; main()"


def insertion(rate=100):
    """Contact at 2 mm, 250 N/m, a fall from 1.5 N to 0.5 N at 8 mm; 2 mm/s."""
    time = np.arange(0, 6.0, 1 / rate)
    depth = 2e-3 * time
    force = np.where(depth < 8e-3, 250.0 * np.maximum(depth - 2e-3, 0.0), 0.5)
    return time, force + 1e-3 * np.random.default_rng(1).standard_normal(len(time)), depth


@pytest.fixture
def file(tmp_path):
    rows = zip(*insertion(), strict=True)
    lines = ["time [s],force [N],depth [mm]", *(f"{t:.3f},{f:.5f},{1e3 * z:.4f}" for t, f, z in rows)]
    (tmp_path / "run.csv").write_text("\n".join(lines) + "\n")
    return tmp_path / "run.csv"


def watched(*arguments):
    return CliRunner().invoke(app, ["watch", *(str(each) for each in arguments)])


def documents(text):
    return [json.loads(line) for line in text.splitlines()]


def test_a_replay_shows_events_and_writes_a_line_an_event_and_one_a_second(file, tmp_path):
    done = watched(file, "--speed", "max", "--json", tmp_path / "out.jsonl")
    assert done.exit_code == 0, done.output
    assert "puncture: 3.9" in done.stderr and "time 5.00 s" in done.stderr and "puncture" in done.stdout
    begin, *lines, end = documents((tmp_path / "out.jsonl").read_text())
    assert begin["kind"] == "begin" and end["kind"] == "end" and end["rows"] == 600
    assert [each["time_s"] for each in lines if each["kind"] == "second"] == pytest.approx([1, 2, 3, 4, 5])
    events = {each["event"]: each for each in lines if each["kind"] == "event"}
    assert list(events) == ["contact", "puncture", "sliding"]
    assert events["puncture"]["depth_m"] == pytest.approx(8e-3, abs=5e-5)
    assert events["sliding"]["force_change_N"] == pytest.approx(1.0, abs=0.02)
    # a larger fall is none
    done = watched(file, "--speed", "max", "--json", "-", "--fall-N", "2")
    assert "puncture" not in [each.get("event") for each in documents(done.stdout)]


def test_where_no_puncture_is_found_the_fall_that_was_looked_for_is_named(file):
    assert "No fall of at least" not in watched(file, "--speed", "max").output
    assert "No fall of at least 2 N" in watched(file, "--speed", "max", "--fall-N", "2").output


def test_a_replay_gives_each_row_when_it_is_due(file, monkeypatch):
    now = [0.0]
    monkeypatch.setattr(rows.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(rows.time, "sleep", lambda seconds: now.__setitem__(0, now[0] + seconds))
    given = []
    for batch in rows.replayed(nf.read(file), speed=5.0):
        given += [(row.time, 5.0 * now[0]) for row in batch]
    assert len(given) == 600
    assert all(due <= at + 1e-9 < due + 5.0 * 0.02 + 1e-6 for due, at in given)


@pytest.mark.parametrize(
    "first, line",
    [("time_s,fz_N,depth_mm", "{:.4f},{:.5f},{:.5f}"), (None, '{{"t_s": {:.4f}, "fz_N": {:.5f}, "depth_mm": {:.5f}}}')],
)
def test_lines_of_a_program_are_watched(first, line):
    reading, writing = os.pipe()
    text = "".join(line.format(t, f, 1e3 * z) + "\n" for t, f, z in zip(*insertion(), strict=True))
    with os.fdopen(reading, "rb") as stream, os.fdopen(writing, "w") as program:
        header = f"{first}\n" if first else ""
        writer = threading.Thread(target=lambda: (program.write(header + text), program.close()))
        writer.start()
        watch = Watch()
        for batch in rows_of_lines(StandardInput(stream)):
            for row in batch:
                watch.add(row)
        writer.join()
    assert [event.kind for event in watch.events] == ["contact", "puncture", "sliding"]
    assert watch.rows == 600 and watch.row == Row(*(pytest.approx(v, abs=2e-3) for v in (5.99, 0.5, 11.98e-3)))


def lines_with(change):
    """Lines of an insertion in which `change(lines)` puts what a program may do."""
    lines = [f"{t:.4f},{f:.5f},{1e3 * z:.5f}" for t, f, z in zip(*insertion(), strict=True)]
    change(lines)
    return "time_s,fz_N,depth_mm\n" + "\n".join(lines) + "\n"


def clock_restarts(lines):
    lines[200:] = [f"{float(t) - 1.9:.4f},{rest}" for t, rest in (each.split(",", 1) for each in lines[200:])]


def one_comes_late(lines):
    lines.insert(300, lines[290])


def some_are_no_numbers(lines):
    lines[100:120:2] = ["0.1,nan,2", "text"] * 5  # the last one is line 119


@pytest.mark.parametrize(
    "change, rows, lost, words",
    [
        (clock_restarts, 600, {"restarts": 1, "restart_row": 201}, "clock restarts: 1, the last one at row 201"),
        (one_comes_late, 600, {"late": 1}, "the last one at 2.900 s. Write rows in the order"),
        (some_are_no_numbers, 590, {"unreadable": 10, "unreadable_line": 119}, "10 of 600, the last one line 119"),
    ],
)
def test_what_a_stream_loses_is_stated_and_the_rest_is_watched(change, rows, lost, words, monkeypatch, capsys):
    reading, writing = os.pipe()
    with os.fdopen(writing, "w") as program:
        program.write(lines_with(change))
    with io.TextIOWrapper(os.fdopen(reading, "rb")) as stream, pytest.raises(SystemExit) as done:
        monkeypatch.setattr(sys, "stdin", stream)
        app(["watch", "-", "--json", "-", "--plain"])
    written, shown = capsys.readouterr()
    *lines, end = documents(written)
    assert done.value.code == 0 and end["rows"] == rows
    assert end | lost == end and words in " ".join(shown.split())
    assert [each["kind"] for each in lines].count("lost") >= 1
    times = [each["time_s"] for each in lines if each["kind"] == "second"]
    assert times == sorted(times) and [each.get("event") for each in lines if "event" in each] != []


def test_a_stream_that_stalls_is_shown_as_such_and_ends_with_its_program():
    lines = "time_s,fz_N,depth_mm\n" + "".join(f"{k / 100:.2f},0.001,0\n" for k in range(20))
    command = [sys.executable, "-c", CODE, "watch", "-", "--json", "-"]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen(command, **pipes) as program:
        program.stdin.write(lines)
        program.stdin.flush()
        for line in program.stdout:  # ends only if the stall is written
            if json.loads(line)["kind"] == "stalled":
                break
        out, shown = program.communicate(timeout=60)
    assert program.returncode == 0 and json.loads(out.splitlines()[-1])["kind"] == "end"
    assert "stalled: no row for 1 s" in shown


@pytest.mark.parametrize(
    "arguments, code, words",
    [
        (["nothing.csv"], 1, "nothing.csv"),
        (["x.csv", "--speed", "0"], 2, "--speed max"),
        (["rig"], 2, "--sensor and --axis"),
        (["x.csv", "--stop-at", "puncture"], 2, "needleforce watch rig"),
    ],
)
def test_what_cannot_be_watched_is_refused_with_the_next_step(arguments, code, words):
    done = watched(*arguments)
    assert done.exit_code == code or (code == 2 and words in str(done.exception))
    assert words in done.output + str(done.exception)


def test_a_terminal_shows_curve_state_and_events(monkeypatch):
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(sys, "stderr", Terminal())
    watch = Watch()
    with view_of(plain=False) as view:
        view.begin("run.csv", watch)
        for row in map(Row._make, zip(*insertion(), strict=True)):
            view.row(row)
            if event := watch.add(row):
                view.event(event)
        view.stalled(2.0)
        view.refresh()
    shown = sys.stderr.getvalue()
    for text in ("run.csv", "depth [mm]", "puncture", "noise", "no row for 2 s"):
        assert text in shown
