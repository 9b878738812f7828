# SPDX-License-Identifier: Apache-2.0
"""The page of a comparison of models: a table, a figure, and the meaning of their columns."""

import math
from collections.abc import Iterable, Sequence
from functools import partial
from math import isfinite
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..display.markup import Markup, element, join, listing, section, table
from ..display.quantities import DASH, counted
from ..identification.compare import ModelRow
from ..identification.cross_validation import DEPTH_TOLERANCE, MIN_OTHERS, SPEED_TOLERANCE, CrossValidation
from ..vocabulary import __version__
from .canvas import INK, MEASURED, MODEL, ON_WHITE, QUIET, SECOND, SLATE, TEXT, Sheet, drawing, panels
from .frame import framed
from .words import file_name

MEANINGS = {
    "prediction ÷": "error on held-out repeats over the floor. Each repeat is predicted by a fit to the others only, "
    "with their mean contact and puncture depths; rms over the repeats.",
    "replay ÷": "the same with the puncture depths of the held-out repeat itself: the remaining error is that of the "
    "law.",
    "insertion, hold, withdrawal ÷": "the prediction error in each part of the cycle, over the floor.",
    "ties": "the error differs from the lowest by no more than its own noise between repeats: these recordings do not "
    "distinguish the two models. The tied model with the lowest BIC of the loading curve comes first.",
    "ΔBIC loading": "BIC of the loading curve up to the first puncture, above the lowest; each recording has its own "
    "contact depth. A layered model has no loading curve. Where models differ in the foundation along the shaft, the "
    "BIC of the friction is added.",
    "ΔBIC correlated": "the same, counting correlated samples as one: the more cautious comparison.",
    "parameters": "of the loading curve with its contact depth; of a layered model all parameters.",
    "residual": "rms residual of the fitted cycles, over the peak force.",
    "held out": "median error of the prediction, over the peak force.",
}  # fmt: skip
OVER_FLOOR = ("prediction", "replay", "insertion", "hold", "withdrawal")
MODELS = (
    *("model", "ΔBIC loading", "ΔBIC correlated", "parameters", "residual", "held out"),
    *(f"{name}\N{NO-BREAK SPACE}÷" for name in OVER_FLOOR),
    "verdict",
)
_ROW_OFFSET = 0.17  # of a row: predictions are above its middle, replays below
_OFFSET = {"textcoords": "offset points"}
FLOOR = "mean of the others"


def models_page(rows: Sequence[ModelRow], files: Sequence[Any] = ()) -> str:
    """The page as HTML text; ``files`` are the recordings of the comparison."""
    sections = [
        section("Models", _table(rows), name="models"),
        section("Held-out repeats", _figure(rows), name="cross-validation"),
        section("Columns of the table", _meanings(), name="meanings"),
        section("Recordings", listing(file_name(str(file)) for file in files) if files else "", name="recordings"),
    ]
    repeats = len(rows[0].cross_validation.floor)
    title = f"Needle force: {counted(len(rows), 'model')} on {counted(repeats, 'repeat')}"
    kicker = f"needleforce {__version__} · comparison of models"
    return framed(title, kicker, _outcome(rows), sections, note=_ranking(rows), links=False, styles=("models.css",))


def _outcome(rows: Sequence[ModelRow]) -> Markup:
    """The best model, those that tie with it, and the floor."""
    best = element("strong", rows[0].model)
    if not len(floor_errors(rows)):
        curve = (
            "loading curve and friction"
            if len({row.friction_bic for row in rows if isfinite(row.friction_bic)}) > 1
            else "loading curve"
        )
        by_bic = [best, f" has the lowest BIC of the {curve}. "] if isfinite(rows[0].bic) else []
        return join([*by_bic, floor_words(rows)])
    tied = [row.model for row in rows if row.ties]
    error = f"{rows[0].prediction:.2f}"
    sentence = [
        best,
        " best predicts held-out repeats, with an error of ",
        element("strong", error),
        " times the floor",
    ]
    sentence += ["; ", element("strong", ", ".join(tied)), " ties" if len(tied) == 1 else " tie"] if tied else []
    return join([*sentence, ". ", floor_words(rows)])


def _ranking(rows: Sequence[ModelRow]) -> str:
    """Why the best model need not have the lowest BIC; empty without a floor."""
    note = "The ranking is by held-out repeats; ΔBIC compares only the loading curves and can rank models differently."
    return note if len(floor_errors(rows)) and any(isfinite(row.bic) for row in rows) else ""


