# SPDX-License-Identifier: Apache-2.0
"""Outcomes of tasks are the same in this process and in others, and none of them ends the work."""

import logging
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
import worker_tasks

import needleforce as nf
from needleforce.running import TaskError, outcomes, run_tasks, started
from needleforce.running.workers import IN_FLIGHT

COUNT = 20


def shown(found) -> list:
    return [(index, each if isinstance(each, int) else repr(each)) for index, each in sorted(found)]


@pytest.fixture(scope="module")
def two():
    with started(jobs=2) as workers:
        yield workers


@pytest.mark.parametrize("block", [1, 3])
def test_outcomes_do_not_depend_on_the_workers(two, block):
    here = list(run_tasks(worker_tasks.square, range(COUNT), jobs=1, block=block))
    there = list(outcomes(two, worker_tasks.square, range(COUNT), block=block))
    assert shown(here) == shown(there) and len(here) == COUNT
    assert all(each == index * index for index, each in here if index not in (5, 6))
    for found in (dict(here), dict(there)):
        error = found[5]
        assert isinstance(error, nf.InputError) and str(error) == "here: number is 5, it is five. Give another."
        assert (error.quantity, error.value, error.place) == ("number", 5, "here")
        assert isinstance(found[6], TaskError) and str(found[6]) == "KeyError: 'six'" and "square" in found[6].trace


def test_a_task_that_ends_its_process_is_found(caplog):
    with caplog.at_level(logging.WARNING, "needleforce"):
        found = dict(run_tasks(worker_tasks.deadly, range(COUNT), jobs=2, block=3))
    assert isinstance(found.pop(7), TaskError) and found == {k: k * k for k in range(COUNT) if k != 7}
    assert "A worker process ended" in caplog.text


def test_a_result_that_cannot_be_sent_is_an_outcome_of_its_task(two):
    found = dict(outcomes(two, worker_tasks.large, range(4), block=2))
    assert len(found) == 4 and all(isinstance(each, TaskError) for each in found.values())


def test_few_tasks_are_taken_ahead(two):
    taken = []
    tasks = (taken.append(k) or k for k in range(1000))
    found = outcomes(two, worker_tasks.square, tasks, block=2)
    next(found)
    assert len(taken) <= 3 * two.window() * 2
    found.close()


def test_progress_knows_how_many_there_are():
    lengths = []
    list(run_tasks(abs, [1, 2, 3], jobs=1, progress=lambda work, text: lengths.append((len(work), text)) or work))
    assert lengths == [(3, "working")]


SCRIPT = """
import sys
sys.path.insert(0, {folder!r})
import worker_tasks
from needleforce.running import run_tasks
print("begins", flush=True)
for index, process in run_tasks(worker_tasks.slow, [{made!r}] * 1000, jobs=2):
    print(process, flush=True)
"""


def test_workers_end_with_a_program_that_is_killed_and_do_not_run_it(tmp_path):
    """A script needs no guard: only the program itself prints that it begins."""
    script, made = tmp_path / "script.py", tmp_path / "made"
    made.mkdir()
    script.write_text(SCRIPT.format(folder=str(Path(worker_tasks.__file__).parent), made=str(made)))
    with subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, text=True) as program:
        assert program.stdout.readline() == "begins\n"
        assert program.stdout.readline().strip().isdecimal()
        program.kill()
    processes = [int(each.name) for each in made.iterdir()]
    assert processes
    for process in processes:
        while is_running(process):  # hangs if it does not end
            time.sleep(0.05)


def is_running(process: int) -> bool:
    """Whether a process runs, as other than one that nobody waited for."""
    try:
        os.kill(process, 0)
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (ProcessLookupError, FileNotFoundError):
        return False


def test_what_cannot_be_started_is_refused(monkeypatch):
    for jobs in (0, -1, 1.5):
        with pytest.raises(nf.InputError, match="jobs"):
            list(run_tasks(abs, [1], jobs=jobs))
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(nf.InputError, match=r"package distributed is not installed.*needleforce\[cluster\]"):
        list(run_tasks(abs, [1], scheduler="local"))


def test_no_more_processes_are_started_than_a_system_waits_for(monkeypatch):
    monkeypatch.setattr("needleforce.running.workers.MAX_PROCESSES", 3)
    with started(jobs=100) as workers:
        assert workers.window() == 3 * IN_FLIGHT
