# SPDX-License-Identifier: Apache-2.0
"""Which experiment narrows a parameter most: candidates are done on simulated specimens and identified as a user would;
their intervals are compared."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..display.canvas import INK, MODEL
from ..display.quantities import percent
from ..display.result import Result
from ..errors import InputError
from ..recording import Card, Recording
from ..rig.sensor import Sensor
from .factors import factor_values
from .insertions import Setting, model_of_row, run_of
from .question import MotionSection, Question
from .rows import columns_of

if TYPE_CHECKING:
    import pandas

EXPERIMENTS_OF_A_TASK = 5


@dataclass(frozen=True)
class Candidate:
    """An experiment: a motion by its place in the file, the sensor's noise [N] and the number of repeats."""

    motion: int
    noise: float
    repeats: int

    def name(self, question: Question) -> str:
        """In words."""
        plural = "" if self.repeats == 1 else "s"
        return f"{question.motions[self.motion]}, {1e3 * self.noise:.3g} mN, {self.repeats} repeat{plural}"


@dataclass(frozen=True, eq=False)
class Experiments:
    """Some experiments of a candidate, which are one task: the rows of their specimens."""

    setting: Setting
    candidate: Candidate
    first: int
    rows: np.ndarray


def done(experiments: Experiments) -> np.ndarray:
    """The interval of each parameter over its value (experiments, parameters); NaN where it is not identifiable."""
    from ..identification import identify

    design = experiments.setting.question.design
    widths = np.full((len(experiments.rows), len(design.parameters)), np.nan)
    for k, row in enumerate(experiments.rows):
        fit = identify(_recordings(experiments, row, experiments.first + k), model=design.identify_as)
        for j, name in enumerate(design.parameters):
            estimate = fit.parameters.get(name)
            if estimate is not None and estimate.identifiable and estimate.value:
                widths[k, j] = (estimate.high - estimate.low) / abs(estimate.value)
    return widths


def _recordings(experiments: Experiments, row: np.ndarray, number: int) -> list[Recording]:
    """The repeats of one specimen, as the sensor shows them."""
    setting, candidate = experiments.setting, experiments.candidate
    question, factors = setting.question, setting.factors
    values = factor_values(factors, row[None, :])
    changes = {factor.place: factor.to_si(values[factor.name][0]) for factor in factors}
    section: MotionSection = question.motion[candidate.motion]
    run, dt = run_of(setting, model_of_row(setting, row, changes), changes, section)
    sensor = Sensor(noise=candidate.noise, filter_length=1, bias=0.0)
    time = dt * np.arange(len(run.depth))
    made = []
    for repeat in range(candidate.repeats):
        random = np.random.default_rng((question.study.seed, candidate.motion, number, repeat))
        force = sensor.record({"force": run.force}, random)["force"]
        card = Card(source=f"specimen {number}, repeat {repeat + 1}")
        velocity = np.gradient(run.depth, dt)
        made.append(Recording(time=time, depth=run.depth, velocity=velocity, force=force, card=card))
    return made


def candidates_of(question: Question) -> list[Candidate]:
    """Every experiment that is compared."""
    design = question.design
    motions = range(len(question.motion))
    return [Candidate(m, noise, n) for m in motions for noise in design.noise_N for n in design.repeats]


def designed(setting: Setting, run_all: Callable[[Callable, Sequence], Iterable]) -> "DesignResult":
    """The result of every candidate; ``run_all(function, tasks)`` gives (number of the task, outcome)."""
    question = setting.question
    candidates, count = candidates_of(question), question.design.experiments
    width = len(columns_of(setting.factors, setting.posterior.size if setting.posterior is not None else 0))
    rows = np.random.default_rng(question.study.seed).random((count, width))
    starts = range(0, count, EXPERIMENTS_OF_A_TASK)
    tasks = [
        Experiments(setting, candidate, k, rows[k : k + EXPERIMENTS_OF_A_TASK])
        for candidate in candidates
        for k in starts
    ]
    found: dict[int, np.ndarray] = {}
    for index, outcome in run_all(done, tasks):
        if isinstance(outcome, Exception):
            raise outcome
        found[index] = outcome
    per = len(starts)
    blocks = [np.concatenate([found[k * per + j] for j in range(per)]) for k in range(len(candidates))]
    if not any(np.isfinite(each).any() for each in blocks):
        names = ", ".join(question.design.parameters)
        limit = "no experiment identifies it"
        raise InputError("parameters of the design", names, limit, next_step="Give names as identify prints them.")
    return DesignResult(question, tuple(candidates), tuple(blocks))


