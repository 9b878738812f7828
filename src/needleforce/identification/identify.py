# SPDX-License-Identifier: Apache-2.0
"""Identification of a model from recordings."""

import dataclasses
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from ..core import Needle
from ..errors import InputError
from ..models.model import Model
from ..preset_files import model_name, needle_of
from ..recording.source import RecordingSource
from .diagnostics import (
    NO_MODEL,
    FitInputs,
    held_fixed,
    misfit_warning,
    modulus_note,
    not_narrowed,
    pooled_quality,
    recording_fit,
    reference_of,
    settings_of,
    unknown,
    warnings_of,
)
from .estimates import Estimate, identified_together, not_identifiable, pool
from .model_choice import (
    choice_of,
    cycle_evidence,
    falls_gradually,
    goes_in_only,
    held_by_tissue,
    match_of,
    meets_puncture,
    misses_cycle,
    offered,
    peak_of,
    supported,
    with_one_layer_parameters,
)
from .models import (
    COMPARED,
    GRADUAL,
    GRADUAL_LAYERS,
    IDENTIFIED,
    MECHANICAL,
    OF_LAYERS,
    derived,
    model_called,
    model_of,
    needle_saturation,
    stiffness_law,
)
from .one_layer.contact_laws import over_laws
from .one_layer.cycle_values import estimates_of
from .one_layer.fit_recording import fitted, limited
from .one_layer.loading_curves import FITS
from .one_layer.machine_stiffness import at_tip, behind, machine_stiffness_of, with_machine
from .one_layer.model_errors import with_misfit_below, with_shared_readings
from .one_layer.puncture_force import puncture_match
from .one_layer.segmented_recording import SegmentedRecording, segmented
from .repeats import paired
from .result import Fit, with_not_identifiable
from .strokes import presliding_of

Progress = Callable[[Any, str], Any]
MISSES_PUNCTURE = (
    "No model: none of the laws meets the measured force at the puncture within 5 % or its noise, {law} has the lowest "
    "BIC. Give a model by name to see it as it stands."
)
DEFAULT_LAYERED = "layered_yielding"
LAYERED_BY_DEFAULT = (
    "The model is layered_yielding: no model of one layer describes these recordings up to their puncture. Give "
    "model='cone_cylinder' for one layer as it stands."
)
LAYERED_WITHOUT_PUNCTURE = (
    "The model is layered_yielding: the recordings lack a puncture, a fall of the force beyond noise and texture, "
    "which a model of one layer needs, but the tissue holds the needle in the withdrawal. Rupture depths are by the "
    "whole cycle and its law: they are not identified, nor what is behind them."
)
LAYERS_BY_PUNCTURES = (
    f"The model is {GRADUAL_LAYERS}: there is more than one puncture and no withdrawal, and no model of one layer "
    "describes these recordings up to the first. Give model='cone_cylinder' for one layer as it stands."
)


