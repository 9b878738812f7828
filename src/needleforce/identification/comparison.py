# SPDX-License-Identifier: Apache-2.0
"""The comparison of models: a row for each, as a table, a figure and a page with the meaning of the columns."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
from math import isfinite
from typing import Any

import numpy as np

from ..display.canvas import MEASURED, MODEL
from ..display.markup import Markup, element, join, listing, table
from ..display.page import Figure, Page, definitions, section
from ..display.quantities import DASH, counted, percent, plain
from ..display.result import Result
from .cross_validation import DEPTH_TOLERANCE, MIN_OTHERS, SPEED_TOLERANCE, CrossValidation
from .report.comparison_figures import FLOOR, draw_cross_validation, draw_held_out, figure_heights
from .report.words import file_name

MEANINGS = {
    "prediction ÷": "error on held-out repeats over the floor. Each repeat is predicted by a fit to the others only, "
    "with their mean contact and puncture depths; rms over the repeats.",
    "replay ÷": "the same with the depths and forces of the held-out repeat's own punctures: the remaining error is "
    "that of the law.",
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


@dataclass(frozen=True, kw_only=True)
class ModelRow:
    """One model of a comparison. Errors and residuals are rms over the peak force [1], NaN where they are missing.

    Attributes
    ----------
    model : str
        Its name.
    bic : float
        Schwarz's criterion of the loading curve up to the first puncture, summed over the recordings that all models
        fit, each with its own contact depth and the same samples for every model. A layered model has none.
    bic_correlated : float
        The same where correlated samples count as one.
    nrmse : float
        Residual of the complete cycles.
    left_out : float
        Median over repeats of the error on a held-out repeat that is predicted from the others, over the complete cycle
        with its hold, at their mean contact and puncture depths. Needs two repeats.
    prediction : float
        Rms of these errors divided by that of the mean of the other repeats, the repeatability floor of the
        experiment. Needs three repeats of the same motion.
    replay : float
        As ``prediction``, with the punctures of the held-out repeat.
    by_stroke : tuple of float
        ``prediction`` for insertion, hold and withdrawal.
    parameters : int
        Parameters of each loading curve; of a layered model those that the repeats share.
    friction_bic : float
        The same of the friction after the first puncture, in bins of 0.25 mm, from the contact of the best loading
        curve: models with the same form of the foundation have the same. NaN with too few bins.
    wins : int
        Recordings on which no model has a lower BIC.
    residual : float
        Median residual of the loading curves.
    ties : bool
        Its errors differ from the first row's by no more than their own noise between repeats.
    notes : tuple of str
        Parameters that were held at a limit, and repeats that could not be predicted.
    cross_validation : CrossValidation or None
        The errors of every repeat and stroke.
    """

    model: str
    bic: float = np.nan
    nrmse: float = np.nan
    left_out: float = np.nan
    bic_correlated: float = np.nan
    friction_bic: float = np.nan
    parameters: int = 0
    wins: int = 0
    residual: float = np.nan
    notes: tuple[str, ...] = ()
    prediction: float = np.nan
    replay: float = np.nan
    by_stroke: tuple[float, float, float] = (np.nan, np.nan, np.nan)
    ties: bool = False
    cross_validation: CrossValidation | None = field(default=None, compare=False, repr=False)

    @property
    def evidence(self) -> float:
        """BIC of the loading curve and, where it is known, of the friction."""
        return self.bic + float(np.nan_to_num(self.friction_bic))


class Comparison(Result, tuple[ModelRow, ...]):
    """Rows of compared models, the best first."""

    __slots__ = ()
    HEAD = ("model", "prediction / floor", "replay / floor", "residual / peak", "BIC", "parameters", "")

    def _heading(self) -> str:
        return ""  # the table states it

    def _cells(self) -> tuple[Sequence[str], Sequence[Sequence[str]]]:
        best = min((row.evidence for row in self if np.isfinite(row.evidence)), default=np.nan)
        rows = [
            (
                row.model, plain(row.prediction, "1"), plain(row.replay, "1"), percent(row.nrmse),
                f"+{row.evidence - best:.1f}" if row.evidence > best else "lowest" if row.evidence == best else DASH,
                str(row.parameters), _verdict(k, row),
            )
            for k, row in enumerate(self)
        ]  # fmt: skip
        return self.HEAD, rows

    def _remarks(self) -> Iterable[tuple[str, Iterable[str]]]:
        yield "Notes", [f"{row.model}: {note}" for row in self for note in row.notes]

    def _draw(self, axes: Any) -> tuple[str, ...]:
        """Each model's prediction error and replay error over the repeatability floor."""
        places = np.arange(len(self))
        for name, colour, shift in (("prediction", MODEL, 0.1), ("replay", MEASURED, -0.1)):
            axes.plot([getattr(row, name) for row in self], places + shift, "o", color=colour, label=name)
        axes.axvline(1.0, color="black", lw=0.8, label="mean of the other repeats")
        axes.set_yticks(places, [row.model for row in self])
        axes.invert_yaxis()
        return "error on held-out repeats over the repeatability floor [1]", ""

    def document(self) -> list[dict]:
        """A dict for each model, without the curves of the repeat that the page shows."""
        found = [asdict(row) for row in self]
        for each in found:
            (each["cross_validation"] or {}).pop("shown", None)
        return found

    def to_dataframe(self) -> Any:
        """A pandas DataFrame with a row for each model and the fields of ``ModelRow`` as columns."""
        import pandas

        names = [name for name in ModelRow.__dataclass_fields__ if name not in ("model", "cross_validation")]
        rows = [{name: getattr(row, name) for name in names} for row in self]
        return pandas.DataFrame(rows, index=pandas.Index([row.model for row in self], name="model"), columns=names)

    def _page(self, files: Sequence[Any] = ()) -> Page:
        """The page; ``files`` are the recordings of the comparison."""
        repeats = len(self[0].cross_validation.floor)
        return Page(
            title=f"Needle force: {counted(len(self), 'model')} on {counted(repeats, 'repeat')}",
            kind="comparison of models",
            outcome=_outcome(self),
            sections=[
                section("Models", _model_table(self), name="models"),
                section("Held-out repeats", _figure(self), _held_out(self), name="cross-validation"),
                section("Columns of the table", definitions(MEANINGS.items()), name="meanings"),
                section("Recordings", listing(file_name(str(file)) for file in files), name="recordings"),
            ],
            note=_ranking(self),
            links=False,
            style="models.css",
        )

    def __repr__(self) -> str:
        return f"<Comparison of {', '.join(row.model for row in self)}: best {self[0].model}>"


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


