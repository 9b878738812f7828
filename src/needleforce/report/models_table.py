# SPDX-License-Identifier: Apache-2.0
"""Models beside each other on the same recordings, as rows of text, and what stands behind them in words."""

import math

import numpy as np

from ..identification.cross_validation import LEAST_OTHERS, SAME_DEPTH, SAME_SPEED
from .numbers import DASH
from .words import counted

OVER_FLOOR = ("prediction", "replay", "insertion", "hold", "withdrawal")
MODELS = (
    *("model", "ΔBIC loading", "ΔBIC, alike", "numbers", "residual", "left out"),
    *(f"{name}\N{NO-BREAK SPACE}÷" for name in OVER_FLOOR),
    "verdict",
)


def model_rows(rows) -> list[tuple[str, ...]]:
    """Each model of a comparison as text under ``MODELS``, in the order of ``rows``."""
    least = [_least(row.bic for row in rows), _least(row.bic_correlated for row in rows)]
    return [
        (row.model, _number(row.bic - least[0], 0), _number(row.bic_correlated - least[1], 0), str(row.numbers),
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
    floors = [row.unseen.floor[:, 0] for row in rows if row.unseen is not None]
    return floors[0][np.isfinite(floors[0])] if floors else np.empty(0)


def floor_words(rows) -> str:
    """What ÷ divides by, or why there is nothing to divide by."""
    floor = floor_errors(rows)
    same = f"as deep within {100 * SAME_DEPTH:.0f} % and as fast within {100 * SAME_SPEED:.0f} %"
    if not len(floor):
        return f"There is no floor to divide by: it needs {LEAST_OTHERS + 1} repeats of the same motion, {same}."
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
