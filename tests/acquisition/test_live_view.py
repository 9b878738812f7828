"""The text of a live view, for given totals."""

import io
import sys

from needleforce.acquisition.settings import Progress
from needleforce.commands.record import Rates, live_view


def progress(seconds, received, lost=0, depth=0.00525):
    return Progress(
        seconds=seconds, received=received, lost=lost, force=1.2345, depth=depth, phase="insertion", bias=-0.25
    )


def test_rate_and_losses_are_those_of_the_last_second():
    rates = Rates()
    assert rates.over_last_second(progress(0.0, 0)) == (None, 0)
    shown = [rates.over_last_second(progress(0.125 * k, 125 * k - k // 8, k // 8)) for k in range(1, 33)]
    assert shown[3] == (1000.0, 0)
    assert shown[-1] == (999.0, 1)


def test_the_plain_view_prints_one_line_per_second(monkeypatch):
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    with live_view(plain=True) as view:
        for k in range(1, 24):
            view(progress(0.125 * k, 125 * k, 3, None if k == 1 else 0.00525))
    lines = sys.stderr.getvalue().splitlines()
    assert len(lines) == 3
    assert lines[0].endswith("depth -, rate -, lost 3 (0 in the last second), bias -0.250 N")
    assert "force 1.234 N, depth 5.25 mm, rate 1000 Hz" in lines[1] or "force 1.235 N" in lines[1]


def test_without_a_terminal_there_is_no_view(monkeypatch):
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    with live_view() as view:
        assert view is None
    assert sys.stderr.getvalue() == ""


def test_a_terminal_shows_a_panel(monkeypatch):
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(sys, "stderr", Terminal())
    with live_view() as view:
        view(progress(0.5, 500, 7))
    for text in ("insertion", "5.25 mm", "7 (0 in the last second)"):
        assert text in sys.stderr.getvalue()
