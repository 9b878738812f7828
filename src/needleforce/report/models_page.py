# SPDX-License-Identifier: Apache-2.0
"""The page of a comparison of models: one table, one figure, and what they mean."""

import math
from functools import partial
from math import isfinite

import numpy as np

from ..display.markup import Markup, element, join, listing, section, table
from ..display.quantities import DASH, counted
from ..identification.cross_validation import DEPTH_TOLERANCE, MIN_OTHERS, SPEED_TOLERANCE
from ..vocabulary import __version__
from .canvas import INK, MEASURED, MODEL, QUIET, SECOND, SLATE, TEXT, drawing, panels
from .frame import framed
from .words import file_name

MEANINGS = {
    "prediction": "each repeat from a fit to the others alone, at their mean contact and punctures; rms over repeats.",
    "replay": "the same with the punctures of the repeat itself, so that what is left is the law's error.",
    "insertion, hold, withdrawal": "the prediction in each part of the cycle.",
    "ties": "errs more than the least by no more than its own noise between repeats: these recordings do not tell the "
    "two apart. Of those that tie, the first is the one with the lowest BIC of the loading curve.",
    "ΔBIC loading": "BIC of the loading curve up to the first puncture, with a contact depth for each recording: how "
    "much more than the best. A layered model has no loading curve of its own.",
    "ΔBIC, alike": "the same where neighbouring samples that are alike count as one, the careful count.",
    "numbers": "of the loading curve with its contact depth; of a layered model all that it gives.",
    "residual": "rms over the peak of the whole cycles that were fitted.",
    "left out": "the median error of the prediction over the peak of the force.",
}  # fmt: skip
OVER_FLOOR = ("prediction", "replay", "insertion", "hold", "withdrawal")
MODELS = (
    *("model", "ΔBIC loading", "ΔBIC, alike", "numbers", "residual", "left out"),
    *(f"{name}\N{NO-BREAK SPACE}÷" for name in OVER_FLOOR),
    "verdict",
)
_APART = 0.17  # of a row, from its middle to predictions above and replays below
_OFFSET = {"textcoords": "offset points"}
FLOOR = "mean of the others"


def models_page(rows, files=()) -> str:
    """The whole page as HTML text; ``files`` are the recordings compared on."""
    sections = [
        section("Models", _table(rows), name="models"),
        section("Held-out repeats", _figure(rows), name="cross-validation"),
        section("What the numbers mean", _meanings(), name="meanings"),
        section("Recordings", listing(file_name(str(file)) for file in files) if files else "", name="recordings"),
    ]
    repeats = len(rows[0].cross_validation.floor)
    title = f"Needle force: {counted(len(rows), 'model')} on {counted(repeats, 'repeat')}"
    kicker = f"needleforce {__version__} · comparison of models"
    return framed(title, kicker, _outcome(rows), sections, links=False, styles=("models.css",))


def _outcome(rows) -> Markup:
    """Who wins, and who is not told from the winner."""
    best = element("strong", rows[0].model)
    if not len(floor_errors(rows)):
        by_bic = [best, " has the lowest BIC of the loading curve. "] if isfinite(rows[0].bic) else []
        return join([*by_bic, floor_words(rows)])
    tied = [row.model for row in rows if row.ties]
    said = [best, f" foretells repeats that it has not seen to {rows[0].prediction:.2f} times the floor"]
    said += ["; ", element("strong", ", ".join(tied)), " ties" if len(tied) == 1 else " tie"] if tied else []
    return join([*said, ". ", floor_words(rows)])


def _table(rows) -> Markup:
    strong = {"best": element("strong", "best")}
    shown = ((element("strong", row[0]), *row[1:-1], strong.get(row[-1], row[-1])) for row in model_rows(rows))
    held = [f"{row.model}: {sentence}" for row in rows for sentence in row.notes]
    notes = listing(held, class_="notes") if held else ""
    return join([table(MODELS, shown, class_="cards numbers dense models"), notes])


def _figure(rows) -> Markup:
    if not len(floor_errors(rows)):
        return Markup("")
    title = "Error on each repeat, foretold from the others, over the floor"
    alt = f"{title}. The numbers are in the table of this page."
    image = drawing("cross-validation", partial(cross_validation_figure, rows=rows), figure_heights(rows), alt)
    kinds = element("b", "Prediction", class_="model"), " filled, ", element("b", "replay", class_="replay")
    key = (
        " hollow, a dot a repeat, a bar at their rms, which is the number in the table. "
        f"Grey: {FLOOR}, whose rms is 1. Dashed: what knowing the mean of all possible repeats would reach, "
        f"{best_possible(rows):.2f}."
    )
    parts = element("div", image, class_="drawing"), element("figcaption", *kinds, key)
    return element("figure", *parts, id="figure-cross-validation")


def _meanings() -> Markup:
    parts = (element("dt", name) + element("dd", meaning) for name, meaning in MEANINGS.items())
    return element("dl", *map(Markup, parts))


def model_rows(rows) -> list[tuple[str, ...]]:
    """Each model of a comparison as text under ``MODELS``, in the order of ``rows``."""
    least = [_least(row.bic for row in rows), _least(row.bic_correlated for row in rows)]
    return [
        (row.model, _number(row.bic - least[0], 0), _number(row.bic_correlated - least[1], 0), str(row.parameters),
         _share(row.nrmse), _share(row.left_out), _number(row.prediction, 2), _number(row.replay, 2),
         *(_number(each, 2) for each in row.by_stroke), _verdict(k, row))
        for k, row in enumerate(rows)
    ]  # fmt: skip


