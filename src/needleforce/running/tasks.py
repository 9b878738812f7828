# SPDX-License-Identifier: Apache-2.0
"""Many tasks on workers: processes of this computer, or a Dask cluster.

What is here cuts the work into blocks and keeps few of them in flight. Scheduling, transport and the replacement of
processes are the workers'. A task is a function that can be imported and a value that can be pickled; it may be done
twice, and its result may not depend on where or when it is done.
"""

import logging
import traceback
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Future, wait
from dataclasses import dataclass
from itertools import islice
from operator import length_hint
from typing import Any

from ..errors import InputError
from .workers import COUNT_S, Processes, Workers, started, versions

_log = logging.getLogger(__name__)


class TaskError(RuntimeError):
    """A task without a result: what it raised, or that its process ended; ``trace`` is the traceback as text."""

    trace = ""


Block = list[tuple[int, Any]]


def run_tasks(
    function: Callable[[Any], Any],
    tasks: Iterable[Any],
    *,
    jobs: int | None = None,
    scheduler: str | None = None,
    block: int = 1,
    progress: Callable[[Any, str], Any] | None = None,
    text: str = "working",
) -> Iterator[tuple[int, Any]]:
    """The outcome of ``function(task)`` for each task, in the order in which they come.

    Parameters
    ----------
    function : callable
        A function of a module, which workers import.
    tasks : iterable
        Taken one after the other, as workers become free.
    jobs, scheduler
        As for ``started``.
    block : int
        Number of tasks that are sent to a worker at once.
    progress : callable, optional
        ``progress(iterable, text)`` wraps the outcomes; their number is its length, if that of the tasks is known.
    text : str
        What is done, for the progress.

    Returns
    -------
    iterator of (int, object)
        The number of a task, from 0, and what its function returned; or the InputError that it raised, or a TaskError
        for any other error and for a task whose process ended. None of these ends the work.

    Raises
    ------
    InputError
        As ``started``; a worker with another version of a package, or without needleforce; a scheduler that ends.
    """
    with started(jobs, scheduler) as workers:
        yield from outcomes(workers, function, tasks, block=block, progress=progress, text=text)


def outcomes(
    workers: Workers,
    function: Callable[[Any], Any],
    tasks: Iterable[Any],
    *,
    block: int = 1,
    progress: Callable[[Any, str], Any] | None = None,
    text: str = "working",
) -> Iterator[tuple[int, Any]]:
    """As ``run_tasks``, on workers that ``started`` gave and that take more work afterwards."""
    count = length_hint(tasks, -1)
    if 0 <= count <= block and isinstance(workers, Processes):
        workers = Workers()  # to start a process would take longer
    found = _found(workers, function, _blocks(tasks, block))
    return iter(progress(_Counted(found, count), text)) if progress and count >= 0 else found


@dataclass(frozen=True)
class _Counted:
    """Outcomes whose number is known before they are."""

    outcomes: Iterator[tuple[int, Any]]
    count: int

    def __iter__(self) -> Iterator[tuple[int, Any]]:
        return self.outcomes

    def __len__(self) -> int:
        return self.count


def _blocks(tasks: Iterable[Any], size: int) -> Iterator[Block]:
    numbered = enumerate(tasks)
    return iter(lambda: list(islice(numbered, size)), [])


def _found(workers: Workers, function: Callable, blocks: Iterator[Block]) -> Iterator[tuple[int, Any]]:
    waiting: dict[Future, Block] = {}
    again: deque[Block] = deque()
    suspected: list[Block] = []
    while True:
        for _ in range(workers.window() - len(waiting)):
            block = again.popleft() if again else next(blocks, None)
            if block is None:
                break
            waiting[workers.submit(_attempts, function, block, workers.expected)] = block
        if not waiting:
            break
        for future in wait(waiting, COUNT_S, FIRST_COMPLETED).done:
            block, error = waiting.pop(future), _error_of(future)
            if error is None:
                yield from future.result()
            elif len(block) > 1:  # which of its tasks it is
                again += [[each] for each in block]
            elif _is_end_of_process(error):
                suspected.append(block)
            else:
                yield _failed(block[0][0], error)
            if error is not None and _is_end_of_process(error):
                _log.warning("A worker process ended (%s). Its tasks (%d) are done again.", error, len(block))
    for block in suspected:  # others were on the worker that ended: each is done once more, with no other next to it
        future = workers.submit(_attempts, function, block, workers.expected)
        while not wait([future], COUNT_S).done:
            workers.window()
        error = _error_of(future)
        yield from future.result() if error is None else [_failed(block[0][0], error)]


def _error_of(future: Future) -> BaseException | None:
    """Why a block has no outcomes. Raises InputError for what concerns all blocks."""
    try:
        error = future.exception()
    except CancelledError:
        step = "Start it, and give the same command again: what a state folder has is kept."
        raise InputError("scheduler", "gone", "it ended, or cannot be reached any more", next_step=step) from None
    if isinstance(error, InputError):
        raise error
    return error


def _failed(index: int, error: BaseException) -> tuple[int, TaskError]:
    """The outcome of a task that returned nothing, not even an error."""
    if not _is_end_of_process(error):
        return index, TaskError(repr(error))
    how = error if isinstance(error, BrokenExecutor) else "its process ended"
    return index, TaskError(f"{how}, also without others; the memory may not suffice")


def _is_end_of_process(error: BaseException) -> bool:
    """Whether the process ended that had the task, or a worker of Dask."""
    return isinstance(error, BrokenExecutor) or type(error).__name__ == "KilledWorker"


def _attempts(function: Callable, block: Block, expected: dict[str, str] | None = None) -> list[tuple[int, Any]]:
    """The outcomes of a block, in a worker. Raises InputError if its packages are not the ``expected`` ones."""
    if expected is not None and (found := versions()) != expected:
        pairs = ((name, found.get(name, ""), wanted) for name, wanted in expected.items())
        text = ", ".join(f"{name} {a or 'missing'} instead of {b or 'none'}" for name, a, b in pairs if a != b)
        step = "Install the versions of this computer for every worker."
        raise InputError("worker", f"with {text or 'more packages'}", "results would differ", next_step=step)
    return [(index, _attempt(function, task)) for index, task in block]


def _attempt(function: Callable, task: Any) -> Any:
    try:
        return function(task)
    except InputError as error:
        return error.with_traceback(None)
    except Exception as error:
        failed = TaskError(f"{type(error).__name__}: {error}")
        failed.trace = "".join(traceback.format_exception(error))
        return failed
