# SPDX-License-Identifier: Apache-2.0
"""The page of a study and its drawings: what matters, effects, pairs, distributions, curves with bands; failures, and
the question."""

from collections.abc import Iterable
from functools import partial
from typing import Any

import numpy as np

from ..display.axes import FORCE
from ..display.canvas import INK, MEASURED, MODEL, SECOND, axis_names, panels
from ..display.markup import element, listing, table
from ..display.page import Figure, Page, section
from .outputs import Output
from .result import INDEX_NAMES, StudyResult

MAX_BARS = 20  # factors of a tornado; the others contribute less
ROW_POINTS = 22.0  # height of a bar
EFFECTS_SHOWN = 6  # factors whose effect is drawn, those with the largest index first


def study_page(result: StudyResult) -> Page:
    """The report."""
    curves = [each for each in result.outputs if each.is_curve]
    numbers = [each for each in result.outputs if not each.is_curve]
    return Page(
        title=result.question.study.name.capitalize(),
        kind="study",
        outcome=f"{result.heading()}.",
        sections=[
            section("What matters", *_tornadoes(result, numbers), name="factors"),
            section("Values", table(*result.cells(), class_="cards numbers dense"), name="values"),
            section("Distributions", *_distributions(result, numbers), name="distributions"),
            section("Effect of each factor", *_effects(result, numbers), name="effects"),
            section("Interactions", *_pairs(result, numbers), name="interactions"),
            section("Curves", *_curves(result, curves), name="curves"),
            section("Insertions without outputs", listing(f"{n}: {why}" for why, n in result.reasons), name="failures"),
            section(
                "The question",
                element("pre", result.to_json().split('"insertions"')[0].rstrip(", \n")),
                name="question",
            ),
        ],
    )


def _one(figure: Any, sheet: Any, left: float, draw: Any) -> None:
    axes = panels(figure, sheet, margins={"left": left, "top": 26.0})[0, 0]
    axis_names(axes, *draw(axes)[:2])
    if axes.get_legend_handles_labels()[1]:
        axes.legend(frameon=False, loc="best")


def _figure(kind: str, title: str, draw: Any, heights: tuple[float, float], caption: str) -> Figure:
    """A figure of one output and motion, which its ``title`` names."""
    name = f"{kind}-" + "".join(each if each.isalnum() else "-" for each in title)
    return Figure(name=name, draw=draw, heights=heights, caption=caption, alt=title, title=title)


def _titled(result: StudyResult, outputs: list[Output]) -> Iterable[tuple[Output, str, str]]:
    """Each output and motion, with a title."""
    for output in outputs:
        for motion in result.question.motions:
            yield output, motion, f"{output.name.replace('_', ' ')}, {motion}"


def _tornadoes(result: StudyResult, outputs: list[Output]) -> Iterable[Figure]:
    caption = "The index of each factor; lines: 95 % intervals."
    if result.question.study.analysis == "sobol":
        caption = "Share of the variance that a factor explains, alone and with interactions; lines: 95 % intervals."
    for output, motion, title in _titled(result, outputs):
        found = result.sensitivities.get((output.name, motion))
        if found is not None:
            height = 80.0 + ROW_POINTS * min(len(found.names), MAX_BARS)
            yield _figure("tornado", title, partial(_tornado, result, output, motion), (height, height), caption)


def _tornado(result: StudyResult, output: Output, motion: str, figure: Any, sheet: Any) -> None:
    left = 90.0 if sheet.narrow else 230.0
    _one(figure, sheet, left, lambda axes: draw_tornado(axes, result, output, motion))


def _distributions(result: StudyResult, outputs: list[Output]) -> Iterable[Figure]:
    for output, motion, title in _titled(result, outputs):
        draw = partial(_drawn, draw_distribution, result, output, motion)
        yield _figure("values", title, draw, (180.0, 180.0), f"{output.kind.meaning.capitalize()}.")


def _curves(result: StudyResult, curves: list[Output]) -> Iterable[Figure]:
    for output, motion, title in _titled(result, curves):
        draw = partial(_drawn, draw_band, result, output, motion)
        yield _figure("curve", title, draw, (260.0, 240.0), "Force in the insertion stroke.")


def _drawn(draw: Any, result: StudyResult, output: Output, motion: str, figure: Any, sheet: Any) -> None:
    _one(figure, sheet, 60.0, lambda axes: draw(axes, result, output, motion))


