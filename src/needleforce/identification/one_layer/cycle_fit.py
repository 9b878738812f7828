# SPDX-License-Identifier: Apache-2.0
"""The complete fit of one insertion and withdrawal with the one-layer model, without starting values."""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from ... import core
from ...errors import InputError
from ...vocabulary import SMALLEST
from ..statistics.noise import MAX_GAIN_GAP, ONE_SIDED
from .cycle_values import CycleEstimates, CycleFit, CycleOptions

MIN_SAMPLES = 50  # of the insertion
SATURATION_STEPS = 4096  # of the grid of saturation depths down to the puncture


def fit_cycle(
    depth_in: np.ndarray,
    force_in: np.ndarray,
    depth_out: np.ndarray | None,
    force_out: np.ndarray | None,
    options: CycleOptions | None = None,
    *,
    limited: bool = True,
) -> CycleFit:
    """Fit one insertion, (n,) depth [m] and force [N] each, and its withdrawal, (m,), None or empty if missing.

    Both strokes are in the order of time, + inwards, force + against insertion, without hold samples:

    | insertion  | b above z0, b + c g(z - z0) up to the puncture, b + f' (z - z0) + f_c after it |
    | withdrawal | b - f' (z - z0) below z0, b above |

    b is the sensor's zero. Without free travel and without a withdrawal, b and f_c are one constant: their intervals
    are then infinite.

    z - z0 is the embedded length after the puncture. g = h² for the law ``cone``; ``cone_cylinder`` continues it beyond
    h_s by 2 h_s h - h_s² (Galin's contact with a fixed edge). With several punctures, end the insertion before the
    second: the one-layer model has one drop, and otherwise the best puncture may be at the edge of the window (with a
    warning).

    Where the best fit has no saturation, the lower limit of its depth takes several more fits. Not ``limited``, they
    are left for ``limit_saturation``, as of a law that may not be chosen.

    Variable projection (Golub & Pereyra 1973) over running sums, an exhaustive scan of the puncture, then Gauss-Newton.
    The intervals (``covariance``) include noise, not errors of the model. BIC counts every sample as independent.

    Raises InputError for unequal lengths, values that are not finite, too few samples, no travel, no possible puncture,
    an unknown law and impossible options.
    """
    given = options or CycleOptions()
    strokes = _checked(depth_in, force_in, depth_out, force_out)
    saturation, free = _saturation(given.law, given.saturation_depth)
    left_out = _left_out(given.filter_length, len(strokes[0]))
    solve = partial(_solve, strokes, left_out, given.puncture_window)
    expected = 1.5 * given.filter_length  # long-run variance over plain variance
    found = solve(saturation, free, MAX_GAIN_GAP * expected)
    estimates = CycleEstimates(found, strokes, given, left_out)
    profile = found
    long_run = estimates.noises[0].long_run
    if long_run > expected * estimates.variance:  # then more punctures are possible than the core returned
        profile = solve(saturation, free, MAX_GAIN_GAP * long_run / estimates.variance)
    fit = estimates.fit(free, profile)
    if limited and free and estimates.x["saturation_depth"] == np.inf:
        fit = replace(fit, low=fit.low | {"saturation_depth": _min_saturation(solve, estimates)}, options=None)
    return fit


def limit_saturation(fit: CycleFit, *strokes: np.ndarray | None) -> CycleFit:
    """A fit of these ``strokes`` that was not ``limited``, as it is with the lower limit of its saturation depth."""
    name = "saturation_depth"
    if fit.options is None or not (fit.saturation_sought and fit.values[name] == np.inf):
        return fit
    limit = fit_cycle(*strokes, fit.options).low[name]
    return replace(fit, low=fit.low | {name: min(fit.low[name], limit)}, options=None)


def _solve(
    strokes: list[np.ndarray],
    left_out: int,
    window: tuple[float, float] | None,
    saturation: float,
    free: bool,
    margin: float,
) -> dict:
    """The result of the compiled fit; raises InputError where it fails."""
    found = core.fit_cycle(
        *strokes,
        saturation=saturation,
        free_saturation=free,
        leave_out=left_out,
        **_window(window),
        margin=margin,
    )
    _refuse_failure(found["outcome"], strokes, window)
    if not (math.isfinite(found["sse"]) and np.isfinite(found["matrices"]).all()):
        step = "Give more samples before the puncture, or begin above the surface."
        raise InputError("fit of the cycle", "not finite", "the samples do not determine it", "insertion", step)
    return found


