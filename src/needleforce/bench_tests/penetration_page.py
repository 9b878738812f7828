# SPDX-License-Identifier: Apache-2.0
"""The report of penetration tests: all curves, figures by group as dots, the marked curve of each needle, tables."""

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ..display.axes import FORCE, TRAVEL
from ..display.canvas import (
    INK,
    MEASURED,
    MODEL,
    QUIET,
    SECOND,
    TEXT,
    THICK,
    THIN,
    Labels,
    Sheet,
    axis_names,
    drawing,
    envelope,
    panels,
)
from ..display.markup import Markup, element, listing, table
from ..display.page import Figure, Page, figure_html, section
from ..display.quantities import counted, quantity, scale
from ..identification.statistics.noise import INTERVAL
from .penetration import FIGURES, PenetrationTest
from .penetration_statistics import ALL, SUMMARY_FIGURES, FigureStatistics, PenetrationTests, statistics_cells

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Drawing

GROUP_COLOURS = (MODEL, SECOND, "#00806a", "#8a4f9e", "#8c6d00", INK)
PLATEAU_COLOUR = "#00806a"
MAX_BANDS = 2  # groups whose bands are drawn; more would cover each other
CELL = 150.0, 104.0  # points: width at least, and height, of the curve of one needle
ROWS_OF_CELLS = 12  # of one drawing
MAX_AVOIDED = 40  # curves that labels avoid
ROW = 15.0  # points: height of a group among the dots
CURVE_COLUMNS = 110  # to which the curve of one needle is reduced
MAX_NAMES = 8  # of needles in a sentence
STATISTICS_HEAD = ("group", "figure", "n", f"mean, {INTERVAL}", "sd", "median", "range", "not given")
NEEDLE_FIGURES = ("entry_force", "entry_travel", "heel_force", "drag", "max_force", "work", "falls")
DEFINITIONS = (
    "Peak at tip entry: the first maximum after which the force falls by more than its noise explains, or the first "
    "place at which its slope falls at once by half or more.",
    "Peak at the heel: the next such maximum or step, by its order; a curve does not show which part of a needle makes "
    "it.",
    "Plateau drag: the mean force over the longest stretch at the end whose slope is zero within its error.",
    "Maximum force: the largest force of the insertion, wherever it is. Work: the integral of force over travel.",
    "Travel counts from the contact, or from the first sample of a curve that begins in contact.",
    "Conformity to a standard is not claimed.",
)


def draw_curves(axes: "Axes", tests: PenetrationTests) -> None:
    """All curves over travel with the mean of each group, and a legend's labels."""
    _draw_all(axes, tests, THIN)
    for group, colour in zip(_drawn_groups(tests), GROUP_COLOURS):
        _draw_mean(axes, tests, group, colour, label=f"mean of {group or ALL}")


def _drawn_groups(tests: PenetrationTests) -> dict[str, Sequence[PenetrationTest]]:
    """The groups with a mean of their own; all needles together if there are many groups."""
    groups = {name: each for name, each in tests.groups.items() if any(len(test.travel) for test in each)}
    return groups if len(groups) <= len(GROUP_COLOURS) else {"": tests.tests}


def _draw_all(axes: "Axes", tests: PenetrationTests, width: float) -> None:
    from matplotlib.collections import LineCollection

    lines = [np.column_stack(envelope(1e3 * test.travel, test.force, 300)) for test in tests.tests if len(test.travel)]
    alpha = min(1.0, max(0.12, 12.0 / max(len(lines), 1)))
    axes.add_collection(LineCollection(lines, colors=MEASURED, linewidths=width, alpha=alpha))
    axes.autoscale_view()


