# SPDX-License-Identifier: Apache-2.0
"""The same outcomes on a Dask cluster, whose workers may end, differ, or be missing."""

import os
import signal
import subprocess
import sys

import pytest
import worker_tasks

import needleforce as nf
from needleforce.running import TaskError, run_tasks, workers

pytestmark = pytest.mark.usefixtures("distributed")


@pytest.fixture(scope="module")
def distributed():
    return pytest.importorskip("distributed", reason="distributed is an optional extra")


@pytest.fixture(scope="module")
def cluster(distributed):
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address="127.0.0.1:0") as made:
        yield made


def test_outcomes_are_those_of_this_process(cluster):
    here, there = (
        sorted((index, repr(each)) for index, each in run_tasks(worker_tasks.square, range(40), block=3, **where))
        for where in ({"jobs": 1}, {"scheduler": cluster.scheduler_address})
    )
    assert here == there and len(here) == 40


def test_the_tasks_of_a_worker_that_is_killed_are_done_by_another(cluster, tmp_path):
    found, killed = [], None
    for index, process in run_tasks(worker_tasks.slow, [str(tmp_path)] * 12, scheduler=cluster.scheduler_address):
        found.append(index)
        if killed is None:
            killed = process
            os.kill(process, signal.SIGKILL)
    assert sorted(found) == list(range(12)) and len(list(tmp_path.iterdir())) > 1


def test_a_task_that_ends_its_worker_is_found():
    found = dict(run_tasks(worker_tasks.deadly, range(20), block=3, jobs=2, scheduler="local"))
    assert isinstance(found.pop(7), TaskError) and found == {k: k * k for k in range(20) if k != 7}


def test_workers_with_other_versions_are_refused(cluster, monkeypatch):
    monkeypatch.setattr(workers, "versions", lambda: {"Python": "3.11", "needleforce": "0.0.1"})
    with pytest.raises(nf.InputError, match=r"worker is with .*needleforce .* instead of 0\.0\.1"):
        list(run_tasks(worker_tasks.square, range(4), scheduler=cluster.scheduler_address))


def test_a_scheduler_that_does_not_answer_is_refused(cluster, monkeypatch):
    monkeypatch.setattr(workers, "CONNECT_S", 0.5)
    for address, words in (("tcp://127.0.0.1:1", r"no answer within 0\.5 s"), ("nowhere", "an address with a port")):
        with pytest.raises(nf.InputError, match=f"scheduler.*{words}"):
            list(run_tasks(worker_tasks.square, range(4), scheduler=address))
    with pytest.raises(nf.InputError, match=r"jobs is 2.*has its own workers"):
        list(run_tasks(worker_tasks.square, range(4), scheduler=cluster.scheduler_address, jobs=2))


WITHOUT = "import sys; sys.modules['needleforce'] = None; from distributed.cli.dask_worker import main; main()"


def test_a_worker_without_needleforce_is_refused(distributed):
    with distributed.LocalCluster(n_workers=0, dashboard_address="127.0.0.1:0") as empty:
        arguments = [empty.scheduler_address, "--no-nanny", "--no-dashboard", "--nthreads", "1"]
        worker = subprocess.Popen([sys.executable, "-c", WITHOUT, *arguments], stderr=subprocess.DEVNULL)
        try:
            with distributed.Client(empty) as client:
                client.wait_for_workers(1)
            with pytest.raises(nf.InputError, match=r"worker is without needleforce"):
                list(run_tasks(nf.preset, ["paper"], scheduler=empty.scheduler_address))
        finally:
            worker.kill()
            worker.wait()
