# SPDX-License-Identifier: Apache-2.0
"""The choice of the model: the stiffness law by the loading curves' BIC, among the laws that meet the measured puncture
force; one layer or several by what the complete cycles support."""

import math
import statistics
from dataclasses import dataclass, replace

import numpy as np

from ..segmentation.contact import CROSSING_SIGMA, MAX_BASELINE_CHANGE
from ..segmentation.strokes import white_noise
from ..vocabulary import Phase
from .diagnostics import MAX_NOISE_RATIO, MAX_RESIDUAL, quality
from .estimates import Estimate
from .one_layer.fit_recording import peak_force
from .one_layer.loading_curves import FITS
from .one_layer.puncture_force import MeasuredPeak, PunctureMatch, measured_peak, puncture_match
from .one_layer.segmented_recording import SegmentedRecording
from .recording_fit import RecordingFit
from .result import Fit
from .settings import Choice
from .statistics.noise import SIGNIFICANT, noise_of
from .statistics.regression import VERY_STRONG_BIC, bic_gain, independent_samples, misfit_gain

HELD_SHARE = 25.0  # [%] of the withdrawal below the surface: a quarter of the samples is neither noise nor a jerk
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
CYCLE = "insertion, hold and withdrawal without the friction reversal"
DISAGREES = (
    "{name} is {measured} from the force up to the first puncture, and {model} in the layered model, which meets the "
    "whole cycle so: the value given is that from the force."
)


def peak_of(single: SegmentedRecording, law: str) -> MeasuredPeak | None:
    """The measured force at the puncture of one recording, which is measured once for each fit."""
    fit = single.fits[law]
    if fit not in single.peaks:
        single.peaks[fit] = _measured_peak(single, law)
    return single.peaks[fit]


def _measured_peak(single: SegmentedRecording, law: str) -> MeasuredPeak | None:
    given = single.events.punctures[0], single.recording.card.filter_length, single.free_noise
    found = measured_peak(single.strokes, single.fits[law], *given)
    return None if found is None else found.rounded(single.force_step)


def match_of(single: SegmentedRecording, law: str) -> PunctureMatch | None:
    """How the law meets the puncture of one recording; None without a fit or a measured force."""
    return puncture_match(single.fits[law], peak_of(single, law)) if law in single.fits else None


def meets_puncture(singles: list[SegmentedRecording], law: str) -> bool:
    """Whether the law meets the measured force at the puncture in at least half of the recordings that show it."""
    found = [match for match in (match_of(single, law) for single in singles) if match is not None]
    fits = any(law in single.fits for single in singles)
    return fits and 2 * sum(match.met and not match.rises for match in found) >= len(found)


def supported(singles: list[SegmentedRecording], laws: tuple[str, ...]) -> bool:
    """Whether one of the laws meets the punctures and leaves no more than the noise of the loading curves, in at least
    half of the recordings."""
    return any(
        meets_puncture(singles, law) and 2 * sum(leaves_noise(single, law) for single in singles) >= len(singles)
        for law in laws
    )


def falls_gradually(singles: list[SegmentedRecording]) -> bool:
    """Whether the first fall is gradual in at least half of the recordings with one."""
    first = [single.events.punctures[0] for single in singles if single.events.punctures]
    return bool(first) and 2 * sum(each.gradual for each in first) >= len(first)


def offered(singles: list[SegmentedRecording], laws: tuple[str, ...]) -> tuple[str, ...]:
    """The laws to choose from: a gradual rupture only where it was found in most of the recordings with a fit."""
    fitted = sum(bool(single.fits) for single in singles)
    return tuple(law for law in laws if not FITS[law].gradual or 2 * sum(law in s.fits for s in singles) > fitted)


def leaves_noise(single: SegmentedRecording, law: str) -> bool:
    """Whether the residual of the loading curve is no larger than the noise of the free travel, by a test of the ratio
    of two variances of correlated samples; False where the free travel is too short to know."""
    noise = single.free_noise
    if law not in single.loading or noise is None:
        return False
    found = single.loading[law].noise
    if not noise.variance > 0.0:
        return not found.sse > 0.0
    correlation = noise.long_run / noise.variance
    scatter = math.sqrt(2.0 * correlation * (1.0 / noise.count + 1.0 / found.count))
    return found.variance <= noise.variance * (1.0 + SIGNIFICANT * scatter)


