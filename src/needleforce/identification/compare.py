# SPDX-License-Identifier: Apache-2.0
"""Models side by side on the same recordings."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..recording import Recording
from ..segmentation import segment
from .identify import identify
from .laws_from_log import MODELS, stiffness_law
from .single import Single, fit_single
from .strokes import strokes_of


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
    """Fits each named model to every recording and predicts each repeat from the others; the lowest BIC first.

    BIC is summed over the recordings that all models fit. ``progress(iterable, text)`` wraps the models. Raises
    InputError for an unknown model or none.
    """
    if not models:
        raise InputError("models", "none", "nothing to compare", next_step=f"Give some of {', '.join(MODELS)}.")
    recordings = list(recordings)
    laws = {name: stiffness_law(name) for name in models}
    singles = [fit_single(each, tuple(dict.fromkeys(laws.values())), None) for each in recordings]
    common = [single for single in singles if set(laws.values()) <= set(single.fits)]
    rows = [
        _row(recordings, name, laws[name], common) for name in (progress(models, "comparing") if progress else models)
    ]
    return tuple(sorted(rows, key=lambda row: row.bic))


def _row(recordings: list[Recording], name: str, law: str, common: list[Single]) -> Row:
    fit = identify(recordings, model=name)
    nrmse = fit.quality.nrmse if fit.quality else np.nan
    bic = float(sum(single.loading[law].bic for single in common)) if common else np.nan
    answering = [i for i, each in enumerate(fit.recordings) if each.quality is not None]
    errors = [_left_out(recordings, name, i, answering) for i in answering] if len(answering) > 1 else [np.nan]
    return Row(name, bic, float(nrmse), float(np.median(errors)) if errors else np.nan)


def _left_out(recordings, name: str, i: int, answering: list[int]) -> float:
    """Error of the model of the other repeats along the motion of repeat i, over its strokes."""
    others = identify([recordings[j] for j in answering if j != i], model=name)
    if others.model is None:
        return np.nan
    left = recordings[i]
    inside = strokes_of(left, segment(left)).mask(len(left))
    residual = (left.force - others.predict(left))[inside]
    return float(np.sqrt(np.mean(residual**2)) / np.max(np.abs(left.force[inside])))
