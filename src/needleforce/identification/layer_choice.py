# SPDX-License-Identifier: Apache-2.0
"""One layer or several: what the complete cycles of the recordings support."""

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from ..vocabulary import Phase
from .diagnostics import MAX_RESIDUAL, quality
from .estimates import Estimate
from .one_layer.segmented_recording import SegmentedRecording
from .recording_fit import RecordingFit
from .result import Fit
from .statistics.noise import noise_of
from .statistics.regression import VERY_STRONG_BIC, bic_gain, independent_samples

# Parameters that the one-layer fit takes from the part of a recording that shows them
ONE_LAYER = (
    "contact_depth",
    "stiffness_coefficient",
    "reduced_modulus",
    "puncture_depth",
    "puncture_indentation",
    "puncture_force",
    "friction_per_length",
    "cutting_force",
)
DEPTHS = ("contact_depth", "puncture_depth")
DISAGREES = (
    "{name} is {measured} from the force up to the first puncture, and {model} in the layered model, which meets the "
    "whole cycle so: the value given is that from the force."
)


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
    used = np.zeros(len(single.recording.time), bool)
    for samples in (single.strokes.index_in, single.strokes.index_out):
        used[samples] = True
    for span in single.events.spans(Phase.hold):
        used[span.first : span.last] = True
    return np.flatnonzero(used)


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

    def sentence(self, law: str, layered: str) -> str:
        """The choice between two models, by their names, in words."""
        chosen, other = (layered, law) if self.for_layers else (law, layered)
        return (
            f"The model is {chosen}: over insertion, hold and withdrawal without the friction reversal the residual is "
            f"{100 * self.one_layer:.2g} % of the peak with one layer ({law}) and {100 * self.layered:.2g} % with "
            f"layers. Give model='{other}' for the other one."
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
    return samples, bic_gain(noises[1].sse, noises[0].sse, 0, samples)


def with_one_layer_parameters(layered: Fit, one: Fit) -> Fit:
    """The layered fit with the parameters that the one-layer fit has too.

    That fit takes them from the part of the recording that shows each: the loading up to the first puncture, then both
    strokes below it, and its intervals hold what these disagree on. A layered model moves its surface, its springs and
    its ruptures to meet the whole cycle; its own friction of each layer is given too. Where the depths of the two
    disagree, a warning has both.
    """
    own, measured = layered.parameters, one.parameters
    taken = {name: measured[name] for name in ONE_LAYER if name in measured and measured[name].identifiable}
    apart = [name for name in DEPTHS if name in own and name in taken and not _overlap(own[name], taken[name])]
    warnings = [_disagreement(name, own[name], taken[name]) for name in apart]
    return dataclasses.replace(
        layered,
        parameters={**own, **taken},
        recordings=tuple(map(_with_notes, layered.recordings, one.recordings)),
        warnings=(*layered.warnings, *warnings),
    )


def _with_notes(layered: RecordingFit, one: RecordingFit) -> RecordingFit:
    """The layered fit of a recording with the notes of its one-layer fit too, which are on the parameters taken."""
    return dataclasses.replace(layered, notes=tuple(dict.fromkeys((*layered.notes, *one.notes))))


def _overlap(one: Estimate, other: Estimate) -> bool:
    return one.low <= other.high and other.low <= one.high


def _disagreement(name: str, model: Estimate, measured: Estimate) -> str:
    depths = {"model": f"{1e3 * model.value:.3g} mm", "measured": f"{1e3 * measured.value:.3g} mm"}
    return DISAGREES.format(name=name, **depths)
