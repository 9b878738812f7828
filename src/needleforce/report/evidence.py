# SPDX-License-Identifier: Apache-2.0
"""Why a layered fit has the layers and mechanisms it has."""

from .markup import Markup, element, table
from .numbers import DASH

EVIDENCE = (
    *("choice", "numbers", "residual / peak", "BIC, more than the best", "error on repeats left out / peak"),
    "verdict",
)


def evidence_rows(evidence: list[dict]) -> list[tuple[str, ...]]:
    """Every choice that was tried as text, with what it loses in BIC, under ``EVIDENCE``."""
    least = min(row["bic"] for row in evidence)
    return [
        (row["choice"], str(row["numbers"]), percent(row["residual"]), f"{row['bic'] - least:.0f}",
         percent(row["left_out"]), "chosen" if row["chosen"] else "ties" if row["ties"] else "")
        for row in evidence
    ]  # fmt: skip


def evidence_table(evidence: list[dict]) -> Markup:
    """The same as a table, the chosen one in bold."""
    rows = [
        (*row[:-1], element("strong", row[-1]) if row[-1] == "chosen" else row[-1]) for row in evidence_rows(evidence)
    ]
    return table(EVIDENCE, rows, class_="cards numbers tight")


def evidence_words(settings: dict) -> str:
    """By what the choice was made, and what a tie is."""
    by_bic = (
        "With fewer than three repeats the least BIC is chosen, over the whole cycle, samples that are alike counting "
        "as one; those within 10 of it tie."
    )
    by_repeats = (
        "Of the choices that foretell each repeat from the others as well as the best, within one standard "
        "error or 2 % (geometric mean over the repeats), the one of the fewest numbers is chosen. What ties "
        "has another error by no more than the noise between repeats: these recordings do not tell it from "
        "the chosen one. BIC, over the whole cycle, samples that are alike counting as one, is shown beside "
        "it and may ask for less."
    )
    given = sum("," not in row["choice"] for row in settings["evidence"]) == 1
    fixed = " The number of layers was given." if given else ""
    return (by_repeats if settings["evidence"][0]["left_out"] is not None else by_bic) + fixed


def evidence_note(settings: dict) -> Markup:
    """The same under the table, and what the choices are."""
    each = (
        "A choice with a comma leaves a mechanism of the chosen number of layers away. Numbers are those sought in all."
    )
    return element("p", f"{evidence_words(settings)} {each}", class_="note")


def percent(share: float | None) -> str:
    """A share of the peak in per cent, two digits or three."""
    return DASH if share is None else f"{100.0 * share:.1f}\N{NO-BREAK SPACE}%"
