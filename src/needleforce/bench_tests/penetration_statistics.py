# SPDX-License-Identifier: Apache-2.0
"""Statistics of the penetration tests of several needles, by group."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.special import stdtrit

from ..display.axes import FORCE, TRAVEL
from ..display.quantities import counted, plain, quantity
from ..display.result import Result
from ..errors import InputError
from ..identification.statistics.noise import INTERVAL
from ..recording import Recording
from ..recording.copies import copies
from .penetration import FIGURES, PenetrationTest, penetration_test, without_figures

if TYPE_CHECKING:
    import pandas

    from ..display.page import Page

REPEAT = re.compile(r"[\s_.#-]+\d+$")  # the number of a repeat at the end of a name
SUMMARY_FIGURES = ("entry_force", "heel_force", "drag", "max_force", "work")
"""The figures that a summary shows first."""
POINTS = 400  # of a mean curve
ALL = "all"


@dataclass(frozen=True, kw_only=True)
class FigureStatistics:
    """One figure over the needles of a group.

    Parameters
    ----------
    group, figure, unit : str
        The group, the name of the figure in ``FIGURES``, and its SI unit.
    n, missing : int
        Needles with and without the figure.
    mean, sd, median, smallest, largest : float
        Over the needles with the figure; NaN without one, ``sd`` (n - 1) with one alone.
    low, high : float
        95 % interval of the mean, by Student's t; NaN for fewer than two needles.
    """

    group: str
    figure: str
    unit: str
    n: int
    missing: int
    mean: float
    sd: float
    median: float
    smallest: float
    largest: float
    low: float
    high: float


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class PenetrationTests(Result):
    """The penetration tests of several needles.

    Parameters
    ----------
    tests : tuple of PenetrationTest
        In the order given; needles without a curve are among them.
    groups : dict of str to tuple of PenetrationTest
        By name, in the order of their first needle.
    """

    tests: tuple[PenetrationTest, ...]
    groups: dict[str, tuple[PenetrationTest, ...]]

    def __len__(self) -> int:
        return len(self.tests)

    def __getitem__(self, name: str) -> PenetrationTest:
        return next(test for test in self.tests if test.name == name)

    def statistics(self, *figures: str) -> list[FigureStatistics]:
        """Statistics of each group, and of all needles if there are several groups.

        Parameters
        ----------
        *figures : str
            Names in ``FIGURES``; default: all.

        Returns
        -------
        list of FigureStatistics
            Group by group.
        """
        groups = dict(self.groups) | ({ALL: self.tests} if len(self.groups) > 1 else {})
        return [_statistics(group, each, tests) for group, tests in groups.items() for each in figures or FIGURES]

    def to_dataframe(self) -> "pandas.DataFrame":
        """A row for each needle: name, group, every figure with its unit, such as ``entry_force [N]``, the ends of its
        interval, and why it is missing."""
        import pandas

        group_of = {id(test): group for group, tests in self.groups.items() for test in tests}
        rows = []
        for test in self.tests:
            row: dict[str, Any] = {"name": test.name, "group": group_of[id(test)]}
            for each in test.figures.values():
                unit = "" if each.unit == "1" else f" [{each.unit}]"
                row |= {f"{each.name}{unit}": np.nan if each.value is None else each.value}
                row |= {f"{each.name}_low{unit}": each.low, f"{each.name}_high{unit}": each.high}
                row |= {f"{each.name}_reason": each.reason}
            rows.append(row)
        return pandas.DataFrame(rows)

    def mean_curve(self, group: str | None = None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Mean force over travel.

        Parameters
        ----------
        group : str, optional
            Default: all needles.

        Returns
        -------
        travel, mean, sd : (m,) array
            Travel [m] as far as half of the curves reach, mean force and its standard deviation over the needles [N].
        """
        curves = [test for test in (self.tests if group is None else self.groups[group]) if len(test.travel)]
        if not curves:
            return np.empty(0), np.empty(0), np.empty(0)
        ends = sorted(float(test.travel[-1]) for test in curves)
        grid = np.linspace(0.0, ends[(len(ends) - 1) // 2], POINTS)
        rows = np.array([np.interp(grid, test.travel, test.force, right=np.nan) for test in curves])
        sd = np.nanstd(rows, axis=0, ddof=1) if len(curves) > 1 else np.zeros(POINTS)
        return grid, np.nanmean(rows, axis=0), np.where(np.isfinite(sd), sd, 0.0)

    def _heading(self) -> str:
        return f"PenetrationTests: {counted(len(self.tests), 'needle')} in {counted(len(self.groups), 'group')}"

    def _cells(self) -> tuple[Sequence[str], Sequence[Sequence[str]]]:
        head = ("group", "figure", "n", f"mean, {INTERVAL}", "sd", "median", "range", "missing")
        return head, [statistics_cells(each) for each in self.statistics() if each.n]

    def _remarks(self) -> Iterable[tuple[str, Iterable[str]]]:
        yield "Without figures", [f"{test.name}: {test['max_force'].reason}" for test in self.tests if test.empty]

    def _draw(self, axes: Any) -> tuple[str, ...]:
        """All curves over travel, with the mean of each group and its band of a standard deviation."""
        from .penetration_page import draw_curves

        draw_curves(axes, self)
        return TRAVEL, FORCE, "Penetration tests"

    def document(self) -> dict:
        """The numbers for JSON: a dict for each needle with figures and peaks, and the statistics."""
        group_of = {id(test): group for group, tests in self.groups.items() for test in tests}
        needles = [{"name": test.name, "group": group_of[id(test)], **test.document()} for test in self.tests]
        return {"needles": needles, "statistics": [asdict(each) for each in self.statistics()]}

    def _page(self) -> "Page":
        from .penetration_page import penetration_page

        return penetration_page(self)


def statistics_cells(each: FigureStatistics) -> tuple[str, ...]:
    """The statistics as text: group, meaning, n, mean with interval, sd, median, range, missing."""
    like = each.sd if each.n > 1 and each.sd > 0.0 else None
    show = lambda value: plain(value, each.unit, like=like)  # noqa: E731
    spread = f"{show(each.smallest)} to {show(each.largest)}" if each.n else ""
    mean = str(quantity(each.mean, each.low, each.high, each.unit)) if each.sd > 0.0 else show(each.mean)
    numbers = (show(each.sd), show(each.median), spread) if each.n else ("", "", "")
    return each.group, FIGURES[each.figure][1], str(each.n), mean, *numbers, str(each.missing) if each.missing else ""


def _statistics(group: str, figure: str, tests: Sequence[PenetrationTest]) -> FigureStatistics:
    values = np.array([test[figure].value for test in tests if test[figure].value is not None], dtype=float)
    n = len(values)
    mean = float(values.mean()) if n else np.nan
    sd = float(values.std(ddof=1)) if n > 1 else np.nan
    half = float(stdtrit(n - 1, 0.975)) * sd / n**0.5 if n > 1 else np.nan
    ends = (float(np.median(values)), float(values.min()), float(values.max())) if n else (np.nan,) * 3
    return FigureStatistics(
        group=group,
        figure=figure,
        unit=FIGURES[figure][0],
        n=n,
        missing=len(tests) - n,
        mean=mean,
        sd=sd,
        median=ends[0],
        smallest=ends[1],
        largest=ends[2],
        low=mean - half,
        high=mean + half,
    )


def penetration_tests(many: Any, *, groups: Mapping[str, str] | None = None, **options: Any) -> PenetrationTests:
    """The figures of several needles and their statistics.

    Parameters
    ----------
    many : mapping of str to source, or sequence of sources
        Name -> (travel, force), Recording, PenetrationTest, or None or an InputError for a needle without a curve, such
        as a broken one, which is listed without figures, as is a recording with the readings of another.
    groups : mapping of str to str, optional
        Name -> group. By default the name without the number at its end: ``A-1`` and ``A-2`` are repeats of ``A``;
        all needles are one group if no two share a name.
    **options
        Those of ``penetration_test``.

    Returns
    -------
    PenetrationTests

    Raises
    ------
    InputError
        No needle at all, or as ``penetration_test`` for one of them, with its name.
    """
    pairs = list(many.items()) if isinstance(many, Mapping) else [(None, each) for each in many]
    if not pairs:
        raise InputError("needles", "none", "at least one is needed", next_step="Give a curve, or several.")
    known = [k for k, (_, each) in enumerate(pairs) if isinstance(each, Recording)]
    for k, first in copies([pairs[k][1] for k in known]).items():
        same = f"the same as those of {pairs[known[first]][1].name}"
        error = InputError("readings", same, "given twice", pairs[known[k]][1].name, "Give each test once.")
        pairs[known[k]] = (pairs[known[k]][0] or pairs[known[k]][1].name, error)
    tests = tuple(_test(name, source, k, options) for k, (name, source) in enumerate(pairs, 1))
    return PenetrationTests(tests=tests, groups=_grouped(tests, groups))


def _test(name: str | None, source: Any, number: int, options: dict[str, Any]) -> PenetrationTest:
    """The test of one source; its name is that given, its own, or its number."""
    if isinstance(source, PenetrationTest):
        return source if name is None else replace(source, name=name)
    if source is None or isinstance(source, InputError):
        reason = "There is no curve." if source is None else f"{source}".rstrip(".") + "."
        return without_figures(name or f"needle {number}", reason)
    values = (source,) if isinstance(source, Recording) else tuple(source)
    own = source.name if isinstance(source, Recording) else f"needle {number}"
    try:
        return penetration_test(*values, name=name or own, **options)
    except InputError as error:
        raise error if error.place else error.at(name or own) from None


def _grouped(
    tests: Sequence[PenetrationTest], given: Mapping[str, str] | None
) -> dict[str, tuple[PenetrationTest, ...]]:
    """The tests by group, as ``penetration_tests`` describes."""
    if given is not None:
        absent = [test.name for test in tests if test.name not in given]
        if absent:
            limit = f"known are {', '.join(map(repr, list(given)[:8]))}"
            step = "Give a group for every needle, or none to group by the names."
            raise InputError("group of a needle", repr(absent[0]), limit, next_step=step)
        names = [str(given[test.name]) for test in tests]
    else:
        names = [REPEAT.sub("", test.name) or test.name for test in tests]
        names = [ALL] * len(tests) if len(set(names)) == len(tests) else names
    return {
        each: tuple(t for t, name in zip(tests, names, strict=True) if name == each) for each in dict.fromkeys(names)
    }
