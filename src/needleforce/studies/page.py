# SPDX-License-Identifier: Apache-2.0
"""The page of a study: what matters, the effect of each factor, curves with bands, failures, and the question."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from ..display.canvas import axis_names, panels
from ..display.markup import element, listing, table
from ..display.page import Figure, Page, section
from .figures import draw_band, draw_distribution, draw_effects, draw_pairs, draw_tornado
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
            section("What matters", *_tornadoes(result), name="factors"),
            section("Values", table(*result.cells(), class_="cards numbers dense"), name="values"),
            section("Distributions", *(each for each in _distributions(result, numbers)), name="distributions"),
            section("Effect of each factor", *_effects(result, numbers), name="effects"),
            section("Interactions", *_pairs(result), name="interactions"),
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


def _tornadoes(result: StudyResult) -> Iterable[Figure]:
    for (name, motion), found in result.sensitivities.items():
        if found is None:
            continue
        output = next(each for each in result.outputs if each.name == name)
        height = 80.0 + ROW_POINTS * min(len(found.names), 20)
        title = f"{name.replace('_', ' ')}, {motion}"
        caption = "Share of the variance that a factor explains, alone and with interactions; lines: 95 % intervals."
        if result.question.study.analysis != "sobol":
            caption = "The index of each factor; lines: 95 % intervals."

        def draw(figure: Any, sheet: Any, output: Output = output, motion: str = motion) -> None:
            _one(
                figure, sheet, 90.0 if sheet.narrow else 230.0, lambda axes: draw_tornado(axes, result, output, motion)
            )

        yield Figure(
            name=f"tornado-{name}-{_slug(motion)}",
            draw=draw,
            heights=(height, height),
            caption=caption,
            alt=title,
            title=title,
        )


def _distributions(result: StudyResult, outputs: list[Output]) -> Iterable[Figure]:
    for output in outputs:
        for motion in result.question.motions:

            def draw(figure: Any, sheet: Any, output: Output = output, motion: str = motion) -> None:
                _one(figure, sheet, 60.0, lambda axes: draw_distribution(axes, result, output, motion))

            title = f"{output.name.replace('_', ' ')}, {motion}"
            yield Figure(
                name=f"values-{output.name}-{_slug(motion)}",
                draw=draw,
                heights=(180.0, 180.0),
                caption=output.kind.meaning.capitalize() + ".",
                alt=title,
                title=title,
            )


def _effects(result: StudyResult, outputs: list[Output]) -> Iterable[Figure]:
    for output in outputs:
        for motion in result.question.motions:
            shown = _largest(result, output, motion)

            def draw(
                figure: Any, sheet: Any, output: Output = output, motion: str = motion, shown: list[int] = shown
            ) -> None:
                columns = 2 if sheet.narrow else 3
                grid = panels(figure, sheet, -(-len(shown) // columns), columns, {"left": 50.0}, sharey=True)
                for axes in grid.ravel()[len(shown) :]:
                    axes.set_visible(False)
                for axes, column in zip(grid.ravel(), shown):
                    draw_effects(axes, result, output, motion, column)
                    axes.set_xlabel(f"{result.labels[column].split(' [')[0]} [%]", loc="right")
                grid.ravel()[0].annotate(
                    output.label, (0, 1), (-40, 10), xycoords="axes fraction", textcoords="offset points"
                )

            rows = -(-len(shown) // 3), -(-len(shown) // 2)
            title = f"{output.name.replace('_', ' ')}, {motion}"
            caption = "Mean in each tenth of a factor's distribution, all values of the others; bands: 95 % intervals."
            yield Figure(
                name=f"effects-{output.name}-{_slug(motion)}",
                draw=draw,
                heights=(150.0 * rows[0] + 20, 150.0 * rows[1] + 20),
                caption=caption,
                alt=title,
                title=title,
            )


def _largest(result: StudyResult, output: Output, motion: str) -> list[int]:
    """The columns whose effect is largest."""
    spread = []
    for column in range(len(result.names)):
        mean = result.effect(output, motion, column)[1]
        spread.append(np.ptp(mean[np.isfinite(mean)]) if np.isfinite(mean).any() else 0.0)
    return [int(k) for k in np.argsort(-np.array(spread), kind="stable")[:EFFECTS_SHOWN]]


def _pairs(result: StudyResult) -> Iterable[Figure]:
    for (name, motion), found in result.sensitivities.items():
        if found is None or not np.isfinite(found.pairs).any():
            continue
        output = next(each for each in result.outputs if each.name == name)

        def draw(figure: Any, sheet: Any, output: Output = output, motion: str = motion) -> None:
            axes = panels(figure, sheet, margins={"left": 180.0, "bottom": 150.0})[0, 0]
            draw_pairs(axes, result, output, motion)

        title = f"{name.replace('_', ' ')}, {motion}"
        yield Figure(
            name=f"pairs-{name}-{_slug(motion)}",
            draw=draw,
            heights=(420.0, 420.0),
            caption="Second-order index of each pair.",
            alt=title,
            title=title,
        )


def _curves(result: StudyResult, curves: list[Output]) -> Iterable[Figure]:
    for output in curves:
        for motion in result.question.motions:

            def draw(figure: Any, sheet: Any, output: Output = output, motion: str = motion) -> None:
                _one(figure, sheet, 50.0, lambda axes: draw_band(axes, result, output, motion))

            yield Figure(
                name=f"curve-{_slug(motion)}",
                draw=draw,
                heights=(260.0, 240.0),
                caption="Force in the insertion stroke.",
                alt=motion,
                title=motion,
            )


def _slug(text: str) -> str:
    return "".join(each if each.isalnum() else "-" for each in text)
