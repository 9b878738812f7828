# SPDX-License-Identifier: Apache-2.0
"""``study``: simulate the insertions of a question on all cores, and say what its outputs depend on."""

import json
import os
import time
from collections.abc import Callable, Mapping
from contextlib import nullcontext
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..files import MAX_RESULT_BYTES, digest, read_text
from ..preset_files.presets import model_source
from ..running import run_tasks
from ..running.workers import processors
from .blocks import BlockFolder
from .design import Candidate, DesignResult, Experiments, candidates_of, designed, done
from .factors import GRID_TAIL, MODEL, MODEL_PLACE, factors_of
from .insertions import Block, Setting, model_of_row, preset_table, sampled_motion, simulated
from .posterior import posterior_of
from .question import Question, read_question
from .result import StudyResult
from .rows import columns_of, number_of_rows, unit_rows

ROWS_OF_A_BLOCK = 500  # rows of one task: a tenth of a second of processor or more, and the rows of one file
ROWS_TRIED = 2  # to estimate the time of a study
ASK_ABOVE_SECONDS = 3600.0  # time or size of a study for which it is asked whether it is meant
ASK_ABOVE_BYTES = 10 << 30


@dataclass(frozen=True)
class Cost:
    """What a study takes: insertions, processor time [s] and bytes of the result."""

    insertions: int
    seconds: float
    size: float

    def __str__(self) -> str:
        hours = f"{self.seconds / 3600.0:.2g} h" if self.seconds > 3600.0 else f"{self.seconds:.2g} s"
        return f"{self.insertions} insertions, {hours} of processor time, {self.size / 1e9:.2g} GB"


def study(
    source: str | os.PathLike | Mapping,
    *,
    jobs: int | None = None,
    scheduler: str | None = None,
    out: str | os.PathLike | None = None,
    yes: bool = False,
    progress: Callable | None = None,
) -> StudyResult | DesignResult:
    """Answer a question about simulated insertions: what its outputs are, and which factors they depend on.

    Parameters
    ----------
    source : str, os.PathLike or mapping
        A study file (TOML), or a mapping with the same keys; the tables are described in docs/howto/studies.md.
    jobs : int, optional
        Processes; the default is one for each core.
    scheduler : str, optional
        ``"local"`` or the address of a Dask scheduler; needs the extra ``cluster``.
    out : str or os.PathLike, optional
        Folder for the result, in blocks of Parquet with a card. A study that was stopped continues there. Needs
        pyarrow.
    yes : bool
        Whether a study of more than an hour or 10 GB is meant.
    progress : callable, optional
        ``progress(iterable, text)`` wraps the work, for a progress bar.

    Returns
    -------
    StudyResult or DesignResult
        The same for the same question, whatever the number of processes.

    Raises
    ------
    InputError
        For a factor that the model does not have, limits outside the range of a law, an output that the question cannot
        give, a folder of another study, or a study that is larger than meant.
    """
    question = read_question(source)
    setting = setting_of(question, Path.cwd() if isinstance(source, Mapping) else Path(source).parent)
    draws = setting.posterior.size if setting.posterior is not None else 0
    _check_ends(setting)
    if question.study.method == "design" and out is not None:
        step = "Leave it out; give a report or JSON."
        raise InputError("out", str(out), "a design has no folder", next_step=step)
    if question.study.method == "design":
        _check_cost(cost_of_design(setting), jobs, yes)
        work = {"jobs": jobs, "scheduler": scheduler, "progress": progress, "text": "doing experiments"}
        return designed(setting, partial(run_tasks, **work))
    count = number_of_rows(question, setting.factors, draws)
    if question.recordings is not None and out is None:
        raise InputError("out", "missing", "recordings are written to a folder", next_step="Give out=, or -o.")
    if count > ROWS_TRIED:
        _check_cost(cost_of(setting, count), jobs, yes)
    rows = unit_rows(question, setting.factors, draws)
    tasks = [Block(setting, k, rows[k : k + ROWS_OF_A_BLOCK]) for k in range(0, len(rows), ROWS_OF_A_BLOCK)]
    work = {"jobs": jobs, "scheduler": scheduler, "progress": progress, "text": "simulating"}
    with nullcontext() if out is None else BlockFolder(Path(out), question, inputs_of(setting)) as folder:
        result = StudyResult(question, tuple(setting.factors), rows, _columns(folder, tasks, work))
        if folder is not None:
            folder.finish(result)
    return result


def _columns(folder: BlockFolder | None, tasks: list[Block], work: dict) -> dict[str, np.ndarray]:
    """The columns of all blocks: of those in the folder, and of the others, which are done."""
    found = {} if folder is None else folder.done(len(tasks))
    waiting = [number for number in range(len(tasks)) if number not in found]
    for index, outcome in run_tasks(simulated, [tasks[number] for number in waiting], **work):
        if isinstance(outcome, Exception):
            raise outcome
        number = waiting[index]
        found[number] = _kept(folder, tasks[number].setting.question, number, outcome)
    blocks = [found[number] for number in range(len(tasks))]
    return {name: np.concatenate([block[name] for block in blocks]) for name in blocks[0]}


