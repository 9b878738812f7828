# SPDX-License-Identifier: Apache-2.0
"""On a terminal the user chooses the columns that a file does not name; elsewhere its error has the command."""

import os
import pty
import select
import shlex
import subprocess
import sys

import pytest
from command_line import run

MINUTE_S = 60.0


@pytest.fixture
def folder(root, tmp_path):
    """A file without headers: force [N] of the opposite sign, time [s], depth [um]."""
    lines = [line for line in (root / "examples" / "insertion.csv").read_text().splitlines() if line[0] != "#"]
    rows = [[float(each) for each in line.split(",")] for line in lines[1::2]]
    (tmp_path / "bare 1.txt").write_text("".join(f"{-r[3]:.6g},{r[0]:.6g},{1e6 * r[1]:.6g}\n" for r in rows))
    return tmp_path


def conversation(arguments, answers, folder):
    """What a command shows on a terminal of its own, given an answer to each question, and its exit code."""
    terminal, end = pty.openpty()
    command = [sys.executable, "-c", "from needleforce.cli import main; main()", *arguments]
    ends = dict.fromkeys(("stdin", "stdout", "stderr"), end)
    process = subprocess.Popen(command, cwd=folder, env=os.environ | {"TERM": "dumb", "COLUMNS": "150"}, **ends)
    os.close(end)
    shown, rest = "", list(answers)
    while select.select([terminal], [], [], MINUTE_S)[0]:
        try:
            shown += os.read(terminal, 4096).decode("utf-8", "replace")
        except OSError:  # the command has ended
            break
        if rest and shown.endswith(": "):
            answer = rest.pop(0)
            os.write(terminal, f"{answer}\n".encode())
            shown += "\n"
    os.close(terminal)
    return shown, process.wait()


def test_on_a_terminal_the_columns_are_chosen_and_the_command_does_it_again(folder):
    # time, its unit; depth after a number that is none, a word that is no unit, its unit; force, its unit, its sign
    answers = ["2", "", "9", "3", "furlong", "um", "", "N", "n"]
    shown, code = conversation(["identify", "bare 1.txt"], answers, folder)
    assert code == 0, shown
    assert "Column of the depth [3]" in shown and "1 to 3, please" in shown and "known are m, mm" in shown
    assert "puncture_force" in shown
    command = next(line.strip() for line in shown.splitlines() if line.startswith("  needleforce identify"))
    again = run(*shlex.split(command)[1:], cwd=folder)
    assert again.returncode == 0, again.stderr
    value = next(line.split("│")[2] for line in again.stdout.splitlines() if "puncture_force" in line)
    assert value.strip().split()[0] in shown


def test_an_end_of_the_input_ends_the_questions(folder):
    shown, code = conversation(["bare 1.txt"], ["2", "\x04"], folder)
    assert code == 1 and "Aborted" in shown and "Traceback" not in shown and not list(folder.glob("*.html"))


def test_without_a_terminal_there_is_the_error_with_the_command(folder):
    done = run("identify", "bare 1.txt", cwd=folder)
    assert done.returncode == 1 and "no column holds" in done.stderr and "Column of" not in done.stdout
    assert "  needleforce identify 'bare 1.txt' --column time=2 --column force=1 --column depth=3" in done.stderr
