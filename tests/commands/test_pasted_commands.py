# SPDX-License-Identifier: Apache-2.0
"""A message that names an option prints the whole command to paste; each of these is pasted."""

import shlex

import numpy as np
import pytest
from command_line import run

TIME, DEPTH, VELOCITY, FORCE = range(4)
NAMES = ("time [s]", "depth [mm]", "velocity [mm/s]", "force [N]")


@pytest.fixture(scope="module")
def rows(root):
    """Time [s], depth [mm], velocity [mm/s] and force [N] of the example, every second sample."""
    lines = [line for line in (root / "examples" / "insertion.csv").read_text().splitlines() if line[0] != "#"]
    numbers = np.array([line.split(",")[:4] for line in lines[1::2]], float)
    return numbers * [1.0, 1e3, 1e3, 1.0]


def text(values, names=None):
    head = [",".join(names)] if names else []
    return "\n".join(head + [",".join(f"{each:.6g}" for each in row) for row in values]) + "\n"


def named(*columns):
    return lambda rows: text(rows[:, columns], [NAMES[k] for k in columns])


def cycles(rows):
    """Six small cycles, counted in a column."""
    loop = rows[::4, [TIME, DEPTH, FORCE]]
    span = loop[-1, 0] - loop[0, 0] + 1.0
    repeated = [np.column_stack([loop + np.array([k * span, 0.0, 0.0]), np.full(len(loop), k)]) for k in range(6)]
    return text(np.vstack(repeated), ["time [s]", "depth [mm]", "force [N]", "cycle"])


# what the file has, the command with FILE for it, and what the message says
CASES = {
    "no header": (lambda rows: text(rows[:, [FORCE, TIME, DEPTH]]), "identify FILE", "time=2 --column force=1"),
    "no header, alone": (lambda rows: text(rows[:, [TIME, FORCE, DEPTH]]), "FILE --needle paper", "force=2"),
    "an odd header": (
        lambda rows: text(rows[:, [0, 1, 3]], ["time [s]", "depth [mm]", "Fxyz"]),
        "inspect FILE --no-plot",
        "force=3",
    ),
    "a header that is not there": (named(TIME, DEPTH, FORCE), "identify FILE --column depth=Tiefe", "depth [mm]"),
    "a header written wrongly": (named(TIME, DEPTH, FORCE), "identify FILE --column=force=forc", "force [N]"),
    "two forces": (
        lambda rows: text(rows[:, [0, 1, 3, 3]], ["time [s]", "depth [mm]", "fz [N]", "force [N]"]),
        "identify FILE",
        "force=",
    ),
    "a large force": (lambda rows: text(rows[:, [0, 1, 3]] * [1, 1, 1e3], ["time", "depth", "force"]), "identify FILE",
                      "--unit force=mN"),
    "an unknown unit": (named(TIME, DEPTH, FORCE), "convert FILE -o out.csv --unit force=xx", "--unit force=N"),
    "a unit that is kept": (named(TIME, DEPTH, FORCE), "identify FILE --unit depth=mm --column force=x", "depth=mm"),
    "a velocity": (named(TIME, VELOCITY, FORCE), "identify FILE", "--start-depth-mm 0"),
    "cycles": (cycles, "identify FILE --model paper", "--part 'cycle"),
    "a file name with a dash": (lambda rows: text(rows[:, [0, 1, 3]]), "identify --model paper -- -x.csv", "-- -x.csv"),
    "no report to open": (named(TIME, DEPTH, FORCE), "compare FILE --open", "--open --report report.html"),
    "a travel that is none": (named(TIME, DEPTH, FORCE), "penetration FILE --plateau-mm 5-9", "--plateau-mm 5:9"),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_the_commands_of_a_message_work_when_pasted(name, rows, tmp_path):
    made, command, expected = CASES[name]
    file = "-x.csv" if "-x.csv" in command else "my 'gel' 1.csv"
    (tmp_path / file).write_text(made(rows), encoding="utf-8")
    typed = [file if word == "FILE" else word for word in shlex.split(command)]
    done = run(*typed, cwd=tmp_path)
    pasted = [line.strip() for line in done.stderr.splitlines() if line.startswith("  needleforce ")]
    assert pasted and any(expected in each for each in pasted), done.stderr
    message = next(line for line in done.stderr.splitlines() if "--" in line and not line.startswith("  "))
    words = shlex.split(pasted[0])
    assert words[0] == "needleforce" and file in words
    again = run(*[word for word in words[1:] if word != "--open"], cwd=tmp_path)
    assert again.returncode == 0, again.stderr
    assert message not in again.stderr.splitlines()


def test_a_command_is_proposed_once(rows, tmp_path):
    for name in ("a.csv", "b.csv"):
        (tmp_path / name).write_text(text(rows[:, [0, 1, 3]]), encoding="utf-8")
    said = run("identify", "a.csv", "b.csv", cwd=tmp_path).stderr.splitlines()
    assert [line.strip() for line in said if line.startswith("  ")] == [
        "needleforce identify a.csv b.csv --column time=1 --column force=3 --column depth=2"
    ]


@pytest.mark.parametrize("header", ["force [N]", "x --save mine.toml", "x --json /etc/passwd --open"])
def test_what_only_the_user_knows_and_what_a_file_says_make_no_command(header, rows, tmp_path):
    (tmp_path / "one.csv").write_text(text(rows[:, [3]], [header]), encoding="utf-8")
    said = run("identify", "one.csv", cwd=tmp_path).stderr
    assert "--motion FILE" in said and "--save mine" not in said.replace(f"'{header}'", "")
    assert not [line for line in said.splitlines() if line.startswith("  ") and ("--save" in line or "--json" in line)]
