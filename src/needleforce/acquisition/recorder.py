# SPDX-License-Identifier: Apache-2.0
"""One run, from the readings and the bias at rest to the closed file, whatever happens on the way."""

import contextlib
import signal
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..wire.rdt import is_fault, status_words
from .force_monitor import ForceMonitor
from .motion_sequence import DONE, REACHED, MotionSequence, RunEnded
from .run import EVERY, Run
from .run_writer import RunWriter
from .settings import Progress, RestBias, RunResult, Settings
from .sources.source import ForceSample, ForceSource

_SLOWEST = 10.0  # times as long as its own clock says that the bias may take
_ADVICE = "Check its address, and that no one else reads it."
FEWEST = 10  # readings
_ADVICE_AT_REST = "Keep the needle free and at rest, or allow more with --steady-N."


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
) -> RunResult:
    """Record one run into ``path``: bias at rest, then ``moves`` (depth [m], speed [m/s]; to where the tip is: a time
    [s] to wait). Without any it goes on for ``settings.duration``, or until it is stopped or the source ends. A first
    move outwards is made before the bias is taken, and is not in the file.

    Both sources are stopped and closed at the end. Ctrl-C or ``stop`` ends a run and its file. Raises InputError, or
    KeyboardInterrupt, for what prevents the start; there is no file then. Every later end is in the outcome.
    """
    import mcap.writer  # noqa: F401 - before anything comes: an import holds up every thread

    stop = threading.Event() if stop is None else stop
    watch = ForceMonitor(force, axis, settings, stop)
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
            run_writer = RunWriter(writer, force)
            course = MotionSequence(axis, moves, settings.silence, watch.send_move) if moves else None
            heard = axis or getattr(force, "axis", None)  # samples on standard input can have a depth beside them
            return Run(Path(path), run_writer, watch, heard, bias, settings, view).run(course, stop)
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


def await_readings(watch: ForceMonitor, seconds: float, silence: float, stop: threading.Event) -> None:
    """Until there are readings over so many ``seconds`` of their own clock. Raises InputError where none come, or their
    clock hardly goes on; KeyboardInterrupt.
    """
    until = time.monotonic() + silence + _SLOWEST * seconds
    while not watch.samples or watch.samples[-1].device - watch.samples[0].device < 1e9 * seconds:
        _check_monitor(watch, stop)
        if time.monotonic() - watch.last > silence:
            raise InputError("sensor", "silent", f"nothing came for {silence:g} s", "", _ADVICE)
        if time.monotonic() > until:
            raise _standing(watch, silence + _SLOWEST * seconds, seconds)
        time.sleep(EVERY)


def _standing(watch: ForceMonitor, waited: float, seconds: float) -> InputError:
    gone = (watch.samples[-1].device - watch.samples[0].device) * 1e-9 if watch.samples else 0.0
    limit = f"{seconds:g} s are needed; its counter or its times hardly go on"
    advice = "Check the rate on the sensor's page, or the times in the lines."
    return InputError("sensor's clock", f"{gone:.3g} s on after {waited:.1f} s", limit, "bias", advice)


def withdraw(axis, move: tuple[float, float], watch: ForceMonitor, patience: float, stop: threading.Event) -> None:
    """Make a move that goes outwards: a needle in tissue is not at rest. Any other is left as it is."""
    state = _gone(MotionSequence(axis, [], patience, watch.send_move), axis, watch, stop)
    if move[0] < state.depth - REACHED:
        axis.check_move(*move)
        _gone(MotionSequence(axis, [move], patience, watch.send_move), axis, watch, stop)
        watch.samples.clear()


def take_bias(watch: ForceMonitor, settings: Settings, stop: threading.Event) -> RestBias:
    """The bias from ``bias_time`` of readings; the watch then holds its limit. What was read stays in its queue."""
    await_readings(watch, settings.bias_time, settings.silence, stop)
    bias = RestBias()
    if settings.bias_time:
        samples = list(watch.samples)
        bias = bias_of([s for s in samples if s.device - samples[0].device <= 1e9 * settings.bias_time], settings)
    watch.bias = bias.wrench[settings.column]
    return bias


def _gone(course: MotionSequence, axis, watch: ForceMonitor, stop: threading.Event):
    """The state of the axis at the end of a course. Raises InputError where it ends badly."""
    try:
        while True:
            _check_monitor(watch, stop)
            course.hear(axis.receive(), time.monotonic())
            course.step(time.monotonic())
            time.sleep(EVERY)
    except RunEnded as ended:
        if ended.why != DONE:
            raise InputError("axis", ended.why.removeprefix("axis "), ended.detail) from None
        return course.state


def _check_monitor(watch: ForceMonitor, stop: threading.Event) -> None:
    if stop.is_set():
        raise KeyboardInterrupt
    if isinstance(watch.error, EOFError):
        raise InputError("source", "ended", "before the bias was taken")
    if watch.error:
        raise watch.error if isinstance(watch.error, InputError) else InputError("sensor", "lost", str(watch.error))


def bias_of(samples: list[ForceSample], settings: Settings) -> RestBias:
    """Mean and noise of healthy readings. Raises InputError for too few, or for an axial force that is not steady.

    Steady: the mean of the last third within ``settings.steady`` [N] of that of the first, and so the noise.
    """
    healthy = [sample.wrench for sample in samples if not is_fault(sample.status)]
    fewest = max(FEWEST, len(samples) // 2)
    if len(healthy) < fewest:
        words = status_words(next((s.status for s in samples if is_fault(s.status)), 0))
        limit = f"{fewest} of {len(samples)} must be healthy; status: {words}"
        raise InputError("readings at rest", len(healthy), limit, "bias", "Give a longer rest with --bias-s, or 0.")
    wrench = np.array(healthy)
    _check_steady(wrench[:, settings.column], settings.steady)
    mean, noise = wrench.mean(axis=0), wrench.std(axis=0, ddof=1)
    return RestBias(tuple(mean.tolist()), tuple(noise.tolist()), len(healthy))


def _check_steady(force: np.ndarray, steady: float) -> None:
    third = len(force) // 3
    drift = float(force[-third:].mean() - force[:third].mean())
    if not abs(drift) <= steady:
        limit = f"more than {steady:g} N: it drifts, or the needle touches"
        raise InputError("change of the force at rest", f"{drift:.3f} N", limit, "bias", _ADVICE_AT_REST)
    noise = float(force.std(ddof=1))
    if not noise <= steady:
        limit = f"more than {steady:g} N: it shakes, or the needle touches"
        raise InputError("standard deviation of the force at rest", f"{noise:.3f} N", limit, "bias", _ADVICE_AT_REST)
