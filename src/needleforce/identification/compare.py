# SPDX-License-Identifier: Apache-2.0
"""Comparison of models on the same recordings."""

import os
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ..core import Needle
from ..errors import InputError
from ..models.model import Model
from ..preset_files import model_name, needle_of
from ..recording.source import RecordingSource
from .comparison import Comparison, ModelRow
from .cross_validation import cross_validate
from .diagnostics import FitInputs
from .identify import Progress, assemble
from .models import COMPARED, GRADUAL_LAYERS, IDENTIFIED, OF_LAYERS, SAME_FORCE, needle_saturation, stiffness_law
from .one_layer.deformation_fit import DeformationFit
from .one_layer.fit_recording import fitted
from .one_layer.loading_curves import FITS
from .one_layer.machine_stiffness import at_tip
from .one_layer.segmented_recording import SegmentedRecording, segmented
from .one_layer.staged_fit import forms_after_puncture
from .repeats import differing_repeats, paired
from .result import Fit
from .statistics.regression import criterion, independent_samples


def compare(
    recordings: RecordingSource,
    models: Sequence[str] = COMPARED,
    progress: Progress | None = None,
    *,
    needle: Needle | Model | str | os.PathLike | None = None,
    machine_stiffness: float | None = None,
) -> Comparison:
    """Fit each named model to every recording, and predict each repeat from the others.

    Models that predict held-out repeats as well as the best come first, in the order of the BIC of their loading
    curves, then the others by their prediction; with fewer than three repeats only the BIC ranks. Each repeat is
    predicted by a fit to the others, without a warm start.

    Parameters
    ----------
    recordings : sequence of recordings
        Repeats of one condition: recordings, files, DataFrames or arrays, as in ``identify``.
    models : sequence of str or Model
        Names, presets, files or models, as in ``identify``.
    progress : callable, optional
        ``progress(iterable, text)`` wraps the work.
    needle : Needle, Model, preset, preset file, JSON of a fit or needle file, optional
        As in ``identify``: with tip and radius the depth of the tip's cone is held fixed.
    machine_stiffness : float, optional
        Stiffness [N/m] of sensor, holder and drive in series, as in ``identify``: the depths are then those of the tip.

    Returns
    -------
    Comparison
        A row for each model, the best first.

    Raises
    ------
    InputError
        For an unknown model, no model, no recording, a file given twice, and a machine stiffness that leaves no travel
        to the tissue.
    """
    if not models:
        step = f"Give some of {', '.join(IDENTIFIED)}."
        raise InputError("number of models", 0, "at least 1 is needed", next_step=step)
    models = [model_name(each, (*IDENTIFIED, *SAME_FORCE)) for each in models]
    laws = {name: None if name in OF_LAYERS else stiffness_law(SAME_FORCE.get(name, name)) for name in models}
    different = tuple(dict.fromkeys(law for law in laws.values() if law is not None))
    recordings, _ = paired(recordings, ())
    recordings = recordings if machine_stiffness is None else [at_tip(each, machine_stiffness) for each in recordings]
    body = None if needle is None else needle_of(needle)
    given = FitInputs(body, needle_saturation(body), {})
    watched = progress(recordings, "comparing") if progress else recordings
    singles = [fitted(segmented(each), different, given.saturation) for each in watched]
    answering = {law for single in singles for law in single.fits}
    common = [single for single in singles if answering and answering <= set(single.fits)]
    grown: dict = {}
    rows = [_row(name, law, singles, common, given, progress=progress, grown=grown) for name, law in laws.items()]
    best, *others = _ranked(rows)
    return Comparison((replace(best, notes=(*differing_repeats(singles), *best.notes)), *others))


def _ranked(rows: list[ModelRow]) -> Comparison:
    """Best first: those that predict held-out repeats as well as the best, by the BIC of their loading curve; then the
    others by their prediction."""
    best = min(rows, key=lambda row: _last(row.prediction)).cross_validation
    tied = [bool(np.isfinite(row.prediction)) and not row.cross_validation.distinguishes(best) for row in rows]

    def place(k: int) -> tuple:
        row = rows[k]
        return not tied[k], _last(row.evidence) if tied[k] else 0.0, _last(row.prediction), _last(row.evidence)

    order = sorted(range(len(rows)), key=place)
    return Comparison(replace(rows[k], ties=bool(n > 0 and tied[k])) for n, k in enumerate(order))


def _last(value: float) -> float:
    return float(np.nan_to_num(value, nan=np.inf))


