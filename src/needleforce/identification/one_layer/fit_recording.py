# SPDX-License-Identifier: Apache-2.0
"""One recording through segmentation and the complete fit, and its measured force just before the puncture."""

import dataclasses
import functools
import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ...errors import InputError
from ...recording import Recording
from ...segmentation import Events, Puncture, segment
from ...vocabulary import Status
from ..estimates import Estimate
from ..statistics.noise import TWO_SIDED, DriftEffect, Noise, noise_of
from ..statistics.regression import inverse, least_squares
from ..strokes import Strokes, strokes_of, usable_samples
from .cycle_estimates import CycleFit
from .cycle_fit import fit_cycle
from .deformation_fit import DeformationFit, fit_deformation
from .force_zero import Drift, drift_of, free_samples
from .loading_curves import FITS
from .staged_fit import agrees, fit_by_stages

WINDOW_MARGIN_M = 0.05e-3  # [m] beyond the samples between which segmentation finds the puncture
WINDOW_MARGIN_SAMPLES = 2
MAX_SPAN = {"time": 1e7, "depth": 10.0, "force": 1e5}  # SI; no insertion has more
SPAN_UNITS = {"time": "s", "depth": "m", "force": "N"}
RETRY_MARGIN_M = 0.5e-3  # [m] by which the window is widened if the puncture is near an end of the stroke
STAGED = (
    "The strokes below the puncture do not agree with the contact depth of the loading curve. The fit is therefore "
    "staged: first the loading curve, then friction and cutting."
)
ONLY_STAGED = "The law {} has only a staged fit: first the loading curve, then friction and cutting."


@dataclass(frozen=True, eq=False, kw_only=True)
class SegmentedRecording:
    """One recording's events, strokes, and the fit of each stiffness law that could be fitted.

    ``loading`` has each law's fit of the loading curve. The ``strokes`` have the ``drift`` of the zero subtracted;
    ``free_after`` (k,) are the samples after the exit that show the same zero.
    """

    recording: Recording
    events: Events
    strokes: Strokes
    status: Status
    notes: tuple[str, ...]
    fits: dict[str, CycleFit] = field(default_factory=dict)
    loading: dict[str, DeformationFit] = field(default_factory=dict)
    drift: Drift = field(default_factory=Drift)
    free_after: np.ndarray = field(default_factory=lambda: np.empty(0, int))


def segmented(recording: Recording) -> SegmentedRecording:
    """One recording segmented and not fitted. Never raises: errors are reported in status and notes."""
    impossible = _impossible(recording)
    events = Events(status=Status.unreadable, notes=(impossible,)) if impossible else segment(recording)
    if events.status is Status.unreadable:
        return SegmentedRecording(
            recording=recording, events=events, strokes=_no_strokes(), status=Status.unreadable, notes=events.notes
        )
    punctured = events.punctures or events.status is not Status.ok
    strokes, drift, free_after = _without_drift(recording, events, strokes_of(recording, events))
    return SegmentedRecording(
        recording=recording,
        events=events,
        strokes=strokes,
        status=events.status if punctured else Status.no_puncture,
        notes=events.notes + ((drift.note,) if drift.note else ()),
        drift=drift,
        free_after=free_after,
    )


def _without_drift(recording: Recording, events: Events, strokes: Strokes) -> tuple[Strokes, Drift, np.ndarray]:
    """The strokes without the drift of the zero, the drift, and the samples after the exit that show the same zero."""
    before, after = free_samples(strokes, events, usable_samples(recording, events))
    drift = drift_of(recording, before, after)
    if drift.uncertain_by > 0.0:  # the two zeros contradict each other: the fit has that before the insertion
        kept, after = ~np.isin(strokes.index_out, after), after[:0]
        strokes = dataclasses.replace(
            strokes,
            depth_out=strokes.depth_out[kept],
            force_out=strokes.force_out[kept],
            index_out=strokes.index_out[kept],
        )
    force_in = strokes.force_in - drift.at(recording.time[strokes.index_in])
    force_out = strokes.force_out - drift.at(recording.time[strokes.index_out])
    return dataclasses.replace(strokes, force_in=force_in, force_out=force_out), drift, after


