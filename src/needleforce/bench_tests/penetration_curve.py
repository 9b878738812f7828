# SPDX-License-Identifier: Apache-2.0
"""The curve of a penetration test: its insertion stroke, its noise at every length, and its steady end."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import core
from ..display.quantities import counted, plain
from ..errors import InputError
from ..identification.one_layer.force_zero import Coefficient, slope_without_contact
from ..identification.statistics.evidence import CurveNoise, curve_noise
from ..identification.statistics.noise import SIGNIFICANT
from ..recording import Recording
from ..recording.force_signal import outliers, quantum_of, without_outliers
from ..segmentation import Events, segment
from ..segmentation.doubtful import MAX_ALTERNATION_SHARE, STEP_GAP, first_step, saturated
from ..segmentation.strokes import cut_samples, deepest_sample
from ..vocabulary import SMALLEST

CLEARLY_FREE, MIN_SLOPE_SAMPLES = 0.8, 20  # share of the readings before contact that show a slope, and their number
NOMINAL_SPEED = 1e-3  # [m/s] of a curve without time, for the search of its contact
NORMAL_95 = 1.96
STEADY_BLOCKS = 400  # blocks of the end of a curve in which the steady part is searched
STEADY_PARTS = 4  # parts of the steady stretch whose means agree
STEADY_CHI2 = 7.81  # of their differences: 5 % by chance, three degrees of freedom
MIN_STEADY_BLOCKS = 16
MIN_STEADY_SHARE = 0.25  # of the travel since the last peak
STEADY_ENDS = (1.0, 0.98, 0.95)  # of that travel: a machine slows down before it stops
MAX_STEADY_CHANGE = 0.1  # of the mean: change over the stretch that the interval of the slope leaves open


def check_options(work_to: float | None, stretch_: tuple[float, float] | None, min_fall: float, tips: int) -> None:
    """Raise InputError for an option of ``penetration_test`` that is out of range."""
    if work_to is not None and not 0.0 < work_to < np.inf:
        raise InputError("work_to", work_to, "a travel above 0 is needed", next_step="Give it in metres.")
    if stretch_ is not None and not (len(stretch_) == 2 and stretch_[0] < stretch_[1]):
        limit, step = "first and last travel are needed", "Give for example (3e-3, 8e-3), in metres."
        raise InputError("plateau_travel", stretch_, limit, next_step=step)
    if not 0.0 <= min_fall < np.inf:
        raise InputError("min_fall", min_fall, "a force of at least 0 is needed", next_step="Give it in newtons.")
    if tips < 1:
        raise InputError("tips", tips, "must be at least 1", next_step="Give the number of tips that enter.")


def curve_arrays(travel: Any, force: Any, name: str) -> tuple[str, np.ndarray, np.ndarray, tuple[str, ...]]:
    """Name, (n,) travel and force without rows that are not numbers, and notes. Raises InputError for other shapes."""
    notes: tuple[str, ...] = ()
    if isinstance(travel, Recording):
        assumed = (each for each in travel.card.assumptions if not each.startswith("velocity"))  # which is not used
        notes = (*assumed, *(note.message for note in travel.notes))
        name, travel, force = name or travel.name, travel.depth, travel.force
    values = np.asarray(force if force is not None else (), dtype=float)
    if np.ndim(travel) == 0:
        if not 0.0 < float(travel) < np.inf:
            limit, step = "a travel from sample to sample above 0 is needed", "Give it in metres, or an array."
            raise InputError("travel", travel, limit, next_step=step)
        travel = float(travel) * np.arange(len(np.atleast_1d(values)))
    travel = np.asarray(travel, dtype=float)
    if travel.shape != values.shape or travel.ndim != 1:
        limit, step = f"force has {values.shape}", "Give two arrays (n,) of equal length."
        raise InputError("shape of travel", travel.shape, limit, name, step)
    if np.isinf(travel).any() or np.isinf(values).any():
        raise InputError(
            "travel and force", "infinite", "finite values are needed", name, "Correct or remove the rows."
        )
    known = np.isfinite(travel) & np.isfinite(values)
    last = int(np.flatnonzero(known)[-1]) + 1 if known.any() else 0
    if not known[:last].all():
        count = int((~known[:last]).sum())
        notes += (f"{counted(count, 'row')} without a number {'is' if count == 1 else 'are'} left out.",)
    return name, travel[known], values[known], notes


def insertion_stroke(travel: np.ndarray, force: np.ndarray) -> tuple[np.ndarray, np.ndarray, tuple[str, ...]]:
    """Travel and force of the insertion stroke, increasing and positive, and what was assumed."""
    notes: list[str] = []
    if len(travel) < 3:
        return travel, force, ()
    size = float(np.ptp(travel))
    if not size > 0.0:
        return travel[:1], force[:1], ()
    if core.noise_exceeds(np.ascontiguousarray(travel), MAX_ALTERNATION_SHARE * size):
        limit, step = "it jumps back and forth from sample to sample", "Sort the samples by time."
        raise InputError("travel", "in no order", limit, next_step=step)
    if travel[0] - travel[-1] > 0.5 * size:
        travel = -travel
        notes.append("Travel decreases in the file: it is reversed, so that it increases into the film.")
    first = int(travel[: int(travel.argmax()) + 1].argmin())
    last = deepest_sample(travel, force) + 1
    if last < len(travel) and travel[last - 1] - travel[last:].min() > 0.01 * size:
        notes.append("The needle goes back after its largest travel: the insertion up to there is used.")
    z, f = travel[first:last], force[first:last]
    if len(z) > 1 and np.any(np.diff(z) < 0.0):
        kept = cut_samples(np.ascontiguousarray(z), 0, len(z), 2)[0]
        z, order = np.maximum.accumulate(z[kept]), kept
        f = f[order]
        if len(kept) < 0.95 * (last - first):
            notes.append("Rests and pull-backs during the insertion are left out.")
    if len(f) and -f.min() > abs(f.max()):
        f = -f
        notes.append("The force is negative against the insertion: its sign is reversed.")
    return np.ascontiguousarray(z), np.ascontiguousarray(f), tuple(notes)


@dataclass(frozen=True, kw_only=True)
class Plateau:
    """The steady end: samples ``first`` up to ``last``, ``start`` and ``stop`` [m], ``mean`` force with its standard
    ``error`` and the ``sd``, ``smallest`` and ``largest`` reading [N]."""

    first: int
    last: int
    start: float
    stop: float
    mean: float
    error: float
    sd: float
    smallest: float
    largest: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Curve:
    """An insertion ready for its figures: (n,) ``travel`` [m] from the contact, or from its first sample, and ``force``
    [N] above that of the free travel, with its ``noise``.

    ``contact`` [m] in the recorded travel, None for a curve that begins in contact, at sample ``start``; 95 % error of
    the contact and ``rounding`` of the travel [m], standard error of the force's zero [N], and the ``limit`` [N] of a
    saturated sensor, infinite if it is not saturated.
    """

    travel: np.ndarray
    force: np.ndarray
    noise: CurveNoise
    rounding: float
    contact: float | None
    start: int
    contact_error: float
    zero_error: float
    limit: float
    notes: tuple[str, ...]


def curve_of(travel: np.ndarray, force: np.ndarray, notes: tuple[str, ...], *, baseline: bool = True) -> Curve:
    """The curve of an insertion stroke: outliers replaced, contact and zero of the force found by segmentation; the
    recorded zero is kept without ``baseline``."""
    quantum, found = quantum_of(force), list(notes)
    wrong = outliers(force, quantum)
    if len(wrong):
        found.append(f"{counted(len(wrong), 'outlier')} of the force replaced by the neighbours.")
    force = without_outliers(force, wrong)
    noise = curve_noise(force, quantum)
    stepped, by = first_step(force, max(quantum, noise.of_mean(1)))
    if stepped:
        place = f"at a travel of {plain(float(travel[stepped]), 'm')}, from one steady level to another"
        found.append(f"The force steps by {plain(by, 'N')} {place}: the zero steps, and what is before is left out.")
        travel, force = travel[stepped + STEP_GAP :], force[stepped + STEP_GAP :]
    at_limit, zero = saturated(travel, force, quantum, noise.of_mean(1)), 0.0
    time = np.arange(len(travel)) * float(travel[-1] - travel[0]) / (len(travel) - 1) / NOMINAL_SPEED
    events = segment(Recording(time=time, depth=travel, force=force))
    if before := _transient(travel, force, noise, events):
        length = plain(float(travel[before] - travel[0]), "m")
        text = f"In the first {length} the force rises and comes back to where it began, and stays there for longer: "
        found.append(text + "a transient of the machine before contact, left out.")
        travel, force, time = travel[before:], force[before:], time[before:]
        events = segment(Recording(time=time - time[0], depth=travel, force=force))
    contact, start, errors = None, 0, (0.0, 0.0)
    if events.contact is None or events.baseline is None:
        text = "The curve begins in contact: travel counts from its first sample, and the zero of the force is taken"
        found.append(text + " as recorded.")
    else:
        contact, zero = float(events.contact.depth), events.baseline if baseline else 0.0
        start = int(np.searchsorted(travel, contact))
        # the force is certainly above the noise there; the earliest place not excluded may be anywhere before
        error = float(travel[min(events.contact.high, len(travel) - 1)]) - contact
        errors = max(error, 0.0), noise.of_mean(max(start, 1)) if baseline else 0.0
        free = int(CLEARLY_FREE * start)
        if baseline and (slope := _slope_without_contact(travel[:free], force[:free])):
            before = f"The force changes by {plain(slope.value, 'N/m')} before contact, as {free} readings show"
            found.append(f"{before}: the zero drifts, and this slope is taken off the curve.")
            force = force - slope.value * (travel - contact)
            zero = float(force[:free].mean())
            errors = errors[0], float(np.hypot(errors[1], slope.error * (travel[-1] - travel[:free].mean())))
    if at_limit is not None:
        found.append(f"The force stands at exactly its maximum for {counted(at_limit[1], 'sample')}, as of a saturated "
                     "sensor: peaks at it are lower bounds.")  # fmt: skip
    return Curve(
        travel=travel - (travel[0] if contact is None else contact),
        force=force - zero,
        noise=noise,
        rounding=0.5 * quantum_of(np.ascontiguousarray(travel)),
        contact=contact,
        start=start,
        contact_error=errors[0],
        zero_error=errors[1],
        limit=float(force.max()) - zero if at_limit is not None else np.inf,
        notes=tuple(found),
    )


def _transient(travel: np.ndarray, force: np.ndarray, noise: CurveNoise, events: Events) -> int:
    """The samples up to the end of a first fall that leaves no force of a needle in tissue, 0 without one: the force
    rose at once, and then is flat and as at the beginning for twice as long, with further falls behind."""
    if events.contact is None or len(events.punctures) < 2:
        return 0
    end, rise = events.punctures[0].end, int(np.searchsorted(travel, events.contact.depth))
    after, first = slice(end, 3 * end), max(end // 8, 1)
    if 2 * rise > end or 3 * end > len(force) or _slope_without_contact(travel[after], force[after]):
        return 0
    change = abs(float(force[after].mean() - force[:first].mean()))
    return end if change <= SIGNIFICANT * np.hypot(noise.of_mean(first), noise.of_mean(2 * end)) else 0


def _slope_without_contact(travel: np.ndarray, force: np.ndarray) -> Coefficient | None:
    """The slope of the force over the (n,) travel before contact; None where noise explains it."""
    if len(travel) < MIN_SLOPE_SAMPLES or not np.ptp(force) > 0.0:
        return None
    slope = slope_without_contact(travel, force)
    return slope if slope.is_significant else None


def work_of(curve: Curve, end: float) -> tuple[float, float]:
    """The work [J] from zero to the travel ``end`` [m] by the trapezoidal rule, and half of its 95 % interval."""
    z = curve.travel
    at = np.concatenate(([0.0], z[(z > 0.0) & (z < end)], [min(end, float(z[-1]))]))
    values = np.interp(at, z, curve.force)
    work = float(np.trapezoid(values, at))
    coarse = np.append(np.arange(0, len(at) - 1, 2), len(at) - 1)
    rule = abs(work - float(np.trapezoid(values[coarse], at[coarse]))) / 3.0
    weights = 0.5 * (np.diff(at, prepend=at[0]) + np.diff(at, append=at[-1]))
    reading = curve.noise.of_mean(len(at)) * len(at) ** 0.5
    ends = (curve.rounding + curve.contact_error) / 3**0.5 * abs(float(values[-1]))
    errors = (reading * float(weights @ weights) ** 0.5, curve.zero_error * float(at[-1]), ends)
    return work, NORMAL_95 * float(np.hypot.reduce(errors)) + rule


def plateau(travel: np.ndarray, force: np.ndarray, first: int) -> Plateau | None:
    """The longest stretch at the end of the (n,) curve after sample ``first`` that is steady, or None.

    Steady: the 95 % interval of the slope contains zero and leaves open a change of less than a tenth of the mean, and
    the means of four parts agree; errors are those of the correlated readings about the line.
    """
    total = float(travel[-1] - travel[first])
    for share in STEADY_ENDS:
        last = int(np.searchsorted(travel, travel[first] + share * total, side="right"))
        size = max(1, (last - first) // STEADY_BLOCKS)
        count = (last - first) // size
        if count < MIN_STEADY_BLOCKS:
            return None
        z, f = (core.block_means(np.ascontiguousarray(values[last - count * size : last]), size)
                for values in (travel, force))  # fmt: skip
        for a in range(count - MIN_STEADY_BLOCKS + 1):
            if z[-1] - z[a] < MIN_STEADY_SHARE * total:
                break
            error = steady_error(z[a:], f[a:])
            if error is not None:
                return stretch(travel, force, last - (count - a) * size, last, error)
    return None


def steady_error(z: np.ndarray, f: np.ndarray) -> float | None:
    """The standard error of the mean of (m,) forces [N] over travel [m] if they are steady, otherwise None."""
    slope, error, mean_error = line_errors(z, f)
    length, level = float(z[-1] - z[0]), abs(float(f.mean()))
    if abs(slope) > NORMAL_95 * error or (abs(slope) + NORMAL_95 * error) * length > MAX_STEADY_CHANGE * level:
        return None
    parts = np.array([part.mean() for part in np.array_split(f, STEADY_PARTS)])
    spread = float(((parts - parts.mean()) ** 2).sum()) / max(STEADY_PARTS * mean_error**2, SMALLEST)
    return mean_error if spread <= STEADY_CHI2 else None


def line_errors(z: np.ndarray, f: np.ndarray) -> tuple[float, float, float]:
    """Slope of a line through (m,) forces [N] over travel [m], its standard error, and that of the mean.

    The readings about the line are correlated from one to the next as a first-order autoregression.
    """
    place = z - z.mean()
    squares = max(float(place @ place), SMALLEST)
    slope = float(place @ f) / squares
    left = f - f.mean() - slope * place
    sd = max(float((left @ left) / max(len(f) - 2, 1)) ** 0.5, 1e-9 * float(np.abs(f).max()))
    correlation = float(left[1:] @ left[:-1]) / max(float(left @ left), SMALLEST)
    correlation = min(max(correlation + 1.0 / len(f), 0.0), 0.99)
    inflation = ((1.0 + correlation) / (1.0 - correlation)) ** 0.5
    return slope, sd * inflation / squares**0.5, sd * inflation / len(f) ** 0.5


def stretch(travel: np.ndarray, force: np.ndarray, first: int, last: int, error: float) -> Plateau:
    """Mean, standard deviation and range of the force from sample ``first`` up to ``last``."""
    part = force[first:last]
    return Plateau(
        first=first,
        last=last,
        start=float(travel[first]),
        stop=float(travel[last - 1]),
        mean=float(part.mean()),
        error=error,
        sd=float(part.std(ddof=1)),
        smallest=float(part.min()),
        largest=float(part.max()),
    )