def identify(
    recordings: RecordingSource,
    *,
    second_pass: RecordingSource = (),
    model: Model | str | None = None,
    needle: Needle | Model | str | None = None,
    bending: str | Path | None = None,
    tension: str | Path | None = None,
    layers: int | None = None,
    tissue_stiffness: Sequence[tuple[float, float] | None] | None = None,
    machine_stiffness: float | None = None,
    progress: Progress | None = None,
) -> Fit:
    """Identify one condition from one recording or from several repeats of it, without starting values.

    A recording that cannot be identified keeps its status and a note; the others are still identified.

    Parameters
    ----------
    recordings : Recording or sequence of Recording
        Repeats of one condition.
    second_pass : Recording or sequence of Recording, optional
        The second insertion at each site, in the order of ``recordings``, None for a site without one. The friction
        then comes from the second pass and the cutting force from the subtraction.
    model : str, optional
        A name in ``IDENTIFIED``: of one layer; ``layered`` or ``layered_yielding`` (both passive) or
        ``layered_as_fitted``, which are fitted to complete cycles; or ``gradual_layers``, to insertions alone. Or a fit
        or preset with such a model.
        Default: ``paper`` or ``cone_cylinder``, whichever has the lower BIC of the loading curves; another law where
        neither meets the puncture or the noise. ``layered_yielding`` with a withdrawal if no law of one layer meets the
        puncture, if there is no puncture but the tissue holds the needle in the withdrawal, or if one layer leaves more
        than 5 % of the peak over insertion, hold and withdrawal, more than the noise without the hold, and the evidence
        for layers is very strong (a difference of BIC of 10); ``gradual_layers`` on such evidence without a withdrawal,
        with two punctures or more.
        The choice is in ``choice`` and ``warnings``.
    needle : Needle or Model, optional
        Needle with its tip, or a model that has one; needed for a modulus.
    bending : str or path-like, optional
        CSV table of the bending test of the needle, which gives its Young modulus; needs ``needle``.
    tension : str or path-like, optional
        CSV table of the tension test of the tissue, which gives its Young modulus.
    layers : int, optional
        Number of layers of a layered model, 1 to 3, or of ``gradual_layers``. Default: what the recordings support.
    tissue_stiffness : sequence, optional
        What is known beforehand of the stiffness of dragged tissue in each layer, from the surface down: its value
        [N/m] and its relative error, the standard deviation of its logarithm; None for a layer of which nothing is
        known. Needs a layered model and ``layers``.
    machine_stiffness : float, optional
        Stiffness [N/m] of what is between the recorded depth and the needle: sensor, holder and drive in series. The
        depth is then that of the tip. Default: none, unless the recordings show one; then it is a parameter.
    progress : callable, optional
        ``progress(iterable, text)`` wraps the work over recordings.

    Returns
    -------
    Fit
        A ``LayeredFit`` for a layered model.

    Raises
    ------
    InputError
        For an unknown model, no recording, a file given twice, second passes that do not pair with the recordings, a
        bending test without a needle, stiffnesses that are not those of the layers, or a machine stiffness that leaves
        no travel to the tissue.

    Notes
    -----
    One-layer fits, two-pass subtraction and bench tests follow the paper, secs. 2.2 and 2.3.
    """
    recordings, seconds = paired(recordings, second_pass)
    if machine_stiffness is not None:
        recordings, seconds = _at_tip(recordings, machine_stiffness), _at_tip(seconds, machine_stiffness)
    needle = None if needle is None else needle_of(needle)
    model = None if model is None else model_name(model, IDENTIFIED)
    bench: dict[str, Estimate] = {}
    if bending is not None or tension is not None:
        from ..bench_tests.reading import bench_estimates

        bench = bench_estimates(bending, tension, needle)
    if "needle_young_modulus" in bench:
        needle = needle.replace(young_modulus=bench["needle_young_modulus"].value)
    if model in OF_LAYERS:
        given = FitInputs(needle, None, bench, _known(tissue_stiffness, layers))
        fit = _layered(recordings, seconds, model, given, layers=layers, progress=progress)
        return with_machine(fit, machine_stiffness)
    if tissue_stiffness is not None:
        step = "Give model='layered' and layers, or leave it out."
        raise InputError("tissue_stiffness", "given", f"the model {model or 'paper'} has no layers", next_step=step)
    if layers not in (None, 1):
        step = "Give model='layered' or leave layers out."
        raise InputError("layers", layers, f"the model {model or 'paper'} has one layer", next_step=step)
    laws = tuple(stiffness_law(name) for name in (MECHANICAL if model is None else (model,)))
    saturation = needle_saturation(needle)
    watched = progress(recordings, "identifying") if progress else recordings
    singles = [fitted(segmented(each), laws, saturation) for each in watched]
    machine = machine_stiffness_of(singles) if machine_stiffness is None else machine_stiffness
    if isinstance(machine, Estimate):
        singles = [fitted(behind(each, machine), laws, saturation) for each in singles]
        seconds = _at_tip(seconds, machine.value) if machine.identifiable else seconds
    preferred = laws
    if model is None:
        singles, laws = _further_laws(singles, laws, saturation)
    choice = choice_of(singles, laws, preferred)
    law = choice[0].name if choice else laws[0]
    if model is None:
        singles = [over_laws(each, law) for each in singles]
    singles = [with_misfit_below(each, law) for each in singles]
    fit = assemble(FitInputs(needle, saturation, bench), singles, seconds, law, choice)
    if model is not None or seconds or layers is not None or not singles:
        return with_machine(fit, machine)
    return with_machine(_with_layers(fit, law, singles, FitInputs(needle, None, bench), progress), machine)


def _at_tip(recordings: list, stiffness: float) -> list:
    """The recordings, None for a missing one, with the depth of the tip."""
    return [None if each is None else at_tip(each, stiffness) for each in recordings]


