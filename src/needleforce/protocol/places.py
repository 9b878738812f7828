# SPDX-License-Identifier: Apache-2.0
"""The needle out of the tissue, and over another site."""

import time
from collections.abc import Callable

from ..acquisition.motion_sequence import REACHED
from ..acquisition.run import EVERY
from ..errors import InputError

_PATIENCE = 5.0  # [s] beyond twice what the way takes


def withdraw(axis, start: float, speed: float) -> None:
    """Bring the tip to ``start`` [m] at ``speed`` [m/s], wherever it was left, and wait until it rests there.

    Raises InputError where it does not arrive; the axis is told to stop then.
    """
    state = _state(axis, time.monotonic() + _PATIENCE)
    if abs(state.depth - start) <= REACHED and state.condition == "idle":
        return
    try:
        axis.move(start, speed)
        until = time.monotonic() + _PATIENCE + 2.0 * abs(state.depth - start) / speed
        before = state.number
        while abs(state.depth - start) > REACHED or state.condition != "idle" or state.number <= before:
            if state.condition in ("stalled", "fault"):
                raise InputError("axis", state.condition, f"at {state.depth:g} m on the way to {start:g} m")
            state = _state(axis, until)
    except BaseException:
        axis.stop()
        raise


def go_to_site(axis, site: int, ask: Callable[[str], bool] | None) -> None:
    """Put the needle over ``site``: the axis does it, or the operator does and says so.

    Raises InputError where neither can.
    """
    try:
        axis.site(site)
    except InputError as refused:
        if ask is None:
            advice = "Run it in a terminal, where somebody can move the phantom and say so."
            raise InputError("site", site, f"the axis does not go there: {refused}", next_step=advice) from None
        if not ask(f"Move the phantom so that the needle is over site {site}. Is it there?"):
            raise KeyboardInterrupt from None


def pause(axis, seconds: float) -> None:
    """Wait with the needle where it is, so that the axis stays connected."""
    until = time.monotonic() + seconds
    while (left := until - time.monotonic()) > 0.0:
        axis.receive()
        axis.alive()
        time.sleep(min(EVERY, left))


def _state(axis, until: float):
    """The newest state, awaited."""
    while not (states := axis.receive()):
        if time.monotonic() > until:
            raise InputError("axis", "silent, or not there in time", "no state says that it rests at the start")
        axis.alive()
        time.sleep(EVERY)
    if time.monotonic() > until:
        raise InputError("axis", f"at {states[-1][0].depth:g} m", "it does not arrive at the start")
    axis.alive()
    return states[-1][0]
