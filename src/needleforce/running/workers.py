# SPDX-License-Identifier: Apache-2.0
"""Workers: processes of this computer, or a Dask cluster, each an executor with the number of blocks it can take."""

import logging
import multiprocessing
import os
import re
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from functools import cache
from importlib import import_module, metadata
from typing import Any

from ..checks import instance_of
from ..errors import InputError, install_step
from ..vocabulary import __version__

CONNECT_S = 10  # [s] within which a scheduler answers
COUNT_S = 5.0  # [s] between two counts of a cluster's workers
ABANDONED_S = 60.0  # [s] in which a cluster of this computer replaces workers that ended, if it does
IN_FLIGHT = 2  # blocks for each worker: one is done, one waits
MAX_PROCESSES = 61 if sys.platform == "win32" else 1024  # Windows waits for no more
_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")  # of linear algebra
_log = logging.getLogger(__name__)


class Workers:
    """This process as the only worker: one block after the other is done in it."""

    expected: dict[str, str] | None = None
    """The versions that a worker must have; None if all are of this installation."""

    def window(self) -> int:
        """The number of blocks that may be in flight."""
        return 1

    def submit(self, function: Callable, *values: Any) -> Future:
        """As that of an executor; one that is broken gives a future with the error."""
        done: Future = Future()
        done.set_result(function(*values))
        return done

    def restart(self) -> None:
        """Replace an executor that is broken."""

    def close(self, at_once: bool) -> None:
        """End it; ``at_once`` in the middle of its work."""


@contextmanager
def started(jobs: int | None = None, scheduler: str | None = None) -> Iterator[Workers]:
    """The workers for ``run_tasks``, ended when the block ends; at once if it ends with an error.

    Parameters
    ----------
    jobs : int, optional
        Number of processes; default: one for each processor that this process may use. With 1 the work is done in this
        process, as it is in a process of another pool.
    scheduler : str, optional
        ``"local"`` for a Dask cluster of processes on this computer, or the address of a scheduler.

    Raises
    ------
    InputError
        A number of processes below 1, a scheduler without the package distributed, or one that does not answer.
    """
    if jobs is not None and instance_of("jobs", jobs, int, "Give the number of processes.") < 1:
        raise InputError("jobs", jobs, "must be at least 1", next_step="Leave it out for one on each processor.")
    if scheduler is not None:
        workers = Cluster(scheduler, jobs)
    elif (jobs or processors()) == 1 or multiprocessing.current_process().daemon:
        workers = Workers()
    else:
        workers = Processes(jobs or processors())
    try:
        yield workers
    except BaseException:
        workers.close(at_once=True)
        raise
    workers.close(at_once=False)


def processors() -> int:
    """The number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class Processes(Workers):
    """Processes of this computer. They end when this one does, however it ends: each waits for the end of a pipe."""

    def __init__(self, count: int):
        self._count = min(count, MAX_PROCESSES)
        self._context = multiprocessing.get_context("spawn")
        self.restart()

    def restart(self) -> None:
        """New processes, started as they are needed, and a new pipe."""
        self._their_end, self._our_end = self._context.Pipe(duplex=False)
        self._pool = ProcessPoolExecutor(self._count, self._context, _end_with, (self._their_end,))

    def window(self) -> int:
        """Two for each process."""
        return IN_FLIGHT * self._count

    def submit(self, function: Callable, *values: Any) -> Future:
        """Send it to the pool; a process is started if none is free."""
        try:
            with _as_workers_start():
                return self._pool.submit(function, *values)
        except BrokenExecutor as error:
            refused: Future = Future()
            refused.set_exception(error)
            return refused

    def close(self, at_once: bool) -> None:
        """End the processes, ``at_once`` by their pipe."""
        if at_once:
            self._our_end.close()
        self._pool.shutdown(cancel_futures=True)
        self._our_end.close()


@contextmanager
def _as_workers_start() -> Iterator[None]:
    """What a new process takes over: one thread of linear algebra, and not the script of the user, which each would run
    from its beginning."""
    main, added = sys.modules["__main__"], [name for name in _THREADS if name not in os.environ]
    script = {name: main.__dict__.pop(name) for name in ("__file__", "__spec__") if name in main.__dict__}
    main.__spec__ = None
    os.environ.update(dict.fromkeys(added, "1"))
    try:
        yield
    finally:
        main.__dict__.update(script)
        for name in added:
            os.environ.pop(name, None)


def _end_with(pipe: Any) -> None:
    """Let this process end when the other end of the pipe is closed; Ctrl-C is for the process that started it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_wait_for_end, args=(pipe,), daemon=True).start()


