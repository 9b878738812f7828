# SPDX-License-Identifier: Apache-2.0
"""Workers: processes of this computer, or a Dask cluster, each an executor with the number of blocks it can take."""

import logging
import multiprocessing
import os
import pickle
import re
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Future, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from functools import cache
from importlib import import_module, metadata
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from multiprocessing.reduction import ForkingPickler
from types import ModuleType
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
_starting = threading.Lock()  # one process after the other: ``_as_workers_start`` concerns the whole program
_log = logging.getLogger(__name__)


class Workers:
    """This process as the only worker: one block after the other is done in it."""

    expected: dict[str, str] | None = None
    """The versions that a worker must have; None if all are of this installation."""

    def window(self) -> int:
        """The number of blocks that may be in flight."""
        return 1

    def submit(self, function: Callable, *values: Any) -> Future:
        """As that of an executor; a BrokenExecutor is the error of work whose process ended."""
        done: Future = Future()
        done.set_result(function(*values))
        return done

    def close(self) -> None:
        """End it, also in the middle of its work."""


@contextmanager
def started(jobs: int | None = None, scheduler: str | None = None) -> Iterator[Workers]:
    """The workers for ``run_tasks``, ended at once when the block ends.

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
    finally:
        workers.close()


def processors() -> int:
    """The number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class Processes(Workers):
    """Processes of this computer, each with its own pipe and its own thread here. What they would share, a lock or a
    pipe, one that ends in the middle of an answer would leave so that all others wait without end."""

    def __init__(self, count: int):
        self._count = min(count, MAX_PROCESSES)
        self._threads = ThreadPoolExecutor(self._count)
        self._of_thread: dict[int, tuple[SpawnProcess, Connection]] = {}
        self._is_closed = False

    def window(self) -> int:
        """Two for each process."""
        return IN_FLIGHT * self._count

    def submit(self, function: Callable, *values: Any) -> Future:
        """Let a process do it; one is started if none is free."""
        return self._threads.submit(self._done, function, values)

    def close(self) -> None:
        """Kill the processes: each thread then finds the end of its pipe."""
        with _starting:
            self._is_closed = True
            for process, _ in self._of_thread.values():
                process.kill()
        self._threads.shutdown(cancel_futures=True)
        for process, _ in self._of_thread.values():
            process.join()

    def _done(self, function: Callable, values: tuple) -> Any:
        """What the process of this thread returns, or raises. No Ctrl-C comes to a thread that starts a process."""
        content = ForkingPickler.dumps((function, values))
        try:
            _, pipe = self._of_thread.get(threading.get_ident()) or self._start()
            pipe.send_bytes(content)
            result, error = pickle.loads(pipe.recv_bytes())
        except (EOFError, OSError, MemoryError) as reason:
            raise BrokenExecutor(self._ended(reason)) from None
        if error is not None:
            raise error
        return result

    def _start(self) -> tuple[SpawnProcess, Connection]:
        """A process, and the pipe to it, whose other end it alone has."""
        ours, theirs = multiprocessing.Pipe()
        process = SpawnProcess(target=_work, args=(theirs,), daemon=True)
        with _starting, theirs, _as_workers_start():
            if self._is_closed:
                raise EOFError("the work is ended")
            process.start()
            self._of_thread[threading.get_ident()] = process, ours
        return process, ours

    def _ended(self, reason: Exception) -> str:
        """How the process of this thread ended; the next block has another."""
        with _starting:
            process, _ = self._of_thread.pop(threading.get_ident(), (None, None))
            if process is None:
                return f"no process is started: {reason}"
            process.kill()
            process.join()
        code = process.exitcode or 0
        return f"its process ended with {'signal' if code < 0 else 'exit code'} {abs(code)}"


@contextmanager
def _as_workers_start() -> Iterator[None]:
    """What a new process takes over: one thread of linear algebra, and not the script of the user, which each would run
    from its beginning."""
    main, added = sys.modules["__main__"], [name for name in _THREADS if name not in os.environ]
    sys.modules["__main__"] = ModuleType("__main__")
    os.environ.update(dict.fromkeys(added, "1"))
    try:
        yield
    finally:
        sys.modules["__main__"] = main
        for name in added:
            os.environ.pop(name, None)


def _work(pipe: Connection) -> None:
    """A process: the answer to one block after the other. It ends when its program does, however that ends; Ctrl-C is
    for the program."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_program, daemon=True).start()
    with suppress(EOFError, OSError):
        while content := pipe.recv_bytes():
            try:
                function, values = pickle.loads(content)
                answer = ForkingPickler.dumps((function(*values), None))
            except Exception as error:
                answer = ForkingPickler.dumps((None, error))
            pipe.send_bytes(answer)


def _end_with_program() -> None:
    multiprocessing.parent_process().join()
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

    def close(self) -> None:
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
