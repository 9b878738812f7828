# SPDX-License-Identifier: Apache-2.0
"""One recording through segmentation and the complete fit."""

import contextlib
import dataclasses
import functools
import math
from collections.abc import Callable

import numpy as np

from ...errors import InputError
from ...recording import Recording
from ...segmentation import Events, Puncture
from ...vocabulary import Status
from ..motion import depths_between
from ..statistics.noise import SIGNIFICANT, TWO_SIDED, DriftEffect
from ..strokes import Strokes, depth_before, filter_delay, strokes_of
from .cycle_fit import fit_cycle, limit_saturation
from .cycle_values import CycleFit, CycleOptions
from .deformation_fit import DeformationFit, fit_deformation
from .gradual_fit import FirstLayer, fit_gradual
from .loading_curves import FITS
from .model_errors import widen_to_cover, widened
from .segmented_recording import STAGE, SegmentedRecording, segmented, without_drift
from .staged_fit import agrees, fit_by_stages

WINDOW_MARGIN_M = 0.05e-3  # [m] beyond the samples between which segmentation finds the puncture
WINDOW_MARGIN_SAMPLES = 2
RETRY_MARGIN_M = 0.5e-3  # [m] by which the window is widened if the puncture is near an end of the stroke
STAGED = (
    "The strokes below the puncture do not agree with the contact depth of the loading curve. The fit is therefore "
    "staged: first the loading curve, then friction and cutting."
)
FAILURES = (ValueError, ArithmeticError, np.linalg.LinAlgError)  # of a fit; an InputError is a ValueError
RUPTURES_GRADUALLY = (
    "The rupture is gradual: it begins at an indentation of {rupture_onset:.3g} mm, before the force peak, and most of "
    "the contact is lost over {rupture_length:.2g} mm. With the law {law}, a sharp rupture does not explain the fall."
)
ONLY_STAGED = "The law {} has only a staged fit: first the loading curve, then friction and cutting."


def fitted(single: SegmentedRecording, laws: tuple[str, ...], saturation: float | None) -> SegmentedRecording:
    """A segmented recording with the fits of further stiffness laws. Never raises: status and notes have errors."""
    if not single.events.punctures:
        return single
    fits, loading, notes = dict(single.fits), dict(single.loading), dict(single.law_notes)
    fit, others = _fits(single, saturation), {k: _fits(other, saturation) for k, other in _retimed(single).items()}
    for law in laws:
        try:
            found, loading[law], sentences = fit(law)
            notes[law] = tuple(dict.fromkeys(sentences))
            fits[law] = widen_to_cover(_covering_start_of_fall(found, single), _answers(others, law))
        except FAILURES as error:
            notes[law] = (f"The file was read, but the law {law} cannot be fitted: {error}",)
    status = single.events.status if fits else Status.unreadable
    return dataclasses.replace(single, status=status, law_notes=notes, fits=fits, loading=loading)


def _fits(single: SegmentedRecording, saturation: float | None) -> Callable:
    """The fit of one recording as a function of the law, which finds the puncture once for several laws."""
    given = saturation, single.recording.card.filter_length
    complete = functools.cache(lambda law: _complete(_first_layer(single), single, law, *given))
    before = loading_samples(single.recording, single.strokes, single.events)
    return functools.partial(_fit, single, given=given, before=before, complete=complete)


def _answers(others: dict[str, Callable], law: str) -> dict[str, CycleFit]:
    """The fits of one law to other readings of a recording, where they have one; a rupture that is gradual may be a
    sharp one behind a filter."""
    found = {}
    for cause, fit in others.items():
        for name in (law, FITS[law].law.name) if FITS[law].gradual else (law,):
            with contextlib.suppress(*FAILURES):
                found[cause] = fit(name)[0]
                break
    return found


def _retimed(single: SegmentedRecording) -> dict[str, SegmentedRecording]:
    """The recording as it is if the lag that it shows is one of the record, and if it is behind the filter that it
    shows; and other readings of it, in which the depth belongs to the force at another time. By these causes."""
    recording, timing = single.recording, single.timing
    declared = recording.card.filter_length
    found = {cause: (each, filter_delay(each, declared)) for cause, each in single.readings.items()}
    if timing.lag is not None:
        found["lag"] = recording, filter_delay(recording, declared) + timing.lag.largest
    if timing.late is not None:
        for cause, end in zip(("lag", "shorter lag"), timing.late.ends):
            found[cause] = recording, filter_delay(recording, declared) + end - timing.late.time
    others = {cause: _at_depth(single, each, depth_before(each, delay)) for cause, (each, delay) in found.items()}
    if timing.filter_length > 1:
        card = dataclasses.replace(recording.card, filter_length=timing.filter_length)
        others["filter"] = segmented(dataclasses.replace(recording, card=card))
    return {cause: each for cause, each in others.items() if each.events.punctures}


