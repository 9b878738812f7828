# SPDX-License-Identifier: Apache-2.0
"""The complete fit of one insertion and withdrawal with the one-layer model, without starting values."""

from collections.abc import Callable
from functools import partial

import numpy as np

from ... import core
from ...errors import InputError
from ..statistics.noise import MARGIN, Z_90
from .cycle_estimates import CycleEstimates, CycleFit

LEAST_SAMPLES = 50


def fit_cycle(
    depth_in: np.ndarray,
    force_in: np.ndarray,
    depth_out: np.ndarray | None,
    force_out: np.ndarray | None,
    *,
    law: str = "cone",
    saturation_depth: float | None = None,
    filter_length: int = 1,
    puncture_window: tuple[float, float] | None = None,
) -> CycleFit:
    """Fit one insertion, (n,) depth [m] and force [N] each, and its withdrawal, (m,), None or empty if cut off.

    Both strokes are in the order of time, + inwards, force + against insertion, bias removed, hold samples left away:

    | insertion  | 0 above z0, c g(z - z0) up to the puncture, f' (z - z0) + f_c after it |
    | withdrawal | -f' (z - z0) below z0, 0 above |

    g = h² for the law ``cone``; ``cone_cylinder`` continues it beyond h_s by 2 h_s h - h_s² (Galin's contact with a
    fixed edge), h_s being ``saturation_depth`` or, if that is None, fitted. ``puncture_window`` [m] bounds the
    puncture's depth. Where there are several punctures, end the insertion before the second: one layer knows one drop,
    and with more of them the least sum of squares lies at the window's edge (a warning says so).

    ``filter_length`` is that of the average filter in samples, 1 if none. The filter smears both steps: as many samples
    on each side of them are left out. It also delays the force by (filter_length - 1) / 2 samples, and depths are taken
    as given: shift them first. Unshifted, with d the travel in that delay, z0 and z1 come out too deep by d, and the
    withdrawal's force stands 2 d too shallow beside them: a misfit of 2 d f', which f' and f_c take up between them.

    Variable projection (Golub & Pereyra 1973) over running sums, an exhaustive scan of the puncture, then Gauss-Newton.
    Intervals: see ``covariance``. They tell of noise, not of a wrong model. BIC counts samples, correlated or not.

    Raises InputError for unequal lengths, values that are not finite, too few samples, no travel, no room for a
    puncture, an unknown law and impossible options.
    """
    strokes = _checked(depth_in, force_in, depth_out, force_out)
    saturation, free = _saturation(law, saturation_depth)
    left_out = _left_out(filter_length, len(strokes[0]))
    ask = partial(_ask, strokes, left_out, puncture_window)
    expected = 1.5 * filter_length  # long-run variance over plain variance
    found = ask(saturation, free, MARGIN * expected)
    estimates = CycleEstimates(found, strokes, filter_length, left_out)
    profile, least_saturation = found, found["unknowns"][4]
    if (
        estimates.noises[0].long_run > expected * estimates.variance
    ):  # then more punctures are possible than were asked for
        profile = ask(saturation, free, MARGIN * estimates.noises[0].long_run / estimates.variance)
    if free and estimates.x["saturation_depth"] == np.inf:
        least_saturation = _least_saturation(ask, estimates)
    return estimates.fit(law, free, profile, least_saturation)


def _ask(
    strokes, left_out: int, window: tuple[float, float] | None, saturation: float, free: bool, margin: float
) -> dict:
    """The compiled fit; raises InputError where it finds nothing."""
    found = core.fit_cycle(*strokes, saturation, free, left_out, *_window(window), margin)
    _refuse_failure(found["outcome"], strokes, window)
    return found


def _least_saturation(ask: Callable, estimates: CycleEstimates) -> float:
    """Least saturation depth [m] that the data do not refuse at 95 %, one-sided, where they ask for none."""
    allowed = estimates.found["sse"] + Z_90**2 * estimates.noises[0].long_run
    low, high = 0.0, estimates.strokes[0][estimates.before - 1] - estimates.x["contact_depth"]
    for _ in range(12):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if ask(middle, False, 0.0)["sse"] > allowed else (low, middle)
    return float(high)


def _checked(depth_in, force_in, depth_out, force_out) -> list[np.ndarray]:
    """The four arrays as contiguous float64, of equal lengths by stroke."""
    strokes = []
    for stroke, depth, force in (("insertion", depth_in, force_in), ("withdrawal", depth_out, force_out)):
        pair = [np.ascontiguousarray(() if a is None else a, dtype=np.float64) for a in (depth, force)]
        if pair[0].ndim != 1 or pair[0].shape != pair[1].shape:
            shapes = f"{pair[0].shape} and {pair[1].shape}"
            raise InputError("shape of depth and force", shapes, "one equal length is needed", stroke)
        strokes += pair
    n = len(strokes[0])
    if n < LEAST_SAMPLES:
        raise InputError("number of samples", n, f"at least {LEAST_SAMPLES} are needed", "insertion")
    first, last = strokes[0][[0, -1]]
    if last <= first:
        value = f"{first:.6g} m at its start and {last:.6g} m at its end"
        raise InputError(
            "depth of the insertion", value, "it must grow", next_step="Depth is + inwards: flip its sign."
        )
    return strokes


def _saturation(law: str, depth: float | None) -> tuple[float, bool]:
    """The saturation depth for the core, and whether it is sought."""
    if law == "cone":
        if depth is not None:
            raise InputError("saturation_depth", depth, "the law cone has none", next_step="Use law cone_cylinder.")
        return np.inf, False
    if law != "cone_cylinder":
        raise InputError("law", law, "known are cone and cone_cylinder")
    if depth is not None and not depth > 0.0:
        raise InputError("saturation_depth", f"{depth} m", "it must be positive")
    return (np.inf, True) if depth is None else (float(depth), False)


def _left_out(filter_length: int, n: int) -> int:
    if filter_length < 1 or filter_length != int(filter_length):
        raise InputError("filter_length", filter_length, "a whole number of samples, 1 for no filter, is needed")
    if filter_length > n // 20:
        limit = f"at most a twentieth of the insertion's {n} samples can be left out at a step"
        raise InputError("filter_length", filter_length, limit)
    return int(filter_length) if filter_length > 1 else 0


def _window(window: tuple[float, float] | None) -> tuple[float, float]:
    if window is None:
        return -np.inf, np.inf
    low, high = map(float, window)
    if not low < high:
        raise InputError("puncture_window", f"{low} to {high} m", "the low end must lie below the high end")
    return low, high


def _refuse_failure(outcome: str, strokes: list[np.ndarray], window: tuple[float, float] | None) -> None:
    """Say why the core has found nothing."""
    if outcome == "found":
        return
    names = ("depth of the insertion", "force of the insertion", "depth of the withdrawal", "force of the withdrawal")
    for name, values in zip(names, strokes):
        bad = np.flatnonzero(~np.isfinite(values))
        if len(bad) > 0:
            raise InputError(
                name, values[bad[0]], "it must be finite", f"sample {bad[0]}", "Remove or mend such samples."
            )
    asked = f" within {window[0]:.6g} to {window[1]:.6g} m" if window else ""
    limit = f"it needs 2 % of the samples before and after it{asked}"
    raise InputError("room for a puncture", "none", limit, "insertion", "Widen puncture_window or give more samples.")
