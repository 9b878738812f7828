# SPDX-License-Identifier: Apache-2.0
"""Recording of one run, from the first readings and the bias at rest to the closed file."""

import contextlib
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..recording.log.writer import part_path
from ..wire.axis_lines import AxisState
from ..wire.net_ft import is_fault, status_words
from .axis_check import MAX_DEVIATION_M, POSITION_TOLERANCE_M, REST_WINDOW_S, check_declared
from .motion_sequence import EndReason, MotionSequence, RunEnded
from .run import POLL_INTERVAL_S, Run
from .run_writer import RunWriter
from .safety_monitor import SafetyMonitor
from .settings import Progress, RestBias, RunResult, Settings, Written
from .sources.source import ForceSample, ForceSource, MotionAxis

MIN_READINGS_AT_REST = 10
_MAX_CLOCK_RATIO = 10.0  # longest wait for readings over a time on their own clock, relative to that time
_SENSOR_ADVICE = "Check its address, and that no other program reads it."
_REST_ADVICE = "Keep the needle free and at rest, or allow more with --steady-N."


def record_run(
    path: str | os.PathLike,
    force: ForceSource,
    axis: MotionAxis | None,
    moves: Sequence[tuple[float, float]],
    card: Mapping[str, str],
    settings: Settings,
    *,
    view: Callable[[Progress], None] | None = None,
    stop: threading.Event | None = None,
    when_withdrawn: Callable[[], None] | None = None,
    feed: Callable[[Written], None] | None = None,
) -> RunResult:
    """Record one run: the bias at rest, then the moves.

    Without moves the recording continues for ``settings.duration``, or until it is stopped or the source ends. A first
    move outwards is made before the bias is taken and is not in the file. Both sources are stopped and closed at the
    end. Ctrl-C or ``stop`` ends a run; its file is complete.

    Parameters
    ----------
    path : str or path
        The MCAP file to write; it must not exist.
    force : ForceSource
        The force sensor, not yet started.
    axis : MotionAxis or None
        The motion axis.
    moves : sequence of (float, float)
        Target depth [m] and speed [m/s] of each move; a move to the present depth is a hold, its second number then
        the duration [s].
    card : mapping of str to str
        Entries for the card of the recording.
    settings : Settings
        Force limit, bias, duration and sensor.
    view : callable, optional
        Called with a ``Progress`` about eight times a second.
    stop : threading.Event, optional
        Ends the run when it is set.
    when_withdrawn : callable, optional
        Called before the bias, when the needle is withdrawn, such as to go to another site; the axis must not move it
        into the tissue.
    feed : callable, optional
        Called with all that was written, about fifty times a second; it must return at once.

    Returns
    -------
    RunResult
        Why the run ended, counts, bias and clocks; any end after the start is reported here.

    Raises
    ------
    InputError
        If the run cannot start; then there is no file.
    AxisNotStopped
        If the run cannot start and the axis does not stop.
    KeyboardInterrupt
        If it is interrupted before the start; then there is no file.
    """
    import mcap.writer  # noqa: F401 - before readings arrive: an import blocks every thread

    if axis is not None and axis.limits is None:
        raise InputError("axis", "without commands", "a run cannot stop it", next_step="Leave it out.")
    stop = threading.Event() if stop is None else stop
    monitor = SafetyMonitor(force, axis, settings, stop)
    try:
        _check(Path(path), axis, moves)
        force.start()  # may wait for a header: Ctrl-C interrupts it, no file is open yet
        with _signals_set(stop):
            monitor.start()
            await_readings(monitor, 0.0, settings.silence, stop)
            if moves:
                withdraw(axis, moves[0], monitor, settings.silence, stop)
        if when_withdrawn:  # may ask an operator: Ctrl-C interrupts it
            when_withdrawn()
            monitor.samples.clear()
        with _signals_set(stop):
            bias = take_bias(monitor, settings, stop)
            run = Run(
                path=Path(path),
                run_writer=RunWriter(_log_writer(path, force, card, settings), force),
                monitor=monitor,
                bias=bias,
                settings=settings,
                view=view,
                feed=feed,
            )
            motion = MotionSequence(axis, moves, settings.silence, monitor.send_move) if moves else None
            return run.run(motion, stop)
    except BaseException as error:
        _stopped(monitor, error)
        raise
    finally:
        monitor.stop()
        force.stop()
        if axis:
            axis.close()


class AxisNotStopped(InputError):
    """A run could not start, and the axis, ordered to stop, was not seen to do so."""

    exit_code = 3


