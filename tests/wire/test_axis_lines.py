"""Lines of the axis: writing, reading, and invalid lines."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from needleforce import InputError
from needleforce.wire.axis_lines import (
    Answer,
    AxisRange,
    AxisState,
    answer_line,
    move_line,
    parse_answer,
    parse_command,
    range_line,
    state_line,
)


@pytest.mark.parametrize(
    "message, line",
    [
        (AxisState(3, 0.05, -0.004, 0.003, "moving"), "state 3 0.050000 -0.00400000 0.0030000 moving"),
        (AxisRange(-0.01, 0.06, 0.02, 0.01), "axis -0.01 0.06 0.02 0.01"),
        (AxisRange(-0.01, 0.06, 0.02, 0.01, 0.5), "axis -0.01 0.06 0.02 0.01 0.5"),
        (Answer("stop", True), "ok stop"),
        (Answer("move", False, "beyond 0.06 m"), "refused move beyond 0.06 m"),
        (Answer("line", False, "too long"), "refused line too long"),
        (Answer("connection", False, "another client"), "refused connection another client"),
    ],
)
def test_lines_of_an_axis_are_written_and_read(message, line):
    written = {AxisState: state_line, AxisRange: range_line, Answer: answer_line}[type(message)](message)
    assert written == line
    assert parse_answer(line) == message


def test_commands_are_read():
    assert parse_command(move_line(16e-3, 3e-3)) == ("move", (16e-3, 3e-3))
    assert parse_command("stop") == ("stop", ())
    assert parse_command("site 2") == ("site", (2.0,))


@pytest.mark.parametrize(
    "line",
    [
        "",
        "move",
        "move 1",
        "move a b",
        "move nan 1",
        "move inf 1",
        "site -1",
        "move 1_0 1",
        "state 1",
        "go",
        "stop now",
    ],
)
def test_invalid_commands_are_refused(line):
    with pytest.raises(InputError, match="line of the axis"):
        parse_command(line)


@pytest.mark.parametrize(
    "line",
    [
        "state 1 1e300 0 0 idle", "state 1 -5e9 0 0 idle", "state 1 0 1e300 0 idle", "state 1 0 0 -1e4 idle",
        f"state {'9' * 5000} 0 0 0 idle", "refused move " + "x" * 5000, "axis -0.03 0.07 0.05 0",
        "axis -0.03 0.07 0 0.01", "axis 0.07 -0.03 0.05 0.01", "axis -0.03 0.07 0.05 -1",
    ],
)  # fmt: skip
def test_impossible_states_and_ranges_are_refused(line):
    with pytest.raises(InputError, match="line of the axis"):
        parse_answer(line)


@given(st.text(max_size=300))
def test_any_text_is_read_or_refused(text):
    for parse in (parse_answer, parse_command):
        try:
            parse(text)
        except InputError as error:
            assert len(str(error)) < 2500