def choice_of(
    singles: list[SegmentedRecording], laws: tuple[str, ...], preferred: tuple[str, ...]
) -> tuple[Choice, ...]:
    """Each law with the BIC of its loading curves, summed over the recordings that all laws fit, the chosen one first.

    The chosen law has the lowest BIC of those that meet the punctures, or of all if none does. Where a gradual rupture
    was found (on very strong evidence, see ``fit_gradual``) and meets them, a sharp one is not chosen. Another than the
    ``preferred`` ones is chosen only on very strong evidence, each recording with its independent samples.
    """
    common = [single for single in singles if set(laws) <= set(single.fits)]
    if not common:
        present = [law for law in laws if any(law in single.fits for single in singles)]
        return tuple(Choice(law, math.nan) for law in present)
    found = [Choice(law, _bic(common, law), _puncture_ratio(common, law)) for law in laws]
    ranked = sorted(found, key=lambda each: each.bic)
    meeting = [each for each in ranked if meets_puncture(singles, each.name)] or ranked
    gradual = [each for each in meeting if FITS[each.name].gradual]
    if gradual:
        first = _best_gradual(common, gradual)
        return (first, *(each for each in ranked if each is not first))
    first = meeting[0]
    others = [each for each in meeting if each.name in preferred]
    if others and first.name not in preferred and not _much_better(common, first.name, others[0].name):
        first = others[0]
    return (first, *(each for each in ranked if each is not first))


def _best_gradual(singles: list[SegmentedRecording], choices: list[Choice]) -> Choice:
    """The gradual rupture of the lowest BIC over loading curve, fall and what follows, in independent samples; of one
    that is not much better than another with fewer parameters, the other."""
    ranked = sorted(choices, key=lambda each: sum(len(single.fits[each.name].order) for single in singles))
    best = ranked[0]
    for each in ranked[1:]:
        if _gain(singles, each.name, best.name) > VERY_STRONG_BIC:
            best = each
    return best


def _gain(singles: list[SegmentedRecording], law: str, than: str) -> float:
    """By how much the BIC of a gradual rupture is lower than that of another."""
    gain = 0.0
    for single in singles:
        one, other = (single.fits[name] for name in (law, than))
        n = independent_samples([one.residuals.noises[0], other.residuals.noises[0]])
        more = len(one.order) - len(other.order)
        gain += bic_gain(one.residuals.noises[0].sse, other.residuals.noises[0].sse, more, n)
    return gain


def _bic(singles: list[SegmentedRecording], law: str) -> float:
    return float(sum(single.loading[law].bic for single in singles))


def _much_better(singles: list[SegmentedRecording], law: str, than: str) -> bool:
    """Whether the evidence for one law against another is very strong, counted in independent samples."""
    gain = 0.0
    for single in singles:
        one, other = (single.loading[name] for name in (law, than))
        n = independent_samples([one.noise, other.noise])
        gain += bic_gain(one.noise.sse, other.noise.sse, len(one.order) - len(other.order), n)
    return gain > VERY_STRONG_BIC


def _puncture_ratio(singles: list[SegmentedRecording], law: str) -> float:
    """Median of modelled over measured force at the puncture; NaN where none is known."""
    ratios = [match.ratio for match in (match_of(single, law) for single in singles) if match is not None]
    return statistics.median(ratios) if ratios else math.nan


def held_by_tissue(single: SegmentedRecording) -> bool:
    """Whether the tissue pulls at the needle over a quarter of the withdrawal, as it does only after the needle has
    entered: by more than five standard deviations of the noise and than the zero changes within a recording."""
    events, strokes = single.events, single.strokes
    if events.contact is None or events.baseline is None:
        return False
    inside = strokes.force_out[strokes.depth_out > events.contact.depth]
    min_pull = max(CROSSING_SIGMA * events.noise, MAX_BASELINE_CHANGE * peak_force(single))
    return len(inside) > 0 and float(np.percentile(inside, HELD_SHARE)) < events.baseline - min_pull


def goes_in_only(singles: list[SegmentedRecording]) -> bool:
    """Whether no recording has a withdrawal, and half of those with contact have two punctures or more."""
    touching = [single for single in singles if single.events.contact is not None]
    several = sum(len(single.events.punctures) > 1 for single in touching)
    return bool(several) and 2 * several >= len(touching) and not any(len(s.strokes.depth_out) for s in touching)


