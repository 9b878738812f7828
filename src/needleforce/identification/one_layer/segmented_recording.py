# SPDX-License-Identifier: Apache-2.0
"""One recording with its events, strokes, timing and the drift of its zero, as the fits use it."""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from ...recording import Recording
from ...recording.force_signal import quantum_of
from ...segmentation import Events, segment
from ...segmentation.doubtful import unreadable
from ...segmentation.strokes import updated_depth, white_noise
from ...vocabulary import Status
from ..motion import DepthSignal
from ..statistics.noise import Noise, noise_of
from ..strokes import Strokes, depth_before, strokes_of, undelayed_depth, usable_samples
from ..timing import Timing, late_words, lateness, timing_of
from .cycle_values import CycleFit
from .deformation_fit import DeformationFit
from .force_zero import Drift, drift_of, free_samples
from .puncture_force import MeasuredPeak

MIN_FREE_SAMPLES = 50  # of free travel, for its noise
MAX_SPAN = {"time": 1e7, "depth": 10.0, "force": 1e5}  # SI; no insertion has more
STAGE = "stage_depth"  # of a recording whose depth is that of the tip behind a machine, its recorded depth [m]
SPAN_UNITS = {"time": "s", "depth": "m", "force": "N"}


@dataclass(frozen=True, eq=False, kw_only=True)
class SegmentedRecording:
    """One recording's ``depth`` signal, events, strokes, and the fit of each stiffness law that could be fitted.

    ``loading`` has each law's fit of the loading curve, ``law_notes`` its notes. The ``strokes`` have the ``drift`` of
    the zero subtracted; ``free_after`` (k,) are the samples after the exit that show the same zero; ``timing`` has
    a lag and a filter that is not declared. ``readings`` are the same samples as other errors of the model have them.
    ``force_step`` [N] is that in which the sensor gives the force, where less noise than half of it leaves its
    rounding; 0 otherwise, as an average over such noise has no steps. ``free_noise`` is that of the free travel before
    the contact; None with too little of it. ``peaks`` are the measured forces at the puncture, by the fit.
    """

    recording: Recording
    depth: DepthSignal
    events: Events
    strokes: Strokes
    status: Status
    notes: tuple[str, ...]
    fits: dict[str, CycleFit] = field(default_factory=dict)
    loading: dict[str, DeformationFit] = field(default_factory=dict)
    law_notes: dict[str, tuple[str, ...]] = field(default_factory=dict)
    timing: Timing = field(default_factory=Timing)
    readings: Mapping[str, Recording] = field(default_factory=dict)
    drift: Drift = field(default_factory=Drift)
    free_after: np.ndarray = field(default_factory=lambda: np.empty(0, int))
    force_step: float = 0.0
    free_noise: Noise | None = None
    peaks: dict[CycleFit, MeasuredPeak | None] = field(default_factory=dict)


def segmented(recording: Recording) -> SegmentedRecording:
    """One recording segmented and not fitted. Never raises: errors are reported in status and notes."""
    impossible = _impossible(recording)
    late = None if impossible or unreadable(recording.time, recording.depth, recording.force) else lateness(recording)
    if late is not None:
        recording = dataclasses.replace(recording, depth=depth_before(recording, late.time))
    events = Events(status=Status.unreadable, notes=(impossible,)) if impossible else segment(recording)
    if events.status is Status.unreadable:
        return SegmentedRecording(
            recording=recording,
            depth=DepthSignal(recording.depth),
            events=events,
            strokes=_no_strokes(),
            status=Status.unreadable,
            notes=events.notes,
        )
    if (depth := updated_depth(recording.depth)) is not recording.depth:
        recording = dataclasses.replace(recording, depth=depth)
    punctured = events.punctures or events.status is not Status.ok
    depth = DepthSignal(recording.depth)
    undelayed = DepthSignal(undelayed_depth(recording)) if recording.card.filter_length > 1 else depth
    timing = timing_of(recording, events, undelayed, late)
    strokes, drift, free_after = without_drift(recording, events, strokes_of(recording, events, undelayed))
    return SegmentedRecording(
        recording=recording,
        depth=depth,
        events=events,
        strokes=strokes,
        status=events.status if punctured else Status.no_puncture,
        notes=(
            *([late_words(late)] if late else []),
            *events.notes,
            *_motion_notes(strokes),
            *([drift.note] if drift.note else []),
            *timing.notes,
        ),
        timing=timing,
        drift=drift,
        free_after=free_after,
        force_step=_force_step(recording.force),
        free_noise=_free_noise(recording, events, strokes),
    )


def _force_step(force: np.ndarray) -> float:
    step = quantum_of(force)
    return step if step > 0.0 and white_noise(force) < 0.5 * step else 0.0


def _free_noise(recording: Recording, events: Events, strokes: Strokes) -> Noise | None:
    if events.contact is None:
        return None
    free = strokes.force_in[: strokes.place_in(events.contact.low)]
    if len(free) < MIN_FREE_SAMPLES:
        return None
    return noise_of(free - free.mean(), len(free), recording.card.filter_length, 1.0)


def _motion_notes(strokes: Strokes) -> tuple[str, ...]:
    """A sentence on a pull-back within the insertion that is longer than the travel in which friction reverses."""
    reversal = strokes.friction_reversal
    if not strokes.backtrack > (0.0 if reversal is None else reversal.high):
        return ()
    return (
        f"The needle is pulled back within the insertion, by up to {1e3 * strokes.backtrack:.3g} mm: the fit uses the "
        "samples at the deepest depth so far, and those where the needle slides back.",
    )


def without_drift(recording: Recording, events: Events, strokes: Strokes) -> tuple[Strokes, Drift, np.ndarray]:
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
    force_in = strokes.force_in - drift.at(recording, strokes.index_in)
    force_out = strokes.force_out - drift.at(recording, strokes.index_out)
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


def _impossible(recording: Recording) -> str:
    """A sentence on values that no insertion has; empty for a possible recording."""
    if len(recording) < 2:
        return "The recording has fewer than 2 samples."
    for name, largest in MAX_SPAN.items():
        values = getattr(recording, name)
        if not float(values.max() / largest) - float(values.min() / largest) <= 1.0:
            return f"The {name} spans more than {largest:g} {SPAN_UNITS[name]} or is not finite: check its unit."
    return ""