def _table(rows: Sequence[ModelRow]) -> Markup:
    """The table of models, with their notes."""
    strong = {"best": element("strong", "best")}
    shown = (
        (element("strong", _breakable(row[0])), *row[1:-1], strong.get(row[-1], row[-1])) for row in model_rows(rows)
    )
    sentences = [f"{row.model}: {sentence}" for row in rows for sentence in row.notes]
    notes = listing(sentences, class_="notes") if sentences else ""
    return join([table(MODELS, shown, class_="cards numbers dense models"), notes])


def _breakable(name: str) -> Markup:
    """A name that a narrow column breaks only after an underscore."""
    return join(name.split("_"), "_<wbr>")


def _figure(rows: Sequence[ModelRow]) -> Markup:
    """The figure with its caption; empty without a floor."""
    if not len(floor_errors(rows)):
        return Markup("")
    title = "Error on each held-out repeat over the floor"
    alt = f"{title}. The values are in the table of this page."
    image = drawing("cross-validation", partial(cross_validation_figure, rows=rows), figure_heights(rows), alt)
    kinds = element("b", "Prediction", class_="model"), " filled, ", element("b", "replay", class_="replay")
    key = (
        " hollow: a dot for each repeat and a bar at their rms, the value in the table. "
        f"Grey: prediction by the {FLOOR}, with rms 1. Dashed: prediction by the mean of all possible repeats, "
        f"{best_possible(rows):.2f}, the lowest error of any model."
    )
    parts = element("div", image, class_="drawing"), element("figcaption", *kinds, key)
    return element("figure", *parts, id="figure-cross-validation")


def _meanings() -> Markup:
    """What each column of the table is."""
    parts = (element("dt", name) + element("dd", meaning) for name, meaning in MEANINGS.items())
    return element("dl", *map(Markup, parts))


def model_rows(rows: Sequence[ModelRow]) -> list[tuple[str, ...]]:
    """Each model of a comparison as text under ``MODELS``, in the order of ``rows``."""
    bic = [(row.evidence, row.evidence - row.bic + row.bic_correlated) for row in rows]
    lowest = [_lowest(each) for each in zip(*bic)]
    return [
        (row.model, *(_number(own - low, 0) for own, low in zip(bic[k], lowest)), str(row.parameters),
         _share(row.nrmse), _share(row.left_out), _number(row.prediction, 2), _number(row.replay, 2),
         *(_number(each, 2) for each in row.by_stroke), _verdict(k, row))
        for k, row in enumerate(rows)
    ]  # fmt: skip


def _lowest(values: Iterable[float]) -> float:
    """The lowest finite value, or NaN."""
    return min((value for value in values if math.isfinite(value)), default=math.nan)


def _verdict(place: int, row: ModelRow) -> str:
    """``best`` for the first model if it has a prediction error or a BIC, ``ties`` or nothing for the others."""
    answers = math.isfinite(row.prediction) or math.isfinite(row.bic)
    return "best" if place == 0 and answers else "ties" if row.ties else ""


def _number(value: float, places: int) -> str:
    """A number with that many decimals, or a dash."""
    return f"{value:.{places}f}" if math.isfinite(value) else DASH


def _share(value: float) -> str:
    """A share in per cent, or a dash."""
    return f"{100.0 * value:.1f}\N{NO-BREAK SPACE}%" if math.isfinite(value) else DASH


def floor_errors(rows: Sequence[ModelRow]) -> np.ndarray:
    """Error of the mean of the other repeats over the complete cycle and over the peak, for each repeat with one."""
    floors = [row.cross_validation.floor[:, 0] for row in rows if row.cross_validation is not None]
    return floors[0][np.isfinite(floors[0])] if floors else np.empty(0)


def floor_words(rows: Sequence[ModelRow]) -> str:
    """What the floor is, or why there is none."""
    floor = floor_errors(rows)
    same = f"depths within {100 * DEPTH_TOLERANCE:.0f} % and speeds within {100 * SPEED_TOLERANCE:.0f} %"
    if not len(floor):
        return f"There is no repeatability floor: it needs {MIN_OTHERS + 1} repeats of the same motion ({same})."
    rms = 100.0 * float(np.sqrt(np.mean(floor**2)))
    return (
        f"The floor is the repeatability of the experiment: the error of predicting each repeat by the mean of the "
        f"others, {rms:.1f} % of the peak force (rms over {counted(len(floor), 'repeat')} of the same motion: {same})."
    )


