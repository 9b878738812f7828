# SPDX-License-Identifier: Apache-2.0
"""The lines between a motion axis and its client: text over TCP, one command or answer per line, in SI.

A client sends ``move DEPTH_m SPEED_m_s``, ``stop``, ``site NUMBER`` and, at least every half second while the axis is
to continue moving, any line, such as ``alive``. The axis sends ``axis LOWEST_m HIGHEST_m MAX_SPEED_m_s
MAX_ACCELERATION_m_s2 [STOP_DECELERATION_m_s2]`` when a client connects, then ``state NUMBER TIME_s DEPTH_m
VELOCITY_m_s CONDITION`` at its own rate, and to each command ``ok COMMAND`` or ``refused COMMAND REASON``; ``refused
line …`` to an invalid line, and ``refused connection …`` if it has a client already. TIME_s is the axis' own clock. An
axis stops by itself when its client is silent or disconnects.
"""

import math
from typing import NamedTuple

from ..errors import InputError
from ..units import number_in

PORT = 49153
STATE_RATE_HZ = 60.0  # source paper sec. 1
MAX_SILENCE_S = 0.5  # without a line from the client, after which an axis stops
CONDITIONS = ("idle", "moving", "stopping", "stalled", "fault")
COMMANDS = ("move", "stop", "site", "alive")
_REFUSED = (*COMMANDS, "line", "connection")  # also an invalid line and a second client
MAX_LINE_LENGTH = 200  # characters
_MAX_TIME_S = 4e9  # of a clock: the range of times in a recording
_MAX_MAGNITUDE = 1e3  # of a depth [m] and a velocity [m/s]


class AxisState(NamedTuple):
    """State of the axis: a counter, its own clock [s], depth [m] and velocity [m/s] from its encoder, condition."""

    number: int
    time: float
    depth: float
    velocity: float
    condition: str


class AxisRange(NamedTuple):
    """Range of an axis: lowest and highest depth [m], largest speed [m/s] and acceleration [m/s^2].

    ``stop_deceleration`` [m/s^2] is 0 for an axis that does not state it; a stop then has the largest acceleration.
    """

    lowest: float
    highest: float
    max_speed: float
    max_acceleration: float
    stop_deceleration: float = 0.0

    @property
    def deceleration(self) -> float:
        """The deceleration [m/s^2] of a stop."""
        return self.stop_deceleration or self.max_acceleration


class Answer(NamedTuple):
    """The answer to a command: whether it is accepted, otherwise the reason."""

    command: str
    accepted: bool
    reason: str = ""


def state_line(state: AxisState) -> str:
    """The line of a state, without the line end."""
    return f"state {state.number} {state.time:.6f} {state.depth:.8f} {state.velocity:.7f} {state.condition}"


def range_line(limits: AxisRange) -> str:
    """The line with the range of an axis, without the line end."""
    return "axis " + " ".join(f"{value:.8g}" for value in (limits if limits.stop_deceleration else limits[:4]))


def answer_line(answer: Answer) -> str:
    """The line of an answer, without the line end."""
    return f"ok {answer.command}" if answer.accepted else f"refused {answer.command} {answer.reason}"


def move_line(depth: float, speed: float) -> str:
    """The command that sends the axis to ``depth`` [m] at ``speed`` [m/s], without the line end."""
    return f"move {depth:.8f} {speed:.7f}"


def parse_answer(line: str) -> AxisState | AxisRange | Answer:
    """The state, range or answer in a line of an axis. Raises InputError for an invalid line."""
    if len(line) > MAX_LINE_LENGTH:
        raise _not_a_line(line)
    match line.split(" "):
        case ["state", number, time, depth, velocity, condition] if condition in CONDITIONS and number.isdecimal():
            return _valid_state(AxisState(int(number), *_numbers(line, time, depth, velocity), condition), line)
        case ["axis", *values] if len(values) in (4, 5):
            return _valid_range(AxisRange(*_numbers(line, *values)), line)
        case ["ok", command] if command in COMMANDS:
            return Answer(command, True)
        case ["refused", command, *reason] if command in _REFUSED:
            return Answer(command, False, " ".join(reason))
    raise _not_a_line(line)


def parse_command(line: str) -> tuple[str, tuple[float, ...]]:
    """A command and its numbers. Raises InputError for an invalid line."""
    match line.split(" "):
        case ["move", depth, speed]:
            return "move", _numbers(line, depth, speed)
        case ["site", number] if number.isdecimal():
            return "site", _numbers(line, number)
        case ["stop" | "alive" as command]:
            return command, ()
    raise _not_a_line(line)


def _numbers(line: str, *texts: str) -> tuple[float, ...]:
    try:
        numbers = tuple(map(number_in, texts))
    except ValueError:
        raise _not_a_line(line) from None
    if not all(map(math.isfinite, numbers)):
        raise _not_a_line(line)
    return numbers


def _valid_state(state: AxisState, line: str) -> AxisState:
    if abs(state.time) > _MAX_TIME_S or max(abs(state.depth), abs(state.velocity)) > _MAX_MAGNITUDE:
        raise _not_a_line(line)
    return state


def _valid_range(limits: AxisRange, line: str) -> AxisRange:
    if not (limits.lowest < limits.highest and limits.max_speed > 0.0 and limits.deceleration > 0.0):
        raise _not_a_line(line)
    return limits


def _not_a_line(line: str) -> InputError:
    limit = "not a valid line of the protocol"
    return InputError("line of the axis", repr(line[:MAX_LINE_LENGTH]), limit, next_step="See docs/reference/rig.md.")
