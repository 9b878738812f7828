# SPDX-License-Identifier: Apache-2.0
"""The fit by stages: the loading curve first, then friction and cutting with its contact depth.

The complete fit shares one contact depth between loading and withdrawal. Where the one-layer model does not hold below
the puncture (layers, relaxation, a surface that moves), the strokes pull that depth away from where the needle
touched. Stages keep it.
"""

import dataclasses
import math

import numpy as np

from .covariance import Z_95, noise_of
from .cycle_fit import CycleFit
from .deformation_fit import DeformationFit, fit_deformation
from .loading_curve import gradient, shape
from .regression import inverse
from .strokes import Strokes

DISAGREES = 3.0  # standard errors of the loading curve's contact depth: Hausman's test of the shared one


def fit_by_stages(joint: CycleFit, strokes: Strokes, contact: float, saturation: float | None, filter_length: int):
    """(DeformationFit, CycleFit) with the puncture of ``joint``; ``contact`` [m] is where the search starts."""
    before = max(joint.samples_before_puncture - joint.left_out, 1)
    loading = fit_deformation(
        strokes.depth_in[:before], strokes.force_in[:before], contact, joint.law, saturation, filter_length
    )
    return loading, _completed(joint, loading, strokes, filter_length)


def agrees(joint: CycleFit, loading: DeformationFit) -> bool:
    """True if the joint fit pushes outwards nowhere and its shared contact depth is the loading curve's, within its
    error."""
    if joint.values["cutting_force"] < 0.0 or joint.values["stiffness_coefficient"] <= 0.0:
        return False
    error = math.sqrt(max(float(loading.covariance[1, 1]), 0.0))
    resolution = 1e-6  # [m]; without noise the errors are those of rounding
    return abs(joint.values["contact_depth"] - loading.contact_depth) <= DISAGREES * error + resolution


def _completed(joint: CycleFit, loading: DeformationFit, strokes: Strokes, filter_length: int) -> CycleFit:
    after = joint.samples_before_puncture + joint.left_out
    pushed, pulled = strokes.depth_in[after:] - loading.contact_depth, strokes.depth_out - loading.contact_depth
    design = np.vstack(
        [
            np.column_stack([pushed, np.ones_like(pushed)]),
            np.column_stack([-np.maximum(pulled, 0.0), np.zeros_like(pulled)]),
        ]
    )
    force = np.concatenate([strokes.force_in[after:], strokes.force_out])
    (friction, cutting), held = _not_negative(design, force)
    covariance = _covariance(design, force - design @ (friction, cutting), len(pushed), filter_length)
    values = _values(joint, loading, friction, cutting)
    low, high = _limits(values, joint, loading, covariance)
    residual_in = strokes.force_in - _insertion(strokes.depth_in, joint.samples_before_puncture, values)
    residual_out = strokes.force_out + friction * np.maximum(pulled, 0.0)
    sse, n = float(residual_in @ residual_in + residual_out @ residual_out), len(residual_in) + len(residual_out)
    return dataclasses.replace(
        joint,
        values=values,
        low=low,
        high=high,
        residual_in=residual_in,
        residual_out=residual_out,
        sse=sse,
        n=n,
        rmse=math.sqrt(sse / n),
        warnings=held,
    )


def _not_negative(design: np.ndarray, force: np.ndarray) -> tuple[np.ndarray, tuple[str, ...]]:
    """Friction and cutting, neither below 0; what was held there is said with the value that least squares would
    take."""
    from scipy.optimize import nnls

    best = np.linalg.lstsq(design, force, rcond=None)[0]
    held = tuple(
        f"The {name} is held at 0: the best value would be {value:.3g} {unit}, which is unphysical."
        for name, unit, value in zip(("friction per length", "cutting force"), ("N/m", "N"), best)
        if value < 0.0
    )
    return (nnls(design, force)[0] if held else best), held


def _covariance(design: np.ndarray, residual: np.ndarray, pushed: int, filter_length: int) -> np.ndarray:
    """Covariance (2, 2) of friction and cutting, from the noise of either stroke."""
    parts = [slice(0, pushed), slice(pushed, None)]
    grams = [design[part].T @ design[part] for part in parts]
    noises = [noise_of(residual[part], len(residual[part]), filter_length, 1.0) for part in parts]
    bread = inverse(sum(grams))
    return bread @ sum(noise.long_run * gram for noise, gram in zip(noises, grams)) @ bread


def _values(joint: CycleFit, loading: DeformationFit, friction: float, cutting: float) -> dict[str, float]:
    indentation = joint.values["puncture_depth"] - loading.contact_depth
    peak = loading.stiffness_coefficient * float(shape(np.array(indentation), loading.saturation_depth))
    new = {
        "stiffness_coefficient": loading.stiffness_coefficient,
        "contact_depth": loading.contact_depth,
        "saturation_depth": loading.saturation_depth,
        "friction_per_length": float(friction),
        "cutting_force": float(cutting),
        "puncture_indentation": indentation,
        "puncture_force": peak,
    }
    return joint.values | new


def _limits(values, joint: CycleFit, loading: DeformationFit, covariance: np.ndarray) -> tuple[dict, dict]:
    """95 % limits; the puncture's own are the joint fit's samples."""
    half = dict(zip(loading.order, Z_95 * np.sqrt(np.maximum(loading.covariance.diagonal(), 0.0))))
    half |= dict(zip(("friction_per_length", "cutting_force"), Z_95 * np.sqrt(np.maximum(covariance.diagonal(), 0.0))))
    samples = 0.5 * (joint.high["puncture_depth"] - joint.low["puncture_depth"])
    half["puncture_indentation"] = math.hypot(half["contact_depth"], samples)
    half["puncture_force"] = _peak_limit(values, loading, samples)
    low = {name: value - float(half.get(name, 0.0)) for name, value in values.items()}
    high = {name: value + float(half.get(name, 0.0)) for name, value in values.items()}
    for name in ("friction_per_length", "cutting_force"):
        low[name] = max(low[name], 0.0)
    return low | {"puncture_depth": joint.low["puncture_depth"]}, high | {
        "puncture_depth": joint.high["puncture_depth"]
    }


def _peak_limit(values, loading: DeformationFit, samples: float) -> float:
    """Half width for the force at the puncture, by the delta method."""
    slopes = gradient(
        np.float64(values["puncture_indentation"]), loading.stiffness_coefficient, loading.saturation_depth
    )
    by = np.array(slopes[: len(loading.order)])
    return math.hypot(Z_95 * math.sqrt(max(float(by @ loading.covariance @ by), 0.0)), float(slopes[1]) * samples)


def _insertion(depth: np.ndarray, before: int, values: dict[str, float]) -> np.ndarray:
    """The fitted force of the insertion, (n,) [N]; the first ``before`` samples lie before the puncture."""
    h = depth - values["contact_depth"]
    pushed = values["stiffness_coefficient"] * shape(h, values["saturation_depth"])
    return np.where(np.arange(len(h)) < before, pushed, values["friction_per_length"] * h + values["cutting_force"])
