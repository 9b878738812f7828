# SPDX-License-Identifier: Apache-2.0
"""The lines between a motion axis and who drives it: text over TCP, one command or answer a line, in SI.

A client sends ``move DEPTH_m SPEED_m_s``, ``stop``, ``site NUMBER`` and, at least every half second while it wants the
axis to go on moving, anything at all, such as ``alive``. The axis sends ``axis LOWEST_m HIGHEST_m MAX_SPEED_m_s
MAX_ACCELERATION_m_s2`` when it is connected to, then ``state NUMBER TIME_s DEPTH_m VELOCITY_m_s CONDITION`` at its own
rate, and to each command ``ok COMMAND`` or ``refused COMMAND REASON``; ``refused line …`` to what is no command, and
``refused connection …`` where it has a client already. TIME_s is the axis' own clock. An axis whose
client falls silent or goes away stops by itself.
"""

import math
from typing import NamedTuple

from ..errors import InputError

PORT = 49153
RATE = 60.0  # [Hz] of the states, paper sec. 1
SILENCE = 0.5  # [s] without a word after which an axis stops
CONDITIONS = ("idle", "moving", "stopping", "stalled", "fault")
COMMANDS = ("move", "stop", "site", "alive")
_REFUSED = (*COMMANDS, "line", "connection")  # also what is no command, and a second client
LONGEST = 200  # characters in a line
_LATEST = 4e9  # [s] of a clock: what fits into a recording
_FARTHEST = 1e3  # [m], and [m/s]


class AxisState(NamedTuple):
    """Where the axis is: a counter, its own clock [s], depth [m] and velocity [m/s] as its encoder has them."""

    number: int
    time: float
    depth: float
    velocity: float
    condition: str


class AxisRange(NamedTuple):
    """What an axis can do: lowest and highest depth [m], speed [m/s], acceleration [m/s^2]."""

    lowest: float
    highest: float
    max_speed: float
    max_acceleration: float


class Answer(NamedTuple):
    """The answer to a command: whether it is done, and why not."""

    command: str
    accepted: bool
    reason: str = ""


def state_line(state: AxisState) -> str:
    """A state as its line, without the line's end."""
    return f"state {state.number} {state.time:.6f} {state.depth:.8f} {state.velocity:.7f} {state.condition}"


def range_line(limits: AxisRange) -> str:
    """The greeting of an axis, without the line's end."""
    return "axis " + " ".join(f"{value:.8g}" for value in limits)


def answer_line(answer: Answer) -> str:
    """An answer, without the line's end."""
    return f"ok {answer.command}" if answer.accepted else f"refused {answer.command} {answer.reason}"


def move_line(depth: float, speed: float) -> str:
    """The command that sends the axis to ``depth`` [m] at ``speed`` [m/s], without the line's end."""
    return f"move {depth:.8f} {speed:.7f}"


def parse_answer(line: str) -> AxisState | AxisRange | Answer:
    """What an axis said. Raises InputError for what it could not have said."""
    if len(line) > LONGEST:
        raise _not_a_line(line)
    match line.split(" "):
        case ["state", number, time, depth, velocity, condition] if condition in CONDITIONS and number.isdecimal():
            return _possible(AxisState(int(number), *_numbers(line, time, depth, velocity), condition), line)
        case ["axis", lowest, highest, speed, acceleration]:
            return _able(AxisRange(*_numbers(line, lowest, highest, speed, acceleration)), line)
        case ["ok", command] if command in COMMANDS:
            return Answer(command, True)
        case ["refused", command, *reason] if command in _REFUSED:
            return Answer(command, False, " ".join(reason))
    raise _not_a_line(line)


def parse_command(line: str) -> tuple[str, tuple[float, ...]]:
    """A command and its numbers. Raises InputError for what is none."""
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
        numbers = tuple(float(text) for text in texts)
    except ValueError:
        raise _not_a_line(line) from None
    if not all(map(math.isfinite, numbers)):
        raise _not_a_line(line)
    return numbers


def _possible(state: AxisState, line: str) -> AxisState:
    if abs(state.time) > _LATEST or max(abs(state.depth), abs(state.velocity)) > _FARTHEST:
        raise _not_a_line(line)
    return state


def _able(limits: AxisRange, line: str) -> AxisRange:
    if not (limits.lowest < limits.highest and limits.max_speed > 0.0 and limits.max_acceleration > 0.0):
        raise _not_a_line(line)
    return limits


def _not_a_line(line: str) -> InputError:
    return InputError("line of the axis", repr(line[:LONGEST]), "not one that is known", "", "See docs/rig.md.")
