# SPDX-License-Identifier: Apache-2.0
"""The model of a fit with the contact and the punctures of a recording, for a replay.

A fit has its contact at the origin of the loading curve, and a gradual rupture begins before the peak at which
segmentation has the puncture. Segmentation traces the contact back from where the force leaves the noise. So events are
compared with those of the fit's own recordings, never with values of the fit: what lies between is common to repeats.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np

from .. import core
from ..models.model import Model
from ..segmentation import Event, Events, Puncture
from .estimates import Parameters
from .recording_fit import RecordingFit
from .statistics.noise import student_quantile

MIN_TOP_M = 1e-6  # [m] of a layer below the rupture of the one above
TRACED = 0.25  # of the way back from where the force leaves the noise: there, the place of a rise is known best
"""Both ends err, in opposite directions: over powers from 1 to 2.5, noise and rates the scatter is least at 0.15 to
0.5, and a third of that of the traced contact."""


def replayed(
    model: Model, parameters: Parameters, recordings: Sequence[RecordingFit], events: Events, depth: np.ndarray
) -> tuple[Model, float]:
    """The ``model`` of pooled ``parameters`` with the contact and the punctures of ``events``, found along ``depth``
    (n,) [m], and the depth [m] of its surface there; ``recordings`` are those of its fit.

    The tissue is the same, so that an earlier peak has a smaller force: the law of the contact stays, and onset and
    length of the first rupture change by the ratio of the indentations at the peaks. A power law then keeps its shape.
    A deeper layer that ruptures one after the other is moved as it is: an insertion shows where it ruptures, not where
    it begins.
    """
    fitted = [each for each in recordings if each.parameters and each.events.contact is not None]
    contact, count = parameters["contact_depth"].value, len(model.layers)
    if events.contact is not None and fitted:
        contact = _surface(events, depth, fitted)
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
    return model.replace(deeper=tuple(deeper)), contact


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