def best_possible(rows: Sequence[ModelRow]) -> float:
    """Error over the floor of a prediction by the mean of all possible repeats; NaN without a floor.

    The error of the mean of n - 1 repeats is the root of 1 + 1 / (n - 1) times the scatter.
    """
    count = len(floor_errors(rows))
    return math.sqrt((count - 1) / count) if count else math.nan


def over_floor(cross_validation: CrossValidation) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Errors of prediction, replay and floor over the rms of the floor, complete cycle, for each repeat that has all.

    The rms of the first two are the values in the table.
    """
    errors = np.stack([cross_validation.prediction[:, 0], cross_validation.replay[:, 0], cross_validation.floor[:, 0]])
    errors = errors[:, np.isfinite(errors).all(axis=0)]
    prediction, replay, floor = errors / np.sqrt(np.mean(errors[2] ** 2)) if errors.size else errors
    return prediction, replay, floor


def cross_validation_figure(figure: Figure, sheet: Sheet, rows: Sequence[ModelRow]) -> None:
    """A row for each model and one for the floor: prediction filled, replay hollow, a bar at the rms of each."""
    left = 8.0 if sheet.narrow else 128.0
    axes = panels(figure, sheet, margins={"top": 22.0, "left": left, "right": 12.0})[0, 0]
    _lines(axes, rows)
    _row(axes, sheet, 0, FLOOR, (over_floor(rows[0].cross_validation)[2], MEASURED, MEASURED, 0.0))
    for k, row in enumerate(rows, 1):
        prediction, replay, _ = over_floor(row.cross_validation)
        mark = " (best)" if k == 1 else " (ties)" if row.ties else ""
        kinds = (prediction, MODEL, MODEL, _ROW_OFFSET), (replay, SECOND, "white", -_ROW_OFFSET)
        _row(axes, sheet, k, f"{row.model}{mark}", *kinds)
    axes.set_xlim(left=0.0)
    axes.set_ylim(-len(rows) - 0.6, 0.7)
    axes.set_yticks([])
    axes.grid(True, axis="x")
    axes.spines["left"].set_visible(False)
    axes.set_xlabel("error / floor [1]", loc="right")


def figure_heights(rows: Sequence[ModelRow]) -> tuple[float, float]:
    """Heights [points], wide and narrow, for these models."""
    return 64.0 + 26.0 * (len(rows) + 1), 64.0 + 40.0 * (len(rows) + 1)


def _lines(axes: Axes, rows: Sequence[ModelRow]) -> None:
    """A line at 1, the floor, and a dashed line at the lowest error of any model."""
    lowest, place = best_possible(rows), axes.get_xaxis_transform()
    axes.axvline(1.0, color=QUIET, lw=1.0)
    axes.axvline(lowest, color=QUIET, lw=0.7, ls=(0, (2, 2)))
    style = {"xycoords": place, "va": "bottom", "fontsize": TEXT - 1, "color": SLATE, **_OFFSET}
    axes.annotate("1: floor", (1.0, 1.0), (3, 3), ha="left", **style)
    axes.annotate(f"{lowest:.2f}", (lowest, 1.0), (-3, 3), ha="right", **style)


def _row(axes: Axes, sheet: Sheet, place: int, name: str, *kinds: tuple) -> None:
    """One row: its name, a dot for each repeat and a bar at the rms; ``kinds`` are (values, edge, face, offset)."""
    at = {"xycoords": axes.get_yaxis_transform(), "bbox": ON_WHITE if sheet.narrow else None, **_OFFSET}
    axes.annotate(name, (0.0, -place), (0, 9) if sheet.narrow else (-128, -3), color=INK, **at)
    for values, edge, face, shift in kinds:
        height = np.full(len(values), shift - place - 0.15 * sheet.narrow)  # below the name
        axes.plot(values, height, "o", ms=4.5, mec=edge, mfc=face, mew=1.1, alpha=0.9)
        rms = float(np.sqrt(np.mean(values**2))) if len(values) else np.nan
        axes.plot([rms, rms], [height[0] - 0.2, height[0] + 0.2] if len(values) else [np.nan] * 2, color=edge, lw=1.6)