def _further_laws(
    singles: list[SegmentedRecording], laws: tuple[str, ...], saturation: float | None
) -> tuple[list[SegmentedRecording], tuple[str, ...]]:
    """The recordings fitted with further laws where the first ``laws`` are not supported, and the laws to choose from.

    A gradual rupture is tried where the falls are gradual too, and where it is found, the laws with a sharp rupture are
    ruled out.
    """
    supports, gradually = supported(singles, laws), falls_gradually(singles)
    tried = GRADUAL if gradually else () if supports else GRADUAL[:1]
    singles = [fitted(each, tried, saturation) for each in singles]
    if tried and offered(singles, tried):
        singles = [fitted(each, GRADUAL[len(tried) :], saturation) for each in singles]
        laws = offered(singles, (*laws, *GRADUAL))
    if not supports and not any(law in GRADUAL and meets_puncture(singles, law) for law in laws):
        more = tuple(stiffness_law(name) for name in COMPARED if name not in MECHANICAL)
        singles, laws = [fitted(each, more, saturation) for each in singles], (*laws, *more)
    return singles, laws


def _with_layers(
    fit: Fit, law: str, singles: list[SegmentedRecording], given: FitInputs, progress: Progress | None
) -> Fit:
    """The one-layer fit, or one with layers where complete cycles, or insertions alone with several punctures, support
    it."""
    if goes_in_only(singles):
        return _with_insertion_layers(fit, law, singles, given)
    punctured = any(single.fits for single in singles)
    if not any(len(single.strokes.depth_out) if punctured else held_by_tissue(single) for single in singles):
        return fit
    if fit.identified_model is not None and not misses_cycle(fit, singles):
        return fit
    from .layered.identify import identify_layered

    layered = identify_layered(singles, DEFAULT_LAYERED, given, None, progress)
    if layered.identified_model is None:
        return fit
    layered = with_one_layer_parameters(layered, fit)
    found = any(single.events.punctures for single in singles)  # of a recording that has no fit, too
    reason = LAYERED_BY_DEFAULT if found else LAYERED_WITHOUT_PUNCTURE
    chosen = _better(fit, layered, singles, (law, DEFAULT_LAYERED), reason, shared=len(layered.parameters))
    return _compared(chosen, fit, singles) if fit.identified_model and chosen.model is layered.model else chosen


def _with_insertion_layers(fit: Fit, law: str, singles: list[SegmentedRecording], given: FitInputs) -> Fit:
    """The one-layer fit of insertions alone, or that of their layers."""
    from .layered.insertion_layers import identify_insertion_layers

    layered = identify_insertion_layers(singles, given, None)
    if layered.identified_model is None or len(layered.model.layers) == 1:
        return fit
    return _better(fit, layered, singles, (law, GRADUAL_LAYERS), LAYERS_BY_PUNCTURES, span="the insertion")


def _better(fit: Fit, layered: Fit, singles: list, names: tuple, no_model: str, shared: int = 0, **span: str) -> Fit:
    """The layered fit for the reason that one layer has ``no_model``, or the better of the two with the evidence."""
    evidence = cycle_evidence(fit, layered, singles, shared) if fit.identified_model else None
    if fit.identified_model and evidence is None:
        return fit
    chosen = layered if evidence is None or evidence.for_layers else fit
    reason = no_model if evidence is None else evidence.sentence(model_called(names[0]), names[1], **span)
    return dataclasses.replace(chosen, warnings=(reason, *chosen.warnings))


def _known(given: Sequence | None, layers: int | None) -> tuple:
    """The stiffnesses of layers that are known beforehand."""
    if given is None:
        return ()
    from .layered.known_stiffness import known_stiffnesses

    return known_stiffnesses(given, layers)


def _layered(
    recordings: list, seconds: list, model: str, given: FitInputs, layers: int | None, progress: Progress | None
) -> Fit:
    """The fit of a layered model; its module is imported here because other fits do not need it."""
    from .layered.identify import MAX_LAYERS, identify_layered

    if seconds:
        step = "Leave out model, to get friction and cutting force from the second passes, or leave out second_pass."
        raise InputError("number of second passes", len(seconds), f"the model {model} does not use them", "", step)
    if layers is not None and layers not in range(1, MAX_LAYERS + 1):
        raise InputError("layers", layers, f"it must be a whole number from 1 to {MAX_LAYERS}")
    if model == GRADUAL_LAYERS and given.stiffness:
        raise InputError("tissue_stiffness", "given", f"no tissue is dragged in the model {model}")
    watched = progress(recordings, "segmenting") if progress else recordings
    singles = [segmented(each) for each in watched]
    if model == GRADUAL_LAYERS:
        from .layered.insertion_layers import identify_insertion_layers

        return identify_insertion_layers(singles, given, layers)
    fit = identify_layered(singles, model, given, layers, progress)
    return _compared(fit, identify(recordings, needle=given.needle, layers=1), singles)


