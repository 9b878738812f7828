# SPDX-License-Identifier: Apache-2.0
"""What comes before a run: readings, the tip outside, the bias at rest. What is wrong here prevents the start."""

import threading
import time

from ..errors import InputError
from .force_monitor import ForceWatch
from .motion_sequence import DONE, REACHED, Course, Ended
from .rest_bias import bias_of
from .run import EVERY
from .settings import Bias, Settings

_SLOWEST = 10.0  # times as long as its own clock says that the bias may take
_ADVICE = "Check its address, and that no one else reads it."


def await_readings(watch: ForceWatch, seconds: float, silence: float, stop: threading.Event) -> None:
    """Until there are readings over so many ``seconds`` of their own clock. Raises InputError where none come, or their
    clock hardly goes on; KeyboardInterrupt.
    """
    until = time.monotonic() + silence + _SLOWEST * seconds
    while not watch.samples or watch.samples[-1].device - watch.samples[0].device < 1e9 * seconds:
        _check(watch, stop)
        if time.monotonic() - watch.last > silence:
            raise InputError("sensor", "silent", f"nothing came for {silence:g} s", "", _ADVICE)
        if time.monotonic() > until:
            raise _standing(watch, silence + _SLOWEST * seconds, seconds)
        time.sleep(EVERY)


def _standing(watch: ForceWatch, waited: float, seconds: float) -> InputError:
    gone = (watch.samples[-1].device - watch.samples[0].device) * 1e-9 if watch.samples else 0.0
    limit = f"{seconds:g} s are needed; its counter or its times hardly go on"
    advice = "Check the rate on the sensor's page, or the times in the lines."
    return InputError("sensor's clock", f"{gone:.3g} s on after {waited:.1f} s", limit, "bias", advice)


def withdraw(axis, move: tuple[float, float], watch: ForceWatch, patience: float, stop: threading.Event) -> None:
    """Make a move that goes outwards: a needle in tissue is not at rest. Any other is left as it is."""
    state = _gone(Course(axis, [], patience, watch.send_move), axis, watch, stop)
    if move[0] < state.depth - REACHED:
        axis.check_move(*move)
        _gone(Course(axis, [move], patience, watch.send_move), axis, watch, stop)
        watch.samples.clear()


def take_bias(watch: ForceWatch, settings: Settings, stop: threading.Event) -> Bias:
    """The bias from ``bias_time`` of readings; the watch then holds its limit. What was read stays in its queue."""
    await_readings(watch, settings.bias_time, settings.silence, stop)
    bias = Bias()
    if settings.bias_time:
        samples = list(watch.samples)
        bias = bias_of([s for s in samples if s.device - samples[0].device <= 1e9 * settings.bias_time], settings)
    watch.bias = bias.wrench[settings.column]
    return bias


def _gone(course: Course, axis, watch: ForceWatch, stop: threading.Event):
    """The state of the axis at the end of a course. Raises InputError where it ends badly."""
    try:
        while True:
            _check(watch, stop)
            course.hear(axis.receive(), time.monotonic())
            course.step(time.monotonic())
            time.sleep(EVERY)
    except Ended as ended:
        if ended.why != DONE:
            raise InputError("axis", ended.why.removeprefix("axis "), ended.detail) from None
        return course.state


def _check(watch: ForceWatch, stop: threading.Event) -> None:
    if stop.is_set():
        raise KeyboardInterrupt
    if isinstance(watch.error, EOFError):
        raise InputError("source", "ended", "before the bias was taken")
    if watch.error:
        raise watch.error if isinstance(watch.error, InputError) else InputError("sensor", "lost", str(watch.error))
