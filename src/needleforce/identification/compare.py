# SPDX-License-Identifier: Apache-2.0
"""Models side by side on the same recordings."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..errors import InputError
from ..recording import Recording
from .cross_validation import CrossValidation, cross_validate
from .diagnostics import FitInputs
from .identify import assemble
from .models import COMPARED, LAYERED, MODELS, SAME_FORCE, stiffness_law
from .one_layer.deformation_fit import DeformationFit
from .one_layer.fit_recording import SegmentedRecording, fit_single
from .one_layer.loading_curves import CURVES
from .result import Fit
from .statistics.regression import criterion, independent_samples


@dataclass(frozen=True)
class ModelRow:
    """One model: its loading curve up to the first puncture, its whole cycle, and the repeats it has not seen.

    ``bic`` is summed over the recordings that all models fit, each with a contact depth of its own, with the same
    samples for every model; ``bic_correlated`` is the same where samples that are alike count as one. ``numbers`` are
    those sought in each loading curve, or those that the repeats share in a layered model, ``wins`` the recordings
    where no model has a lower BIC, ``residual`` the median rms of the loading curves over their peaks. ``nrmse`` is the
    residual of the whole cycles (rms / peak).

    ``left_out`` is the median over repeats of the error over the peak, whole cycle with its hold, of the model fitted
    to the others, with their mean contact and puncture depths. ``prediction`` is the rms of these errors over that of
    the mean of the other repeats, the experiment's own repeatability; ``replay`` the same with the repeat's own
    punctures; ``by_stroke`` the prediction for insertion, hold and withdrawal. ``ties`` says that this
    model's errors differ from the least by no more than their own noise between repeats, as the first row's do.

    NaN where nothing answers: ``left_out`` with fewer than two repeats, ``prediction`` with fewer than three of the
    same motion. A layered model has no loading curve of its own. ``notes`` say which numbers were held.
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
    prediction: float = np.nan
    replay: float = np.nan
    by_stroke: tuple[float, float, float] = (np.nan, np.nan, np.nan)
    ties: bool = False
    cross_validation: CrossValidation | None = field(default=None, compare=False, repr=False)


def compare(recordings: Sequence[Recording], models: Sequence[str] = COMPARED, progress=None) -> tuple[ModelRow, ...]:
    """Fits each named model to every recording and predicts each repeat from the others, from cold.

    First come the models that predict unseen repeats as well as any, by the BIC of their loading curves, then the
    others by their prediction; with fewer than three repeats the BIC alone ranks. ``progress(iterable, text)`` wraps
    the work. Raises InputError for an unknown model or none.
    """
    if not models:
        known = ", ".join((*MODELS, *LAYERED))
        raise InputError("models", "none", "nothing to compare", next_step=f"Give some of {known}.")
    laws = {name: None if name in LAYERED else stiffness_law(SAME_FORCE.get(name, name)) for name in models}
    different = tuple(dict.fromkeys(law for law in laws.values() if law is not None))
    watched = progress(recordings, "comparing") if progress else recordings
    singles = [fit_single(each, different, None) for each in watched]
    common = [single.loading for single in singles if different and set(different) <= set(single.fits)]
    return _ranked([_row(name, law, singles, common, progress) for name, law in laws.items()])


def _ranked(rows: list[ModelRow]) -> tuple[ModelRow, ...]:
    """Best first: those that predict unseen repeats as well as any, by the BIC of their loading curve; then the others
    by their prediction."""
    best = min(rows, key=lambda row: _last(row.prediction)).cross_validation
    tied = {id(row): np.isfinite(row.prediction) and not row.cross_validation.distinguishes(best) for row in rows}

    def place(row: ModelRow) -> tuple:
        tie = tied[id(row)]
        return not tie, _last(row.bic) if tie else 0.0, _last(row.prediction), _last(row.bic)

    rows = sorted(rows, key=place)
    return tuple(replace(row, ties=bool(k > 0 and tied[id(row)])) for k, row in enumerate(rows))


def _last(value: float) -> float:
    return float(np.nan_to_num(value, nan=np.inf))


def correlated(loading: dict[str, DeformationFit]) -> dict[str, float]:
    """The BIC of each law's fit to the same samples, where neighbours that are alike count as one."""
    samples = independent_samples([fit.noise for fit in loading.values()])
    return {law: criterion(fit.noise, len(fit.order), samples) for law, fit in loading.items()}


def _row(
    name: str, law: str | None, singles: list[SegmentedRecording], common: list[dict[str, DeformationFit]], progress
) -> ModelRow:
    fit = _identified(singles, name, law)
    watch = (lambda work: progress(work, f"leaving out, {name}")) if progress else iter
    cross_validation = cross_validate(singles, lambda others: _identified(others, name, law), watch)
    errors = cross_validation.prediction[:, 0][np.isfinite(cross_validation.prediction[:, 0])]
    ratios, replayed = (
        cross_validation.over_floor(each) for each in (cross_validation.prediction, cross_validation.replay)
    )
    row = ModelRow(
        name,
        np.nan,
        fit.quality.nrmse if fit.quality else np.nan,
        float(np.median(errors)) if len(errors) else np.nan,
        np.nan,
        _shared_parameters(fit) if law is None else len(CURVES[law].units) + 1,
        0,
        np.nan,
        cross_validation.refused,
        prediction=float(ratios[0]),
        replay=float(replayed[0]),
        by_stroke=tuple(float(ratio) for ratio in ratios[1:]),
        cross_validation=cross_validation,
    )
    row = row if law is None or not common else _with_loading_curve(row, law, common)
    if name in SAME_FORCE:
        said = f"At one speed it predicts what {SAME_FORCE[name]} does: a log cannot tell them apart."
        return replace(row, notes=(said, *row.notes))
    return row


def _with_loading_curve(row: ModelRow, law: str, common: list[dict[str, DeformationFit]]) -> ModelRow:
    return replace(
        row,
        bic=sum(loading[law].bic for loading in common),
        bic_correlated=sum(correlated(loading)[law] for loading in common),
        wins=sum(loading[law].bic <= min(each.bic for each in loading.values()) for loading in common),
        residual=float(np.median([loading[law].nrmse for loading in common])),
        notes=row.notes + tuple(dict.fromkeys(sentence for loading in common for sentence in loading[law].held)),
    )


def _identified(singles: list[SegmentedRecording], name: str, law: str | None) -> Fit:
    given = FitInputs(None, None, {})
    if law is not None:
        return assemble(given, singles, [], law, ())
    from .layered.identify import identify_layered

    return identify_layered(singles, name, given, None)


def _shared_parameters(fit: Fit) -> int:
    """How many parameters the repeats of a layered fit share; 0 for one without a model."""
    return getattr(fit.settings, "parameters", 0)