def _draw_mean(
    axes: "Axes", tests: PenetrationTests, group: str, colour: str, label: str | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """The mean of a group with its band of a standard deviation; returns the drawn line."""
    travel, mean, sd = tests.mean_curve(group or None)
    if len(_drawn_groups(tests)) <= MAX_BANDS:
        axes.fill_between(1e3 * travel, mean - sd, mean + sd, color=colour, alpha=0.18, lw=0.0, zorder=2)
    axes.plot(1e3 * travel, mean, color=colour, lw=THICK, zorder=4, label=label)
    return 1e3 * travel, mean


def curves_figure(figure: "Drawing", sheet: Sheet, tests: PenetrationTests) -> None:
    """All curves, the mean of each group, and the band of a standard deviation."""
    axes = panels(figure, sheet)[0, 0]
    _draw_all(axes, tests, 0.7)
    groups = _drawn_groups(tests)
    lines = [_draw_mean(axes, tests, group, colour) for group, colour in zip(groups, GROUP_COLOURS)]
    axis_names(axes, TRAVEL, FORCE)
    every = [test for test in tests.tests if len(test.travel)]
    around = [envelope(1e3 * test.travel, test.force, 60) for test in every[:: max(len(every) // MAX_AVOIDED, 1)]]
    labels = Labels(axes, [*lines, *around])
    for (group, _), line, colour in zip(groups.items(), lines, GROUP_COLOURS):
        labels.on(f"mean of {group}" if group else "mean of all", *line, colour)


def dots_figure(figure: "Drawing", sheet: Sheet, tests: PenetrationTests, names: Sequence[str]) -> None:
    """Each figure by group: a dot a needle, the mean and its interval."""
    columns = 1 if sheet.narrow else min(len(names), 3)
    groups = list(tests.groups)
    longest = min(max(map(len, groups), default=1), 16)
    margins = {"left": 12.0 + 5.2 * longest, "across": 16.0, "down": 56.0}
    made = panels(figure, sheet, math.ceil(len(names) / columns), columns, margins)
    for k, axes in enumerate(made.ravel()):
        if k >= len(names):
            axes.set_visible(False)
            continue
        _dots(axes, tests, names[k], labelled=k % columns == 0)


def _dots(axes: "Axes", tests: PenetrationTests, name: str, labelled: bool) -> None:
    """The panel of one figure."""
    unit = FIGURES[name][0]
    found = [[test[name].value for test in each if test[name].value is not None] for each in tests.groups.values()]
    factor, shown = scale(max((abs(x) for each in found for x in each), default=1.0), unit)
    statistics = {each.group: each for each in tests.statistics(name)}
    for row, (group, values) in enumerate(zip(tests.groups, found, strict=True)):
        axes.plot(
            factor * np.array(values), [row - 0.12] * len(values), "o", color=MEASURED, ms=3.6, mew=0.0, alpha=0.8
        )
        each = statistics[group]
        if each.n > 1:
            axes.plot([factor * each.low, factor * each.high], [row + 0.26] * 2, color=MODEL, lw=1.2, zorder=4)
        if each.n:
            axes.plot(factor * each.mean, row + 0.1, "|", color=MODEL, ms=7.0, mew=1.7, zorder=5)
    every = factor * np.array([x for each in found for x in each])
    margin = 0.08 * (float(np.ptp(every)) or abs(float(every[0])) or 1.0)
    axes.set_xlim(every.min() - margin, every.max() + margin)  # the interval of few needles may be much wider
    axes.set_ylim(len(found) - 0.4, -0.6)
    axes.set_yticks(range(len(found)), [_short(group) for group in tests.groups] if labelled else [""] * len(found))
    axes.locator_params(axis="x", nbins=5)
    axes.set_title(f"{FIGURES[name][1]} [{shown}]", loc="left", fontsize=TEXT)


def _short(group: str) -> str:
    return group if len(group) <= 16 else group[:15] + "…"


def needles_figure(figure: "Drawing", sheet: Sheet, shown: Sequence[PenetrationTest]) -> None:
    """The curve of each needle with its marked peaks and plateau, each on its own scales."""
    columns = max(int(sheet.width // (CELL[0] if not sheet.narrow else 0.8 * CELL[0])), 1)
    height, wide, high = 72.0 * figure.get_figheight(), sheet.width / columns, CELL[1]
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(0.0, sheet.width), ylim=(0.0, height))
    axes.axis("off")
    for k, test in enumerate(shown):
        left, top = (k % columns) * wide + 30.0, height - (k // columns) * high - 14.0
        _cell(axes, test, (left, top - high + 34.0, wide - 42.0, high - 40.0))


def _cell(axes: "Axes", test: PenetrationTest, box: tuple[float, float, float, float]) -> None:
    """One curve within a ``box`` of left, bottom, width and height [points]."""
    left, bottom, width, height = box
    first, last = float(test.travel[0]), float(test.travel[-1])
    low, high = min(float(test.force.min()), 0.0), float(test.force.max())
    across = lambda z: left + width * (np.asarray(z) - first) / (last - first)  # noqa: E731
    up = lambda f: bottom + height * (np.asarray(f) - low) / (high - low)  # noqa: E731
    axes.plot([left, left, left + width], [bottom + height, bottom, bottom], color="#c4c8cc", lw=0.7)
    axes.text(left, bottom + height + 5.0, _short(test.name), fontsize=TEXT, color=INK, ha="left", va="bottom")
    small = {"fontsize": TEXT - 1.5, "color": QUIET}
    axes.text(left - 3.0, bottom + height, f"{high:.2g} N", ha="right", va="center", **small)
    axes.text(left - 3.0, float(up(0.0)), "0", ha="right", va="center", **small)
    axes.text(left, bottom - 3.0, f"{1e3 * first:.2g}".replace("-", "−"), ha="left", va="top", **small)
    axes.text(left + width, bottom - 3.0, f"{1e3 * last:.3g} mm", ha="right", va="top", **small)
    z, f = envelope(test.travel, test.force, CURVE_COLUMNS)
    axes.plot(across(z), up(f), color=MEASURED, lw=0.9)
    if test.plateau is not None:
        ends = across([test.plateau.start, test.plateau.stop])
        axes.plot(ends, up([test.plateau.mean] * 2), color=PLATEAU_COLOUR, lw=2.2, zorder=4)
    marks = [("o", MODEL, MODEL), ("s", SECOND, SECOND), *[("o", QUIET, "white")] * len(test.features)]
    if test["heel_force"].value is None:
        del marks[1]
    for each, (mark, edge, fill) in zip(test.features, marks):
        axes.plot(across(each.travel), up(each.force), mark, mec=edge, mfc=fill, ms=4.2, mew=1.0, zorder=5)


def penetration_page(tests: PenetrationTests) -> Page:
    """The report."""
    further = [name for name in FIGURES if name not in SUMMARY_FIGURES]
    return Page(
        title=f"Penetration tests: {counted(len(tests), 'needle')} in {counted(len(tests.groups), 'group')}",
        kind="penetration tests",
        outcome=_outcome(tests),
        sections=[
            section("Force over travel", *_curves(tests), name="curves"),
            section("Figures by group", *_dots_figure(tests), *_tables(tests, SUMMARY_FIGURES), name="groups"),
            section("Each needle", _needles(tests), _needle_table(tests), name="needles"),
            section("Further figures by group", *_tables(tests, further), name="further"),
            section("What is not given", _missing(tests), name="missing"),
            section("Definitions and notes", listing([*DEFINITIONS, *_notes(tests)]), name="notes"),
        ],
    )


def _outcome(tests: PenetrationTests) -> str:
    """The main figures over all needles, in a sentence."""
    name = ALL if len(tests.groups) > 1 else next(iter(tests.groups))
    found = [each for each in tests.statistics(*SUMMARY_FIGURES) if each.group == name and each.n]
    texts = [f"{FIGURES[each.figure][1]} {_mean(each)} (n = {each.n})" for each in found]
    empty = sum(test.empty for test in tests.tests)
    more = f" {counted(empty, 'needle')} without figures." * (empty > 0)
    text = "; ".join(texts) if texts else "No needle shows a figure"
    return f"{text[0].upper()}{text[1:]}.{more}"


def _mean(each: FigureStatistics) -> str:
    return str(quantity(each.mean, each.low, each.high, each.unit))


def _figure(name: str, draw: Any, heights: tuple[float, float], alt: str, caption: str) -> Figure:
    alt = f"{alt} The values are in the tables of this page."
    return Figure(name=name, draw=draw, heights=heights, alt=alt, caption=caption)


def _curves(tests: PenetrationTests) -> list[Figure]:
    if not any(len(test.travel) for test in tests.tests):
        return []
    several = len(_drawn_groups(tests)) > 1
    caption = "Grey: every needle. Coloured: the mean" + (" of each group" if several else "")
    bands = len(_drawn_groups(tests)) <= MAX_BANDS
    caption += ", with a band of one standard deviation over the needles." if bands else "."
    return [_figure("curves", partial(curves_figure, tests=tests), (300.0, 240.0), "Force over travel.", caption)]


def _dots_figure(tests: PenetrationTests) -> list[Figure]:
    names = [name for name in SUMMARY_FIGURES if any(test[name].value is not None for test in tests.tests)]
    if not names:
        return []
    one = 78.0 + ROW * len(tests.groups)
    heights = one * math.ceil(len(names) / 3) + 4.0, one * len(names)
    caption = (
        f"A dot a needle; stroke and line: mean and its {INTERVAL}, by Student's t, as far as it is within the axis."
    )
    return [_figure("dots", partial(dots_figure, tests=tests, names=names), heights, "Each figure by group.", caption)]


def _tables(tests: PenetrationTests, figures: Iterable[str]) -> list[Markup]:
    """A table for each of the figures that any needle has, a row for each group."""
    made = []
    for name in figures:
        meaning = FIGURES[name][1]
        rows = [statistics_cells(each) for each in tests.statistics(name)]
        if any(row[2] != "0" for row in rows):
            cells = [(row[0], *row[2:]) for row in rows]
            head = (STATISTICS_HEAD[0], *STATISTICS_HEAD[2:])
            heading = element("h3", meaning[0].upper() + meaning[1:])
            made += [heading, table(head, cells, class_="cards numbers dense")]
    return made


def _needles(tests: PenetrationTests) -> Markup:
    """The curves of all needles, in drawings of a number of rows each."""
    curves = [test for test in tests.tests if len(test.travel)]
    if not curves:
        return Markup("")
    alt, per, made = "The curve of each needle with its peaks.", ROWS_OF_CELLS * 4, []
    for k in range(0, len(curves), per):
        part = curves[k : k + per]
        heights = tuple(CELL[1] * math.ceil(len(part) / n) + 4.0 for n in (4, 2))
        made.append(drawing(f"needles-{k}", partial(needles_figure, shown=part), heights, alt))
    caption = (
        "Each on its own scales. Filled circle: tip entry. Filled square: heel. Open circles: further peaks and steps. "
        "Green line: plateau drag."
    )
    return figure_html("needles", made, caption)


def _needle_table(tests: PenetrationTests) -> Markup:
    head = ("needle", *(FIGURES[name][1] for name in NEEDLE_FIGURES))
    rows = ((test.name, *(str(test[name]) for name in NEEDLE_FIGURES)) for test in tests.tests)
    return table(head, rows, class_="cards numbers dense")


def _missing(tests: PenetrationTests) -> Markup:
    """Each reason with its figures and needles."""
    found: dict[tuple[str, str], list[str]] = {}
    for test in tests.tests:
        reasons: dict[str, list[str]] = {}
        for each in test.figures.values():
            if each.reason:
                reasons.setdefault(each.reason, []).append(each.meaning)
        for reason, names in reasons.items():
            whole = len(names) == len(FIGURES)
            found.setdefault((reason, "all figures" if whole else ", ".join(names)), []).append(test.name)
    rows = [(_names(names), figures, reason) for (reason, figures), names in found.items()]
    return table(("needles", "figures", "reason"), rows, class_="cards")


def _names(names: Sequence[str]) -> str:
    more = f" and {len(names) - MAX_NAMES} more" if len(names) > MAX_NAMES else ""
    return f"{len(names)}: {', '.join(names[:MAX_NAMES])}{more}" if len(names) > 1 else names[0]


def _notes(tests: PenetrationTests) -> list[str]:
    counts = Counter(note for test in tests.tests for note in dict.fromkeys(test.notes))
    return [f"{note} ({number} of {counted(len(tests), 'needle')})" for note, number in counts.items()]