def _at_depth(single: SegmentedRecording, recording: Recording, depth: np.ndarray) -> SegmentedRecording:
    """The same samples at another ``depth`` (n,) [m]."""
    strokes = single.strokes
    moved = dataclasses.replace(strokes, depth_in=depth[strokes.index_in], depth_out=depth[strokes.index_out])
    return dataclasses.replace(single, recording=recording, strokes=moved)


def _fit(
    single: SegmentedRecording, law: str, *, given: tuple, before: slice, complete: Callable
) -> tuple[CycleFit, DeformationFit, list[str]]:
    """The complete fit, or the staged one where the strokes do not agree or the law has no other; the fit of the
    loading curve; notes."""
    saturation, filter_length = given
    joint, notes = complete(FITS[law].complete)
    if FITS[law].gradual:
        found = _gradual(single, law, joint, _loading(single, FITS[law].law.name, before, saturation), saturation)
        values = {name: 1e3 * found[0].values[name] for name in ("rupture_onset", "rupture_length")}
        return *found, [*notes, RUPTURES_GRADUALLY.format(law=FITS[law].law.name, **values)]
    loading = _loading(single, law, before, saturation)
    if law == joint.law and len(single.events.punctures) == 1 and agrees(joint, loading):
        return joint, loading, [*notes, *joint.warnings]
    strokes = single.strokes
    staged = fit_by_stages(joint, loading, strokes, filter_length, _drift_effect(single, strokes))
    return staged, loading, [*notes, STAGED if law == joint.law else ONLY_STAGED.format(law), *staged.warnings]


def _gradual(
    single: SegmentedRecording, law: str, joint: CycleFit, loading: DeformationFit, saturation: float | None
) -> tuple[CycleFit, DeformationFit]:
    """The fit of a gradual rupture to all samples of the first layer, those of the fall too."""
    recording, events = single.recording, single.events
    sharp = dataclasses.replace(
        events, punctures=tuple(dataclasses.replace(p, gradual=False) for p in events.punctures)
    )
    complete, _, _ = without_drift(recording, events, strokes_of(recording, sharp))
    peak = _peak_sample(single)
    second = complete.place_in(_place(recording, events.punctures[1])) if len(events.punctures) > 1 else None
    end = _end_of_layer(complete, complete.place_in(max(events.punctures[0].end, peak + 1)), second)
    layer = FirstLayer(
        strokes=complete,
        reduced=single.strokes,
        peak=min(complete.place_in(peak), end - 1),
        end=end,
        several=len(events.punctures) > 1,
        filter_length=recording.card.filter_length,
        drift=_drift_effect(single, complete),
    )
    return fit_gradual(joint, loading, layer, law, saturation)


def _place(recording: Recording, puncture: Puncture) -> int:
    """The recording's sample of a puncture's peak."""
    return int(np.searchsorted(recording.time, puncture.time))


def _loading(single: SegmentedRecording, law: str, before: slice, saturation: float | None) -> DeformationFit:
    """The fit of the loading curve, with the free travel after the exit as data of the zero."""
    strokes, contact, recording = single.strokes, single.events.contact.depth, single.recording
    depth, force = strokes.depth_in[before], strokes.force_in[before]
    above = contact - 2.0 * max(float(depth.max(initial=contact)) - contact, 0.0)
    after, drift = single.free_after, single.drift
    samples = np.append(strokes.index_in[before], after)
    return fit_deformation(
        np.append(depth, np.full(len(after), above)),
        np.append(force, recording.force[after] - drift.at(recording, after)),
        contact,
        law,
        known={"saturation_depth": saturation},
        filter_length=recording.card.filter_length,
        drift=drift.effect(recording, samples),
    )


def _drift_effect(single: SegmentedRecording, strokes: Strokes) -> DriftEffect | None:
    """The drift at the samples of both strokes; None without one."""
    return single.drift.effect(single.recording, np.concatenate([strokes.index_in, strokes.index_out]))