def correlated(loading: dict[str, DeformationFit]) -> dict[str, float]:
    """The BIC of each law's fit to the same samples, where correlated samples count as one."""
    samples = independent_samples([fit.noise for fit in loading.values()])
    return {law: criterion(fit.noise.mean_square, len(fit.order), samples) for law, fit in loading.items()}


def _row(
    name: str,
    law: str | None,
    singles: list[SegmentedRecording],
    common: list[SegmentedRecording],
    given: FitInputs,
    progress: Progress | None,
    grown: dict,
) -> ModelRow:
    identified = partial(_identified, name=name, law=law, given=given, grown=grown)
    fit = identified(singles, progress=progress)
    watch = (lambda work: progress(work, f"leaving out, {name}")) if progress else iter
    held_out = cross_validate(singles, identified, watch)
    errors = held_out.prediction[:, 0][np.isfinite(held_out.prediction[:, 0])]
    ratios, replayed = (held_out.over_floor(each) for each in (held_out.prediction, held_out.replay))
    row = ModelRow(
        model=name,
        nrmse=fit.quality.nrmse if fit.quality else np.nan,
        left_out=float(np.median(errors)) if len(errors) else np.nan,
        parameters=_shared_parameters(fit) if law is None else len(FITS[law].parameters) + 1 + 2 * _bends(law),
        notes=(*_why_none(fit), *held_out.refused),
        prediction=float(ratios[0]),
        replay=float(replayed[0]),
        by_stroke=tuple(float(ratio) for ratio in ratios[1:]),
        cross_validation=held_out,
    )
    row = _with_loading_curve(row, law, common) if common and law in common[0].fits else row
    if name in SAME_FORCE:
        same = f"At one speed it predicts the same force as {SAME_FORCE[name]}: a recording does not distinguish them."
        return replace(row, notes=(same, *row.notes))
    return row


def _why_none(fit: Fit) -> tuple[str, ...]:
    """Why recordings have no model."""
    reasons = dict.fromkeys(each.notes[0] for each in fit.recordings if each.notes)
    return tuple(reasons) if fit.identified_model is None else ()


def _with_loading_curve(row: ModelRow, law: str, common: list[SegmentedRecording]) -> ModelRow:
    loadings = [single.loading for single in common]
    return replace(
        row,
        bic=sum(loading[law].bic for loading in loadings),
        bic_correlated=sum(correlated(loading)[law] for loading in loadings),
        friction_bic=sum(_friction_bic(single, FITS[law].foundation) for single in common),
        wins=sum(loading[law].bic <= min(each.bic for each in loading.values()) for loading in loadings),
        residual=float(np.median([loading[law].nrmse for loading in loadings])),
        notes=row.notes + tuple(dict.fromkeys(sentence for loading in loadings for sentence in loading[law].held)),
    )


def _bends(law: str) -> bool:
    """Whether a nonlinear foundation adds its two parameters."""
    return FITS[law].foundation != "linear"


def _friction_bic(single: SegmentedRecording, foundation: str) -> float:
    """Schwarz's criterion of the friction of one recording under a form of the foundation; NaN with too few bins."""
    fit = single.fits[min(single.loading, key=lambda law: single.loading[law].bic)]
    after = fit.puncture.before + fit.puncture.left_out
    contact, zero = fit.values["contact_depth"], fit.values["force_offset"]
    found = forms_after_puncture(single.strokes, contact, after, zero, (foundation,))
    return found[0].bic if found else np.nan


def _identified(
    singles: list[SegmentedRecording],
    name: str,
    law: str | None,
    given: FitInputs,
    grown: dict,
    progress: Progress | None = None,
) -> Fit:
    """The fit of one model. The layered ones share ``grown``, the search in the form from which all of them start, and
    what was fitted to each insertion."""
    if law is not None:
        return assemble(given, singles, [], law, ())
    if name == GRADUAL_LAYERS:
        from .layered.insertion_fit import InsertionFits
        from .layered.insertion_layers import identify_insertion_layers

        return identify_insertion_layers(singles, given, None, grown.setdefault(GRADUAL_LAYERS, InsertionFits()))
    from .layered.identify import identify_layered

    return identify_layered(singles, name, given, None, progress=progress, grown=grown)


def _shared_parameters(fit: Fit) -> int:
    """How many parameters the repeats of a layered fit share, or each insertion alone has; 0 without a model."""
    if fit.identified_model is None:
        return 0
    from .layered.insertion_problem import SIZE

    return getattr(fit.settings, "parameters", SIZE * len(fit.model.layers) + 1)
