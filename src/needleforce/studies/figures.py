# SPDX-License-Identifier: Apache-2.0
"""Drawings of a study: tornado, effects, pairs, distributions and bands of curves."""

from typing import TYPE_CHECKING, Any

import numpy as np

from ..display.axes import FORCE
from ..display.canvas import INK, MEASURED, MODEL, SECOND
from .outputs import Output

if TYPE_CHECKING:
    from .result import StudyResult

MAX_BARS = 20  # factors of a tornado; the others contribute less


def draw_tornado(axes: Any, result: "StudyResult", output: Output, motion: str) -> tuple[str, str, str]:
    """A bar for each factor, the largest first: its total contribution, with the interval, and its own part."""
    from .result import INDEX_NAMES

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


def draw_effects(
    axes: Any, result: "StudyResult", output: Output, motion: str, column: int, colour: str = MODEL
) -> None:
    """The mean output in each tenth of a factor's range, with its 95 % interval."""
    place, mean, half = result.effect(output, motion, column)
    axes.fill_between(
        100.0 * place, output.factor * (mean - half), output.factor * (mean + half), color=colour, alpha=0.2, lw=0
    )
    axes.plot(100.0 * place, output.factor * mean, color=colour, lw=1.5)


def draw_distribution(axes: Any, result: "StudyResult", output: Output, motion: str) -> tuple[str, str, str]:
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


def draw_band(axes: Any, result: "StudyResult", output: Output, motion: str) -> tuple[str, str, str]:
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


def draw_pairs(axes: Any, result: "StudyResult", output: Output, motion: str) -> None:
    """The second-order index of each pair of factors."""
    found = result.sensitivities[output.name, motion]
    image = axes.imshow(found.pairs, cmap="Greys", vmin=0.0, vmax=1.0)
    names = result.labels
    axes.set_xticks(range(len(names)), names, rotation=60, ha="right")
    axes.set_yticks(range(len(names)), names)
    axes.grid(False)
    for i, j in zip(*np.nonzero(np.isfinite(found.pairs))):
        axes.text(j, i, f"{found.pairs[i, j]:.2f}", ha="center", va="center", color=MODEL, fontsize=8)
    axes.figure.colorbar(image, ax=axes, label="second-order index [1]")