def loading_samples(recording: Recording, strokes: Strokes, events: Events) -> slice:
    """Samples of the insertion up to the first puncture's peak, the same for every law; a filter smears the last."""
    smeared = recording.card.filter_length if recording.card.filter_length > 1 else 0
    peak = strokes.place_in(int(np.searchsorted(recording.time, events.punctures[0].time)) + 1)
    return slice(0, max(peak - smeared, 1))


def _first_layer(single: SegmentedRecording) -> Strokes:
    """The insertion up to a second puncture: the next layer, with its drop, would bias the first puncture."""
    strokes, events = single.strokes, single.events
    if len(events.punctures) < 2:
        return strokes
    end = max(strokes.place_in(events.punctures[1].low), 1)
    return dataclasses.replace(
        strokes, depth_in=strokes.depth_in[:end], force_in=strokes.force_in[:end], index_in=strokes.index_in[:end]
    )


def _peak_sample(single: SegmentedRecording) -> int:
    """The recording's sample of the first puncture's peak."""
    return _place(single.recording, single.events.punctures[0])


def _complete(
    strokes: Strokes, single: SegmentedRecording, law: str, saturation: float | None, filter_length: int
) -> tuple[CycleFit, list[str]]:
    """The complete fit with a scan of the complete insertion; around the first puncture if there are several, if the
    scan finds another, or if the rupture is gradual: then the puncture is the peak before the fall."""
    options = CycleOptions(
        law=law,
        saturation_depth=saturation if law == "cone_cylinder" else None,
        filter_length=filter_length,
        depth_noise=strokes.depth_noise,
        drift=_drift_effect(single, strokes),
        jumps=STAGE in single.recording.axes,
    )
    arrays = strokes.arrays
    first, count = single.events.punctures[0], len(single.events.punctures)
    notes = [_first_puncture_note(count, first.depth)] if count > 1 else []
    low, high = _bracket(strokes, first)
    if first.gradual:
        return _at_peak(_bound(arrays, options, low, high), strokes, single), notes
    fit = _or_none(arrays, options)
    if fit is not None and low <= fit.values["puncture_depth"] <= high:
        return _within(fit, low, high), notes
    return _within(_bound(arrays, options, low, high), low, high), [_first_puncture_note(count, first.depth)]


def _bound(arrays: tuple, options: CycleOptions, low: float, high: float) -> CycleFit:
    """The complete fit with the puncture between two depths [m], or near them if that is near an end of the stroke."""
    bound = _or_none(arrays, dataclasses.replace(options, puncture_window=(low, high)))
    if bound is None:
        wider = low - RETRY_MARGIN_M, high + RETRY_MARGIN_M
        bound = fit_cycle(*arrays, dataclasses.replace(options, puncture_window=wider), limited=False)
    return bound


def _at_peak(fit: CycleFit, strokes: Strokes, single: SegmentedRecording) -> CycleFit:
    """The fit with its puncture at the force peak before a gradual fall, between the samples that bound it."""
    first, depth = single.events.punctures[0], single.recording.depth
    peak = float(strokes.depth_in[max(strokes.place_in(_peak_sample(single) + 1) - 1, 0)])
    ends = (float(depth[first.low]), float(depth[min(first.high, len(depth) - 1)]))
    half = max(peak - min(ends), max(ends) - peak, 0.0)
    return fit.with_puncture(peak, half)


def _bracket(strokes: Strokes, puncture: Puncture) -> tuple[float, float]:
    """The depths [m] between which segmentation finds the puncture, with a margin of the travel of a few samples."""
    first, last = (min(strokes.place_in(k), len(strokes.depth_in) - 1) for k in (puncture.low, puncture.high))
    margin = max(WINDOW_MARGIN_M, WINDOW_MARGIN_SAMPLES * float(np.ptp(strokes.depth_in)) / len(strokes.depth_in))
    low, high = depths_between(strokes.depth_in, first, last)
    return low - margin, high + margin


def _within(fit: CycleFit, low: float, high: float) -> CycleFit:
    """The fit with the puncture's interval limited to the bracket, in which the drop was measured. A fit that has its
    puncture outside contradicts the measurement: its interval holds both. What the model misses elsewhere moves it off
    its fall so, in all repeats alike."""
    name = "puncture_depth"
    value = fit.values[name]
    if low <= value <= high:
        ends = max(fit.low[name], low), min(fit.high[name], high)
        return dataclasses.replace(fit, low=fit.low | {name: ends[0]}, high=fit.high | {name: ends[1]})
    return _covering(fit, low, high)


