# SPDX-License-Identifier: Apache-2.0
"""The page of a comparison of models: one table, one figure, and what they mean."""

from functools import partial
from math import isfinite
from pathlib import Path
from string import Template

from ..vocabulary import __version__
from .canvas import drawing
from .markup import Markup, element, escape, join, listing, section, table
from .models_figure import FLOOR, figure_heights, unseen_figure
from .models_table import MODELS, best_possible, floor_errors, floor_words, model_rows
from .words import counted, file_name

HERE = Path(__file__).parent
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


def models_page(rows, files=()) -> str:
    """The whole page as HTML text; ``files`` are the recordings compared on."""
    sections = [
        section("Models", _table(rows), name="models"),
        section("Repeats not seen", _figure(rows), name="unseen"),
        section("What the numbers mean", _meanings(), name="meanings"),
        section("Recordings", listing(file_name(str(file)) for file in files) if files else "", name="recordings"),
    ]
    repeats = len(rows[0].unseen.floor)
    style = "".join((HERE / name).read_text(encoding="utf-8") for name in ("page.css", "models.css"))
    return Template((HERE / "page.html").read_text(encoding="utf-8")).substitute(
        title=escape(f"Needle force: {counted(len(rows), 'model')} on {counted(repeats, 'repeat')}"),
        style=style,
        kicker=escape(f"needleforce {__version__} · comparison of models"),
        outcome=_outcome(rows),
        contents="",
        sections=join(sections),
    )


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
    image = drawing("unseen", partial(unseen_figure, rows=rows), figure_heights(rows), alt)
    kinds = element("b", "Prediction", class_="model"), " filled, ", element("b", "replay", class_="replay")
    key = (
        " hollow, a dot a repeat, a bar at their rms, which is the number in the table. "
        f"Grey: {FLOOR}, whose rms is 1. Dashed: what knowing the mean of all possible repeats would reach, "
        f"{best_possible(rows):.2f}."
    )
    parts = element("div", image, class_="drawing"), element("figcaption", *kinds, key)
    return element("figure", *parts, id="figure-unseen")


def _meanings() -> Markup:
    parts = (element("dt", name) + element("dd", meaning) for name, meaning in MEANINGS.items())
    return element("dl", *map(Markup, parts))
