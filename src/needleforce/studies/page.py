# SPDX-License-Identifier: Apache-2.0
"""The page of a study: what matters, the effect of each factor, curves with bands, failures, and the question."""

from collections.abc import Iterable
from functools import partial
from typing import Any

import numpy as np

from ..display.canvas import axis_names, panels
from ..display.markup import element, listing, table
from ..display.page import Figure, Page, section
from .figures import MAX_BARS, draw_band, draw_distribution, draw_effects, draw_pairs, draw_tornado
from .outputs import Output
from .result import StudyResult

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
        draw_effects(axes, result, output, motion, column)
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
    draw_pairs(panels(figure, sheet, margins={"left": 180.0, "bottom": 150.0})[0, 0], result, output, motion)
