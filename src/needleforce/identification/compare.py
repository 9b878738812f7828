# SPDX-License-Identifier: Apache-2.0
"""Models side by side on the same recordings."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..recording import Recording
from .identify import identify
from .laws_from_log import MODELS


@dataclass(frozen=True)
class Row:
    """One model: BIC summed over the recordings, residual of its own fits, and of repeats that were left out (rms /
    peak).

    ``left_out`` is the median over repeats of the error of the model fitted to the others, with their mean contact and
    puncture depth; NaN with fewer than two repeats that answer.
    """

    model: str
    bic: float
    nrmse: float
    left_out: float


def compare(recordings: Sequence[Recording], models: Sequence[str] = tuple(MODELS), progress=None) -> tuple[Row, ...]:
    """Fits each named model to every recording and predicts each repeat from the others; the lowest BIC first."""
    recordings = list(recordings)
    work = [(name, progress) for name in models]
    rows = [_row(recordings, name) for name, _ in (progress(work, "comparing") if progress else work)]
    if not rows:
        raise InputError("models", "none", "nothing to compare", next_step=f"Give some of {', '.join(MODELS)}.")
    return tuple(sorted(rows, key=lambda row: row.bic))


def _row(recordings: list[Recording], name: str) -> Row:
    fit = identify(recordings, model=name)
    nrmse = fit.quality.nrmse if fit.quality else np.nan
    bic = fit.choice[0][1] if fit.choice else np.nan
    answering = [i for i, each in enumerate(fit.recordings) if each.parameters]
    errors = [_left_out(recordings, fit, name, i, answering) for i in answering] if len(answering) > 1 else [np.nan]
    return Row(name, float(bic), float(nrmse), float(np.median(errors)))


def _left_out(recordings, fit, name: str, i: int, answering: list[int]) -> float:
    """Error of the model of the other repeats along the motion of repeat i, over its strokes."""
    others = identify([recordings[j] for j in answering if j != i], model=name)
    left = fit.recordings[i]
    if others.model is None:
        return np.nan
    predicted = others.predict(left.recording)
    inside = left.predicted != 0.0
    residual = (left.recording.force - predicted)[inside]
    return float(np.sqrt(np.mean(residual**2)) / np.max(np.abs(left.recording.force)))
