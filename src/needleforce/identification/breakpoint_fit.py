# SPDX-License-Identifier: Apache-2.0
"""The complete fit of one in-out cycle with the one-layer model, without starting values."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from .. import core
from ..errors import InputError
from .covariance import MARGIN, Z_90, Z_95, Noise, likely_punctures, noise_of, sandwich

UNKNOWNS = ("stiffness_coefficient", "contact_depth", "friction_per_length", "cutting_force", "saturation_depth")
"""Order of the unknowns in the compiled core: c [N/m²], z0 [m], f' [N/m], f_c [N], h_s [m]."""

LEAST_SAMPLES = 50


@dataclass(frozen=True, eq=False)
class CycleFit:
    """What a cycle tells of the one-layer model, SI: ``values`` and, by the same keys, 95 % limits ``low``, ``high``.

    ``stiffness_coefficient`` c [N/m²], ``contact_depth`` z0 [m], ``saturation_depth`` h_s [m] (inf: bare cone),
    ``friction_per_length`` f' [N/m], ``cutting_force`` f_c [N], ``puncture_depth`` z1 [m],
    ``puncture_indentation`` z1 - z0 [m], ``puncture_force`` c g(z1 - z0) [N]. Depths are in the recording's own zero.
    """

    law: str
    values: dict[str, float]
    low: dict[str, float]
    high: dict[str, float]
    covariance: np.ndarray
    """(p, p) of the continuous parameters, in the order of ``covariance_order``."""
    covariance_order: tuple[str, ...]
    puncture_low: int
    """The puncture lies between samples ``puncture_low`` and ``puncture_high`` of the insertion, at 95 % or more."""
    puncture_high: int
    samples_before_puncture: int
    residual_in: np.ndarray
    """Measured minus modelled force of the insertion, (n_in,) [N], of every sample, left out or not."""
    residual_out: np.ndarray
    left_out: int
    """Samples left out on each side of the puncture, at the insertion's end and at the withdrawal's start."""
    sse: float
    n: int
    """Samples used, and the sum of their squared residuals [N²]."""
    bic: float
    rmse: float
    noise_correlation_length: float
    """Samples that count as one: long-run over plain variance of the residuals. 1 is white noise."""
    warnings: tuple[str, ...]


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
    told = _Told(ask(saturation, free, MARGIN * expected), strokes, filter_length, left_out)
    if told.noises[0].long_run > expected * told.variance:  # then more punctures are possible than were asked for
        told.found |= _profile(ask(saturation, free, MARGIN * told.noises[0].long_run / told.variance))
    if free and told.x["saturation_depth"] == np.inf:
        told.least_saturation = _least_saturation(ask, told)
    return told.fit(law, free)


def _ask(
    strokes, left_out: int, window: tuple[float, float] | None, saturation: float, free: bool, margin: float
) -> dict:
    """The compiled fit, whose failures are told as InputError."""
    found = core.fit_cycle(*strokes, saturation, free, left_out, *_window(window), margin)
    _refuse_failure(found["outcome"], strokes, window)
    return found


def _profile(found: dict) -> dict:
    return {key: found[key] for key in ("first_gain", "gain")}


def _least_saturation(ask: Callable, told: "_Told") -> float:
    """Least saturation depth [m] that the data do not refuse at 95 %, one-sided, where they ask for none."""
    allowed = told.found["sse"] + Z_90**2 * told.noises[0].long_run
    low, high = 0.0, told.strokes[0][told.before - 1] - told.x["contact_depth"]
    for _ in range(12):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if ask(middle, False, 0.0)["sse"] > allowed else (low, middle)
    return float(high)


