# SPDX-License-Identifier: Apache-2.0
"""The numbers of a layered fit by name, with intervals."""

import numpy as np

from ..covariance import Z_95, noise_of
from ..estimates import Estimate
from ..pooling import student
from .search import Solved

OF_A_LAYER = {
    "stiffness_coefficient": "N/m^2",
    "saturation_depth": "m",
    "contact_stiffness": "N/m",
    "puncture_depth": "m",
    "puncture_indentation": "m",
    "friction_per_length": "N/m",
    "tissue_stiffness": "N/m",
    "rupture_length": "m",
    "resting_surface": "m",
}
UNFELT = 1e-9  # of the median: no run tells of a number that its residuals feel less
SHARES = {"relaxation_share_1": "1", "relaxation_share_2": "1"}
MOST_FACTOR = 3.0  # a positive number that may be so much larger is not told
ENOUGH = 3  # repeats for a scatter
SIGNED = {"contact_depth", "top", "puncture_depth", "resting_surface"}


def prefix(layer: int) -> str:
    """Nothing for the first layer, layer_2_ for the second."""
    return f"layer_{layer + 1}_" if layer else ""


def units(layers: int) -> dict[str, str]:
    """Every name with its SI unit, in the order of ``values``."""
    found = {}
    for layer in range(layers):
        found[f"{prefix(layer)}{'top' if layer else 'contact_depth'}"] = "m"
        found |= {prefix(layer) + name: unit for name, unit in OF_A_LAYER.items()}
    return found | SHARES


def values(solved: Solved, x: np.ndarray, but: int | None = None) -> np.ndarray:
    """The named numbers (p,) of x at the mean punctures, those of the run ``but`` left out; deeper tops below the
    surface, other depths in the recording's zero."""
    unknowns = solved.problem.unknowns
    punctures = unknowns.punctures(x) if but is None else np.delete(unknowns.punctures(x), but, axis=0)
    rows = unknowns.rows(x[None], punctures.mean(axis=0)[None])[0]
    surface, found = rows[0, 2], []
    for c, saturation, top, puncture, grip, stiffness, rupture, resting in rows[:, :8]:
        place = top - surface if found else top
        slope = 2.0 * c * min(saturation, puncture - top)
        found += [place, c, saturation, slope, puncture, puncture - top, grip, stiffness, rupture, resting]
    return np.array([*found, rows[0, 8], rows[0, 10]])


def estimates(solved: Solved) -> dict[str, Estimate]:
    """Every number with its interval: Student's on the jackknife over repeats, never below the error within runs.

    With fewer than three repeats it is the error within runs alone.
    """
    layers, count = solved.problem.unknowns.layers, len(solved.problem.courses)
    value, (within, moves) = values(solved, solved.x), _errors(solved)
    positive = np.array([not any(name.endswith(word) for word in SIGNED) for name in units(layers)])
    reach = max(float(np.ptp(course.depth)) for course in solved.problem.courses)
    half, between = Z_95 * within, [None] * len(value)
    source = f"layered fit, {count} recordings"
    if count >= ENOUGH:
        error = np.sqrt((count - 1) / count * (moves**2).sum(axis=0))
        half, between = np.fmax(half, student(count) * error), (error * np.sqrt(count)).tolist()
        source = f"{source}, jackknife over repeats"
    made = {}
    for k, (name, unit) in enumerate(units(layers).items()):
        low, high = _limits(float(value[k]), float(half[k]), bool(positive[k]))
        told = high < MOST_FACTOR * value[k] if positive[k] else half[k] < reach
        made[name] = Estimate(name, float(value[k]), unit, low, high, between[k], bool(told), source)
    return made


def _limits(value: float, half: float, positive: bool) -> tuple[float, float]:
    """Limits of a number; of one that is positive by its logarithm."""
    if not np.isfinite(half):
        return (0.0 if positive else -np.inf), np.inf
    if not positive or value <= 0.0:
        return value - half, value + half
    factor = np.exp(min(half / value, 300.0))
    return value / factor, value * factor


def _errors(solved: Solved) -> tuple[np.ndarray, np.ndarray]:
    """Standard errors (p,) from the noise within the runs, neighbours alike, inf for what no run feels; and by how much
    each run, left out, moves the numbers, less the mean, (runs, p).

    The moves are one Gauss-Newton step each: the force jumps at ruptures, where a search would come to rest.
    """
    problem, size = solved.problem, solved.problem.unknowns.size
    grams, slopes, longs = [], [], []
    for run, course in enumerate(problem.courses):
        places, jacobian = problem.jacobian(run, solved.x)
        residual, gram, slope = problem.residuals(run, solved.x), np.zeros((size, size)), np.zeros(size)
        gram[np.ix_(places, places)], slope[places] = jacobian.T @ jacobian, jacobian.T @ residual
        grams, slopes = [*grams, gram], [*slopes, slope]
        longs.append(noise_of(residual, len(course.depth)).long_run)
    whole, by = sum(grams), _by_unknowns(solved)
    felt = whole.diagonal() > UNFELT * np.median(whole.diagonal()[problem.unknowns.free])
    bread = _inverse(whole, felt)
    within = by @ bread @ sum(long * gram for long, gram in zip(longs, grams)) @ bread @ by.T
    steps = [-_inverse(whole - gram, felt) @ (sum(slopes) - slope) for gram, slope in zip(grams, slopes)]
    own = values(solved, solved.x)
    moves = np.array([by @ step + values(solved, solved.x, but) - own for but, step in enumerate(steps)])
    sought = np.isin(np.arange(size), problem.unknowns.free)
    unfelt = np.abs(by[:, ~felt & sought]).max(axis=1, initial=0.0) > 0.0
    error = np.where(unfelt, np.inf, np.sqrt(np.maximum(within.diagonal(), 0.0)))
    return error, moves - moves.mean(axis=0)


def _inverse(gram: np.ndarray, felt: np.ndarray) -> np.ndarray:
    """Inverse of J'J (size, size), zero for what is not felt; scaled, directions without data left away."""
    part = felt & (gram.diagonal() > 0.0)
    scale = 1.0 / np.sqrt(gram.diagonal()[part])
    found = np.zeros_like(gram)
    inner = np.linalg.pinv(gram[np.ix_(part, part)] * np.outer(scale, scale), rcond=1e-10, hermitian=True)
    found[np.ix_(part, part)] = inner * np.outer(scale, scale)
    return found


def _by_unknowns(solved: Solved) -> np.ndarray:
    """Derivatives (p, size) of the named numbers by x."""
    columns, step = [], 1e-5
    for k in range(solved.problem.unknowns.size):
        move = np.zeros(solved.problem.unknowns.size)
        move[k] = step
        up, down = (values(solved, solved.x + sign * move) for sign in (1.0, -1.0))
        columns.append((up - down) / (2.0 * step))
    return np.array(columns).T