def misses_cycle(fit: Fit, singles: list[SegmentedRecording]) -> bool:
    """Whether the one-layer fit leaves more than 5 % of the peak over insertion, hold and withdrawal, and more than the
    noise over the strokes, in at least half of the complete recordings: a force that relaxes at rest is no evidence for
    layers."""
    complete = [
        (one, single)
        for one, single in zip(fit.recordings, singles)
        if len(one.residuals) and len(single.strokes.depth_out)
    ]
    missed = [_share(one, _samples(single)) > MAX_RESIDUAL and _misses_strokes(one, single) for one, single in complete]
    return bool(missed) and 2 * sum(missed) >= len(missed)


def _misses_strokes(one: RecordingFit, single: SegmentedRecording) -> bool:
    """Whether the fit leaves more than the noise over insertion and withdrawal."""
    strokes, free = single.strokes, single.free_noise
    noise = max(white_noise(strokes.force_in), 0.0 if free is None else math.sqrt(free.variance))
    left = one.residuals[np.concatenate([strokes.index_in, strokes.index_out])]
    return math.sqrt(np.mean(left**2)) > MAX_NOISE_RATIO * noise


def _samples(single: SegmentedRecording) -> np.ndarray:
    """Sample numbers (n,) of insertion, hold and withdrawal, without those where friction reverses, which has a travel
    of its own in either model; of the insertion without a withdrawal."""
    used = np.zeros(len(single.recording.time), bool)
    for samples in (single.strokes.index_in, single.strokes.index_out):
        used[samples] = True
    for span in single.events.spans(Phase.hold) if len(single.strokes.index_out) else ():
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

    def sentence(self, law: str, layered: str, span: str = CYCLE) -> str:
        """The choice between two models, by their names, in words; ``span`` is what was compared."""
        chosen, other = (layered, law) if self.for_layers else (law, layered)
        return (
            f"The model is {chosen}: over {span} the residual is {100 * self.one_layer:.2g} % of the peak with one "
            f"layer ({law}) and {100 * self.layered:.2g} % with layers. Give model='{other}' for the other one."
        )


def cycle_evidence(one: Fit, layered: Fit, singles: list[SegmentedRecording], shared: int) -> CycleEvidence | None:
    """The evidence of the recordings that both models describe; None without one.

    Correlated samples count as one. The one-layer model has its own parameters in every recording, the layered one
    those of its recordings and the ones that they share, so many.
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
    more = shared + sum(len(second.parameters) - len(first.parameters) for first, second, _ in both)
    shares = [(_share(first, chosen), _share(second, chosen)) for first, second, chosen in both]
    one_layer, several = np.sqrt(np.mean(np.square(shares), axis=0)).tolist()
    return CycleEvidence(one_layer=one_layer, layered=several, gain=gain - more * math.log(samples))


def _compared(one: np.ndarray, layered: np.ndarray) -> tuple[float, float]:
    """Independent samples of two residuals, and minus twice the logarithm of their ratio of likelihoods."""
    noises = [noise_of(each, len(each)) for each in (one, layered)]
    return independent_samples(noises), misfit_gain(noises[1], noises[0])


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
    return replace(
        layered,
        parameters={**own, **taken},
        recordings=tuple(map(_with_own, layered.recordings, one.recordings)),
        warnings=(*layered.warnings, *warnings),
    )


def _with_own(layered: RecordingFit, one: RecordingFit) -> RecordingFit:
    """The layered fit of a recording with the puncture depth of its one-layer fit, and the notes on what is taken."""
    name, notes = "puncture_depth", tuple(dict.fromkeys((*layered.notes, *one.notes)))
    measured = name in one.parameters and one.parameters[name].identifiable
    own = {**layered.parameters, name: one.parameters[name]} if measured else layered.parameters
    return replace(layered, parameters=own, notes=notes)


def _overlap(one: Estimate, other: Estimate) -> bool:
    return one.low <= other.high and other.low <= one.high


def _disagreement(name: str, model: Estimate, measured: Estimate) -> str:
    depths = {"model": f"{1e3 * model.value:.3g} mm", "measured": f"{1e3 * measured.value:.3g} mm"}
    return DISAGREES.format(name=name, **depths)