def _covering(fit: CycleFit, low: float, high: float) -> CycleFit:
    """The fit whose puncture's interval holds its own and the depths ``low`` to ``high`` [m] that were measured."""
    name = "puncture_depth"
    value = fit.values[name]
    less, more = max(fit.low[name] - low, 0.0), max(high - fit.high[name], 0.0)
    moved = dict.fromkeys((name, "puncture_indentation"), (high if value < low else low) - value)
    lows = fit.low | {each: fit.low[each] - less for each in moved}
    highs = fit.high | {each: fit.high[each] + more for each in moved}
    found = widened(fit, lows, highs, {"drop": moved})
    shared = {each: (max(-change, 0.0), max(change, 0.0)) for each, change in moved.items()}
    return dataclasses.replace(found, systematic=found.systematic | shared)


def _covering_start_of_fall(fit: CycleFit, single: SegmentedRecording) -> CycleFit:
    """The fit whose puncture's interval holds the start of a fall that takes several samples, where a sharp puncture is
    drawn into it: the puncture is not where the force leaves its peak, the law is above the force between the two, or
    the force is not yet down behind it. A fall may begin as long before its highest sample as it takes to leave the
    noise from there."""
    if single.recording.card.filter_length > 1:  # which moves the peak
        return fit
    if FITS[fit.law].gradual:
        return _covering(fit, *_start_if_exponential(fit))
    strokes, residual, before = single.strokes, fit.residuals.insertion, fit.puncture.before
    depth, force, limit = strokes.depth_in, strokes.force_in, SIGNIFICANT * math.sqrt(fit.residuals.noises[0].variance)
    peak = max(strokes.place_in(_peak_sample(single) + 1) - 1, 0)
    past = peak + int(np.argmax(force[peak:] < force[peak] - math.sqrt(2.0) * limit))
    n = max(before - 1 - peak, 0)
    above = float(residual[max(peak - n, 0) : peak].sum() - residual[peak + 1 : before].sum())
    slow = above > limit * math.sqrt(2.0 * n) or float(residual[before : before + 1].sum()) > limit
    ends, margin = depth[[max(2 * peak - past, 0), past]], TWO_SIDED * strokes.depth_noise
    low, high = float(ends.min()) - margin, float(ends.max()) + margin
    return _covering(fit, low, high) if slow or not low <= fit.values["puncture_depth"] <= high else fit


def _start_if_exponential(fit: CycleFit) -> tuple[float, float]:
    """The depths [m] between which a gradual rupture starts: as the fit has it and, where its exponent m is held, as an
    exponential fall that loses half of the contact at the same depth and as fast, later by ln(2)^(1/m) (1 - 1/m)
    lengths."""
    held, m = "rupture_exponent" not in fit.order, fit.values["rupture_exponent"]
    later = fit.values["rupture_length"] * math.log(2.0) ** (1.0 / m) * (1.0 - 1.0 / m) if held else 0.0
    start = fit.values["contact_depth"] + fit.values["rupture_onset"]
    half = float(np.nan_to_num(0.5 * (fit.high["rupture_onset"] - fit.low["rupture_onset"])))
    half = min(half, 1.0)  # [m] where nothing limits it: no depth is farther
    return start + min(later, 0.0) - half, start + max(later, 0.0) + half


def _or_none(arrays: tuple, options: CycleOptions) -> CycleFit | None:
    """The complete fit, or None where it finds no possible puncture."""
    try:
        return fit_cycle(*arrays, options, limited=False)
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


def limited(single: SegmentedRecording, law: str) -> CycleFit:
    """The fit of a law with the lower limit of its saturation depth, which takes several more fits."""
    return limit_saturation(single.fits[law], *_first_layer(single).arrays)


def peak_force(single: SegmentedRecording) -> float:
    """The largest measured force of the insertion [N]."""
    return float(np.max(single.strokes.force_in, initial=0.0))


def _end_of_layer(strokes: Strokes, first: int, second: int | None) -> int:
    """Where the insertion of the first layer ends: at its least force between the end of the fall, sample ``first``,
    and the peak of the ``second`` puncture, as from there on the next layer is pressed in."""
    if second is None or second <= first + 1:
        return len(strokes.depth_in)
    return first + int(np.argmin(strokes.force_in[first:second])) + 1
