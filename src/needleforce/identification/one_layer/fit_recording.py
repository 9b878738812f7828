# SPDX-License-Identifier: Apache-2.0
"""One recording through segmentation and the complete fit."""

import dataclasses
import functools
from dataclasses import dataclass, field

import numpy as np

from ...errors import InputError
from ...recording import Recording
from ...segmentation import Events, Puncture, segment
from ...vocabulary import Status
from ..strokes import Strokes, strokes_of
from .cycle_estimates import CycleFit
from .cycle_fit import fit_cycle
from .deformation_fit import DeformationFit, fit_deformation
from .loading_curves import CURVES
from .staged_fit import agrees, fit_by_stages

WINDOW = 0.05e-3  # [m] beyond the samples between which segmentation sees the puncture
MARGIN_SAMPLES = 2
LARGEST = {"time": 1e7, "depth": 10.0, "force": 1e5}
UNIT = {"time": "s", "depth": "m", "force": "N"}
ROOM = 0.5e-3  # [m]
BY_STAGES = (
    "The strokes below the puncture would move the contact depth away from the loading curve's: fitted by stages, the "
    "loading curve first, then friction and cutting."
)
ONLY_BY_STAGES = "The law {} is fitted by stages: the loading curve first, then friction and cutting."


@dataclass(frozen=True, eq=False)
class SegmentedRecording:
    """One recording's events, strokes, and the fit of each stiffness law; ``fits`` is empty where none could be made.

    ``loading`` is each law's fit of the loading curve alone.
    """

    recording: Recording
    events: Events
    strokes: Strokes
    status: Status
    notes: tuple[str, ...]
    fits: dict[str, CycleFit] = field(default_factory=dict)
    loading: dict[str, DeformationFit] = field(default_factory=dict)


def segmented(recording: Recording) -> SegmentedRecording:
    """One recording segmented and not fitted. Never raises: what is wrong is in status and notes."""
    impossible = _impossible(recording)
    events = Events(status=Status.unreadable, notes=(impossible,)) if impossible else segment(recording)
    if events.status is Status.unreadable:
        nothing = Strokes(*4 * (np.empty(0),), slice(0, 0), slice(0, 0), None)
        return SegmentedRecording(recording, events, nothing, Status.unreadable, events.notes)
    pierced = events.punctures or events.status is not Status.ok
    status = events.status if pierced else Status.no_puncture
    return SegmentedRecording(recording, events, strokes_of(recording, events), status, events.notes)


def fit_single(recording: Recording, laws: tuple[str, ...], saturation: float | None) -> SegmentedRecording:
    """Segments and fits one recording with each stiffness law. Never raises: what went wrong is in status and notes."""
    unfitted = segmented(recording)
    if not unfitted.events.punctures:
        return unfitted
    events, strokes = unfitted.events, unfitted.strokes
    fits, loading, notes = {}, {}, list(events.notes)
    given = saturation, recording.card.filter_length
    complete = functools.cache(lambda law: _complete(_first_layer(strokes, events), events, law, *given))
    before = loading_samples(recording, strokes, events)
    for law in laws:
        try:
            fits[law], loading[law], said = _fit(strokes, events, law, given, before, complete)
            notes += [sentence for sentence in said if sentence not in notes]
        except (ValueError, ArithmeticError, np.linalg.LinAlgError) as error:  # InputError is a ValueError
            notes.append(f"The law {law} cannot be fitted: {error}")
    return SegmentedRecording(
        recording, events, strokes, events.status if fits else Status.unreadable, tuple(notes), fits, loading
    )


def _fit(strokes: Strokes, events: Events, law: str, given: tuple, before: slice, complete):
    """The complete fit, or the one by stages where the strokes disagree or the law has no other; the loading curve's
    fit; what is to be said."""
    saturation, filter_length = given
    joint, said = complete(CURVES[law].complete)
    depth, force = strokes.depth_in[before], strokes.force_in[before]
    known = {"saturation_depth": saturation}
    loading = fit_deformation(depth, force, events.contact.depth, law, known, filter_length)
    if law == joint.law and len(events.punctures) == 1 and agrees(joint, loading):
        return joint, loading, [*said, *joint.warnings]
    staged = fit_by_stages(joint, loading, strokes, filter_length)
    return staged, loading, [*said, BY_STAGES if law == joint.law else ONLY_BY_STAGES.format(law), *staged.warnings]