def _stopped(monitor: SafetyMonitor, error: BaseException) -> None:
    """Stop an axis that may move after an error. Raises AxisNotStopped if it is not seen at rest."""
    with _signals_set(threading.Event()):  # a second Ctrl-C does not keep it from being reported
        monitor.send_stop()
        while monitor.waits_for_rest:
            time.sleep(POLL_INTERVAL_S)
    report = monitor.stop_report
    if report and not report.confirmed and (monitor.has_moved or report.distance > MAX_DEVIATION_M):
        raise AxisNotStopped("axis", "not stopped", str(report), next_step=f"It was stopped after: {error}") from error


def _check(path: Path, axis: MotionAxis | None, moves: Sequence[tuple[float, float]]) -> None:
    """Raise InputError for a file or moves that are impossible, before anything is started."""
    for file in (path, part_path(path, 2)):
        if file.exists():
            limit = "this file exists; a recording is never overwritten"
            raise InputError("output", str(file), limit, next_step="Give another name.")
    if not path.parent.is_dir():
        raise InputError("folder", str(path.parent), "does not exist", next_step="Make it first.")
    if axis is None and moves:
        raise InputError("axis", "none", "moves need one", next_step="Give --axis.")
    if axis is not None:
        check_declared(axis.limits, getattr(axis, "place", "axis"))
    here = None
    for depth, speed in moves:
        if depth != here:
            max_speed = axis.limits.max_speed
            axis.check_move(depth, min(speed, max_speed) if here is None else speed)  # the first one may be a hold
        elif not 0.0 <= speed <= 1e6:
            raise InputError("hold", speed, "outside 0 to 1e6 s")
        here = depth


def _log_writer(path: str | os.PathLike, force: ForceSource, card: Mapping[str, str], settings: Settings) -> Any:
    from ..recording.log.writer import LogWriter

    configuration = getattr(force, "configuration", None)
    entries = {"axial": settings.axial, "filter_length": str(settings.filter_length)}
    entries |= {"force_limit_N": f"{settings.force_limit:.6g}", "force_limit_source": settings.limit_source}
    entries |= {"wrench_rate_Hz": f"{force.clock_rate:.12g}", "sensor_serial": getattr(configuration, "serial", "")}
    parts = {"part_samples": settings.part_samples, "part_time": settings.part_time}
    return LogWriter(path, entries | dict(card), **parts)


@contextlib.contextmanager
def _signals_set(stop: threading.Event) -> Iterator[None]:
    """Ctrl-C and the end of the terminal set ``stop`` instead of interrupting a write; in the main thread only."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    numbers = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
    replaced = {
        number: handler for number in numbers if (handler := signal.getsignal(number)) not in (signal.SIG_IGN, None)
    }
    for number in replaced:
        signal.signal(number, lambda *_: stop.set())
    try:
        yield
    finally:
        for number, handler in replaced.items():
            signal.signal(number, handler)


def await_readings(monitor: SafetyMonitor, seconds: float, silence: float, stop: threading.Event) -> None:
    """Wait until the readings span ``seconds`` of their own clock.

    Raises InputError if no readings arrive or their clock hardly advances, and KeyboardInterrupt.
    """
    until = time.monotonic() + silence + _MAX_CLOCK_RATIO * seconds
    while not monitor.samples or monitor.samples[-1].device - monitor.samples[0].device < 1e9 * seconds:
        _check_monitor(monitor, stop)
        if time.monotonic() - monitor.last_time > silence:
            raise InputError("sensor", "silent", f"no reading for {silence:g} s", "", _SENSOR_ADVICE)
        if time.monotonic() > until:
            raise _slow_clock(monitor, silence + _MAX_CLOCK_RATIO * seconds, seconds)
        time.sleep(POLL_INTERVAL_S)


def _slow_clock(monitor: SafetyMonitor, waited: float, seconds: float) -> InputError:
    advanced = (monitor.samples[-1].device - monitor.samples[0].device) * 1e-9 if monitor.samples else 0.0
    limit = f"{seconds:g} s are needed; its counter or its time stamps hardly advance"
    advice = "Check the rate on the sensor's page, or the times in the lines."
    return InputError("sensor's clock", f"{advanced:.3g} s ahead after {waited:.1f} s", limit, "bias", advice)


def withdraw(
    axis: MotionAxis, move: tuple[float, float], monitor: SafetyMonitor, timeout: float, stop: threading.Event
) -> None:
    """Make a move that goes outwards, as a needle in tissue is not at rest; leave any other move for later."""
    state = _state_at_rest(monitor, timeout, stop)
    if move[0] < state.depth - POSITION_TOLERANCE_M:
        axis.check_move(*move)
        _make_move(MotionSequence(axis, [move], timeout, monitor.send_move), monitor, stop)
        monitor.pause_motion()
        monitor.samples.clear()


def take_bias(monitor: SafetyMonitor, settings: Settings, stop: threading.Event) -> RestBias:
    """The bias from ``bias_time`` of readings, which remain in the monitor's queue; the force limit holds from now."""
    await_readings(monitor, settings.bias_time, settings.silence, stop)
    bias = RestBias()
    if settings.bias_time:
        samples = list(monitor.samples)
        monitor.learn_noise(samples)
        bias = bias_of([s for s in samples if s.device - samples[0].device <= 1e9 * settings.bias_time], settings)
    monitor.bias = bias.wrench[settings.column]
    return bias