def _no_strokes() -> Strokes:
    none = np.empty(0)
    return Strokes(
        depth_in=none,
        force_in=none,
        depth_out=none,
        force_out=none,
        index_in=none.astype(int),
        index_out=none.astype(int),
        inwards=slice(0, 0),
        outwards=slice(0, 0),
        friction_reversal=None,
    )


def fit_single(recording: Recording, laws: tuple[str, ...], saturation: float | None) -> SegmentedRecording:
    """Segment and fit one recording with each stiffness law. Never raises: errors are reported in status and notes."""
    unfitted = segmented(recording)
    if not unfitted.events.punctures:
        return unfitted
    events, strokes = unfitted.events, unfitted.strokes
    fits, loading, notes = {}, {}, list(events.notes)
    given = saturation, recording.card.filter_length
    complete = functools.cache(lambda law: _complete(_first_layer(unfitted), unfitted, law, *given))
    before = loading_samples(recording, strokes, events)
    for law in laws:
        try:
            fits[law], loading[law], sentences = _fit(unfitted, law, given, before=before, complete=complete)
            notes += [sentence for sentence in sentences if sentence not in notes]
        except (ValueError, ArithmeticError, np.linalg.LinAlgError) as error:  # InputError is a ValueError
            notes.append(f"The law {law} cannot be fitted: {error}")
    return dataclasses.replace(
        unfitted,
        status=events.status if fits else Status.unreadable,
        notes=tuple(notes),
        fits=fits,
        loading=loading,
    )


def _fit(
    single: SegmentedRecording, law: str, given: tuple, *, before: slice, complete: Callable
) -> tuple[CycleFit, DeformationFit, list[str]]:
    """The complete fit, or the staged one where the strokes do not agree or the law has no other; the fit of the
    loading curve; notes."""
    saturation, filter_length = given
    joint, notes = complete(FITS[law].complete)
    loading = _loading(single, law, before, saturation)
    if law == joint.law and len(single.events.punctures) == 1 and agrees(joint, loading):
        return joint, loading, [*notes, *joint.warnings]
    strokes = single.strokes
    staged = fit_by_stages(joint, loading, strokes, filter_length, _drift_effect(single, strokes))
    return staged, loading, [*notes, STAGED if law == joint.law else ONLY_STAGED.format(law), *staged.warnings]


def _loading(single: SegmentedRecording, law: str, before: slice, saturation: float | None) -> DeformationFit:
    """The fit of the loading curve, with the free travel after the exit as data of the zero."""
    strokes, contact, recording = single.strokes, single.events.contact.depth, single.recording
    depth, force = strokes.depth_in[before], strokes.force_in[before]
    above = contact - 2.0 * max(float(depth.max(initial=contact)) - contact, 0.0)
    after, drift = single.free_after, single.drift
    times = recording.time[np.append(strokes.index_in[before], after)]
    return fit_deformation(
        np.append(depth, np.full(len(after), above)),
        np.append(force, recording.force[after] - drift.at(recording.time[after])),
        contact,
        law,
        known={"saturation_depth": saturation},
        filter_length=recording.card.filter_length,
        drift=DriftEffect(lever=times - drift.origin, error=drift.error) if drift.error > 0.0 else None,
    )


def _drift_effect(single: SegmentedRecording, strokes: Strokes) -> DriftEffect | None:
    """The drift at the samples of both strokes; None without one."""
    if not single.drift.error > 0.0:
        return None
    samples = np.concatenate([strokes.index_in, strokes.index_out])
    return DriftEffect(lever=single.recording.time[samples] - single.drift.origin, error=single.drift.error)


def loading_samples(recording: Recording, strokes: Strokes, events: Events) -> slice:
    """Samples of the insertion up to the first puncture's peak, the same for every law; a filter smears the last."""
    smeared = recording.card.filter_length if recording.card.filter_length > 1 else 0
    peak = strokes.place_in(int(np.searchsorted(recording.time, events.punctures[0].time)) + 1)
    return slice(0, max(peak - smeared, 1))


