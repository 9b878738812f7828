# SPDX-License-Identifier: Apache-2.0
"""``campaign``: identify every condition in a folder of recordings, with a result for every recording. Workers read the
files and identify the conditions; what they found is kept in a folder, if one is given, and put together here."""

import logging
import os
from collections.abc import Callable, Collection, Iterable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, fields, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ..core import Needle
from ..errors import InputError
from ..identification import identify
from ..preset_files import needle_of
from ..recording import Recording
from ..recording.mappings import IN_FOLDER, load_mapping
from ..recording.options import FileOptions, ReadOptions, keywords_of
from ..running import Workers, outcomes, started
from ..state_folder import StateFolder, key_of
from ..vocabulary import Status, __version__
from .checks import wrong_labels
from .condition import ConditionTask, failed, identified
from .file_facts import FileFacts, FileTask, content_of, facts_of, stamp_of
from .folder_files import File, find_files
from .kept_results import Plan, decoded, decoded_condition, encoded
from .labels import REPEATS, Label, grouped, inferred, label_files
from .recording_result import INVALIDATING, Anomaly, RecordingResult
from .result import Campaign, Condition, is_result

Progress = Callable[[Any, str], Any]
KIND, PLAN = "campaign", "plan"
READ_AT_ONCE = 8  # files that are sent to a worker together: reading one takes some 20 ms, sending it to a cluster 2 ms
_log = logging.getLogger(__name__)


@dataclass(frozen=True, kw_only=True)
class CampaignOptions(FileOptions):
    """The options of ``campaign``: those of its files, and these.

    Parameters
    ----------
    instrument : str or os.PathLike, optional
        Options kept in a file, the ``mapping`` of ``read``.
    pattern : str, optional
        Pattern of the file names, such as ``"{specimen}_{speed_mm_s}_{repeat}"``, from which the fields of a file are
        read.
    mapping : str or os.PathLike, optional
        CSV table with a column ``file`` and one column for each field, for files that do not match the pattern. Without
        either, the fields are read from the card in the file, otherwise from the names by evidence: a note states what
        the values decide (date, speed, repeat) and what they do not.
    model : str, optional
        Name of the model, as for ``identify``.
    needle : Needle, optional
        The needle, as for ``identify``.
    repeats : collection of str
        Fields in which repeats of one condition differ. Files with equal other fields are repeats of one condition; a
        file without fields is identified by itself.
    progress : callable, optional
        ``progress(iterable, text)`` wraps the work over files and over conditions, for a progress bar.
    follow_links : bool
        Also read files of a folder that are links to what is not in it.
    jobs : int, optional
        Number of processes; default: one for each processor. The result does not depend on it.
    scheduler : str, optional
        The address of a Dask scheduler whose workers do the work, or ``"local"``; needs the extra ``cluster``.
    state : str or os.PathLike, optional
        A folder in which the result of each condition is kept: a campaign that was stopped continues, and what has not
        changed is not done again.
    """

    instrument: str | os.PathLike | None = None
    pattern: str | None = None
    mapping: str | os.PathLike | None = None
    model: str | None = None
    needle: Needle | None = None
    repeats: Collection[str] = REPEATS
    progress: Progress | None = None
    follow_links: bool = False
    jobs: int | None = None
    scheduler: str | None = None
    state: str | os.PathLike | None = None