def _compared(fit: Fit, one: Fit, singles: list[SegmentedRecording]) -> Fit:
    """A layered fit with a sentence on what one layer leaves of the same strokes; where that is as little, it comes
    first, and no parameter of a deeper layer is identifiable."""
    from .layered.model_selection import stroke_evidence

    if fit.identified_model is None or not one.choice:
        return fit
    if (evidence := stroke_evidence(one, fit, fit.held_out, singles)) is None:
        return fit
    sentence = evidence.sentence(model_called(one.choice[0].name), fit.settings.layers)
    if evidence.for_layers:
        return dataclasses.replace(fit, warnings=(*fit.warnings, sentence))
    fit = dataclasses.replace(fit, warnings=(sentence, *fit.warnings))
    return with_not_identifiable(fit, [name for name in fit.parameters if name.startswith("layer_")])


def assemble(given: FitInputs, singles: list[SegmentedRecording], seconds: list, law: str, choice: tuple) -> Fit:
    """The fit of one law from recordings that were segmented and fitted one by one."""
    answering = [single for single in singles if law in single.fits]
    for single in answering:
        single.fits[law] = limited(single, law)
    own = {single: _own(single, law, given) for single in answering}
    parameters = with_shared_readings(pool(list(own.values())), [single.fits[law] for single in answering])
    two_pass, replaced, refused = None, {}, {}
    if seconds:
        from .two_pass.subtraction import two_pass_estimates

        two_pass, replaced, refused = two_pass_estimates(singles, seconds, own, given, FITS[law].foundation)
    parameters |= replaced
    if parameters:
        parameters |= derived(parameters, given.needle, given.bench.get("tissue_young_modulus")) | given.bench
    model, trouble = _model(parameters, law, given.needle, singles)
    if len(choice) > 1 and model is not None and not meets_puncture(singles, law):
        model, trouble = None, (MISSES_PUNCTURE.format(law=FITS[law].law.name),)
    fits = tuple(
        recording_fit(_with_puncture_note(s, law), own.get(s, {}), law, given.needle, refused.get(s, ""))
        for s in singles
    )
    residual, modulus = pooled_quality(fits), modulus_note(given.needle, law, parameters)
    return Fit(
        recordings=fits,
        parameters=parameters,
        identified_model=model,
        quality=residual,
        warnings=(*misfit_warning(residual), *warnings_of(singles, model, law), *trouble, *modulus),
        held_fixed=held_fixed(given, law, parameters),
        unknown=unknown(given, law, two_pass is not None) + not_narrowed(parameters, fits) + identified_together(fits),
        choice=choice,
        settings=settings_of(law, given.needle, singles),
        two_pass=two_pass,
    )


def _own(single: SegmentedRecording, law: str, given: FitInputs) -> dict[str, Estimate]:
    """The estimates of one recording: the puncture force is the measured one; a given saturation depth, and a law that
    misses the puncture, are marked as not identified."""
    fit, strokes, peak = single.fits[law], single.strokes, peak_of(single, law)
    found = estimates_of(fit, len(strokes.depth_out) > 0)
    match = puncture_match(fit, peak)
    if match is not None and not match.met:
        found = not_identifiable(found, FITS[law].parameters)
    found |= {} if peak is None else {"puncture_force": peak.estimate(fit)}
    found |= {} if strokes.friction_reversal is None else {"presliding": presliding_of(strokes.friction_reversal)}
    if "saturation_depth" in found and given.saturation is not None:
        held = "held fixed: from the needle's tip and radius"
        found["saturation_depth"] = dataclasses.replace(found["saturation_depth"], identifiable=False, source=held)
    return found


def _with_puncture_note(single: SegmentedRecording, law: str) -> SegmentedRecording:
    """The recording with a note if the law misses its puncture."""
    match = match_of(single, law)
    sentence = "" if match is None else match.sentence(FITS[law].law.name)
    return dataclasses.replace(single, notes=(*single.notes, sentence)) if sentence else single


def _model(
    parameters: dict, law: str, needle: Needle | None, singles: list[SegmentedRecording]
) -> tuple[Model | None, tuple[str, ...]]:
    """The pooled model, or None and the reason."""
    if not parameters:
        return None, ()
    values = {name: estimate.value for name, estimate in parameters.items()}
    try:
        return model_of(values, law, needle, f"identified_{law}", reference_of(singles)), ()
    except InputError as error:
        return None, (NO_MODEL.format(error),)