def _effects(result: StudyResult, outputs: list[Output]) -> Iterable[Figure]:
    caption = "Mean in each tenth of a factor's distribution, all values of the others; bands: 95 % intervals."
    for output, motion, title in _titled(result, outputs):
        shown = _largest(result, output, motion)
        heights = 150.0 * -(-len(shown) // 3) + 20.0, 150.0 * -(-len(shown) // 2) + 20.0
        yield _figure("effects", title, partial(_draw_effects, result, output, motion, shown), heights, caption)


def _draw_effects(result: StudyResult, output: Output, motion: str, shown: list[int], figure: Any, sheet: Any) -> None:
    columns = 2 if sheet.narrow else 3
    grid = panels(figure, sheet, -(-len(shown) // columns), columns, {"left": 50.0}, sharey=True).ravel()
    for axes in grid[len(shown) :]:
        axes.set_visible(False)
    for axes, column in zip(grid, shown):
        place, mean, half = result.effect(output, motion, column)
        low, high = output.factor * (mean - half), output.factor * (mean + half)
        axes.fill_between(100.0 * place, low, high, color=MODEL, alpha=0.2, lw=0)
        axes.plot(100.0 * place, output.factor * mean, color=MODEL, lw=1.5)
        axes.set_xlabel(f"{result.labels[column].split(' [')[0]} [%]", loc="right")
    grid[0].annotate(output.label, (0, 1), (-40, 10), xycoords="axes fraction", textcoords="offset points")


def _largest(result: StudyResult, output: Output, motion: str) -> list[int]:
    """The columns whose effect is largest."""
    spread = []
    for column in range(len(result.names)):
        mean = result.effect(output, motion, column)[1]
        spread.append(np.ptp(mean[np.isfinite(mean)]) if np.isfinite(mean).any() else 0.0)
    return [int(k) for k in np.argsort(-np.array(spread), kind="stable")[:EFFECTS_SHOWN]]


def _pairs(result: StudyResult, outputs: list[Output]) -> Iterable[Figure]:
    for output, motion, title in _titled(result, outputs):
        found = result.sensitivities.get((output.name, motion))
        if found is not None and np.isfinite(found.pairs).any():
            draw = partial(_draw_pairs, result, output, motion)
            yield _figure("pairs", title, draw, (420.0, 420.0), "Second-order index of each pair.")


def _draw_pairs(result: StudyResult, output: Output, motion: str, figure: Any, sheet: Any) -> None:
    """The second-order index of each pair of factors."""
    axes = panels(figure, sheet, margins={"left": 180.0, "bottom": 150.0})[0, 0]
    found = result.sensitivities[output.name, motion]
    image = axes.imshow(found.pairs, cmap="Greys", vmin=0.0, vmax=1.0)
    names = result.labels
    axes.set_xticks(range(len(names)), names, rotation=60, ha="right")
    axes.set_yticks(range(len(names)), names)
    axes.grid(False)
    for i, j in zip(*np.nonzero(np.isfinite(found.pairs))):
        axes.text(j, i, f"{found.pairs[i, j]:.2f}", ha="center", va="center", color=MODEL, fontsize=8)
    figure.colorbar(image, ax=axes, label="second-order index [1]")


def draw_tornado(axes: Any, result: StudyResult, output: Output, motion: str) -> tuple[str, str, str]:
    """A bar for each factor, the largest first: its total contribution, with the interval, and its own part."""
    found = result.sensitivities[output.name, motion]
    order = np.argsort(-found.total, kind="stable")[:MAX_BARS]
    places = np.arange(len(order))
    main, total = INDEX_NAMES[result.question.study.analysis]
    factor = output.factor if result.question.study.analysis == "morris" else 1.0
    axes.barh(places, factor * found.total[order], color=MEASURED, height=0.7, label=total)
    if result.question.study.analysis != "morris":
        axes.barh(places, found.main[order], color=MODEL, height=0.35, label=main)
    axes.errorbar(
        factor * found.total[order], places, xerr=factor * found.total_error[order], fmt="none", ecolor=INK, lw=1.0
    )
    axes.set_yticks(places, [result.labels[k] for k in order])
    axes.set_ylim(len(order) - 0.4, -0.6)
    unit = output.label.rpartition("[")[2].rstrip("]") if result.question.study.analysis == "morris" else "1"
    return f"index [{unit}]", "", f"{output.name.replace('_', ' ')}, {motion}"


def draw_distribution(axes: Any, result: StudyResult, output: Output, motion: str) -> tuple[str, str, str]:
    """How often each value occurs, with the limits where the output has them."""
    if output.is_curve:
        return draw_band(axes, result, output, motion)
    values = result.values(output, motion)
    values = output.factor * values[np.isfinite(values)]
    axes.hist(values, bins=min(60, max(5, int(len(values) ** 0.5))), color=MEASURED)
    for limit in (output.low, output.high):
        if limit is not None:
            axes.axvline(output.factor * limit, color=MODEL, lw=1.4)
    return output.label, "insertions [1]", motion


def draw_band(axes: Any, result: StudyResult, output: Output, motion: str) -> tuple[str, str, str]:
    """The median curve, and the bands that hold half and nine tenths of the curves."""
    values = result.values(output, motion)
    values = values[np.isfinite(values).all(axis=1)]
    share = np.linspace(0.0, 1.0, output.points)
    if len(values):
        low, quarter, middle, three, high = np.percentile(values, [5, 25, 50, 75, 95], axis=0)
        axes.fill_between(100.0 * share, low, high, color=MEASURED, alpha=0.35, lw=0, label="90 % of insertions")
        axes.fill_between(100.0 * share, quarter, three, color=SECOND, alpha=0.35, lw=0, label="half of them")
        axes.plot(100.0 * share, middle, color=MODEL, lw=1.6, label="median")
    return "share of the travel inwards [%]", FORCE, motion
