# SPDX-License-Identifier: Apache-2.0
"""The model of a fit with the contact and the punctures of a recording, for a replay.

A fit has its contact at the origin of the loading curve, and a gradual rupture begins before the peak at which
segmentation has the puncture. Segmentation traces the contact back from where the force leaves the noise. So depths of
events are compared with those of the fit's own recordings, never with values of the fit: what lies between is common to
repeats. The force at a puncture is the recording's own: it shows how stiff the contact of that specimen is.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np

from .. import core
from ..models.model import Model
from ..recording import Recording
from ..segmentation import Event, Events, Puncture
from .diagnostics import is_saturated
from .estimates import Parameters
from .models import run_model, with_stiffer_contact
from .recording_fit import RecordingFit
from .statistics.noise import student_quantile

STIFFER = 1.05  # of a contact, to see its part in the force at a puncture
MIN_PART = 0.02  # of the force, which the contact must have to be its reason
MIN_TOP_M = 1e-6  # [m] of a layer below the rupture of the one above
TRACED = 0.25  # of the way back from where the force leaves the noise: there, the place of a rise is known best
"""Both ends err, in opposite directions: over powers from 1 to 2.5, noise and rates the scatter is least at 0.15 to
0.5, and a third of that of the traced contact."""


def replayed(
    model: Model, parameters: Parameters, recordings: Sequence[RecordingFit], events: Events, recording: Recording
) -> tuple[Model, float]:
    """The ``model`` of pooled ``parameters`` with the contact and the punctures of ``events``, found in ``recording``,
    and the depth [m] of its surface there; ``recordings`` are those of its fit.

    Onset and length of the first rupture change by the ratio of the indentations at the peaks: a power law then keeps
    its shape. A deeper layer that ruptures one after the other is moved as it is: an insertion shows where it ruptures,
    not where it begins. Then each contact is made as stiff as the force at its puncture states.
    """
    fitted = [each for each in recordings if each.parameters and each.events.contact is not None]
    contact, count = parameters["contact_depth"].value, len(model.layers)
    if events.contact is not None and fitted:
        contact = _surface(events, recording.depth, fitted)
    found = _indentations(events, contact, count)
    usual = [_indentations(each.events, each.surface, count) for each in fitted]
    mean = [float(np.mean(layer)) for layer in zip(*(each for each in usual if len(each) == count))]
    if not found or not mean:
        return model, contact
    model = _stretched(model, found[0] / mean[0])
    deeper, above = list(model.deeper), model.puncture.depth
    for k, layer in enumerate(deeper):
        moved = found[k + 1] - mean[k + 1] if k + 1 < len(found) else 0.0
        deeper[k] = dataclasses.replace(layer, top=max(layer.top + moved, above + MIN_TOP_M))
        above = deeper[k].top + layer.puncture.depth
    return _as_stiff(model.replace(deeper=tuple(deeper)), events, recording, contact), contact


def _as_stiff(model: Model, events: Events, recording: Recording, surface: float) -> Model:
    """The model with contacts that reach the forces of the punctures, along the motion of the recording."""
    begin = 0
    for layer, puncture in enumerate(punctures_of_layers(events, len(model.layers))):
        end, force = max(puncture.high, puncture.end) + 1, force_of_puncture(puncture, events)
        both = model, with_stiffer_contact(model, layer, STIFFER)
        times = times_as_stiff(force, *(float(run_model(each, recording, surface)[begin:end].max()) for each in both))
        model, begin = with_stiffer_contact(model, layer, times) if times > 0.0 else model, end
    return model


def times_as_stiff(force: float, reached: float, stiffer: float) -> float:
    """How many times as stiff a contact has a force [N], by those reached with it and with one ``STIFFER`` times as
    stiff; NaN where it has no part in them, or the force is not known."""
    part = (stiffer - reached) / (STIFFER - 1.0)
    return 1.0 + (force - reached) / part if part > MIN_PART * abs(reached) else np.nan


def force_of_puncture(puncture: Puncture, events: Events) -> float:
    """Force [N] at the peak of a puncture above the free travel; NaN without one, and where the sensor is saturated."""
    if events.baseline is None or is_saturated(events):
        return np.nan
    return puncture.force - events.baseline


def punctures_of_layers(events: Events, count: int) -> list[Puncture]:
    """The punctures of so many layers, in order of time: the first of one layer, otherwise those with the largest
    drops."""
    if count == 1:
        return list(events.punctures[:1])
    return sorted(sorted(events.punctures, key=lambda each: -each.drop)[:count], key=lambda each: each.time)


def _surface(events: Events, depth: np.ndarray, fitted: Sequence[RecordingFit]) -> float:
    """Where a fit would have the surface [m]: that of its own recording; otherwise by its rise, or between that and
    the mean surface by their variances over the recordings of the fit. Farther from these than chance allows, it is
    another zero of the depth, and the rise alone counts."""
    for each in fitted:
        if each.events.contact == events.contact:
            return each.surface
    surfaces = np.array([each.surface for each in fitted])
    distances = surfaces - [_rise(each.events.contact, each.recording.depth) for each in fitted]
    by_rise, count = _rise(events.contact, depth) + float(distances.mean()), len(fitted)
    if count == 1:
        return by_rise
    between, error = float(surfaces.var(ddof=1)), float(distances.var(ddof=1))
    away = by_rise - float(surfaces.mean())
    if away**2 > student_quantile(count - 1) ** 2 * (1.0 + 1.0 / count) * (between + error):
        return by_rise
    return float(surfaces.mean()) + away * between / max(between + error, 1e-30)


def _rise(contact: Event, depth: np.ndarray) -> float:
    """The depth [m] at which a rise of the force is known best."""
    return TRACED * contact.depth + (1.0 - TRACED) * float(depth[contact.high])


def _indentations(events: Events, surface: float, count: int) -> list[float]:
    """Depths [m] below a surface at the punctures of so many layers."""
    return [max(each.depth - surface, 0.0) for each in punctures_of_layers(events, count)]


def _stretched(model: Model, ratio: float) -> Model:
    """The model whose first layer ruptures at so many times the indentation."""
    friction = model.friction
    if isinstance(friction, core.laws.YieldingCoulomb):
        friction = friction.replace(rupture_length=ratio * friction.rupture_length)
    return model.replace(puncture=core.laws.PunctureDepth(ratio * model.puncture.depth), friction=friction)