def _model_table(rows: Sequence[ModelRow]) -> Markup:
    """The table of models, with their notes."""
    strong = {"best": element("strong", "best")}
    shown = (
        # a narrow column breaks the name only after an underscore
        (element("strong", join(row[0].split("_"), "_<wbr>")), *row[1:-1], strong.get(row[-1], row[-1]))
        for row in model_rows(rows)
    )
    sentences = [f"{row.model}: {sentence}" for row in rows for sentence in row.notes]
    return join([table(MODELS, shown, class_="cards numbers dense models"), listing(sentences, class_="notes")])


def _figure(rows: Sequence[ModelRow]) -> Figure | str:
    """The figure with its caption; empty without a floor."""
    if not len(floor_errors(rows)):
        return ""
    marks = [" (best)", *(" (ties)" if row.ties else "" for row in rows[1:])]
    models = [(f"{row.model}{mark}", *row.cross_validation.dots()[:2]) for row, mark in zip(rows, marks)]
    floor = rows[0].cross_validation.dots()[2]
    kinds = element("b", "Prediction", class_="model"), " filled, ", element("b", "replay", class_="replay")
    key = (
        " hollow: a dot for each repeat and a bar at their rms, the value in the table. "
        f"Grey: prediction by the {FLOOR}, with rms 1. Dashed: prediction by the mean of all possible repeats, "
        f"{best_possible(rows):.2f}, the lowest error of any model."
    )
    return Figure(
        name="cross-validation",
        draw=partial(draw_cross_validation, models=models, floor=floor, lowest=best_possible(rows)),
        heights=figure_heights(len(rows)),
        caption=join([*kinds, key]),
        alt="Error on each held-out repeat over the floor. The values are in the table of this page.",
    )


def _held_out(rows: Sequence[ModelRow]) -> Figure | str:
    """The curve of one held-out repeat with what the others predict; empty without a floor."""
    shown = rows[0].cross_validation.shown if rows[0].cross_validation is not None else None
    if shown is None:
        return ""
    measured, model = element("b", "Measured", class_="measured"), element("b", rows[0].model, class_="model")
    key = (
        measured,
        " thin and grey; ",
        model,
        ", fitted to the other repeats only; ",
        element("b", FLOOR, class_="replay"),
    )
    caption = join([*key, f". {file_name(shown.file)}, whose floor is the median of all repeats."])
    title, alt = "A held-out repeat", "Force over depth of a held-out repeat, measured and predicted."
    draw = partial(draw_held_out, shown=shown, model=rows[0].model)
    return Figure(name="held-out", draw=draw, heights=(280.0, 240.0), caption=caption, alt=alt, title=title)


def model_rows(rows: Sequence[ModelRow]) -> list[tuple[str, ...]]:
    """Each model of a comparison as text under ``MODELS``, in the order of ``rows``."""
    bic = [(row.evidence, row.evidence - row.bic + row.bic_correlated) for row in rows]
    lowest = [min(filter(math.isfinite, each), default=math.nan) for each in zip(*bic)]
    return [
        (row.model, *(_number(own - low, 0) for own, low in zip(bic[k], lowest)), str(row.parameters),
         _share(row.nrmse), _share(row.left_out), _number(row.prediction, 2), _number(row.replay, 2),
         *(_number(each, 2) for each in row.by_stroke), _verdict(k, row))
        for k, row in enumerate(rows)
    ]  # fmt: skip


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
