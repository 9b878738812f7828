# SPDX-License-Identifier: Apache-2.0
"""The contact depth over all loading laws that a recording does not exclude, and its bounds without a law.

A cone fits the loading curve of a polynomial within the noise, with a contact a tenth of a millimetre off. Where the
law is chosen from the data, the interval of the contact carries that choice: a posterior over the laws.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ... import core
from ..statistics.noise import LEVEL, TWO_SIDED, noise_of
from ..statistics.regression import inverse
from ..strokes import undelayed_depth
from .cycle_values import CycleFit
from .deformation_fit import fitted_curve
from .fit_recording import loading_samples
from .loading_curves import CURVES, LoadingCurve
from .model_errors import widened
from .segmented_recording import SegmentedRecording
from .strokes_below import AFTER, strokes_below

BINS = 48  # of the samples in contact, as means: smooth curves lose nothing
MIN_BINS = 12
STARTS = np.linspace(0.05, 0.95, 5)  # [of the range of contacts]
NODES, ROUNDS = 15, 5  # contacts of each law's profile, and times that they are narrowed to those with weight
MAX_LOG_RATIO = 12.0  # a contact with less weight has none
FITTED = 4.0  # that a fit takes from the residual: amplitude, zero, contact, shape
MAX_HIDDEN = 0.5  # [of the indentation] before the force shows a contact
STEEPEST, SEGMENTED = 3.0, 2.0  # exponents of the loading curve: the largest here, and that of the segmentation's range


@dataclass(frozen=True, eq=False, kw_only=True)
class Found:
    """Least squares of one law: the sum of squares [N²], the residual (k,) [N], the contact depth ``place`` and the
    shape parameter, SI."""

    squares: float
    residual: np.ndarray
    place: float
    shape: float


@dataclass(frozen=True, eq=False, kw_only=True)
class Loading:
    """Means of depth and force (k,) over equal numbers of samples up to the puncture, and the range ``low`` to ``high``
    [m] in which the force leaves its noise, whatever the law; the sensor gives the force in steps of ``step`` [N]."""

    depth: np.ndarray
    force: np.ndarray
    low: float
    high: float
    step: float = 0.0

    @property
    def rounding(self) -> float:
        """Long-run variance [N²] of the bins by rounding: the bins of one step share its error."""
        if not self.step > 0.0:
            return 0.0
        steps = max(float(np.ptp(self.force)) / self.step, 1.0)
        return self.step**2 / 12.0 * max(float(np.sum(self.depth > self.high)) / steps, 1.0)

    @property
    def indentation(self) -> float:
        """Of the last bin, from the end of the range of contacts [m]."""
        return float(self.depth.max()) - self.high

    def least_squares(self, curve: LoadingCurve) -> "Found | None":
        """The best fit of a law with its contact in the range; None where it cannot be fitted."""
        low = (self.low - self.high) / self.indentation
        scales = {"contact": self.high, "indentation": self.indentation}
        contacts = low * (1.0 - STARTS), (low, 0.0)
        values, squares = fitted_curve(curve, self.depth, self.force, **scales, contacts=contacts)
        if not math.isfinite(squares):
            return None
        place, shape = values["contact_depth"], next((values[name] for name in curve.shape), 0.0)
        residual = self.force - values["force_offset"] - curve.force(self.depth - place, values)
        return Found(squares=squares, residual=residual, place=place, shape=shape)

    def squares(self, curve: LoadingCurve, places: np.ndarray, near: float) -> np.ndarray:
        """Sums of squares (n,) [N²] of a law with its contact at each of ``places`` (n,) [m], with its shape started
        ``near`` a value; infinite where it cannot be fitted."""
        starts, ends = (0.0,), (0.0, 0.0)
        for each in curve.shape.values():
            starts = (near / self.indentation**each.power, each.starts[len(each.starts) // 2])
            ends = each.low, each.high
        found = core.loading_profile(
            self.depth,
            self.force,
            law=curve.law.name,
            contact=self.high,
            indentation=self.indentation,
            places=(places - self.high) / self.indentation,
            shapes=np.array(starts),
            shape_range=ends,
        )
        return np.array(found)


def loading_of(single: SegmentedRecording) -> Loading | None:
    """The loading curve of one recording in bins; None with too few samples in contact.

    The range of contacts is that of segmentation, from the last sample that is certainly free to the first that is
    certainly in contact for forces that rise with a power of 1 to 2, extended to a power of 3: such a force is hidden
    in the noise over more of the indentation. A recording that begins in contact has no lower end: there it is one
    indentation long.
    """
    strokes, contact = single.strokes, single.events.contact
    used = loading_samples(single.recording, strokes, single.events)
    depth, force = strokes.depth_in[used], strokes.force_in[used]
    low, high = sorted(undelayed_depth(single.recording)[[contact.low, contact.high]].tolist())
    touching = int(np.sum(depth > high))
    if touching < MIN_BINS or not depth[-1] > high > low:
        return None
    deepest, step = float(depth.max()), single.force_step
    if single.events.baseline is None:
        low = high - (deepest - high)
    else:
        hidden = min(((high - low) / (deepest - low)) ** (SEGMENTED / STEEPEST), MAX_HIDDEN)
        low = min(low, (high - hidden * deepest) / (1.0 - hidden))
    if step > 0.0:  # up to half a step, a rising force reads as the zero
        hidden = min(math.sqrt(0.5 * step / max(float(np.ptp(force)), step)), MAX_HIDDEN)
        low = min(low, (low - hidden * deepest) / (1.0 - hidden))
    size = max(touching // BINS, 1)
    before = int(np.argmax(depth > low)) - 2 * BINS * size
    count = (len(depth) - max(before, 0)) // size
    first = len(depth) - count * size
    z, f = (values[first:].reshape(count, size).mean(axis=1) for values in (depth, force))
    return Loading(depth=z, force=_straightened(f, size), low=low, high=high, step=step)


def _straightened(mean: np.ndarray, size: int) -> np.ndarray:
    """The force (k,) in the middle of each bin: the mean of a curve is off by a 24th of its second difference."""
    bent = np.zeros_like(mean)
    if size > 1:
        bent[1:-1] = (mean[2:] - 2.0 * mean[1:-1] + mean[:-2]) / 24.0
    return mean - bent


def contact_interval(loading: Loading) -> tuple[float, float] | None:
    """Interval [m] of the contact depth over the laws, each with its shape free, within the range without a law.

    Every contact has the least squares of each law there (profile likelihood), with the noise of the law that fits
    best. The laws have Akaike's weights (Burnham & Anderson 2002, sec. 2.9): a cone and a polynomial differ by less
    than the noise at contact depths a quarter of a millimetre apart, and the BIC, which becomes sure of the simpler law
    with the number of samples, leaves out the truth there. None where no law can be fitted.
    """
    best = {name: loading.least_squares(curve) for name, curve in CURVES.items()}
    best = {name: found for name, found in best.items() if found is not None}
    if not best:
        return None
    closest = min(best.values(), key=lambda found: found.squares).residual
    noise = max(noise_of(closest, len(closest), 1, FITTED).long_run, loading.rounding)
    if not noise > 0.0:
        return None
    weights = {name: 1 - len(CURVES[name].parameters) - 0.5 * found.squares / noise for name, found in best.items()}
    largest = max(weights.values())
    likely = [name for name, weight in weights.items() if weight > largest - MAX_LOG_RATIO]
    return _ends([(weights[name] - largest, *_profile(loading, CURVES[name], best[name], noise)) for name in likely])


def _profile(loading: Loading, curve: LoadingCurve, best: Found, noise: float) -> tuple[np.ndarray, np.ndarray]:
    """Contacts (n,) [m] that have weight under one law, and their likelihood (n,), 1 at the best."""
    low, high = loading.low, loading.high
    for _ in range(ROUNDS):
        places = np.unique([*np.linspace(low, high, NODES), best.place])
        squares = loading.squares(curve, places, best.shape)
        likely = np.flatnonzero(squares - squares.min() < 2.0 * MAX_LOG_RATIO * noise)
        if len(likely) > NODES // 2:
            break
        low, high = places[max(likely[0] - 1, 0)], places[min(likely[-1] + 1, len(places) - 1)]
    return places, np.exp(-0.5 * (squares - squares.min()) / noise)


def _ends(parts: list[tuple[float, np.ndarray, np.ndarray]]) -> tuple[float, float]:
    """The quantiles of a mixture: log weights, contacts (n,), and their likelihoods (n,), scaled here to one area."""
    grid = np.unique(np.concatenate([places for _, places, _ in parts]))
    below = np.zeros_like(grid)
    for weight, places, likelihood in parts:
        area = np.append(0.0, np.cumsum(0.5 * (likelihood[1:] + likelihood[:-1]) * np.diff(places)))
        below += math.exp(weight) * np.interp(grid, places, area / area[-1])
    low, high = np.interp((0.5 * (1.0 - LEVEL), 0.5 * (1.0 + LEVEL)), below / below[-1], grid)
    return float(low), float(high)


def over_laws(single: SegmentedRecording, law: str) -> SegmentedRecording:
    """The recording with the choice of the law in the intervals of one law's fit."""
    fit = single.fits.get(law)
    loading = None if fit is None or single.events.contact is None else loading_of(single)
    found = None if loading is None else contact_interval(loading)
    if found is None:
        return single
    moved = [each.get("contact_depth", 0.0) for each in fit.causes.values()]  # by readings of unknown law
    found = found[0] + min([0.0, *moved]), found[1] + max([0.0, *moved])
    return replace(single, fits=single.fits | {law: with_contact(fit, found, _slopes(single, fit))})


