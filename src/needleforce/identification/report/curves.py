# SPDX-License-Identifier: Apache-2.0
"""The curves drawn of a fit: recordings with their samples, and means of samples by depth."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...recording.recording import Recording
from ...segmentation.events import Events
from ..recording_fit import RecordingFit

DEFAULT_SPEED = 3e-3  # [m/s], the paper's, for a recording without motion before the puncture
# a recording is anomalous if its residual is above this many times the median of all …
RESIDUAL_FACTOR = 2.0
FORCE_SHARE = 0.25  # … or its puncture force differs from the median by more than this share


@dataclass(frozen=True, eq=False, kw_only=True)
class DrawnRepeat:
    """One recording in the units of the figures.

    Attributes
    ----------
    number : int
        Number of the recording, from 1.
    fit : RecordingFit
        Its own fit.
    time, indentation, measured : ndarray (n,)
        Time [s] from the start, indentation [mm] and measured force [N].
    model : ndarray (n,)
        Force of the model [N]; all NaN without a model.
    inward, outward : ndarray (n,)
        True for the samples of the insertion stroke and of the withdrawal stroke.
    anomalous : bool
        Whether its residual or puncture force differs from those of the other recordings.
    """

    number: int
    fit: RecordingFit
    time: np.ndarray
    indentation: np.ndarray
    measured: np.ndarray
    model: np.ndarray
    inward: np.ndarray
    outward: np.ndarray
    anomalous: bool = False

    @property
    def puncture(self) -> tuple[float, float] | None:
        """Indentation [mm] and force [N] of the first puncture, or None."""
        events, recording = self.fit.events, self.fit.recording
        if not events.punctures:
            return None
        broke = events.punctures[0]
        return self.indentation[0] + 1e3 * (broke.depth - recording.depth[0]), broke.force

    @property
    def strokes(self) -> tuple[np.ndarray, np.ndarray]:
        """True for the samples (n,) of each stroke."""
        return self.inward, self.outward

    @property
    def zero(self) -> float:
        """Its identified zero of the force [N]; 0 without one."""
        return self.fit.parameters["force_offset"].value if "force_offset" in self.fit.parameters else 0.0

    @property
    def residual(self) -> np.ndarray:
        """Measured minus modelled force (n,) [N]."""
        return self.measured - self.model

    @property
    def has_model(self) -> bool:
        """Whether a model was run along this recording."""
        return bool(np.isfinite(self.model).any())


def repeats(recordings: Sequence[RecordingFit], shared_contact: float | None) -> tuple[DrawnRepeat, ...]:
    """Every recording that can be drawn, in the order of the files; ``shared_contact`` [m] is None where each has its
    own contact depth."""
    anomalous = anomalous_recordings(recordings)
    numbered = ((k, one) for k, one in enumerate(recordings, 1) if one.recording is not None)
    return tuple(_repeat(k, one, k in anomalous, shared_contact) for k, one in numbered if len(one.recording) > 1)


def _repeat(number: int, one: RecordingFit, anomalous: bool, shared: float | None) -> DrawnRepeat:
    """One recording in the units of the figures; ``shared`` is the contact depth [m] common to all, or None."""
    recording, events = one.recording, one.events
    surface = one.surface if shared is None else shared
    model = one.predicted if len(one.predicted) == len(recording) else np.full(len(recording), np.nan)
    return DrawnRepeat(
        number=number,
        fit=one,
        time=recording.time - recording.time[0],
        indentation=1e3 * (recording.depth - surface),
        measured=recording.force,
        model=model,
        inward=_within(recording, events, ("deformation", "insertion")),
        outward=_within(recording, events, ("extraction",)),
        anomalous=anomalous,
    )


def _within(recording: Recording, events: Events, phases: tuple[str, ...]) -> np.ndarray:
    """True for the samples (n,) of these phases; without phases, for those of the stroke by the sign of velocity."""
    chosen = np.zeros(len(recording), bool)
    if not events.phases:
        return recording.velocity < 0.0 if phases == ("extraction",) else recording.velocity > 0.0
    for span in events.phases:
        chosen[span.first : span.last] |= str(span.phase) in phases
    return chosen


def representative(drawn: tuple[DrawnRepeat, ...]) -> DrawnRepeat | None:
    """The recording with the median residual: neither the best fit nor the worst."""
    ranked = sorted((r for r in drawn if r.has_model and r.fit.quality), key=lambda r: r.fit.quality.rmse_N)
    if ranked:
        return ranked[(len(ranked) - 1) // 2]
    return next((r for r in drawn if r.fit.events.contact is not None), drawn[0] if drawn else None)


def anomalous_recordings(recordings: Sequence[RecordingFit]) -> set[int]:
    """Numbers of the recordings whose residual or puncture force differs from the others, among three or more."""
    residual = {k: one.quality.rmse_N for k, one in enumerate(recordings, 1) if one.quality}
    force = {k: one.events.punctures[0].force for k, one in enumerate(recordings, 1) if one.events.punctures}
    far = {k for k in residual if residual[k] > RESIDUAL_FACTOR * np.median(list(residual.values()))}
    middle = np.median(list(force.values())) if force else 0.0
    off = {k for k in force if abs(force[k] - middle) > FORCE_SHARE * abs(middle)}
    return (far if len(residual) >= 3 else set()) | (off if len(force) >= 3 else set())


def loading(one: DrawnRepeat) -> slice:
    """The samples from contact to the first puncture; to the greatest depth without a puncture."""
    events, first = one.fit.events, int(np.argmax(one.indentation >= 0.0))
    deepest = int(np.argmax(one.indentation))
    # the peak itself: the interval in which the puncture lies may reach into the drop
    peak = np.searchsorted(one.fit.recording.time, events.punctures[0].time) if events.punctures else deepest
    return slice(first, max(int(peak), first) + 1)


def loading_speed(one: DrawnRepeat) -> float:
    """Mean speed [m/s] from contact to the first puncture."""
    part = loading(one)
    travel, time = np.ptp(one.indentation[part]), np.ptp(one.time[part])
    return 1e-3 * float(travel / time) if travel > 0.0 and time > 0.0 else DEFAULT_SPEED


def binned(x: np.ndarray, y: np.ndarray, edges: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mean, lowest and highest y of each bin of x, (m,) each for ``edges`` (m + 1,); NaN in empty bins."""
    keep = np.isfinite(y) & (x >= edges[0]) & (x <= edges[-1])
    y, bins = y[keep], len(edges) - 1
    k = np.clip(np.searchsorted(edges, x[keep], side="right") - 1, 0, bins - 1)
    count, low, high = np.bincount(k, minlength=bins), np.full(bins, np.inf), np.full(bins, -np.inf)
    np.minimum.at(low, k, y)
    np.maximum.at(high, k, y)
    empty = np.where(count > 0, 0.0, np.nan)
    return np.bincount(k, y, bins) / np.maximum(count, 1) + empty, low + empty, high + empty
