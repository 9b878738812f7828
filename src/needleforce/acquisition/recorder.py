# SPDX-License-Identifier: Apache-2.0
"""One run, from the bias at rest to the closed file, whatever happens on the way."""

import contextlib
import signal
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from ..errors import InputError
from .course import Course
from .force_watch import ForceWatch
from .keeper import Keeper
from .rest_bias import bias_of
from .run import EVERY, Progress, Run
from .settings import Bias, Outcome, Settings
from .source import ForceSource


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
    [s] to wait). Without any it goes on for ``settings.duration``, or until it is stopped or the source ends.

    Both sources are stopped and closed at the end. Ctrl-C or ``stop`` ends a run and its file. Raises InputError, or
    KeyboardInterrupt, for what prevents the start; there is no file then. Every later end is in the outcome.
    """
    stop = threading.Event() if stop is None else stop
    watch = ForceWatch(force, axis, settings)
    try:
        _check(Path(path), axis, moves, settings)
        with _interrupts(stop):
            force.start()
            watch.start()
            bias = _rest(watch, settings, stop)
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
            axis.check_move(depth, speed)
        elif not 0.0 <= speed <= 1e6:
            raise InputError("hold", speed, "outside 0 to 1e6 s")
        here = depth


def _rest(watch: ForceWatch, settings: Settings, stop: threading.Event) -> Bias:
    """The bias from the first ``bias_time`` of readings; sets that of the watch. What was read stays in its queue."""
    begun = time.monotonic()
    while not watch.samples or watch.samples[-1].arrival - watch.samples[0].arrival < 1e9 * settings.bias_time:
        if stop.is_set():
            raise KeyboardInterrupt
        if watch.error:
            raise watch.error if isinstance(watch.error, InputError) else InputError("sensor", "lost", str(watch.error))
        if time.monotonic() - max(begun, watch.last) > settings.silence:
            advice = "Check its address, and that no one else reads it."
            raise InputError("sensor", "silent", f"nothing came for {settings.silence:g} s", "", advice)
        time.sleep(EVERY)
    bias = bias_of(list(watch.samples), settings) if settings.bias_time else Bias()
    watch.bias = bias.wrench[settings.column]
    return bias


def _writer(path, force: ForceSource, card: Mapping[str, str], settings: Settings):
    from ..recording.log.writer import LogWriter

    configuration = getattr(force, "configuration", None)
    told = {"axial": settings.axial, "filter_length": str(settings.filter_length)}
    told |= {"wrench_rate_Hz": f"{force.clock_rate:.12g}", "sensor_serial": getattr(configuration, "serial", "")}
    return LogWriter(path, told | dict(card))


@contextlib.contextmanager
def _interrupts(stop: threading.Event):
    """Ctrl-C sets ``stop`` instead of breaking into a write, where this thread may say so."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, lambda *_: stop.set())
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