def _impossible(recording: Recording) -> str:
    """A sentence on values that no insertion has; empty for a possible recording."""
    if len(recording) < 2:
        return "The recording has fewer than 2 samples."
    for name, largest in MAX_SPAN.items():
        values = getattr(recording, name)
        if not float(values.max() / largest) - float(values.min() / largest) <= 1.0:
            return f"The {name} spans more than {largest:g} {SPAN_UNITS[name]} or is not finite: check its unit."
    return ""


def _first_layer(single: SegmentedRecording) -> Strokes:
    """The insertion up to a second puncture: the next layer, with its drop, would bias the first puncture."""
    strokes, events = single.strokes, single.events
    if len(events.punctures) < 2:
        return strokes
    end = max(strokes.place_in(events.punctures[1].low), 1)
    return dataclasses.replace(
        strokes, depth_in=strokes.depth_in[:end], force_in=strokes.force_in[:end], index_in=strokes.index_in[:end]
    )


def _complete(
    strokes: Strokes, single: SegmentedRecording, law: str, saturation: float | None, filter_length: int
) -> tuple[CycleFit, list[str]]:
    """The complete fit with a scan of the complete insertion; around the first puncture if there are several, or if the
    scan finds another."""
    options = {"law": law, "filter_length": filter_length, "depth_noise": strokes.depth_noise}
    options["drift"] = _drift_effect(single, strokes)
    if law == "cone_cylinder":
        options["saturation_depth"] = saturation
    arrays = (strokes.depth_in, strokes.force_in, strokes.depth_out, strokes.force_out)
    first, count = single.events.punctures[0], len(single.events.punctures)
    low, high = _bracket(strokes, first)
    fit = _or_none(arrays, options)
    if fit is not None and low <= fit.values["puncture_depth"] <= high:
        return _within(fit, low, high), [_first_puncture_note(count, first.depth)] if count > 1 else []
    bound = _or_none(arrays, options | {"puncture_window": (low, high)})
    if bound is None:  # the puncture is near an end of the stroke
        low, high = low - RETRY_MARGIN_M, high + RETRY_MARGIN_M
        bound = fit_cycle(*arrays, **options, puncture_window=(low, high))
    return _within(bound, low, high), [_first_puncture_note(count, first.depth)]


def _bracket(strokes: Strokes, puncture: Puncture) -> tuple[float, float]:
    """The depths [m] between which segmentation finds the puncture, with a margin of the travel of a few samples."""
    first, last = (min(strokes.place_in(k), len(strokes.depth_in) - 1) for k in (puncture.low, puncture.high))
    margin = max(WINDOW_MARGIN_M, WINDOW_MARGIN_SAMPLES * float(np.ptp(strokes.depth_in)) / len(strokes.depth_in))
    return float(strokes.depth_in[first]) - margin, float(strokes.depth_in[last]) + margin


def _within(fit: CycleFit, low: float, high: float) -> CycleFit:
    """The fit with the puncture's interval limited to the bracket, in which the drop was measured."""
    name = "puncture_depth"
    lows = fit.low | {name: max(fit.low[name], low)}
    highs = fit.high | {name: min(fit.high[name], high)}
    return dataclasses.replace(fit, low=lows, high=highs)


def _or_none(arrays: tuple, options: dict) -> CycleFit | None:
    """The complete fit, or None where it finds no possible puncture."""
    try:
        return fit_cycle(*arrays, **options)
    except InputError:
        return None


def _first_puncture_note(punctures: int, first: float) -> str:
    place = f"at a depth of {1e3 * first:.2f} mm"
    if punctures > 1:
        return (
            f"There are {punctures} punctures. This one-layer model describes the first, {place}, and omits the deeper "
            "ones."
        )
    return (
        f"The largest drop of the force is at another depth, but the first puncture, {place}, ends the deformation: "
        "the fit uses the first puncture."
    )