@keywords_of(CampaignOptions)
def campaign(source: str | os.PathLike | Iterable[str | os.PathLike] | None, options: CampaignOptions) -> Campaign:
    """Identify every condition of a campaign.

    The result does not depend on the order of the files, on the number of processes, nor on whether it was interrupted.
    Only the arrays of one condition are in the memory of a process at a time. A file that cannot be read or identified
    is part of the result, with its status, and a file of the folder that is not a recording is listed with the reason.
    Every recording of a file with several is used, or those of ``part``, as for ``read_all``: ``"cycle *"`` takes every
    cycle of a recording that repeats, which by default is used as a whole. They are repeats of one condition.

    Parameters
    ----------
    source : str, os.PathLike or iterable of them
        A folder, a glob, or a list of files, folders and globs. None for what the folder ``state`` has so far.
    options : CampaignOptions
        The keywords.

    Returns
    -------
    Campaign
        The conditions and the recordings without condition.

    Raises
    ------
    InputError
        A source without files, a pattern that matches none of them, a mapping that cannot be read, an unknown model, a
        scheduler that does not answer, or a state folder that another program uses.
    """
    if source is None:
        return _so_far(options.state)
    work = _Work(options)
    if options.model is not None:  # one that is unknown is refused before any file is read
        still = np.zeros(10)
        identify([Recording(np.arange(10.0), still, still, still)], model=options.model, needle=work.needle)
    files, others = campaign_files(source, options.follow_links)
    with work.state_folder() as work.state, started(options.jobs, options.scheduler) as work.workers:
        labels, plan = _labelled(source, files, others, work)
        groups = grouped(labels, options.repeats)
        tasks = [work.task(group) for group in groups]
        plan = replace(plan, keys=tuple(map(work.key, tasks)))
        if work.state is not None:
            work.state.replace(PLAN, encoded(plan))
        return _put_together(work.conditions(tasks, plan.keys), plan)


def campaign_files(
    source: str | os.PathLike | Iterable[str | os.PathLike], follow_links: bool = False
) -> tuple[list[File], list[File]]:
    """The recordings and the other files, as ``find_files``, without the tables, reports and JSON of campaigns."""
    found = find_files(source, follow_links)
    files, others = ([file for file in each if file.why or not is_result(file.path)] for each in found)
    if not files and not others:
        raise InputError("source", repr(str(source)), "only results of campaigns", next_step="Give the recordings.")
    return files, others


def _labelled(source: Any, files: list[File], others: list[File], work: "_Work") -> tuple[list[Label], Plan]:
    """The recordings with their labels, and the plan without the keys. Raises InputError if there is no recording."""
    pattern, mapping = work.options.pattern, work.options.mapping
    table = None if mapping is None else Path(os.path.abspath(mapping))
    kinds = {file: "it is the mapping" if file.path == table else
             "it keeps options" if file.path.name == IN_FOLDER else file.why for file in others}  # fmt: skip
    facts = work.read([*files, *(file for file, why in kinds.items() if not why)], used=set(files))
    rest = [(file.name, why or facts[file.path].problem) for file, why in kinds.items()]
    rest = [(name, why) for name, why in rest if why]
    files = sorted(file for file in (*files, *others) if file.path in facts and not facts[file.path].problem)
    if not files:
        reasons = "; ".join(f"{name}: {why}" for name, why in rest[:3])
        raise InputError("source", repr(str(source)), f"a folder without recordings ({reasons})")
    files = [each for file in files for each in facts[file.path].recordings(file)]
    labels, notes = label_files(files, pattern, mapping, {path: each.card for path, each in facts.items()})
    if pattern is None and mapping is None:
        labels, more = inferred(labels, {path: each.speed for path, each in facts.items()})
        notes += more
    reasons = {label.file.name: label.why for label in labels}
    return labels, Plan(keys=(), reasons=reasons, notes=tuple(notes), not_recordings=tuple(rest))


