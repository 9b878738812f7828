# SPDX-License-Identifier: Apache-2.0
"""Models side by side on the same recordings."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..recording import Recording
from .curves import CURVES
from .deformation_fit import DeformationFit
from .identify import assemble
from .information import criterion, independent_samples
from .laws_from_log import COMPARED, MODELS, stiffness_law
from .single import Single, fit_single
from .telling import Given


@dataclass(frozen=True)
class Row:
    """One model: its loading curve up to the first puncture, and its whole cycle.

    ``bic`` is summed over the recordings that all models fit, each with a contact depth of its own, with the same
    samples for every model; ``bic_correlated`` is the same where samples that are alike count as one. ``numbers`` are
    those sought in each loading curve, ``wins`` the recordings where no model has a lower BIC, ``residual`` the median
    rms of the loading curves over their peaks. ``nrmse`` is the residual of the whole cycles (rms / peak), ``left_out``
    the median over repeats of the error of the model fitted to the others, with their mean contact and puncture depth.
    NaN where nothing answers, ``left_out`` with fewer than two repeats that do. ``notes`` say which numbers were held.
    """

    model: str
    bic: float
    nrmse: float
    left_out: float
    bic_correlated: float
    numbers: int
    wins: int
    residual: float
    notes: tuple[str, ...] = ()


def compare(recordings: Sequence[Recording], models: Sequence[str] = COMPARED, progress=None) -> tuple[Row, ...]:
    """Fits each named model to every recording and predicts each repeat from the others; the lowest BIC first.

    ``progress(iterable, text)`` wraps the recordings. Raises InputError for an unknown model or none.
    """
    if not models:
        raise InputError("models", "none", "nothing to compare", next_step=f"Give some of {', '.join(MODELS)}.")
    laws = {name: stiffness_law(name) for name in models}
    different = tuple(dict.fromkeys(laws.values()))
    watched = progress(recordings, "comparing") if progress else recordings
    singles = [fit_single(each, different, None) for each in watched]
    common = [single.loading for single in singles if set(different) <= set(single.fits)]
    rows = [_row(name, law, singles, common) for name, law in laws.items()]
    return tuple(sorted(rows, key=lambda row: row.bic))


def correlated(loading: dict[str, DeformationFit]) -> dict[str, float]:
    """The BIC of each law's fit to the same samples, where neighbours that are alike count as one."""
    samples = independent_samples([fit.noise for fit in loading.values()])
    return {law: criterion(fit.noise, len(fit.order), samples) for law, fit in loading.items()}


def _row(name: str, law: str, singles: list[Single], common: list[dict[str, DeformationFit]]) -> Row:
    fit = _identified(singles, law)
    answering = [single for single, each in zip(singles, fit.recordings) if each.quality is not None]
    errors = [_left_out(answering, k, law) for k in range(len(answering))] if len(answering) > 1 else []
    return Row(
        name,
        sum(loading[law].bic for loading in common) if common else np.nan,
        fit.quality.nrmse if fit.quality else np.nan,
        float(np.median(errors)) if errors else np.nan,
        sum(correlated(loading)[law] for loading in common) if common else np.nan,
        len(CURVES[law].units) + 1,
        sum(loading[law].bic <= min(each.bic for each in loading.values()) for loading in common),
        float(np.median([loading[law].nrmse for loading in common])) if common else np.nan,
        tuple(dict.fromkeys(sentence for loading in common for sentence in loading[law].held)),
    )


def _identified(singles: list[Single], law: str):
    return assemble(Given(None, None, {}), singles, [], law, ())


def _left_out(answering: list[Single], k: int, law: str) -> float:
    """Error of the model of the other repeats along the motion of repeat k, over its strokes."""
    others = _identified(answering[:k] + answering[k + 1 :], law)
    if others.model is None:
        return np.nan
    left = answering[k].recording
    inside = answering[k].strokes.mask(len(left))
    residual = (left.force - others.predict(left))[inside]
    return float(np.sqrt(np.mean(residual**2)) / np.max(np.abs(left.force[inside])))
