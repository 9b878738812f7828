# SPDX-License-Identifier: Apache-2.0
"""Limits that a recording crosses and its model does not know, said in plain words."""

import numpy as np

from ..mechanics.validity import FRICTION_LIMIT
from ..segmentation import Events
from ..vocabulary import Phase
from .one_layer.fit_recording import Single, peak_force

SMALL_LATERAL = 0.1
RELAXED = 0.1
SMEARED = 0.02  # of the indentation, travelled within the filter's length
LEAST_HOLD = 1.0  # [s]; what is shorter is the turn between the strokes


def crossed(single: Single, one_layer: bool = True) -> list[str]:
    """Every limit that one recording crosses; a layered model knows layers and relaxation."""
    said = [_lateral(single), _deep(single), _smeared(single)]
    said += [_layers(single.events), _relaxation(single)] if one_layer else []
    return [sentence for sentence in said if sentence]


def _layers(events: Events) -> str:
    if len(events.punctures) < 2:
        return ""
    return (
        "There is more than one puncture: the specimen has layers, and a one-layer model cannot "
        "follow what lies below the first."
    )


def _relaxation(single: Single) -> str:
    holds = single.events.spans(Phase.hold)
    peak = peak_force(single)
    if not holds or peak <= 0 or holds[0].end - holds[0].start < LEAST_HOLD:
        return ""
    force = single.recording.force[holds[0].first : holds[0].last]
    tenth = max(len(force) // 10, 1)
    # the ends of a hold belong to the braking before it and to the start of the withdrawal
    early, late = force[tenth : 2 * tenth], force[-3 * tenth : -2 * tenth]
    fall = 1.0 - float(np.mean(late)) / float(np.mean(early) or np.nan)
    if not fall > RELAXED:
        return ""
    return "The force relaxes by more than a tenth during the hold: the tissue is viscous, the model is not."


def _smeared(single: Single) -> str:
    recording = single.recording
    if not single.fits or recording.card.filter_length == 1:
        return ""
    travel = float(np.abs(recording.velocity).max()) * recording.card.filter_length / recording.rate
    if travel <= SMEARED * next(iter(single.fits.values())).values["puncture_indentation"]:
        return ""
    return (
        "The average filter smears the force over more than a fiftieth of the indentation: its delay is undone, "
        "its bending of the loading curve is not, and the intervals of contact and stiffness are too narrow."
    )


def _lateral(single: Single) -> str:
    axes = single.recording.axes
    if "fx" not in axes or "fy" not in axes:
        return ""
    if not lateral_ratio(single) > SMALL_LATERAL:
        return ""
    return (
        "The lateral forces are not small beside the axial one (over a tenth): the paper neglects "
        "them, and the needle bends."
    )


def lateral_ratio(single: Single) -> float:
    """Largest lateral force over the largest axial one, both as the 99th percentile of the strokes; NaN without fx,
    fy."""
    axes = single.recording.axes
    if "fx" not in axes or "fy" not in axes:
        return float("nan")
    inside = single.strokes.mask(len(single.recording))
    lateral = np.hypot(axes["fx"], axes["fy"])[inside]
    axial = np.abs(single.recording.force)[inside]
    return float(np.percentile(lateral, 99) / np.percentile(axial, 99)) if len(axial) else float("nan")


def _deep(single: Single) -> str:
    if not single.fits or len(single.strokes.depth_in) == 0:
        return ""
    contact = next(iter(single.fits.values())).values["contact_depth"]
    if single.strokes.depth_in.max() - contact <= FRICTION_LIMIT:
        return ""
    return "The needle goes deeper than 12 mm, beyond which the paper sees friction leave the line in depth."