class _Work:
    """The work on files and conditions: what is kept is not done again, the rest goes to the workers."""

    workers: Workers
    state: StateFolder | None

    def __init__(self, options: CampaignOptions):
        self.options = options
        self.needle = None if options.needle is None else needle_of(options.needle)
        self.reading = ReadOptions(**options.of_every_file(), mapping=options.instrument)
        self._facts: dict[Path, FileFacts] = {}
        self._fatal: dict[Path, str] = {}

    def state_folder(self) -> Any:
        """The folder that keeps the results, opened; None without one."""
        if self.options.state is None:
            return nullcontext()
        return StateFolder(self.options.state, KIND, self._settings)

    @cached_property
    def _settings(self) -> dict[str, str]:
        """The options on which results depend, as text."""
        given = {row.name: repr(getattr(self.reading, row.name)) for row in fields(self.reading)}
        if self.reading.mapping is not None:
            given["mapping"] = repr(load_mapping(self.reading.mapping))
        model = self.options.model
        content = content_of(Path(model)) if isinstance(model, str | os.PathLike) else ""
        return given | {"model": f"{model!r} {content}".rstrip(), "needle": repr(self.needle)}

    def read(self, files: list[File], used: set[File]) -> dict[Path, FileFacts]:
        """What is known of each file by its path; of those that are not ``used`` in any case, also why they are not."""
        speeds = self.options.pattern is None and self.options.mapping is None
        kept = self.state is not None
        tasks = [FileTask(file=file, reading=self.reading, is_used=file in used, speeds=speeds, kept=kept)
                 for file in files]  # fmt: skip
        for task in tasks if kept else ():
            content = self.state.result(self._file_key(task, stamp_of(task.file.path)))
            if content is not None:
                self._facts[task.file.path] = decoded(content, FileFacts)
        tasks = [task for task in tasks if task.file.path not in self._facts]
        for index, found in self._outcomes(facts_of, tasks, READ_AT_ONCE, "reading"):
            self._take(tasks[index], found)
        return self._facts

    def _take(self, task: FileTask, found: FileFacts | Exception) -> None:
        """Take over what a worker found in a file."""
        path = task.file.path
        if isinstance(found, Exception):
            self._fatal[path] = f"{task.file.name}: {found}"
            found = FileFacts(parts=((self.reading.part, None),), problem="" if task.is_used else str(found))
        if not found.is_there and path.exists():
            step = "Give a folder that all computers have under this name."
            raise InputError("file", "missing for a worker", "it is on this computer", str(path), step)
        self._facts[path] = found
        if self.state is not None and found.stamp:
            line = {"task": "file", "name": task.file.name, "files": [task.file.name], "seconds": found.seconds}
            line["status"] = found.problem or "read"
            self.state.keep(self._file_key(task, found.stamp), encoded(found), **line)

    def task(self, group: Sequence[Label]) -> ConditionTask:
        """The task to identify a group of repeats."""
        return ConditionTask(
            labels=tuple(group),
            fields=group[0].condition(self.options.repeats),
            reading=self.reading,
            model=self.options.model,
            needle=self.needle,
            unreadable={each.file.name: self._fatal[each.file.path] for each in group if each.file.path in self._fatal},
            contents=() if self.state is None else tuple(self._facts[each.file.path].content for each in group),
        )

    def key(self, task: ConditionTask) -> str:
        """The digest of all that the condition follows from; empty if nothing is kept."""
        if self.state is None:
            return ""
        labels = [
            (each.file.name, each.file.part, each.fields, content, *self._companions(each.file.path))
            for each, content in zip(task.labels, task.contents)
        ]
        return key_of("condition", __version__, self._settings, task.fields, labels)

    def conditions(self, tasks: list[ConditionTask], keys: Sequence[str]) -> list[Condition]:
        """The conditions in the order of the tasks. Raises InputError if it is that of every one."""
        kept = () if self.state is None else map(self.state.result, keys)
        found = {k: decoded_condition(content) for k, content in enumerate(kept) if content}
        # the longest first: at the end no worker waits for one that began late
        waiting = sorted((k for k in range(len(tasks)) if k not in found), key=lambda k: -_size(tasks[k]))
        refused: list[InputError] = []
        if self.state is not None:
            _log.info("%d of %d conditions are kept, %d are identified.", len(found), len(tasks), len(waiting))
        for index, done in self._outcomes(identified, [tasks[k] for k in waiting], 1, "identifying"):
            k = waiting[index]
            if isinstance(done, Exception):
                refused += [done] if isinstance(done, InputError) else []
                found[k] = failed(tasks[k], f"Not identified: {done}.")
                continue
            found[k] = decoded_condition(done.content)
            if self.state is not None and done.follows:
                line = {"task": "condition", "name": found[k].name, "seconds": done.seconds}
                line |= {"files": [each.file.name for each in tasks[k].labels], "status": found[k].why or "identified"}
                self.state.keep(keys[k], done.content, **line)
        done = [found[k] for k in range(len(tasks))]
        if refused and all(one.status == Status.unreadable for each in done for one in each.recordings):
            raise refused[0]
        return done

    def _outcomes(self, function: Callable, tasks: list, block: int, text: str) -> Iterable[tuple[int, Any]]:
        return outcomes(self.workers, function, tasks, block=block, progress=self.options.progress, text=text)

    def _file_key(self, task: FileTask, stamp: tuple[int, ...]) -> str:
        reading = {row.name: self._settings[row.name] for row in fields(self.reading)}
        path = os.fsencode(task.file.path).hex()
        in_folder = content_of(task.file.path.with_name(IN_FOLDER))
        return key_of("file", __version__, reading, (path, stamp, in_folder), (task.is_used, task.speeds))

    def _companions(self, path: Path) -> tuple[str, str]:
        """The digests of the files from which a recording takes its options and its motion; empty without them."""
        motion = Path(self._facts[path].motion).name
        return content_of(path.with_name(IN_FOLDER)), content_of(path.with_name(motion)) if motion else ""


