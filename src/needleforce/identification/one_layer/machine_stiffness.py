# SPDX-License-Identifier: Apache-2.0
"""A machine in series with the needle: sensor, holder and drive yield by the force over their stiffness, and the tip is
behind the recorded depth by as much.

It bends the loading curve, turns the friction of the insertion and that of the withdrawal to opposite sides, and
spreads the reversal between them. A recording shows it where the complete fit leaves more than the noise without a
machine, and no more with one. Its compliance is not above that of the fall of the force where the needle turns: what
yields there is in series. Where a machine only fits better, the intervals hold the values with and without it.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ... import core
from ...errors import InputError
from ...models.parameter_units import UNITS
from ...recording import Recording
from ...segmentation import Events, segment
from ..estimates import Estimate, pool
from ..statistics.noise import SIGNIFICANT, TWO_SIDED, Noise
from ..statistics.regression import VERY_STRONG_BIC, inverse
from ..strokes import Strokes
from .cycle_fit import fit_cycle
from .cycle_values import CycleFit, CycleOptions, CycleResiduals, cycle_jacobian
from .segmented_recording import STAGE, SegmentedRecording, segmented

NAME = "machine_stiffness"
SOURCE = "a machine in series, with which the complete fit leaves no more than the noise"
FOUND = (
    "A machine (sensor, holder, drive) of {:.4g} N/mm ({:.4g} to {:.4g}) in series with the needle explains what the "
    "fit of the recorded depth leaves beyond the noise. The depths are therefore those of the tip: less by the force "
    "over this stiffness. Give machine_stiffness where it is known."
)
POSSIBLE = (
    "With a machine (sensor, holder, drive) of about {:.2g} N/mm in series the model fits better, which may have "
    "another cause: the intervals hold the values with and without it. Give machine_stiffness where it is known."
)
KNOWN = "machine stiffness: {:.4g} N/mm, as given; the depths are those of the tip, less by the force over it"
BEYOND = 1.1  # of the compliance of the reversal, which is measured too
STEP = 0.01  # of the largest compliance, to which the least sum of squares is searched
PARTS = 8  # of the travel to a peak
BLOCKS = 1000  # of samples, in the test whether a machine is to be sought
ABSORBING = ("contact_depth", "stiffness_coefficient", "friction_per_length", "cutting_force", "force_offset")
NESTED = ("cone", "cone_cylinder")  # in the complete fit with a machine


def at_tip(recording: Recording, stiffness: float, events: Events | None = None) -> Recording:
    """The recording with the depth of the tip behind a machine of a ``stiffness`` [N/m], from the unloaded one.

    Raises InputError for a stiffness not above 0, or with which the tip would be above the surface while it is pushed.
    """
    if not (math.isfinite(stiffness) and stiffness > 0.0):
        raise InputError(NAME, f"{stiffness} N/m", "must be above 0", next_step="Give it in N/m, or leave it out.")
    events = events or segment(recording)
    force = recording.force
    if events.contact is not None:
        force = force - float(np.median(force[: max(events.contact.low, 1)]))
        _check(stiffness, recording, force, events)
    columns = {"time": recording.time, "depth": recording.depth - force / stiffness, "force": recording.force}
    axes = recording.axes | {STAGE: recording.depth}
    return Recording(**columns, axes=axes, card=recording.card, notes=recording.notes)


def _check(stiffness: float, recording: Recording, force: np.ndarray, events: Events) -> None:
    """Raises InputError where the force (n,) [N] rises by more, over the travel to a peak or a part of it, than the
    machine alone yields: the tip would move outwards while the needle is pushed in."""
    peaks = [int(np.argmax(force)), *(int(np.searchsorted(recording.time, each.time)) for each in events.punctures)]
    steepest = max(_steepest(recording, force, events, peak) for peak in peaks)
    if stiffness <= steepest:
        raise InputError(
            NAME,
            f"{1e-3 * stiffness:.3g} N/mm",
            f"it must exceed {1e-3 * steepest:.3g} N/mm, by which the force rises over travel on the way to a peak: "
            "less would leave nothing of this travel to the tissue",
            recording.name,
            "Give the stiffness of sensor, holder and drive in series, or leave it out.",
        )


def _steepest(recording: Recording, force: np.ndarray, events: Events, peak: int) -> float:
    """The largest rise of the force over the travel [N/m] from the contact to the sample ``peak``, over all of it or
    one of eight parts, without what noise adds once in 1000 of these; negative without such a travel."""
    first, depth = int(np.searchsorted(recording.time, events.contact.time)), recording.depth
    travel = float(depth[peak]) - events.contact.depth
    if not travel > 0.0:
        return -math.inf
    found = [float(force[peak]) / travel]
    blocks = [block for block in np.array_split(np.arange(first, peak + 1), PARTS + 1) if len(block)]
    for one, other in itertools.pairwise(blocks):
        part = float(depth[other].mean() - depth[one].mean())
        noise = SIGNIFICANT * events.noise * math.sqrt(1.0 / len(one) + 1.0 / len(other))
        if part > 0.5 * travel / PARTS:
            found.append((float(force[other].mean() - force[one].mean()) - noise) / part)
    return max(found)


def machine_stiffness_of(singles: Sequence[SegmentedRecording]) -> Estimate | None:
    """The stiffness of the machine that all repeats share, if more than half of those with a fit show one; not
    identifiable where it only fits better in half of them."""
    known = [single for single in singles if single.fits]
    found = [estimate for estimate in map(_shown, known) if estimate is not None]
    sure = [estimate for estimate in found if estimate.identifiable]
    chosen = next((each for each in (sure, found) if 2 * len(each) > len(known)), None)
    return pool([{NAME: each} for each in chosen])[NAME] if chosen else None


def behind(single: SegmentedRecording, stiffness: Estimate) -> SegmentedRecording:
    """A recording segmented at the tip behind a machine, with its readings at the ends of the interval of the
    ``stiffness``; as it was recorded, with its reading behind the softer end, where the machine is not identifiable.
    One that it cannot be of stays as it is."""
    recording, events = single.recording, single.events
    ends = {"stiffer machine": stiffness.high, "softer machine": stiffness.low}
    try:
        if not stiffness.identifiable:
            return replace(single, fits={}, readings={"machine": at_tip(recording, stiffness.low, events)})
        others = {cause: at_tip(recording, end, events) for cause, end in ends.items()}
    except InputError:
        return single
    return replace(segmented(at_tip(recording, stiffness.value, events)), readings=others)


def with_machine(fit: Any, machine: Estimate | float | None) -> Any:
    """The fit of recordings at the tip with the ``machine`` stiffness [N/m], found or given, as a parameter."""
    if machine is None or not fit.parameters:
        return fit
    if isinstance(machine, Estimate):
        if not machine.identifiable:
            return replace(fit, warnings=(*fit.warnings, POSSIBLE.format(1e-3 * machine.value)))
        sentence = FOUND.format(*(1e-3 * value for value in (machine.value, machine.low, machine.high)))
        return replace(fit, parameters=fit.parameters | {NAME: machine}, warnings=(sentence, *fit.warnings))
    known = Estimate(NAME, machine, UNITS[NAME], machine, machine, source="given")
    held = (KNOWN.format(1e-3 * machine), *fit.held_fixed)
    return replace(fit, parameters=fit.parameters | {NAME: known}, held_fixed=held)


@dataclass(frozen=True, eq=False)
class Profile:
    """Complete fits of the strokes with a machine of any compliance [m/N]."""

    strokes: Strokes
    options: CycleOptions

    def residuals(self, compliance: float) -> CycleResiduals | None:
        """The residuals of the fit; None where there is none."""
        s = self.strokes
        depths = s.depth_in - compliance * s.force_in, s.depth_out - compliance * s.force_out
        try:
            return fit_cycle(depths[0], s.force_in, depths[1], s.force_out, self.options, limited=False).residuals
        except InputError:
            return None

    def squares(self, compliance: float) -> float:
        """Sum of squares [N²]; infinite without a fit."""
        found = self.residuals(compliance)
        return math.inf if found is None else found.sse


def _shown(single: SegmentedRecording) -> Estimate | None:
    """The stiffness of the machine that one recording shows: with which the evidence of a fit is very strongly better,
    and identifiable if the fit leaves more than the noise without it alone; None without such evidence."""
    strokes, events = single.strokes, single.events
    reversal, noise = strokes.friction_reversal, single.free_noise
    if reversal is None or noise is None or len(events.punctures) != 1 or events.punctures[0].gradual:
        return None
    fits = [fit for law, fit in single.fits.items() if law in NESTED]
    if fits and not _score(fits[0], strokes, noise) > TWO_SIDED:
        return None
    push, pull = float(np.median(strokes.force_in[-5:])), float(np.median(strokes.force_out[:5]))
    largest = BEYOND * 2.0 * reversal.half / max(push - pull, 1e-12)
    options = CycleOptions(law="cone_cylinder", filter_length=single.recording.card.filter_length)
    profile = Profile(strokes, options)
    without = profile.residuals(0.0)
    if without is None or not largest > 0.0:
        return None
    best, error = _best(profile, largest)
    left = profile.residuals(best)
    gain = VERY_STRONG_BIC + math.log(without.count)
    if left is None or not best > TWO_SIDED * error or without.sse - left.sse < noise.long_run * gain:
        return None
    puncture = events.punctures[0]
    amplified = 1.0 + best * puncture.force / max(puncture.indentation, 1e-12)  # the noise is in the tip's depth too
    sure = without.rmse > _explained(noise) and left.rmse <= amplified * _explained(noise)
    ends = 1.0 / (best + TWO_SIDED * error), 1.0 / (best - TWO_SIDED * error)
    return Estimate(NAME, 1.0 / best, UNITS[NAME], *ends, source=SOURCE, identifiable=sure)


def _score(fit: CycleFit, strokes: Strokes, noise: Noise) -> float:
    """The misfit that a machine would reduce, in standard errors: that along the derivative of the force by a
    compliance, without what the parameters absorb (the score test, which needs no fit with a machine); of means of
    ``size`` samples, which lose nothing."""
    before, w, (depth_in, force_in, depth_out, force_out) = fit.puncture.before, fit.puncture.left_out, strokes.arrays
    size = max((len(depth_in) + len(depth_out)) // BLOCKS, 1)
    insertion, withdrawal = fit.residuals.insertion, fit.residuals.withdrawal
    parts = [
        [each[used] for each in (depth_in, force_in, insertion)]
        for used in (slice(before - w), slice(before + w, None))
    ]
    loading, cut, back = (
        np.array([each[: len(each) // size * size].reshape(-1, size).mean(axis=1) for each in part])
        for part in (*parts, (depth_out, force_out, withdrawal))
    )
    depth, force, residual = np.hstack([loading, cut, back])
    first = loading.shape[1] + cut.shape[1]
    values = {"saturation_depth": math.inf} | fit.values
    slopes = cycle_jacobian(values, (depth[:first], force, depth[first:], force), loading.shape[1], ABSORBING)
    gram = core.gram(np.vstack([slopes, -slopes[0] * force, residual]))
    absorbed = inverse(gram[:-2, :-2]) @ gram[:-2, -2]
    along = float(gram[-2, -2] - gram[:-2, -2] @ absorbed)
    return -float(gram[-1, -2] - gram[-1, :-2] @ absorbed) / math.sqrt(max(noise.long_run / size * along, 1e-300))


def _explained(noise: Noise) -> float:
    """Root mean square [N] that the noise of the free travel explains, once in a thousand recordings more."""
    independent = max(noise.count * noise.variance / noise.long_run, 1.0) if noise.long_run > 0.0 else noise.count
    return math.sqrt(noise.variance) * (1.0 + SIGNIFICANT / math.sqrt(2.0 * independent))


def _best(profile: Profile, largest: float) -> tuple[float, float]:
    """The compliance [m/N] with the least sum of squares, and its standard error; none where it is above the
    ``largest``: what a machine cannot explain by the fall of the force is no machine."""
    from scipy.optimize import minimize_scalar

    found = minimize_scalar(profile.squares, bounds=(0.0, largest), method="bounded", options={"xatol": STEP * largest})
    best, step = float(found.x), 0.05 * largest
    low, middle, high = (profile.residuals(best + k * step) for k in (-1, 0, 1))
    if low is None or middle is None or high is None:
        return 0.0, math.inf
    bend = (low.sse - 2.0 * middle.sse + high.sse) / step**2
    if not bend > 0.0 or (best := best - 0.5 * (high.sse - low.sse) / step / bend) > largest:
        return 0.0, math.inf
    long_run = max(noise.long_run for noise in middle.noises)
    return best, math.sqrt(2.0 * long_run / bend)