def _state_at_rest(monitor: SafetyMonitor, timeout: float, stop: threading.Event) -> AxisState:
    """The state of the axis before its first order. Raises InputError if it is not at rest, by its own depth."""
    until = time.monotonic() + REST_WINDOW_S + timeout
    while not monitor.begins_at_rest():
        _check_monitor(monitor, stop)
        if time.monotonic() > until:
            state, advice = monitor.axis_check.state, "Stop it, and check that nothing else commands it."
            if state is None:
                raise InputError("axis", "silent", f"no state for {timeout:g} s", next_step="Check the axis.")
            where = f"at {1e3 * state.depth:.3f} mm, {1e3 * monitor.axis_check.measured_speed:.3g} mm/s"
            raise InputError(
                "axis", where, "it must rest before a run, and report at least 15 states per second", "", advice
            )
        time.sleep(POLL_INTERVAL_S)
    return monitor.axis_check.state


def _make_move(motion: MotionSequence, monitor: SafetyMonitor, stop: threading.Event) -> None:
    """Make the moves of ``motion`` before the recording. Raises InputError if they do not end as planned."""
    motion.add_states([(monitor.axis_check.state, 0)], time.monotonic())
    try:
        while True:
            _check_monitor(monitor, stop)
            motion.add_states(monitor.take()[1], time.monotonic())
            motion.step(time.monotonic())
            time.sleep(POLL_INTERVAL_S)
    except RunEnded as ended:
        if ended.reason is not EndReason.DONE:
            raise InputError("axis", ended.reason.removeprefix("axis "), ended.detail) from None


def _check_monitor(monitor: SafetyMonitor, stop: threading.Event) -> None:
    if stop.is_set():
        raise KeyboardInterrupt
    if monitor.over_limit:
        force, limit = monitor.axial(monitor.over_limit), "beyond the force limit, compared with that before the move"
        raise InputError(
            "force with its bias", f"{force:.3f} N", limit, next_step="Free the needle, or raise the limit."
        )
    if monitor.axis_error:
        raise monitor.axis_error
    if monitor.reason:
        raise InputError(str(monitor.reason), "", monitor.detail)
    if isinstance(monitor.error, EOFError):
        advice = "Let the source run longer, or take no bias with --bias-s 0."
        raise InputError("source", "ended", "before the bias was taken", next_step=advice)
    if monitor.error:
        known = isinstance(monitor.error, InputError)
        raise monitor.error if known else InputError("sensor", "lost", str(monitor.error), "", _SENSOR_ADVICE)


def bias_of(samples: list[ForceSample], settings: Settings) -> RestBias:
    """Mean and standard deviation of the healthy readings at rest.

    Raises InputError for too few of them, or if the axial force is not steady: if the means of the first and the last
    third differ by more than ``settings.steady`` [N], or the standard deviation is larger than that.
    """
    healthy = [sample.wrench for sample in samples if sample.fresh and not is_fault(sample.status)]
    needed = max(MIN_READINGS_AT_REST, len(samples) // 2)
    if len(healthy) < needed:
        words = status_words(next((s.status for s in samples if is_fault(s.status)), 0))
        limit = f"{needed} of {len(samples)} must be new and healthy; status: {words}"
        raise InputError("readings at rest", len(healthy), limit, "bias", "Give a longer rest with --bias-s, or 0.")
    wrench = np.array(healthy)
    _check_steady(wrench[:, settings.column], settings.steady)
    mean, noise = wrench.mean(axis=0), wrench.std(axis=0, ddof=1)
    return RestBias(tuple(mean.tolist()), tuple(noise.tolist()), len(healthy))


def _check_steady(force: np.ndarray, steady: float) -> None:
    third = len(force) // 3
    drift = float(force[-third:].mean() - force[:third].mean())
    if not abs(drift) <= steady:
        limit = f"more than {steady:g} N: the sensor drifts, or the needle touches"
        raise InputError("change of the force at rest", f"{drift:.3f} N", limit, "bias", _REST_ADVICE)
    noise = float(force.std(ddof=1))
    if not noise <= steady:
        limit = f"more than {steady:g} N: the needle vibrates or touches"
        raise InputError("standard deviation of the force at rest", f"{noise:.3f} N", limit, "bias", _REST_ADVICE)