def _size(task: ConditionTask) -> int:
    """The bytes of a condition's files, by which its time is judged."""
    return sum(sum(stamp_of(each.file.path)[:1]) for each in task.labels)


def _so_far(folder: str | os.PathLike | None) -> Campaign:
    """The conditions that a state folder has. Raises InputError without one."""
    if folder is None:
        raise InputError("source", "missing", "no file to identify", next_step="Give a folder, a glob or files.")
    with StateFolder(folder, KIND) as state:
        plan = decoded(state.read(PLAN), Plan)
        kept = [content for content in map(state.result, plan.keys) if content is not None]
    if len(kept) < len(plan.keys):
        note = f"{len(kept)} of {len(plan.keys)} conditions are identified so far."
        plan = replace(plan, notes=(*plan.notes, note))
    return _put_together(list(map(decoded_condition, kept)), plan)


def _put_together(found: list[Condition], plan: Plan) -> Campaign:
    """The conditions with what only shows when all are known, and the recordings without a condition."""
    conditions = _with_wrong_labels([each for each in found if each.recordings[0].fields])
    others = [each.recordings[0] for each in found if not each.recordings[0].fields]
    without = tuple(_without_condition(each, plan.reasons[each.file]) for each in others)
    return Campaign(tuple(conditions), without, plan.notes, plan.not_recordings)


def _with_wrong_labels(conditions: list[Condition]) -> list[Condition]:
    """The conditions with anomalies of labels, which are found only by comparing all conditions."""
    curves = {each.name: {one.file: one.curve for one in each.recordings if _comparable(one)} for each in conditions}
    pooled = {
        each.name: [one.file for one in each.recordings if one.pooled and _comparable(one)] for each in conditions
    }
    with np.errstate(all="ignore"):  # values too large for a force give distances that are not finite
        mislabelled = dict(wrong_labels(curves, pooled))
    return [
        replace(each, recordings=tuple(_with(one, mislabelled.get(one.file)) for one in each.recordings))
        for each in conditions
    ]


def _comparable(one: RecordingResult) -> bool:
    """Whether the loading curve can be compared: it exists, and its sign, unit and range are valid."""
    return len(one.curve) > 0 and not any(each.kind in INVALIDATING for each in one.anomalies)


def _without_condition(one: RecordingResult, reason: str) -> RecordingResult:
    """Pooled with none; the reason is of no use for a file that cannot be read."""
    why = None if one.status == Status.unreadable else Anomaly(kind="no_condition", sentence=reason)
    return replace(_with(one, why), pooled=False)


def _with(one: RecordingResult, anomaly: Anomaly | None) -> RecordingResult:
    return one if anomaly is None else replace(one, anomalies=(*one.anomalies, anomaly))
