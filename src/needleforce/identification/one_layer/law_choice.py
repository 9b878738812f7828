# SPDX-License-Identifier: Apache-2.0
"""The choice of the stiffness law: by the loading curves' BIC, among the laws that meet the measured puncture force."""

import math
import statistics
from weakref import WeakKeyDictionary

from ..result import Choice
from ..statistics.noise import noise_of
from ..statistics.regression import VERY_STRONG_BIC, bic_gain, independent_samples
from .loading_curves import FITS
from .puncture_force import MeasuredPeak, PunctureMatch, measured_peak, puncture_match
from .segmented_recording import SegmentedRecording

SIGNIFICANT = 3.29  # [standard errors] noise exceeds it once in a thousand recordings
MIN_FREE_SAMPLES = 50  # of free travel, for its noise


_peaks: WeakKeyDictionary[SegmentedRecording, dict[str, MeasuredPeak | None]] = WeakKeyDictionary()


def peak_of(single: SegmentedRecording, law: str) -> MeasuredPeak | None:
    """The measured force at the puncture of one recording, which is measured once for each law."""
    known = _peaks.setdefault(single, {})
    if law not in known:
        known[law] = _measured_peak(single, law)
    return known[law]


def _measured_peak(single: SegmentedRecording, law: str) -> MeasuredPeak | None:
    events, strokes = single.events, single.strokes
    free = strokes.place_in(events.contact.low) if events.contact is not None else 0
    given = single.recording.card.filter_length, free
    found = measured_peak(strokes, single.fits[law], events.punctures[0], *given)
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
    events, strokes = single.events, single.strokes
    free = strokes.force_in[: strokes.place_in(events.contact.low) if events.contact is not None else 0]
    if law not in single.loading or len(free) < MIN_FREE_SAMPLES:
        return False
    found = single.loading[law].noise
    noise = noise_of(free - free.mean(), len(free), single.recording.card.filter_length, 1.0)
    if not noise.variance > 0.0:
        return not found.sse > 0.0
    correlation = noise.long_run / noise.variance
    scatter = math.sqrt(2.0 * correlation * (1.0 / len(free) + 1.0 / found.count))
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
    ranked = sorted(choices, key=lambda each: sum(len(single.fits[each.name].covariance_order) for single in singles))
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
        n = independent_samples([one.noises[0], other.noises[0]])
        more = len(one.covariance_order) - len(other.covariance_order)
        gain += bic_gain(one.noises[0].sse, other.noises[0].sse, more, n)
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
