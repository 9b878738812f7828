# SPDX-License-Identifier: Apache-2.0
"""One layer or several: what the complete cycles of the recordings support."""

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from ..vocabulary import Phase
from .diagnostics import MAX_RESIDUAL, quality
from .estimates import Estimate
from .one_layer.fit_recording import SegmentedRecording
from .recording_fit import RecordingFit
from .result import Fit
from .statistics.noise import noise_of
from .statistics.regression import VERY_STRONG_BIC, independent_samples


def misses_cycle(fit: Fit, singles: list[SegmentedRecording]) -> bool:
    """Whether the one-layer fit leaves more than 5 % of the peak over insertion, hold and withdrawal in at least half
    of the complete recordings."""
    shares = [
        _share(one, _samples(single))
        for one, single in zip(fit.recordings, singles)
        if len(one.residuals) and len(single.strokes.depth_out)
    ]
    return bool(shares) and 2 * sum(share > MAX_RESIDUAL for share in shares) >= len(shares)


def _samples(single: SegmentedRecording) -> np.ndarray:
    """Sample numbers (n,) of insertion, hold and withdrawal, without those where friction reverses, which has a travel
    of its own in either model."""
    holds = [np.arange(span.first, span.last) for span in single.events.spans(Phase.hold)]
    return np.unique(np.concatenate([single.strokes.index_in, *holds, single.strokes.index_out]))


def _share(one: RecordingFit, samples: np.ndarray) -> float:
    """The residual over the samples, rms over the peak."""
    return quality(one.recording.force[samples], one.predicted[samples]).nrmse


@dataclass(frozen=True, kw_only=True)
class CycleEvidence:
    """Residuals over the complete cycles, rms over the peak, of one layer and of the layered model, and by how much the
    BIC of the layered model is lower."""

    one_layer: float
    layered: float
    gain: float

    @property
    def for_layers(self) -> bool:
        """Whether the evidence for the layered model is very strong."""
        return self.gain > VERY_STRONG_BIC

    def sentence(self, law: str) -> str:
        """The choice in words."""
        chosen, other = ("layered", law) if self.for_layers else (law, "layered")
        return (
            f"The model is {chosen}: over insertion, hold and withdrawal without the friction reversal the residual is "
            f"{100 * self.one_layer:.2g} % of the peak with one layer ({law}) and {100 * self.layered:.2g} % with the "
            f"layered model. Give model='{other}' for the other one."
        )


def cycle_evidence(one: Fit, layered: Fit, singles: list[SegmentedRecording]) -> CycleEvidence | None:
    """The evidence of the recordings that both models describe; None without one.

    Correlated samples count as one. The one-layer model has its own parameters in every recording, the layered one its
    ruptures.
    """
    both = [
        (first, second, _samples(single))
        for first, second, single in zip(one.recordings, layered.recordings, singles)
        if len(first.residuals) and len(second.residuals)
    ]
    if not both:
        return None
    found = [_compared(first.residuals[chosen], second.residuals[chosen]) for first, second, chosen in both]
    samples, gain = (float(sum(each)) for each in zip(*found))
    more = len(layered.parameters) + sum(len(second.parameters) - len(first.parameters) for first, second, _ in both)
    shares = [(_share(first, chosen), _share(second, chosen)) for first, second, chosen in both]
    one_layer, several = np.sqrt(np.mean(np.square(shares), axis=0)).tolist()
    return CycleEvidence(one_layer=one_layer, layered=several, gain=gain - more * math.log(samples))


def _compared(one: np.ndarray, layered: np.ndarray) -> tuple[float, float]:
    """Independent samples of two residuals, and minus twice the logarithm of their ratio of likelihoods."""
    noises = [noise_of(each, len(each)) for each in (one, layered)]
    samples = independent_samples(noises)
    return samples, samples * math.log(noises[0].sse / max(noises[1].sse, 1e-300))


def with_measured_puncture(layered: Fit, one: Fit) -> Fit:
    """The layered fit with the first puncture as it was measured: its depth, indentation and force.

    A layered model describes the whole cycle and may have its first rupture elsewhere: a warning names both depths.
    """
    own, measured = layered.parameters, one.parameters
    if not {"puncture_depth", "puncture_force"} <= measured.keys():
        return layered
    at, contact, rupture = measured["puncture_depth"], own.get("contact_depth"), own.get("puncture_depth")
    parameters = {**own, "puncture_depth": at, "puncture_force": measured["puncture_force"]}
    if contact is not None:
        parameters["puncture_indentation"] = _difference(at, contact)
    warnings = layered.warnings
    if rupture is not None and not (rupture.low <= at.high and at.low <= rupture.high):
        depths = f"{1e3 * rupture.value:.3g} mm, the first measured puncture at {1e3 * at.value:.3g} mm"
        warnings = (
            *warnings,
            f"The first rupture of the layered model is at {depths}: puncture_* is the measured one.",
        )
    return dataclasses.replace(layered, parameters=parameters, warnings=warnings)


def _difference(deep: Estimate, shallow: Estimate) -> Estimate:
    """The puncture's indentation with the errors of both depths, which are independent."""
    value = deep.value - shallow.value
    low = value - math.hypot(deep.value - deep.low, shallow.high - shallow.value)
    high = value + math.hypot(deep.high - deep.value, shallow.value - shallow.low)
    identifiable = deep.identifiable and shallow.identifiable and low > 0.0
    source = "measured puncture depth minus the contact depth of the layered fit"
    return Estimate("puncture_indentation", value, "m", low, high, identifiable=identifiable, source=source)
