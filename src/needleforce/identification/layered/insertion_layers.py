# SPDX-License-Identifier: Apache-2.0
"""Identification of layers that rupture one after another, from insertions without a withdrawal."""

import statistics
from dataclasses import replace

import numpy as np

from ...errors import InputError
from ...models.parameter_units import unit_of
from ..diagnostics import (
    NO_MODEL,
    FitInputs,
    is_saturated,
    misfit_warning,
    pooled_quality,
    quality,
    reference_of,
    settings_of,
    unfitted,
    warnings_of,
)
from ..estimates import Estimate, is_meaningful, pool
from ..models import GRADUAL_LAYERS, run_model
from ..one_layer.segmented_recording import SegmentedRecording
from ..recording_fit import RecordingFit
from ..result import Fit
from .insertion_fit import InsertionFit, InsertionFits
from .insertion_problem import MAX_LAYERS, stacked
from .parameters import prefix

MAX_PEAK_ERROR = 0.05  # [of a measured peak] a larger error of the model is noted
ONLY_SUM = ("friction_per_length", "cutting_force")
NAME = f"identified_{GRADUAL_LAYERS}"
SOURCE = "fit of the layers to the insertion"
HELD = (
    "contacts: a cone or cone + cylinder in each layer, which begins where the one before has ruptured; intervals hold "
    "the values with power laws too",
    "forces at the tip: the contact of the next layer replaces the cutting force of the last, as soon as it is more",
)
UNKNOWN = (
    "Friction and cutting force of each layer separately: an insertion shows their sum behind a rupture, a withdrawal "
    "the friction alone.",
    "Where a deeper layer begins, closer than its interval: its contact shows only above the cutting force before it.",
    "Relaxation, dependence on speed, and tissue that the shaft drags along: these insertions do not show them.",
)


def identify_insertion_layers(
    singles: list[SegmentedRecording], given: FitInputs, layers: int | None, fits: InsertionFits | None = None
) -> Fit:
    """The fit of ``layers`` that rupture one after another, by default as many as most recordings have punctures and
    all together need. A recording with fewer keeps its status and a note. Calls with the same recordings may share
    ``fits``."""
    fits = InsertionFits() if fits is None else fits
    counts = sorted(len(each.events.punctures) for each in singles if each.events.punctures)
    if layers is None and counts:
        layers = fits.needed_layers(singles, min(statistics.mode(counts), MAX_LAYERS))
    own = {single: _fitted(single, layers, fits) for single in singles}
    recordings = tuple(_recording(single, found, given) for single, found in own.items())
    parameters = pool([each.parameters for each in recordings if each.parameters])
    model, trouble = None, ()
    if parameters and layers is not None:
        try:
            rows = [_values(parameters, k) for k in range(layers)]
            model = stacked(rows, needle=given.needle, name=NAME, reference=reference_of(singles))
        except InputError as error:
            trouble = (NO_MODEL.format(error),)
    residual = pooled_quality(recordings)
    return Fit(
        recordings=recordings,
        parameters=parameters,
        identified_model=model,
        quality=residual,
        warnings=(*misfit_warning(residual), *warnings_of(singles, model), *trouble),
        held_fixed=HELD,
        unknown=UNKNOWN,
        settings=settings_of("cone_cylinder", given.needle, singles),
    )


def _fitted(single: SegmentedRecording, layers: int | None, fits: InsertionFits) -> InsertionFit | InputError:
    """The layers of one recording, or the reason why it has none."""
    if single.events.contact is None or layers is None:
        return InputError("number of punctures", 0, "the model gradual_layers needs one in each layer")
    try:
        return fits.fit(single, layers)
    except InputError as error:
        return error


def _values(parameters: dict[str, Estimate], layer: int) -> dict[str, float]:
    """The values of one layer by their names without its prefix."""
    start = prefix(layer)
    own = {name.removeprefix(start): each.value for name, each in parameters.items() if name.startswith(start)}
    return {"top": 0.0} | own


def _recording(single: SegmentedRecording, found: InsertionFit | InputError, given: FitInputs) -> RecordingFit:
    """The result of one recording with its own model along its own motion."""
    base = replace(unfitted(single), strokes=single.strokes)
    if isinstance(found, InputError):
        return replace(base, notes=(str(found), *base.notes))
    own = {name: _estimate(name, found) for name in found.values}
    rows = [_values(own, layer) for layer in range(found.layers)]
    try:
        model = stacked(rows, needle=given.needle)
    except InputError as error:
        return replace(base, parameters=own, notes=(*base.notes, NO_MODEL.format(error)))
    predicted = run_model(model, single.recording, own["contact_depth"].value, single.depth)
    predicted += own["force_offset"].value + single.drift.at(single.recording)
    inside = single.strokes.mask(len(predicted))
    residual = quality(single.recording.force[inside], predicted[inside])
    return replace(
        base,
        parameters=own,
        layers=found,
        predicted=predicted,
        quality=residual,
        notes=(*base.notes, *_missed(found, predicted, single)),
    )


def _missed(found: InsertionFit, predicted: np.ndarray, single: SegmentedRecording) -> list[str]:
    """A sentence for each layer whose peak the model misses by more than 5 % and the noise, if the sensor shows it."""
    if is_saturated(single.events):
        return []
    force, problem = single.recording.force, found.problem
    notes = []
    for part, peak in zip(problem.parts, problem.peaks):
        samples = problem.samples[part]
        modelled, measured = (float(each[samples].max()) - problem.zero for each in (predicted, force))
        if abs(modelled - measured) > max(MAX_PEAK_ERROR * measured, 4.0 * single.events.noise):
            notes.append(
                f"The model has {modelled:.3g} N for the measured peak of {measured:.3g} N at "
                f"{1e3 * problem.depth[peak]:.4g} mm: its law of the contact or of the rupture is another."
            )
    return notes


def _estimate(name: str, found: InsertionFit) -> Estimate:
    low, high = found.low[name], found.high[name]
    plain = name.split("layer_")[-1].lstrip("0123456789_")
    start = name.removesuffix(plain)
    scales = {
        "force": found.values[f"{start}puncture_force"],
        "depth": found.values[f"{start}puncture_indentation"],
    }
    known = plain not in ONLY_SUM and is_meaningful(plain, low, high, **scales)
    limits = found.values[name], unit_of(name), low, high
    return Estimate(name, *limits, identifiable=known, source=SOURCE, systematic=found.systematic(name))