def _least(values) -> float:
    return min((value for value in values if math.isfinite(value)), default=math.nan)


def _verdict(place: int, row) -> str:
    """A best there is only where something was foretold, or a loading curve compared."""
    answers = math.isfinite(row.prediction) or math.isfinite(row.bic)
    return "best" if place == 0 and answers else "ties" if row.ties else ""


def _number(value: float, places: int) -> str:
    return f"{value:.{places}f}" if math.isfinite(value) else DASH


def _share(value: float) -> str:
    return f"{100.0 * value:.1f}\N{NO-BREAK SPACE}%" if math.isfinite(value) else DASH


def floor_errors(rows) -> np.ndarray:
    """Whole-cycle error over the peak of the mean of the other repeats, one for each repeat that has it."""
    floors = [row.cross_validation.floor[:, 0] for row in rows if row.cross_validation is not None]
    return floors[0][np.isfinite(floors[0])] if floors else np.empty(0)


def floor_words(rows) -> str:
    """What ÷ divides by, or why there is nothing to divide by."""
    floor = floor_errors(rows)
    same = f"as deep within {100 * DEPTH_TOLERANCE:.0f} % and as fast within {100 * SPEED_TOLERANCE:.0f} %"
    if not len(floor):
        return f"There is no floor to divide by: it needs {MIN_OTHERS + 1} repeats of the same motion, {same}."
    rms = 100.0 * float(np.sqrt(np.mean(floor**2)))
    return (
        f"The floor is how well the experiment repeats itself: each repeat foretold by the mean of the others, "
        f"{rms:.1f} % of the peak (rms over {counted(len(floor), 'repeat')} of the same motion, {same})."
    )


def best_possible(rows) -> float:
    """Over the floor, the error of who knows the mean of all possible repeats: the mean of n - 1 errs by the root of
    1 + 1 / (n - 1) times the scatter. NaN without a floor."""
    count = len(floor_errors(rows))
    return math.sqrt((count - 1) / count) if count else math.nan


def over_floor(cross_validation) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Whole-cycle errors of prediction, replay and floor over the rms of the floor, each one for every repeat that has
    all; the rms of the first two are the numbers in the table."""
    errors = np.stack([cross_validation.prediction[:, 0], cross_validation.replay[:, 0], cross_validation.floor[:, 0]])
    errors = errors[:, np.isfinite(errors).all(axis=0)]
    prediction, replay, floor = errors / np.sqrt(np.mean(errors[2] ** 2)) if errors.size else errors
    return prediction, replay, floor


def cross_validation_figure(figure, sheet, rows) -> None:
    """A row a model and one for the floor itself: prediction filled, replay hollow, a bar at the rms of either."""
    left = 8.0 if sheet.narrow else 128.0
    axes = panels(figure, sheet, margins={"top": 22.0, "left": left, "right": 12.0})[0, 0]
    _lines(axes, rows)
    _row(axes, sheet, 0, FLOOR, (over_floor(rows[0].cross_validation)[2], MEASURED, MEASURED, 0.0))
    for k, row in enumerate(rows, 1):
        prediction, replay, _ = over_floor(row.cross_validation)
        mark = " (best)" if k == 1 else " (ties)" if row.ties else ""
        kinds = (prediction, MODEL, MODEL, _APART), (replay, SECOND, "white", -_APART)
        _row(axes, sheet, k, f"{row.model}{mark}", *kinds)
    axes.set_xlim(left=0.0)
    axes.set_ylim(-len(rows) - 0.6, 0.7)
    axes.set_yticks([])
    axes.grid(True, axis="x")
    axes.spines["left"].set_visible(False)
    axes.set_xlabel("error / floor", loc="right")


def figure_heights(rows) -> tuple[float, float]:
    """Heights [points], wide and narrow, for so many models."""
    return 64.0 + 26.0 * (len(rows) + 1), 64.0 + 40.0 * (len(rows) + 1)


def _lines(axes, rows) -> None:
    """At 1 the experiment itself, lighter what the best of models could reach."""
    least, place = best_possible(rows), axes.get_xaxis_transform()
    axes.axvline(1.0, color=QUIET, lw=1.0)
    axes.axvline(least, color=QUIET, lw=0.7, ls=(0, (2, 2)))
    style = {"xycoords": place, "va": "bottom", "fontsize": TEXT - 1, "color": SLATE, **_OFFSET}
    axes.annotate("1, the repeats themselves", (1.0, 1.0), (3, 3), ha="left", **style)
    axes.annotate(f"{least:.2f}", (least, 1.0), (-3, 3), ha="right", **style)


def _row(axes, sheet, place: int, name: str, *kinds: tuple) -> None:
    at = {"xycoords": axes.get_yaxis_transform(), **_OFFSET}
    axes.annotate(name, (0.0, -place), (0, 9) if sheet.narrow else (-128, -3), color=INK, **at)
    for values, edge, face, shift in kinds:
        height = np.full(len(values), shift - place - 0.15 * sheet.narrow)  # below the name
        axes.plot(values, height, "o", ms=4.5, mec=edge, mfc=face, mew=1.1, alpha=0.9)
        rms = float(np.sqrt(np.mean(values**2))) if len(values) else np.nan
        axes.plot([rms, rms], [height[0] - 0.2, height[0] + 0.2] if len(values) else [np.nan] * 2, color=edge, lw=1.6)