def _min_saturation(solve: Callable, estimates: CycleEstimates) -> float:
    """One-sided lower limit [m] of the saturation depth where the best fit has no saturation: the first of a fine grid
    whose sum of squares the noise allows; 0 where a fit for it fails.

    The sum of squares grows with a power of the distance from the puncture, about the fifth, for the force changes by
    the distance's square over the distance: the next fit is at a secant of the logarithms, after eight in the middle.
    """
    best, deepest = estimates.found["sse"], estimates.strokes[0][estimates.before - 1] - estimates.x["contact_depth"]
    excess = max(ONE_SIDED**2 * estimates.noises[0].long_run, SMALLEST)
    low, high, guess, power, known = 0, SATURATION_STEPS, SATURATION_STEPS // 5 * 4, 5.0, []
    while high - low > 1:
        try:
            above = max(solve(deepest * guess / SATURATION_STEPS, False, 0.0)["sse"] - best, SMALLEST)
        except InputError:
            return 0.0
        low, high = (guess, high) if above > excess else (low, guess)
        x, y = math.log(SATURATION_STEPS - guess), math.log(above / excess)
        power = min(max((y - known[-1][1]) / (x - known[-1][0]), 1.0), 20.0) if known else power
        known.append((x, y))
        guess = math.floor(SATURATION_STEPS - math.exp(x - y / power)) + (guess == low)
        if len(known) > 8 or not low < guess < high:
            guess = (low + high) // 2
    return float(deepest * high / SATURATION_STEPS)


def _checked(
    depth_in: ArrayLike, force_in: ArrayLike, depth_out: ArrayLike | None, force_out: ArrayLike | None
) -> list[np.ndarray]:
    """The four arrays as contiguous float64, of equal lengths by stroke."""
    strokes = []
    for stroke, depth, force in (("insertion", depth_in, force_in), ("withdrawal", depth_out, force_out)):
        pair = [np.ascontiguousarray(() if a is None else a, dtype=np.float64) for a in (depth, force)]
        if pair[0].ndim != 1 or pair[0].shape != pair[1].shape:
            shapes = f"{pair[0].shape} and {pair[1].shape}"
            raise InputError("shape of depth and force", shapes, "they must be (n,) of the same length", stroke)
        strokes += pair
    n = len(strokes[0])
    if n < MIN_SAMPLES:
        step = "Record at a higher rate."
        raise InputError("number of samples", n, f"at least {MIN_SAMPLES} are needed", "insertion", step)
    first, last = strokes[0][[0, -1]]
    if last <= first:
        value = f"{first:.6g} m at its start and {last:.6g} m at its end"
        raise InputError(
            "depth of the insertion", value, "it must increase", next_step="Depth is + inwards: flip its sign."
        )
    return strokes


def _saturation(law: str, depth: float | None) -> tuple[float, bool]:
    """The saturation depth for the core, and whether it is fitted."""
    if law == "cone":
        if depth is not None:
            step = "Use the law cone_cylinder."
            raise InputError("saturation_depth", depth, "the law cone has none", next_step=step)
        return np.inf, False
    if law != "cone_cylinder":
        raise InputError("law", repr(law), "unknown", next_step="Give cone or cone_cylinder.")
    if depth is not None and not depth > 0.0:
        raise InputError("saturation_depth", f"{depth} m", "it must be positive")
    return (np.inf, True) if depth is None else (float(depth), False)


def _left_out(filter_length: int, n: int) -> int:
    if filter_length < 1 or filter_length != int(filter_length):
        limit = "it must be a whole number of samples, 1 for no filter"
        raise InputError("filter_length", filter_length, limit)
    if filter_length > n // 20:
        limit = f"it must be at most a twentieth of the insertion's {n} samples, which are left out at a step"
        raise InputError("filter_length", filter_length, limit, next_step="Use a shorter filter or a longer insertion.")
    return int(filter_length) if filter_length > 1 else 0


def _window(window: tuple[float, float] | None) -> dict[str, float]:
    if window is None:
        return {"puncture_low": -np.inf, "puncture_high": np.inf}
    low, high = map(float, window)
    if not low < high:
        raise InputError("puncture_window", f"{low} to {high} m", "the lower limit must be below the upper limit")
    return {"puncture_low": low, "puncture_high": high}


def _refuse_failure(outcome: str, strokes: list[np.ndarray], window: tuple[float, float] | None) -> None:
    """Raises InputError with the reason why the core found no fit."""
    if outcome == "found":
        return
    names = ("depth of the insertion", "force of the insertion", "depth of the withdrawal", "force of the withdrawal")
    for name, values in zip(names, strokes):
        bad = np.flatnonzero(~np.isfinite(values))
        if len(bad) > 0:
            raise InputError(name, values[bad[0]], "it must be finite", f"sample {bad[0]}", "Remove such samples.")
    where = f" within {window[0]:.6g} to {window[1]:.6g} m" if window else ""
    limit = f"a puncture needs 2 % of the samples before and after it{where}"
    step = "Widen puncture_window or give more samples."
    raise InputError("number of possible punctures", 0, limit, "insertion", step)