@dataclass(frozen=True, eq=False, repr=False)
class DesignResult(Result):
    """The candidates with the intervals that they gave.

    Parameters
    ----------
    question : Question
        What was asked.
    candidates : tuple of Candidate
        The experiments.
    widths : tuple of ndarray, shape (experiments, parameters)
        The 95 % interval over the value of each parameter; NaN where it was not identifiable.
    """

    question: Question
    candidates: tuple[Candidate, ...]
    widths: tuple[np.ndarray, ...]

    def expected(self, parameter: int) -> np.ndarray:
        """The median, 10th and 90th percentile of the width (candidates, 3); an experiment without value is widest."""
        filled = [np.where(np.isfinite(each[:, parameter]), each[:, parameter], np.inf) for each in self.widths]
        return np.array([np.percentile(each, [50, 10, 90], method="lower") for each in filled])

    is_empty = False  # such a design is refused

    def order(self) -> np.ndarray:
        """The candidates, that with the narrowest first parameter first."""
        return np.argsort(self.expected(0)[:, 0], kind="stable")

    def _heading(self) -> str:
        count = self.question.design.experiments
        return f"{self.question.study.name}: {len(self.candidates)} experiments, each done {count} times"

    def _cells(self) -> tuple[Sequence[str], Sequence[Sequence[str]]]:
        names = [name.replace("_", " ") for name in self.question.design.parameters]
        head = ["experiment", *(f"{name}: interval / value (10 to 90 % of experiments)" for name in names)]
        rows = []
        for k in self.order():
            cells = (self._cell(k, j) for j in range(len(names)))
            rows.append([self.candidates[k].name(self.question), *cells])
        return head, rows

    def _cell(self, candidate: int, parameter: int) -> str:
        middle, low, high = self.expected(parameter)[candidate]
        if not np.isfinite(middle):
            return "not identified"
        end = percent(high) if np.isfinite(high) else "not identified"
        return f"{percent(middle)} ({percent(low)} to {end})"

    def _draw(self, axes: Any) -> tuple[str, ...]:
        order, found = self.order(), self.expected(0)
        places = np.arange(len(order))
        middle, low, high = (100.0 * np.where(np.isfinite(each), each, np.nan) for each in found[order].T)
        axes.hlines(places, low, high, color=INK, lw=1.2)
        axes.plot(middle, places, "o", color=MODEL)
        axes.set_yticks(places, [self.candidates[k].name(self.question) for k in order])
        axes.set_ylim(len(order) - 0.5, -0.5)
        return f"{self.question.design.parameters[0].replace('_', ' ')}: interval / value [%]", ""

    def document(self) -> dict:
        """The question and the widths of every experiment."""
        return {
            "study": self.question.document(),
            "experiments": [
                {"motion": self.question.motions[each.motion], "noise_N": each.noise, "repeats": each.repeats}
                | {"widths": widths.tolist()}
                for each, widths in zip(self.candidates, self.widths)
            ],
        }

    def to_dataframe(self) -> "pandas.DataFrame":
        """A row for each experiment that was done: the candidate, and the width of each parameter's interval."""
        import pandas

        frames = []
        for each, widths in zip(self.candidates, self.widths):
            columns = dict(zip(self.question.design.parameters, widths.T))
            known = {"motion": self.question.motions[each.motion], "noise": each.noise, "repeats": each.repeats}
            frames.append(pandas.DataFrame(known | columns))
        return pandas.concat(frames, ignore_index=True)