def predict_cycle(fit: CycleFit, depth_in: np.ndarray, depth_out: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Force [N] of the fitted model along other strokes, (n,) and (m,) depths [m] in the fitted recording's zero.

    The puncture happens once, where the insertion first passes the fitted puncture depth.
    """
    v = fit.values
    depth_in, depth_out = np.asarray(depth_in, float), np.asarray(depth_out, float)
    h = depth_in - v["contact_depth"]
    pierced = np.maximum.accumulate(depth_in) > v["puncture_depth"] if len(h) else np.zeros(0, bool)
    pushed = v["stiffness_coefficient"] * _stiffness(h, v["saturation_depth"])
    force_in = np.where(pierced, v["friction_per_length"] * h + v["cutting_force"], pushed)
    return force_in, -v["friction_per_length"] * np.maximum(depth_out - v["contact_depth"], 0.0)


def _stiffness(h: np.ndarray, saturation: float) -> np.ndarray:
    """g(h) [m²]: h² up to the saturation depth, then linear."""
    h = np.maximum(h, 0.0)
    cone = np.minimum(h, saturation)
    return cone * (2.0 * h - cone)


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


class _Told:
    """The core's answer on its way to a CycleFit: noise, covariance, estimates, warnings."""

    def __init__(self, found: dict, strokes: list[np.ndarray], filter_length: int, left_out: int):
        self.least_saturation = found["unknowns"][4]
        self.found, self.strokes, self.filter_length, self.left_out = found, strokes, filter_length, left_out
        self.x, self.before = dict(zip(UNKNOWNS, found["unknowns"])), found["puncture"]
        self.order = UNKNOWNS if found["free"][4] else UNKNOWNS[:4]
        *grams, bread = found["matrices"][:, : len(self.order), : len(self.order)]
        if not bread.diagonal().all():
            bread = np.full_like(bread, np.nan)  # the data do not determine every parameter: no intervals
        lost = [float(np.vdot(bread, gram)) for gram in grams]
        self.noises = self._noises([0.0 if math.isnan(paid) else paid for paid in lost])
        self.covariance = sandwich(bread, grams, self.noises)
        self.sse, self.n = (self.noises[0][k] + self.noises[1][k] for k in (0, 1))
        self.variance = self.sse / self.n

    def _pushed(self, depth: float) -> list[float]:
        """The derivatives of the deformation's force at a depth, by c, z0, f', f_c, h_s."""
        h, c, saturation = depth - self.x["contact_depth"], self.x["stiffness_coefficient"], self.x["saturation_depth"]
        cone = min(max(h, 0.0), saturation)
        return [cone * (2.0 * h - cone), -2.0 * c * cone, 0.0, 0.0, 2.0 * c * (h - cone)]

    def _noises(self, lost: list[float]) -> list[Noise]:
        """Noise of either stroke; each has paid for as many parameters as it tells of, tr(B G): ``lost``."""
        w, before, residuals = self.left_out, self.before, [self.found["residual_in"], self.found["residual_out"]]
        counts = [max(len(residuals[0]) - 3 * w, 0), max(len(residuals[1]) - w, 0)]
        if w:
            residuals = [residual.copy() for residual in residuals]
            residuals[0][before - w : before + w] = residuals[0][-w:] = residuals[1][:w] = 0.0
        return [noise_of(r, n, self.filter_length, paid) for r, n, paid in zip(residuals, counts, lost)]

    def fit(self, law: str, free: bool) -> CycleFit:
        """The whole answer."""
        rows, weights = likely_punctures(self.found["gain"], self.noises[0].long_run)
        rows += self.found["first_gain"]
        values, low, high = self._estimates(rows, weights)
        smear, depth = self.filter_length // 2, self.strokes[0]
        first, last = max(int(rows.min()) - 1 - smear, 0), min(int(rows.max()) + smear, len(depth) - 1)
        low["puncture_depth"], high["puncture_depth"] = float(depth[first]), float(depth[last])
        plain = sum(noise.count * noise.variance for noise in self.noises)
        long_run = sum(noise.count * noise.long_run for noise in self.noises)
        return CycleFit(
            law=law,
            values=values,
            low=low,
            high=high,
            covariance=self.covariance,
            covariance_order=self.order,
            puncture_low=first,
            puncture_high=last,
            samples_before_puncture=self.before,
            residual_in=self.found["residual_in"],
            residual_out=self.found["residual_out"],
            left_out=self.left_out,
            sse=self.sse,
            n=self.n,
            bic=self.n * math.log(max(self.variance, 1e-300)) + (5 + free) * math.log(self.n),
            rmse=math.sqrt(self.variance),
            noise_correlation_length=long_run / plain if plain > 0.0 else 1.0,
            warnings=tuple(self._warnings(values, low, high, free)),
        )

    def _estimates(self, rows: np.ndarray, weights: np.ndarray) -> tuple[dict, dict, dict]:
        """Values and 95 % limits (delta method) of all quantities; the puncture depth's limits are samples, see fit."""
        x, depth, before = self.x, self.strokes[0], self.before
        puncture = 0.5 * float(depth[before - 1] + depth[before])
        h, c, saturation = puncture - x["contact_depth"], x["stiffness_coefficient"], x["saturation_depth"]
        cone = min(max(h, 0.0), saturation)
        values = x | {
            "puncture_depth": puncture,
            "puncture_indentation": h,
            "puncture_force": c * cone * (2.0 * h - cone),
        }
        slope, beyond = 2.0 * c * cone, 2.0 * c * (h - cone)
        force_by = np.array((cone * (2.0 * h - cone), -slope, 0.0, 0.0, beyond)[: len(self.order)])
        drop = values["puncture_force"] - x["friction_per_length"] * h - x["cutting_force"]
        spread, variance = self._puncture_variance(rows, weights, drop), self.covariance.diagonal().tolist()
        variances = dict(zip(self.order, variance))
        variances["puncture_indentation"] = variance[1] + spread
        variances["puncture_force"] = float(force_by @ self.covariance @ force_by + force_by[1] ** 2 * spread)
        half = {name: Z_95 * math.sqrt(max(value, 0.0)) for name, value in variances.items()}
        low = {name: value - half.get(name, 0.0) for name, value in values.items()}
        high = {name: value + half.get(name, 0.0) for name, value in values.items()}
        low["saturation_depth"] = min(low["saturation_depth"], self.least_saturation)
        if "saturation_depth" in half and high["saturation_depth"] > h:
            high["saturation_depth"] = math.inf  # past the puncture, one saturation depth is as good as any other
        if not self.found["free"][2]:
            low["friction_per_length"] = 0.0
        return values, low, high

    def _puncture_variance(self, rows: np.ndarray, weights: np.ndarray, drop: float) -> float:
        """Variance [m²] of the puncture's depth: between the candidate gaps, and even within each gap.

        A filter turns the drop into a ramp, which a sharp step meets in its middle: to one sample, and to the depth in
        which the ramp crosses the noise.
        """
        depth, length = self.strokes[0], self.filter_length
        before, after = depth[rows - 1], depth[rows]
        if length > 1 and drop > 0.0:
            gap = float(after[0] - before[0])
            return gap**2 * (1.0 / 3.0 + length * self.noises[0].long_run / drop**2)
        middle = 0.5 * (before + after)
        return float(weights @ ((middle - weights @ middle) ** 2 + (after - before) ** 2 / 12.0))

    def _warnings(self, values: dict, low: dict, high: dict, free: bool) -> Iterator[str]:
        """What a reader should know before believing the numbers, in plain words."""
        found, depth, v = self.found, self.strokes[0], values
        if not low["stiffness_coefficient"] > 0.0:
            yield "the stiffness is not different from zero: there may be no contact"
        after = v["friction_per_length"] * v["puncture_indentation"] + v["cutting_force"]
        if not v["puncture_force"] - after > high["puncture_force"] - v["puncture_force"]:
            yield "the force does not drop at the puncture found: there may be none"
        if self.before in found["admitted"]:
            yield "the puncture found is the first or the last one admitted"
        if v["contact_depth"] <= depth[0]:
            yield "the recording starts in contact: the contact depth is extrapolated"
        if not found["free"][2]:
            best = found["unconstrained_friction"]
            yield f"the friction per length is held at 0: the best value would be {best:.4g} N/m, which is unphysical"
        if free and not found["free"][4]:
            yield "the bare cone fits best: the contact does not saturate before the puncture"
        if not len(self.strokes[2]):
            yield "no withdrawal: friction and cutting force rest on the insertion alone"
        if found["backtrack"] > 0.02 * (depth[-1] - depth[0]):
            yield f"a stroke goes back by up to {found['backtrack'] * 1e3:.3g} mm on its way"
        reach = max(noise.reach for noise in self.noises)
        if reach > 1.5 * self.filter_length and self.variance > (1e-9 * v["puncture_force"]) ** 2:
            yield (
                f"residuals are correlated over {reach} samples, the filter's length is {self.filter_length}: "
                "an unknown filter, or a model that does not describe this recording"
            )