def peak_force(single: SegmentedRecording) -> float:
    """The largest measured force of the insertion [N]."""
    return float(np.max(single.strokes.force_in, initial=0.0))


WINDOW_M = 0.1e-3  # [m] of travel before the puncture
MIN_SAMPLES = 10  # in the window
MIN_FREE_SAMPLES = 50  # of free travel, for the noise
PEAK_DROP_SIGMA = 5.0  # [standard deviations of the noise] more than the largest of the samples near a peak
CONTACT_MARGIN = 0.1  # [of the indentation] the contact depth is not known better
MAX_STRAIGHT_WINDOW = 0.03  # [of the indentation] over a longer window the curvature of the loading curve matters


def measured_peak(strokes: Strokes, fit: CycleFit, puncture: Puncture, filter_length: int) -> Estimate | None:
    """``puncture_force`` [N]: a curve through the last 0.1 mm before the puncture, read at its depth.

    A line, or a parabola where the window is more than 3 % of the indentation; samples that a filter smears are left
    out. Tissue may rupture gradually: if the peak that segmentation finds is clearly above the curve, the force fell
    before the fitted puncture, and the curve ends at the peak instead. The noise is that of the free travel before the
    contact. None with too few samples of either.
    """
    noise = _free_noise(strokes, fit, filter_length)
    if noise is None:
        return None
    found = _peak_at(strokes, fit, fit.samples_before_puncture - fit.left_out, fit.values["puncture_depth"], noise)
    if found is not None and puncture.force - fit.values["force_offset"] - found.value > PEAK_DROP_SIGMA * math.sqrt(
        noise.variance
    ):
        peak = _sample_of(puncture, strokes)
        return _peak_at(strokes, fit, peak + 1, float(strokes.depth_in[peak]), noise)
    return found


def _sample_of(puncture: Puncture, strokes: Strokes) -> int:
    """The sample of the peak. The depth of the event is that of the filtered force, which is delayed."""
    last = int(np.argmax(strokes.depth_in >= puncture.depth))
    return int(np.argmax(strokes.force_in[: last + 1]))


def _peak_at(strokes: Strokes, fit: CycleFit, end: int, at: float, noise: Noise) -> Estimate | None:
    """Value at the depth ``at`` [m] of the curve through the last samples before ``end``."""
    depth, force = strokes.depth_in, strokes.force_in
    first = min(int(np.searchsorted(depth[:end], depth[end - 1] - WINDOW_M)) if end > 0 else 0, end - MIN_SAMPLES)
    if first < 0 or not np.ptp(depth[first:end]) > 0.0:
        return None
    x, y = depth[first:end] - at, force[first:end]
    curved = np.ptp(x) > MAX_STRAIGHT_WINDOW * fit.values["puncture_indentation"]
    design = np.vander(x / np.ptp(x), 3 if curved else 2)
    values, _, _ = least_squares(design, y)
    # the puncture lies between samples: the growth of the force between them is not known
    between = abs(float(values[-2])) / np.ptp(x) * 0.5 * (fit.high["puncture_depth"] - fit.low["puncture_depth"])
    zero = fit.values["force_offset"], 0.5 * (fit.high["force_offset"] - fit.low["force_offset"])
    own = TWO_SIDED * math.sqrt(noise.long_run * float(inverse(design.T @ design)[-1, -1]))
    value, half = float(values[-1]) - zero[0], math.hypot(own, between, zero[1])
    source = "measured: curve through the last 0.1 mm before the puncture"
    return Estimate("puncture_force", value, "N", value - half, value + half, source=source)


def _free_noise(strokes: Strokes, fit: CycleFit, filter_length: int) -> Noise | None:
    """The noise of the force before the contact; None if the free travel is too short."""
    last = fit.values["contact_depth"] - CONTACT_MARGIN * fit.values["puncture_indentation"]
    free = strokes.force_in[: int(np.argmax(strokes.depth_in > last))]
    if len(free) < max(MIN_FREE_SAMPLES, 4 * filter_length):
        return None
    return noise_of(free - free.mean(), len(free), filter_length, 1.0)
