# SPDX-License-Identifier: Apache-2.0
"""Bending stiffness of a rod from three-point bending: of its elastic part, between slack and yielding or break."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from ..display.quantities import plain
from ..errors import InputError
from ..identification.statistics.evidence import CurveNoise, Departure, curve_noise, departure, long_run
from ..identification.statistics.noise import TWO_SIDED, student_quantile
from ..recording.force_signal import quantum_of
from ..vocabulary import SMALLEST
from .bending import MIN_READINGS, BendingFit, small_deflection_note
from .elastica import three_point_load
from .stress_fit import inflation_of

_NOT_JUDGED = Departure(ratio=0.0, limit=math.inf)
MAX_EDGES = 41  # places at which a part may begin and end
MIN_PART_READINGS = 8
MIN_RISE = 0.1  # of the range of the readings: a smaller part may be a step or a slip
STEEPER_SIGMA = 4.0  # [standard errors] by which a shorter part is steeper, so that it counts
SMOOTH_CHANGE = 0.2  # of the slope from one part to the next: more is another regime, such as a toe or yielding
TRIM = 0.2  # of a part, left out at an end where the curve continues: it is found late that the line does not
MIN_SEARCHED = 2 * MIN_PART_READINGS  # readings; of fewer all are used
BROKEN = 0.5  # of the largest elastic force: less after it is a break
PASSES = 4  # of the search: the slack bends the scale on which a large deflection is straight
PIECES = 4  # of a part that no line describes, whose slopes are the interval
SETTLED = 1e-5  # of the range of the deflection: a smaller change of the slack ends the search
MAX_SHARE = 0.5  # of the span: the end of the closed form


@dataclass(frozen=True, kw_only=True)
class StraightPart:
    """Readings ``first`` up to ``last`` of a curve, the ``slope`` of their line with its standard ``error``, and their
    ``departure`` from it, which is found only where no part is straight; ``near`` are the slopes of as many readings
    before and after, where they differ little: of a curve that bends throughout."""

    first: int
    last: int
    slope: float
    error: float
    departure: Departure = _NOT_JUDGED
    near: tuple[float, ...] = ()

    @property
    def used(self) -> slice:
        """Its readings."""
        return slice(self.first, self.last)


def three_point_modulus(
    force: ArrayLike, deflection: ArrayLike, span: float, second_moment: float | None = None
) -> BendingFit:
    """Young modulus of a rod from three-point bending, large deflections included.

    Parameters
    ----------
    force, deflection : array_like
        Force (n,) [N] at the middle of the span, and deflection there (n,) [m], while the load grows.
    span : float
        Distance of the supports [m]; the rod slides on them without friction.
    second_moment : float, optional
        Second moment of area I [m^4], such as ``needle.second_moment``; without it only E I is found.

    Returns
    -------
    BendingFit
        Without ``second_moment`` the moduli are NaN.

    Raises
    ------
    InputError
        With fewer than three readings, or no force that grows with the deflection.

    Notes
    -----
    Least squares of F = E I ``three_point_load``((deflection - slack)/span)/span^2 over E I and slack, of the elastic
    part alone (``straight_part``): readings before it are slack or a toe, those after it yield or follow a break.
    Compliance of machine and supports, friction on the supports and their radius are not part of it: subtract the
    first, and keep the deflection below a tenth of the span for the others. Residuals that are correlated widen the
    interval as in ``fit_stress``, and so does the noise of the readings; where no part is straight, the interval is
    that of the slopes of its quarters.
    """
    force, deflection = np.asarray(force, float), np.asarray(deflection, float)
    if len(force) < MIN_READINGS:
        raise InputError(
            "number of bending readings", len(force), f"at least {MIN_READINGS} are needed", next_step="Give more."
        )
    order = np.argsort(deflection, kind="stable")
    x, y = np.ascontiguousarray(deflection[order] / span), np.ascontiguousarray(force[order])
    part, slack = _elastic_part(x, y)
    found = _fitted(x[part.used], y[part.used], part, slack)
    stiffness = span**2 * np.array([found.value, found.low, found.high])
    modulus = stiffness / (math.nan if second_moment is None else second_moment)
    used = np.zeros(len(y), bool)
    used[order[part.used]] = True
    fit = BendingFit(
        young_modulus=float(modulus[0]),
        low=float(modulus[1]),
        high=float(modulus[2]),
        bending_stiffness=float(stiffness[0]),
        stiffness_low=float(stiffness[1]),
        stiffness_high=float(stiffness[2]),
        slack=found.slack * span,
        small_deflection_modulus=found.small / 48.0 * float(modulus[0]) / found.value,
        misfit=found.rms / float(np.abs(y).max()),
        used=used,
    )
    notes = [*_notes(x * span, y, part), *(small_deflection_note(fit) if second_moment is not None else [])]
    return replace(fit, notes=tuple(notes))


def _straightened(share: np.ndarray) -> np.ndarray:
    """Deflections over the span on the scale on which the force is a line."""
    return np.sign(share) * three_point_load(np.minimum(np.abs(share), MAX_SHARE)) / 48.0


def _elastic_part(x: np.ndarray, y: np.ndarray) -> tuple[StraightPart, float]:
    """The elastic part and its slack over the span. Raises InputError without a force that grows."""
    scale, slack = x, 0.0
    part = StraightPart(first=0, last=len(x), slope=0.0, error=0.0)
    for _ in range(PASSES):
        if len(y) >= MIN_SEARCHED:
            part = straight_part(scale, y, _noise(x, y, part.slope))
        slope, offset = np.polyfit(scale[part.used], y[part.used], 1)
        if not slope > 0.0:
            step = "Check the signs of the columns, or reverse one with --unit deflection=-mm."
            raise InputError("force", "not growing with the deflection", next_step=step)
        change, scale = float(offset / slope), _straightened(x - slack + offset / slope)
        slack -= change
        if 0.0 < abs(change) < SETTLED * float(np.ptp(x)):
            break
    return part, slack


def _noise(x: np.ndarray, y: np.ndarray, slope: float) -> CurveNoise:
    """The noise of the force with that of the deflection, such as its rounding."""
    own, other = curve_noise(y, quantum_of(y)), curve_noise(x, 0.0)
    return replace(own, deviations=np.hypot(own.deviations, slope * other.deviations))


@dataclass(frozen=True, kw_only=True)
class _Line:
    """E I over the span squared [N], its interval, and by the formula for small deflections times 48; slack over the
    span; root mean square of the residual [N]."""

    value: float
    low: float
    high: float
    small: float
    slack: float
    rms: float


def _fitted(x: np.ndarray, y: np.ndarray, part: StraightPart, slack: float) -> _Line:
    """E I and slack by least squares of the elastic part."""
    from scipy.optimize import least_squares

    slope = float(np.polyfit(x, y, 1)[0])
    size, top = np.array([slope / 48.0, 1.0]), float(np.abs(y).max())

    def residual(z: np.ndarray) -> np.ndarray:
        return (z[0] * size[0] * 48.0 * _straightened(x - z[1]) - y) / top

    found = least_squares(residual, [1.0, slack], xtol=1e-12, ftol=1e-14, gtol=1e-14)
    left = found.fun
    inflation = inflation_of([left], 2)
    unit = float(np.linalg.inv(found.jac.T @ found.jac)[0, 0]) ** 0.5
    spread = (2.0 * found.cost / (len(y) - 2) * inflation) ** 0.5
    half = student_quantile(max(int(len(y) / inflation) - 2, 1)) * spread * unit
    half = max(half, TWO_SIDED * part.error / max(part.slope, SMALLEST) * float(found.x[0]))
    ends = float(found.x[0]) - half, float(found.x[0]) + half
    slopes = list(part.near)
    if part.departure.found:  # no part is straight: the stiffness is that of one of its pieces
        place = _straightened(x - found.x[1])
        pieces = zip(np.array_split(place, PIECES), np.array_split(y, PIECES))
        slopes = [float(np.polyfit(*piece, 1)[0]) for piece in pieces]
    ends = min([ends[0], *(each / slope for each in slopes)]), max([ends[1], *(each / slope for each in slopes)])
    return _Line(value=float(found.x[0] * size[0]), low=float(ends[0] * size[0]), high=float(ends[1] * size[0]),
                 small=slope, slack=float(found.x[1]), rms=top * float(np.sqrt(np.mean(left**2))))  # fmt: skip


def _notes(deflection: np.ndarray, force: np.ndarray, part: StraightPart) -> list[str]:
    """Sentences on the readings that are not of the elastic part, and on one that is not straight."""
    count, notes = part.last - part.first, []
    if part.departure.found:
        notes.append(
            f"No part of the curve is straight within its noise: the slow part of the residual is "
            f"{part.departure.ratio**0.5:.3g} times what that explains. The interval holds the slopes of its quarters."
        )
    if count < len(force):
        ends = " to ".join(plain(float(each), "m") for each in deflection[[part.first, part.last - 1]])
        notes.append(f"The elastic part is used, {count} of {len(force)} readings, from {ends}, up to "
                     f"{plain(float(force[part.used].max()), 'N')}.")  # fmt: skip
    if part.near:
        notes.append("The curve bends beyond it too: the interval holds the slopes next to it.")
    elif part.first:
        notes.append("Before it the rod is slack, or it seats.")
    if part.last < len(force) and not part.near:
        after = force[part.last :]
        fallen = float(after.min()) < BROKEN * float(force[part.used].max())
        notes.append("After it the force falls: the rod breaks or slips." if fallen else "After it the rod yields.")
    return notes


def straight_part(x: np.ndarray, y: np.ndarray, noise: CurveNoise) -> StraightPart:
    """The straight part of (n,) readings y over rising x.

    Of the parts that a line describes within the noise and that rise by a tenth of all readings, the one that rises
    furthest, unless a shorter one is steeper by four standard errors: toe and yielding are less steep than the part
    between them (ASTM D790, toe compensation). Without such a part it is all readings.
    """
    best: StraightPart | None = None
    for each in _parts(x, y, noise):
        if best is None or each.slope > best.slope + STEEPER_SIGMA * float(np.hypot(best.error, each.error)):
            best = best if departure(x[each.used], y[each.used], noise).found else each
    if best is None:
        return _judged(x, y, noise, _part(x, y, noise, 0, len(x)))
    size = best.last - best.first
    first = best.first + int(TRIM * size) * (best.first > 0)
    last = best.last - int(TRIM * size) * (best.last < len(x))
    ends = (first, last) if last - first >= MIN_PART_READINGS else (best.first, best.last)
    return replace(_judged(x, y, noise, _part(x, y, noise, *ends)), near=tuple(_near(x, y, best)))


def _near(x: np.ndarray, y: np.ndarray, part: StraightPart) -> Iterator[float]:
    size = part.last - part.first
    for first, last in ((max(part.first - size, 0), part.first), (part.last, min(part.last + size, len(x)))):
        if last - first >= MIN_PART_READINGS:
            slope = float(np.polyfit(x[first:last], y[first:last], 1)[0])
            if abs(slope / part.slope - 1.0) < SMOOTH_CHANGE:
                yield slope


def _parts(x: np.ndarray, y: np.ndarray, noise: CurveNoise) -> Iterator[StraightPart]:
    """The parts between two edges that rise enough, the one that rises furthest first: with the lines of all of them by
    sums up to each edge."""
    edges = _edges(x, y)
    first, last = (edges[each] for each in np.triu_indices(len(edges), 1))
    first, last = (each[last - first >= MIN_PART_READINGS] for each in (first, last))
    place, values, size = x - x.mean(), y - y.mean(), last - first
    sums = (np.append(0.0, np.cumsum(each)) for each in (place, values, place**2, place * values))
    places, heights, squares, products = (each[last] - each[first] for each in sums)
    squares = np.maximum(squares - places**2 / size, 1e-300)
    slope = (products - places * heights / size) / squares
    rise = slope * (x[last - 1] - x[first])
    for k in np.argsort(-rise, kind="stable")[: np.count_nonzero(rise > MIN_RISE * np.ptp(y))].tolist():
        error = float(long_run(noise, int(size[k])) / squares[k]) ** 0.5
        yield StraightPart(first=int(first[k]), last=int(last[k]), slope=float(slope[k]), error=error)


def _edges(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Places in equal steps of x and of the rise of y together: a short steep part has as many as a long one."""
    size = max(len(y) // (4 * MAX_EDGES), 1)
    smooth = np.convolve(np.pad(y, (size // 2, size - 1 - size // 2), mode="edge"), np.full(size, 1.0 / size), "valid")
    rise = np.maximum.accumulate(smooth)
    along = (x - x[0]) / max(float(np.ptp(x)), 1e-300) + (rise - rise[0]) / max(float(np.ptp(rise)), 1e-300)
    return np.unique(np.append(np.searchsorted(along, np.linspace(0.0, along[-1], MAX_EDGES)[:-1]), len(x)))


def _part(x: np.ndarray, y: np.ndarray, noise: CurveNoise, first: int, last: int) -> StraightPart:
    place, values = x[first:last], y[first:last]
    from_mean = place - place.mean()
    squares = max(float(from_mean @ from_mean), 1e-300)
    return StraightPart(
        first=first,
        last=last,
        slope=float(from_mean @ values) / squares,
        error=(long_run(noise, last - first) / squares) ** 0.5,
    )


def _judged(x: np.ndarray, y: np.ndarray, noise: CurveNoise, part: StraightPart) -> StraightPart:
    return replace(part, departure=departure(x[part.used], y[part.used], noise))
