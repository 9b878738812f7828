# SPDX-License-Identifier: Apache-2.0
"""One run, from the bias at rest to the closed file, whatever happens on the way."""

import contextlib
import signal
import threading
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from ..errors import InputError
from .force_monitor import ForceWatch
from .motion_sequence import Course
from .preparation import await_readings, take_bias, withdraw
from .run import Run
from .run_writer import Keeper
from .settings import Outcome, Progress, Settings
from .sources.source import ForceSource


def record_run(
    path,
    force: ForceSource,
    axis,
    moves: Sequence[tuple[float, float]],
    card: Mapping[str, str],
    settings: Settings,
    *,
    view: Callable[[Progress], None] | None = None,
    stop: threading.Event | None = None,
) -> Outcome:
    """Record one run into ``path``: bias at rest, then ``moves`` (depth [m], speed [m/s]; to where the tip is: a time
    [s] to wait). Without any it goes on for ``settings.duration``, or until it is stopped or the source ends. A first
    move outwards is made before the bias is taken, and is not in the file.

    Both sources are stopped and closed at the end. Ctrl-C or ``stop`` ends a run and its file. Raises InputError, or
    KeyboardInterrupt, for what prevents the start; there is no file then. Every later end is in the outcome.
    """
    import mcap.writer  # noqa: F401 - before anything comes: an import holds up every thread

    stop = threading.Event() if stop is None else stop
    watch = ForceWatch(force, axis, settings, stop)
    try:
        _check(Path(path), axis, moves, settings)
        force.start()  # may wait for a header: Ctrl-C breaks into it, nothing is open yet
        with _interrupts(stop):
            watch.start()
            await_readings(watch, 0.0, settings.silence, stop)
            if moves:
                withdraw(axis, moves[0], watch, settings.silence, stop)
            bias = take_bias(watch, settings, stop)
            writer = _writer(path, force, card, settings)
            keeper = Keeper(writer, force)
            course = Course(axis, moves, settings.silence, watch.send_move) if moves else None
            heard = axis or getattr(force, "axis", None)  # samples on standard input can have a depth beside them
            return Run(Path(path), keeper, watch, heard, bias, settings, view).run(course, stop)
    finally:
        if axis:
            axis.stop()
        watch.stop()
        force.stop()
        if axis:
            axis.close()


def _check(path: Path, axis, moves, settings: Settings) -> None:
    """Refuse what cannot be done before anything is started."""
    if path.exists():
        raise InputError("output", str(path), "exists; a recording is never written over", "", "Name another file.")
    if not path.parent.is_dir():
        raise InputError("folder", str(path.parent), "does not exist", "", "Make it first.")
    if axis is None and moves:
        raise InputError("axis", "none", "moves need one")
    here = None
    for depth, speed in moves:
        if depth != here:
            fastest = axis.limits.max_speed
            axis.check_move(depth, min(speed, fastest) if here is None else speed)  # the first may be a wait
        elif not 0.0 <= speed <= 1e6:
            raise InputError("hold", speed, "outside 0 to 1e6 s")
        here = depth


def _writer(path, force: ForceSource, card: Mapping[str, str], settings: Settings):
    from ..recording.log.writer import LogWriter

    configuration = getattr(force, "configuration", None)
    told = {"axial": settings.axial, "filter_length": str(settings.filter_length)}
    told |= {"wrench_rate_Hz": f"{force.clock_rate:.12g}", "sensor_serial": getattr(configuration, "serial", "")}
    return LogWriter(path, told | dict(card))


@contextlib.contextmanager
def _interrupts(stop: threading.Event):
    """Ctrl-C, or the end of the terminal, sets ``stop`` and breaks into no write, where this thread may say so."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    asked = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
    heeded = {
        number: handler for number in asked if (handler := signal.getsignal(number)) not in (signal.SIG_IGN, None)
    }
    for number in heeded:
        signal.signal(number, lambda *_: stop.set())
    try:
        yield
    finally:
        for number, handler in heeded.items():
            signal.signal(number, handler)
