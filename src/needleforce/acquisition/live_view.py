# SPDX-License-Identifier: Apache-2.0
"""What a run looks like in a terminal while it is recorded; on standard error, where somebody watches."""

import contextlib
import sys
from collections.abc import Callable, Iterator

from .settings import Progress


class Rates:
    """Readings a second [Hz] and losses over the last second, from totals."""

    def __init__(self):
        self._before: list[Progress] = []

    def over_last_second(self, now: Progress) -> tuple[float | None, int]:
        """Rate and losses up to ``now``; no rate from a first look."""
        self._before.append(now)
        while len(self._before) > 2 and now.seconds - self._before[1].seconds >= 1.0:
            self._before.pop(0)
        then = self._before[0]
        span = now.seconds - then.seconds
        return (now.received - then.received) / span if span > 0.0 else None, now.lost - then.lost


def facts(now: Progress, rate: float | None, lost: int) -> list[tuple[str, str]]:
    """What is shown, as names and texts."""
    depth = "-" if now.depth is None else f"{1e3 * now.depth:8.2f} mm"
    return [
        ("time", f"{now.seconds:8.1f} s"),
        ("phase", now.phase or "-"),
        ("force", f"{now.force:8.3f} N"),
        ("depth", depth),
        ("rate", "-" if rate is None else f"{rate:8.0f} Hz"),
        ("lost", f"{now.lost} ({lost} in the last second)"),
        ("bias", f"{now.bias:8.3f} N"),
    ]


@contextlib.contextmanager
def live_view(plain: bool = False) -> Iterator[Callable[[Progress], None] | None]:
    """A view for ``record_run``: a panel in a terminal, a line a second where ``plain``, else none."""
    if plain:
        yield _lines()
    elif not sys.stderr.isatty():
        yield None
    else:
        with _panel() as view:
            yield view


def _lines() -> Callable[[Progress], None]:
    rates, told = Rates(), [-1]

    def view(now: Progress) -> None:
        rate, lost = rates.over_last_second(now)
        if int(now.seconds) > told[0]:
            told[0] = int(now.seconds)
            print(", ".join(f"{name} {text.strip()}" for name, text in facts(now, rate, lost)), file=sys.stderr)

    return view


@contextlib.contextmanager
def _panel() -> Iterator[Callable[[Progress], None]]:
    from rich.console import Console
    from rich.live import Live
    from rich.text import Text

    rates = Rates()
    with Live(console=Console(stderr=True), auto_refresh=False, transient=True) as live:

        def view(now: Progress) -> None:
            rate, lost = rates.over_last_second(now)
            text = Text()
            for name, value in facts(now, rate, lost):
                style = "bold red" if name == "lost" and now.lost else "bold"
                text.append(f"{name:>6}  ").append(f"{value}\n", style=style)
            live.update(text, refresh=True)

        yield view
