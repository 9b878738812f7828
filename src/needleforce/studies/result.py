# SPDX-License-Identifier: Apache-2.0
"""The result of a study: its insertions as a table, what the outputs are, and what they depend on."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..display.quantities import counted, fixed, percent, plain, quantity
from ..display.result import Result
from .factors import Factor
from .outputs import Output
from .question import Question
from .rows import columns_of
from .sensitivity import Sensitivity, sensitivity

if TYPE_CHECKING:
    import pandas

    from ..display.page import Page

EFFECT_BINS = 10  # of equal counts, in which the mean output over a factor is shown
NORMAL_95 = 1.96
MAX_REASONS = 10  # reasons of failures that are listed


@dataclass(frozen=True, eq=False, repr=False)
class StudyResult(Result):
    """The result of a study.

    Parameters
    ----------
    question : Question
        What was asked.
    factors : tuple of Factor
        The factors in the order of the file.
    rows : ndarray, shape (n, k)
        The rows of numbers between 0 and 1 that the values were made from.
    columns : mapping of str to ndarray
        A column for each factor and output in SI, with the number of the insertion, its motion, and why it failed.
    """

    question: Question
    factors: tuple[Factor, ...]
    rows: np.ndarray
    columns: Mapping[str, np.ndarray]

    @property
    def outputs(self) -> tuple[Output, ...]:
        """The outputs."""
        return self.question.outputs

    @property
    def failed(self) -> np.ndarray:
        """Whether each insertion has no outputs."""
        return self.columns["why"] != ""

    @property
    def is_empty(self) -> bool:
        """Whether every insertion failed."""
        return bool(self.failed.all())

    @cached_property
    def reasons(self) -> tuple[tuple[str, int], ...]:
        """Why insertions failed, with their numbers, the most frequent first."""
        return tuple(Counter(self.columns["why"][self.failed].tolist()).most_common(MAX_REASONS))

    @property
    def labels(self) -> list[str]:
        """The independent columns of ``rows`` as on an axis."""
        labels = {factor.name: factor.label for factor in self.factors}
        return [labels.get(name, name) for name in self.names]

    @property
    def names(self) -> list[str]:
        """The independent columns of ``rows``."""
        return columns_of(list(self.factors), self.rows.shape[1] - len(columns_of(list(self.factors), 0)))

    def values(self, output: Output, motion: str) -> np.ndarray:
        """The values of an output (n,) in SI, or of a curve (n, points), in the order of ``rows``."""
        return self.columns[output.name][self.columns["motion"] == motion]

    @cached_property
    def sensitivities(self) -> dict[tuple[str, str], Sensitivity | None]:
        """(output, motion) -> the indices of its factors; None where too few insertions have a value."""
        method = self.question.study
        if method.method != "sensitivity":
            return {}
        return {
            (output.name, motion): sensitivity(
                method.analysis,
                self.names,
                self.rows,
                self.values(output, motion),
                interactions=method.interactions,
                seed=method.seed,
            )
            for output in self.outputs
            if not output.is_curve
            for motion in self.question.motions
        }

    def effect(self, output: Output, motion: str, column: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The mean output where a column of ``rows`` is in each tenth of its range: places, means, half widths."""
        values, place = self.values(output, motion), self.rows[:, column]
        bins = np.minimum((place * EFFECT_BINS).astype(int), EFFECT_BINS - 1)
        groups = [values[(bins == k) & np.isfinite(values)] for k in range(EFFECT_BINS)]
        means = np.array([each.mean() if len(each) else np.nan for each in groups])
        half = np.array(
            [NORMAL_95 * each.std(ddof=1) / len(each) ** 0.5 if len(each) > 1 else np.nan for each in groups]
        )
        return (np.arange(EFFECT_BINS) + 0.5) / EFFECT_BINS, means, half

    def within(self, output: Output, motion: str) -> tuple[int, int]:
        """Insertions within the limits of an output, and all; one that failed or has no value is outside."""
        values = self.values(output, motion)
        low = -np.inf if output.low is None else output.low
        high = np.inf if output.high is None else output.high
        return int(np.count_nonzero((values >= low) & (values <= high))), len(values)

    def _heading(self) -> str:
        question = self.question
        insertions = counted(len(self.columns["number"]), "insertion")
        factors = counted(len(self.names), "factor")
        failed = f", {int(self.failed.sum())} failed" if self.failed.any() else ""
        return (
            f"{question.study.name}: {insertions} of {question.model.preset or question.model.fit}, {factors}{failed}"
        )

    def _cells(self) -> tuple[Sequence[str], Sequence[Sequence[str]]]:
        if self.question.study.method == "sensitivity":
            return self._indices()
        head = ["output", "motion", "mean", "standard deviation", "5 %", "median", "95 %", "without value"]
        limits = self.question.study.method == "robust"
        return head + ["within limits"] * limits, [
            [output.name, motion, *self._summary(output, motion), *([self._share(output, motion)] if limits else [])]
            for output in self.outputs
            if not output.is_curve
            for motion in self.question.motions
        ]

    def _summary(self, output: Output, motion: str) -> list[str]:
        values = self.values(output, motion)
        found = values[np.isfinite(values)]
        numbers = [np.nan] * 5
        if len(found):
            numbers = [found.mean(), found.std(), *np.percentile(found, [5, 50, 95])]
        unit = output.kind.unit
        return [
            *(plain(float(each), unit, like=float(numbers[1]) or None) for each in numbers),
            str(len(values) - len(found)),
        ]

    def _share(self, output: Output, motion: str) -> str:
        if output.low is None and output.high is None:
            return ""
        low, high = wilson(*self.within(output, motion))
        inside, total = self.within(output, motion)
        return f"{percent(inside / total)} ({percent(low)} to {percent(high)})"

    def _indices(self) -> tuple[Sequence[str], Sequence[Sequence[str]]]:
        main, total = INDEX_NAMES[self.question.study.analysis]
        rows, kinds = [], {each.name: each.kind for each in self.outputs}
        for (output, motion), found in self.sensitivities.items():
            unit = kinds[output].unit if self.question.study.analysis == "morris" else "1"
            for k in [] if found is None else np.argsort(-found.total, kind="stable"):
                pairs = (found.main[k], found.main_error[k]), (found.total[k], found.total_error[k])
                rows.append([output, motion, self.labels[k], *(_index(value, error, unit) for value, error in pairs)])
        return ["output", "motion", "factor", main, total], rows

    def _remarks(self) -> Iterable[tuple[str, Iterable[str]]]:
        yield "Insertions without outputs", (f"{number}: {why}" for why, number in self.reasons)
        yield "Notes", self._notes()

    def _notes(self) -> Iterable[str]:
        for (output, motion), found in self.sensitivities.items():
            if found is None:
                yield f"{output}, {motion}: too few insertions have a value, or all have the same"
            elif found.rows < len(self.rows):
                lost = len(self.rows) - found.rows
                yield f"{output}, {motion}: {lost} insertions of groups with a failed one are left out"

    def _draw(self, axes: Any) -> tuple[str, ...]:
        from .page import draw_distribution, draw_tornado

        output = next((each for each in self.outputs if not each.is_curve), self.outputs[0])
        motion = self.question.motions[0]
        if self.sensitivities.get((output.name, motion)) is not None:
            return draw_tornado(axes, self, output, motion)
        return draw_distribution(axes, self, output, motion)

    def _page(self) -> "Page":
        from .page import study_page

        return study_page(self)

    def document(self) -> dict:
        """The question, the summary of each output, the indices, and the reasons of failures."""
        head, rows = self._cells()
        return {
            "study": self.question.document(),
            "insertions": len(self.columns["number"]),
            "failed": int(self.failed.sum()),
            "table": [dict(zip(head, row)) for row in rows],
            "indices": [
                {"output": output, "motion": motion, "factors": list(found.names), "rows": found.rows}
                | {
                    name: getattr(found, name).tolist()
                    for name in ("main", "main_error", "total", "total_error", "pairs")
                }
                for (output, motion), found in self.sensitivities.items()
                if found is not None
            ],
            "reasons": [{"why": why, "insertions": number} for why, number in self.reasons],
        }

    def to_dataframe(self) -> "pandas.DataFrame":
        """A row for each insertion and motion in SI; a curve is a column of arrays."""
        import pandas

        return pandas.DataFrame({name: list(each) if each.ndim > 1 else each for name, each in self.columns.items()})


INDEX_NAMES = {
    "sobol": ("first-order index", "total index"),
    "morris": ("mean effect ± standard deviation", "mean absolute effect"),
    "delta": ("first-order index", "delta index"),
}
"""Analysis -> the names of its two indices."""


def _index(value: float, error: float, unit: str) -> str:
    """An index with three decimals, or an effect with its unit."""
    if unit != "1":
        return str(quantity(float(value), float(value - error), float(value + error), unit))
    return f"{fixed(value, 3)} ± {fixed(error, 3)}"


def wilson(inside: int, total: int) -> tuple[float, float]:
    """The 95 % interval of a share by Wilson's score."""
    share, z2 = inside / total, NORMAL_95**2
    middle = (share + z2 / (2 * total)) / (1 + z2 / total)
    half = NORMAL_95 / (1 + z2 / total) * np.sqrt(share * (1 - share) / total + z2 / (4 * total**2))
    return max(float(middle - half), 0.0), min(float(middle + half), 1.0)