def _kept(folder: BlockFolder | None, question: Question, number: int, columns: dict) -> dict[str, np.ndarray]:
    """The columns of a block, written to the folder where there is one, without those of recordings."""
    if folder is None:
        return columns
    if question.recordings is not None:
        columns = folder.write_recordings(number, columns, question.recordings.format)
    return folder.write(number, columns)


def setting_of(question: Question, folder: Path) -> Setting:
    """What the insertions of a question share. Raises InputError for a preset, fit or factor that cannot be used."""
    if question.model.preset:
        setting = Setting(question, preset_table(question.model.preset, folder), None, folder)
    else:
        model_source(folder / question.model.fit)  # raises for what is no fit
        document = json.loads(read_text(folder / question.model.fit, "fit", MAX_RESULT_BYTES))
        posterior = posterior_of(document, question.model.fit) if question.posterior else None
        setting = Setting(question, document["preset"], posterior, folder)
    setting.factors  # raises for what the model does not have, before any work  # noqa: B018
    return setting


def inputs_of(setting: Setting) -> dict:
    """What else a study depends on: the preset that it changes, and a digest of each file that it names."""
    question, names = setting.question, [setting.question.model.fit]
    names += [each.table for each in question.factor if each.distribution == "campaign"]
    names += [str(each) for section in question.factor if section.name == MODEL for each in section.choices]
    names += [question.solid.file] if question.solid is not None else []
    files = {name: setting.folder / name for name in names if name}
    return {"preset": setting.document} | {name: digest(path) for name, path in files.items() if path.is_file()}


def _check_ends(setting: Setting) -> None:
    """Raise InputError for a model or motion that cannot be used, a preset that lacks a factor's value, or a factor
    whose ends alone leave the range of its law."""
    middle = np.full(setting.posterior.size if setting.posterior is not None else 0, 0.5)
    factors = setting.factors
    chosen = next((each for each in factors if each.place == MODEL_PLACE), None)
    if chosen is None:
        _usable(setting, middle, {})
    for name in () if chosen is None else chosen.values((np.arange(chosen.levels) + 0.5) / chosen.levels):
        factors_of(setting.question, preset_table(str(name), setting.folder), setting.folder)
        _usable(setting, middle, {MODEL_PLACE: str(name)})
    for factor in factors:
        ends = (0.0, 1.0) if factor.spread == "ends" else (GRID_TAIL, 1.0 - GRID_TAIL)
        for value in factor.values(np.array(ends)) if factor is not chosen else ():
            try:
                _usable(setting, middle, {factor.place: factor.to_si(value)})
            except InputError as error:
                limit = f"its value {value:g} cannot be used: {error}".split("\n")[0]
                raise InputError("factor", repr(factor.name), limit, next_step="Change its numbers.") from None


def _usable(setting: Setting, row: np.ndarray, changes: dict) -> None:
    """Raise InputError if the model or a motion with these changes cannot be used."""
    model_of_row(setting, row, changes)
    for section in setting.question.motion:
        sampled_motion(section, changes)


def cost_of(setting: Setting, count: int) -> Cost:
    """The cost of a study, from a few of its insertions."""
    draws = setting.posterior.size if setting.posterior is not None else 0
    width = len(columns_of(setting.factors, draws))
    rows = np.random.default_rng(0).uniform(0.2, 0.8, (ROWS_TRIED, width))
    started = time.process_time()
    columns = simulated(Block(setting, 0, rows))
    seconds = (time.process_time() - started) / ROWS_TRIED
    size = sum(each.nbytes for each in columns.values()) / ROWS_TRIED
    return Cost(count * len(setting.question.motion), count * seconds, count * size)


def cost_of_design(setting: Setting) -> Cost:
    """The cost of a design, from one experiment with one repeat."""
    candidates, design = candidates_of(setting.question), setting.question.design
    draws = setting.posterior.size if setting.posterior is not None else 0
    row = np.full((1, len(columns_of(setting.factors, draws))), 0.5)
    started = time.process_time()
    done(Experiments(setting, Candidate(candidates[0].motion, candidates[0].noise, 1), 0, row))
    fits = design.experiments * sum(each.repeats for each in candidates)
    return Cost(fits, fits * (time.process_time() - started), 0.0)


def _check_cost(cost: Cost, jobs: int | None, yes: bool) -> None:
    """Raise InputError for a study that is larger than a user expects, if it is not confirmed."""
    long = cost.seconds / (jobs or processors()) > ASK_ABOVE_SECONDS
    if not yes and (long or cost.size > ASK_ABOVE_BYTES):
        limit = f"above {ASK_ABOVE_SECONDS / 3600:.0f} h or {ASK_ABOVE_BYTES / 1e9:.0f} GB it has to be confirmed"
        raise InputError("size of the study", str(cost), limit, next_step="Give --yes (yes=True), or fewer samples.")