def loading_samples(recording: Recording, strokes: Strokes, events: Events) -> slice:
    """Samples of the insertion up to the first puncture's peak, the same for every law; a filter smears the last."""
    smeared = recording.card.filter_length if recording.card.filter_length > 1 else 0
    peak = int(np.searchsorted(recording.time, events.punctures[0].time)) + 1 - strokes.inwards.start
    return slice(0, max(peak - smeared, 1))


def _impossible(recording: Recording) -> str:
    """What no insertion has, in words; empty for a possible one."""
    if len(recording) < 2:
        return "There are no samples."
    for name, largest in LARGEST.items():
        values = getattr(recording, name)
        if not float(values.max() / largest) - float(values.min() / largest) <= 1.0:
            return f"The {name} spans more than {largest:g} {UNIT[name]}, or is not finite: check its unit."
    return ""


def _first_layer(strokes: Strokes, events: Events) -> Strokes:
    """The insertion up to a second puncture: what follows is another layer, whose drop would pull the first one's."""
    if len(events.punctures) < 2:
        return strokes
    end = max(events.punctures[1].low - strokes.inwards.start, 1)
    return dataclasses.replace(strokes, depth_in=strokes.depth_in[:end], force_in=strokes.force_in[:end])


def _complete(strokes: Strokes, events: Events, law: str, saturation: float | None, filter_length: int):
    """By a scan of the whole insertion, or around the first puncture where there are several or the scan found
    another."""
    options = {"law": law, "filter_length": filter_length}
    if law == "cone_cylinder":
        options["saturation_depth"] = saturation
    arrays = (strokes.depth_in, strokes.force_in, strokes.depth_out, strokes.force_out)
    first, count = events.punctures[0], len(events.punctures)
    low, high = _bracket(strokes, first)
    fit = _or_none(arrays, options)
    if fit is not None and low <= fit.values["puncture_depth"] <= high:
        return _within(fit, low, high), [_why(count, first.depth)] if count > 1 else []
    bound = _or_none(arrays, options | {"puncture_window": (low, high)})
    if bound is None:  # so near an end of the stroke that the fit needs more room
        low, high = low - ROOM, high + ROOM
        bound = fit_cycle(*arrays, **options, puncture_window=(low, high))
    return _within(bound, low, high), [_why(count, first.depth)]


def _bracket(strokes: Strokes, puncture: Puncture) -> tuple[float, float]:
    """The depths [m] between which segmentation sees the puncture, a little wider: by the travel of a few samples."""
    first, last = (min(k - strokes.inwards.start, len(strokes.depth_in) - 1) for k in (puncture.low, puncture.high))
    margin = max(WINDOW, MARGIN_SAMPLES * float(np.ptp(strokes.depth_in)) / len(strokes.depth_in))
    return float(strokes.depth_in[first]) - margin, float(strokes.depth_in[last]) + margin


def _within(fit: CycleFit, low: float, high: float) -> CycleFit:
    """The fit with the puncture's interval inside the bracket: there the drop is seen, whatever the model's misfit
    says."""
    name = "puncture_depth"
    lows = fit.low | {name: max(fit.low[name], low)}
    highs = fit.high | {name: min(fit.high[name], high)}
    return dataclasses.replace(fit, low=lows, high=highs)


def _or_none(arrays: tuple, options: dict) -> CycleFit | None:
    """The complete fit, or None where it finds no room for a puncture of its own."""
    try:
        return fit_cycle(*arrays, **options)
    except InputError:
        return None


def _why(punctures: int, first: float) -> str:
    place = f"at a depth of {1e3 * first:.2f} mm"
    if punctures > 1:
        return (
            f"There are {punctures} punctures; this one-layer model takes the first, {place}, and misses what follows."
        )
    return (
        f"The force jumps most elsewhere, but the first puncture {place} ends the deformation: the fit is bound to it."
    )


def peak_force(single: SegmentedRecording) -> float:
    """The largest measured force of the insertion [N]."""
    return float(np.max(single.strokes.force_in, initial=0.0))
