# SPDX-License-Identifier: Apache-2.0
"""The model of a fit with the contact and the punctures of a recording, for a replay.

Segmentation has the contact where the force leaves the noise, and a puncture at the force peak. A fit has its contact
at the origin of the loading curve, and a gradual rupture begins before the peak. So an event is moved by the distance
that the recordings of the fit have between the two, and onset and length of a gradual rupture are stretched by one
ratio until the peak of the model is that of the event: a power law then keeps its shape.
"""

import dataclasses
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from .. import core
from ..models.model import Insertion, Model
from ..segmentation import Events, Puncture
from .estimates import Parameters
from .layered.parameters import prefix
from .models import with_ruptures
from .recording_fit import RecordingFit

PEAK_LENGTHS = 3.0  # [rupture lengths] after the onset: of the contact 5 % are left, or 0.01 % with an exponent of 2
PEAK_GRID = 500  # depths at which the peak of the model is searched
MAX_STEPS = 6  # of the ratio
MIN_RATIO, MAX_RATIO = 0.5, 2.0  # beyond, it is not the rupture of the fit
MIN_LEFT = 0.5  # [of the contact] carried at the onset by what is to rupture; where the fit has less, no less than that
MIN_TOP_M = 1e-6  # [m] of a layer below the rupture of the one above
STEP_S = 1e-3  # [s] between the depths of a search: these laws do not depend on the speed


def replayed(
    model: Model, parameters: Parameters, recordings: Sequence[RecordingFit], events: Events
) -> tuple[Model, float]:
    """The ``model`` of pooled ``parameters`` with the contact and the punctures of ``events``, and the depth [m] of its
    surface there; ``recordings`` are those of its fit.

    A deeper layer that ruptures one after the other is moved as it is: an insertion shows where it ruptures, not where
    it begins.
    """
    contact, count = parameters["contact_depth"].value, len(model.layers)
    if events.contact is not None:
        contact = _fitted(events, recordings, "contact_depth", lambda found: found.contact)
    peaks = [
        _fitted(events, recordings, f"{prefix(k)}puncture_depth", partial(_puncture, layer=k, count=count)) - contact
        for k in range(min(count, len(events.punctures)))
    ]
    if not peaks:
        return model, contact
    if isinstance(model.friction, core.laws.YieldingCoulomb):
        model, found = _stretched(model, peaks[0])
        contact, peaks = contact + peaks[0] - found, [peak + found - peaks[0] for peak in peaks]
    else:
        model = with_ruptures(model, peaks[:1])
    deeper, above = list(model.deeper), model.puncture.depth
    for k, layer in enumerate(deeper):
        name = f"{prefix(k + 1)}puncture_indentation"
        top = peaks[k + 1] - parameters[name].value if k + 1 < len(peaks) else layer.top
        deeper[k] = dataclasses.replace(layer, top=max(top, above + MIN_TOP_M))
        above = deeper[k].top + layer.puncture.depth
    return model.replace(deeper=tuple(deeper)), contact


def punctures_of_layers(events: Events, count: int) -> list[Puncture]:
    """The punctures of so many layers, in order of time: the first of one layer, otherwise those with the largest
    drops."""
    if count == 1:
        return list(events.punctures[:1])
    return sorted(sorted(events.punctures, key=lambda each: -each.drop)[:count], key=lambda each: each.time)


def _puncture(events: Events, layer: int, count: int) -> Puncture | None:
    """The puncture of one of so many layers; None without one."""
    found = punctures_of_layers(events, count)
    return found[layer] if layer < len(found) else None


def _fitted(events: Events, recordings: Sequence[RecordingFit], name: str, event: Callable) -> float:
    """Where a fit would have what it calls ``name`` by where segmentation has its ``event`` [m]: for a recording of the
    fit where it has it; for another, deeper by the mean distance of the two, with one of none as one recording more, as
    segmentation errs too."""
    depth, distances = event(events).depth, []
    for each in recordings:
        own, fitted = event(each.events), each.parameters.get(name)
        if own is not None and fitted is not None:
            if own.depth == depth:
                return fitted.value
            distances.append(fitted.value - own.depth)
    return depth + sum(distances) / (len(distances) + 1)


def _stretched(model: Model, peak: float) -> tuple[Model, float]:
    """The model whose first, gradual rupture has its peak at ``peak`` [m] below the surface, and that of its peak, as
    near as the limits of the ratio allow."""
    ratio, (tried, found) = 1.0, (model, _peak(model))
    for _ in range(MAX_STEPS):
        ratio = float(np.clip(ratio * peak / max(found, 1e-9), MIN_RATIO, MAX_RATIO))
        tried = _scaled(model, ratio)
        found = _peak(tried)
    return tried, found


def _scaled(model: Model, ratio: float) -> Model:
    """Onset and length times a ratio; the onset stays where friction and cutting would take over the contact there."""
    onset = ratio * model.puncture.depth
    if _left(model, onset) < min(_left(model, model.puncture.depth), MIN_LEFT):
        onset = model.puncture.depth
    friction = model.friction.replace(rupture_length=ratio * model.friction.rupture_length)
    return model.replace(puncture=core.laws.PunctureDepth(onset), friction=friction)


def _left(model: Model, onset: float) -> float:
    """The share of the contact's force at an onset [m] that friction and cutting do not take over."""
    whole = float(_run(with_ruptures(model, [onset]), np.linspace(0.0, onset, PEAK_GRID))[-2])
    return 1.0 - (model.friction.per_length * onset + model.cutting.force) / max(whole, 1e-12)


def _peak(model: Model) -> float:
    """Depth [m] of the first maximum after the onset of a gradual rupture; the onset without one."""
    onset = model.puncture.depth
    depth = onset + np.linspace(0.0, PEAK_LENGTHS * model.friction.rupture_length, PEAK_GRID)
    force = _run(model, np.append(np.linspace(0.0, onset, PEAK_GRID, endpoint=False), depth))[PEAK_GRID:]
    falls = np.flatnonzero(np.diff(force) < 0.0)
    return float(depth[falls[0]]) if len(falls) else onset


def _run(model: Model, depth: np.ndarray) -> np.ndarray:
    """Force (n,) [N] of the first layer alone on the way along depths (n,) [m]."""
    return Insertion(model.replace(deeper=()), max_speed=np.inf).forces(depth, np.full(len(depth), STEP_S))