def _slopes(single: SegmentedRecording, fit: CycleFit) -> dict[str, float]:
    """Change of the other parameters with the contact depth: of the law's by its covariance, of friction and cutting by
    least squares of the strokes below the puncture."""
    place = fit.order.index("contact_depth")
    variance = float(fit.covariance[place, place])
    found = dict.fromkeys(fit.order, 0.0)
    if 0.0 < variance < math.inf:
        across = np.where(np.isfinite(fit.covariance[place]), fit.covariance[place], 0.0) / variance
        found |= dict(zip(fit.order, across.tolist()))
    parts = strokes_below(fit, single)
    if parts and parts[0].inwards:
        lever = sum(part.shown * part.products[:2, 1] * (1.0 if part.inwards else -1.0) for part in parts)
        moved = fit.values["friction_per_length"] * inverse(sum(part.gram for part in parts)) @ lever
        found |= dict(zip(AFTER, np.nan_to_num(moved).tolist()))
    return found | {"contact_depth": 1.0}


def with_contact(fit: CycleFit, interval: tuple[float, float], slopes: Mapping[str, float]) -> CycleFit:
    """The fit with a contact that may be anywhere in ``interval`` [m] too; the others follow by their ``slopes``."""
    name = "contact_depth"
    less, more = max(fit.low[name] - interval[0], 0.0), max(interval[1] - fit.high[name], 0.0)
    if not (less > 0.0 or more > 0.0):
        return fit
    low, high = dict(fit.low), dict(fit.high)
    slopes = {"puncture_indentation": -1.0, **slopes}
    for each, slope in slopes.items():
        changes = (-slope * less, slope * more, 0.0)
        low[each], high[each] = fit.low[each] + min(changes), fit.high[each] + max(changes)
    place = fit.order.index(name)
    wanted = (0.5 * (high[name] - low[name]) / TWO_SIDED) ** 2
    added = max(wanted - float(np.nan_to_num(fit.covariance[place, place])), 0.0)
    moved = {each: TWO_SIDED * math.sqrt(added) * slope for each, slope in slopes.items()}
    return widened(fit, low, high, {"law": moved})