def _wait_for_end(pipe: Any) -> None:
    with suppress(OSError):
        pipe.poll(None)
    os._exit(1)


class Cluster(Workers):
    """A Dask cluster: one on this computer, or that of a scheduler with an address. A worker that ends is replaced by
    Dask, and its tasks are done again."""

    def __init__(self, scheduler: str, jobs: int | None):
        try:
            import dask
            from distributed import Client, LocalCluster
        except ImportError:
            raise InputError("package distributed", "not installed", "it is needed for --scheduler",
                             next_step=install_step("distributed", "cluster")) from None  # fmt: skip
        if scheduler != "local" and not re.search(r":\d+/?$|://", scheduler):
            step = "Give 'local' or an address such as tcp://HOST:8786."
            raise InputError(
                "scheduler", repr(scheduler[:80]), "neither local nor an address with a port", next_step=step
            )
        self._started = ExitStack()
        if scheduler == "local":
            self._started.enter_context(_as_workers_start())  # also one that replaces another
            # a task is given up when its worker ends once: ``run_tasks`` does it once more, alone
            with dask.config.set({"distributed.scheduler.allowed-failures": 0}):
                local = LocalCluster(
                    n_workers=jobs or processors(), threads_per_worker=1, dashboard_address="127.0.0.1:0"
                )
            self._started.enter_context(local)
        elif jobs is not None:
            raise InputError("jobs", jobs, f"the cluster at {scheduler} has its own workers", next_step="Leave it out.")
        try:
            self._client = Client(local if scheduler == "local" else scheduler, timeout=CONNECT_S, set_as_default=False)
        except (OSError, ValueError) as error:
            step = "Start it, or give 'local' or an address such as tcp://HOST:8786."
            limit = f"no answer within {CONNECT_S} s ({error})"
            raise InputError("scheduler", repr(scheduler[:80]), limit, next_step=step) from None
        self._executor = self._client.get_executor(pure=False)
        self.expected = versions()
        self._threads: dict[str, int] = {}
        self._counted, self._seen, self._is_local = -COUNT_S, time.monotonic(), scheduler == "local"
        self.window()
        if not self._threads:
            _log.warning("The scheduler has no worker yet. The work starts when it has one.")

    def window(self) -> int:
        """Two for each thread of its workers, whose number may change."""
        if time.monotonic() - self._counted > COUNT_S:
            before, self._threads = self._threads, self._client.nthreads()
            self._check([each for each in self._threads if each not in before])
            self._counted = time.monotonic()
            self._seen = self._counted if self._threads else self._seen
            if before and not self._threads:
                _log.warning("The scheduler has no worker any more. The work continues when it has one.")
        if self._is_local and self._counted - self._seen > ABANDONED_S:
            step = "Without a scheduler, the task that ends them is found and left out."
            raise InputError("workers", "none", f"all ended, and none came for {ABANDONED_S:g} s", next_step=step)
        return IN_FLIGHT * max(sum(self._threads.values()), 1)

    def _check(self, addresses: list[str]) -> None:
        """Raises InputError for a new worker without needleforce: it would end with the first task that it is sent."""
        found = self._client.run(import_module, __package__, workers=addresses, on_error="return") if addresses else {}
        for address, error in found.items():
            if isinstance(error, ModuleNotFoundError):
                step = "Install the same version of needleforce, with the same extras, for every worker."
                raise InputError("worker", "without needleforce", str(error), address, step)

    def submit(self, function: Callable, *values: Any) -> Future:
        """Send it to the scheduler."""
        return self._executor.submit(function, *values)

    def close(self, at_once: bool) -> None:
        """Cancel what is left, and leave the cluster; one on this computer is ended."""
        with suppress(Exception):  # a cluster that is gone
            self._executor.shutdown(wait=False)
        self._client.close()
        self._started.close()


@cache
def versions() -> dict[str, str]:
    """The versions on which a result may depend: Python, needleforce, and the packages that it can use."""
    with suppress(metadata.PackageNotFoundError):
        names = sorted({re.match(r"[\w.-]+", each)[0] for each in metadata.requires("needleforce") or ()})
        return {"Python": f"{sys.version_info[0]}.{sys.version_info[1]}", "needleforce": __version__} | {
            name: _version(name) for name in names
        }
    return {"needleforce": __version__}


def _version(name: str) -> str:
    with suppress(metadata.PackageNotFoundError):
        return metadata.version(name)
    return ""
