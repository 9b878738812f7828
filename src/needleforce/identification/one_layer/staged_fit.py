# SPDX-License-Identifier: Apache-2.0
"""The staged fit: the loading curve first, then friction and cutting with its contact depth.

The complete fit uses one contact depth for loading and withdrawal. Where the one-layer model does not hold below the
puncture (layers, relaxation, a surface that moves), this biases the contact depth. The staged fit does not.
"""

import dataclasses
import math

import numpy as np

from ..statistics.noise import TWO_SIDED, noise_of
from ..statistics.regression import inverse
from ..strokes import Strokes
from .cycle_estimates import CycleFit
from .deformation_fit import DeformationFit

MAX_CONTACT_SHIFT = 3.0  # [standard errors of the loading curve's contact depth] Hausman's test of the shared one


def agrees(joint: CycleFit, loading: DeformationFit) -> bool:
    """True if no force of the joint fit is negative and its contact depth is the loading curve's within its error."""
    if joint.values["cutting_force"] < 0.0 or joint.values["stiffness_coefficient"] <= 0.0:
        return False
    place = loading.order.index("contact_depth")
    error = math.sqrt(max(float(loading.covariance[place, place]), 0.0))
    resolution = 1e-6  # [m]; without noise the errors are those of rounding
    difference = abs(joint.values["contact_depth"] - loading.values["contact_depth"])
    return difference <= MAX_CONTACT_SHIFT * error + resolution


def fit_by_stages(joint: CycleFit, loading: DeformationFit, strokes: Strokes, filter_length: int) -> CycleFit:
    """The cycle with the given loading curve, the puncture of ``joint``, and a new fit of friction and cutting."""
    from scipy.linalg import block_diag

    after = joint.samples_before_puncture + joint.left_out
    contact = loading.values["contact_depth"]
    embedded_length_in = strokes.depth_in[after:] - contact
    embedded_length_out = np.maximum(strokes.depth_out - contact, 0.0)
    design = np.vstack(
        [
            np.column_stack([embedded_length_in, np.ones_like(embedded_length_in)]),
            np.column_stack([-embedded_length_out, np.zeros_like(embedded_length_out)]),
        ]
    )
    force = np.concatenate([strokes.force_in[after:], strokes.force_out])
    (friction, cutting), held = _not_negative(design, force)
    covariance = _covariance(design, force - design @ (friction, cutting), len(embedded_length_in), filter_length)
    values = _values(joint, loading, friction, cutting)
    low, high = _limits(values, joint, loading, covariance)
    residual_in = strokes.force_in - _insertion(strokes.depth_in, joint.samples_before_puncture, loading, values)
    residual_out = strokes.force_out + friction * embedded_length_out
    sse, n = float(residual_in @ residual_in + residual_out @ residual_out), len(residual_in) + len(residual_out)
    return dataclasses.replace(
        joint,
        law=loading.law,
        values=values,
        low=low,
        high=high,
        covariance=block_diag(loading.covariance, covariance),
        covariance_order=(*loading.order, "friction_per_length", "cutting_force"),
        residual_in=residual_in,
        residual_out=residual_out,
        sse=sse,
        n=n,
        rmse=math.sqrt(sse / n),
        warnings=(*loading.held, *held),
        noises=(loading.noise, joint.noises[1]),
        saturation_sought="saturation_depth" in loading.order,
        by_stages=True,
    )


def _not_negative(design: np.ndarray, force: np.ndarray) -> tuple[np.ndarray, tuple[str, ...]]:
    """Friction and cutting, neither below 0, and a sentence for each that is held at 0, with its best value."""
    from scipy.optimize import nnls

    best = np.linalg.lstsq(design, force, rcond=None)[0]
    held = tuple(
        f"The {name} is held at 0: least squares give {value:.3g} {unit}, which is unphysical."
        for name, unit, value in zip(("friction per length", "cutting force"), ("N/m", "N"), best)
        if value < 0.0
    )
    return (nnls(design, force)[0] if held else best), held


def _covariance(design: np.ndarray, residual: np.ndarray, n_insertion: int, filter_length: int) -> np.ndarray:
    """Covariance (2, 2) of friction and cutting, from the noise of each stroke; the insertion comes first."""
    parts = [slice(0, n_insertion), slice(n_insertion, None)]
    grams = [design[part].T @ design[part] for part in parts]
    noises = [noise_of(residual[part], len(residual[part]), filter_length, 1.0) for part in parts]
    bread = inverse(sum(grams))
    return bread @ sum(noise.long_run * gram for noise, gram in zip(noises, grams)) @ bread


def _values(joint: CycleFit, loading: DeformationFit, friction: float, cutting: float) -> dict[str, float]:
    indentation = joint.values["puncture_depth"] - loading.values["contact_depth"]
    return loading.values | {
        "friction_per_length": float(friction),
        "cutting_force": float(cutting),
        "puncture_depth": joint.values["puncture_depth"],
        "puncture_indentation": indentation,
        "puncture_force": float(loading.curve.force(np.float64(indentation), loading.values)),
    }


def _limits(
    values: dict[str, float], joint: CycleFit, loading: DeformationFit, covariance: np.ndarray
) -> tuple[dict, dict]:
    """Limits of the intervals; the puncture's are the joint fit's samples. No parameter of a curve is negative."""
    half = dict(zip(loading.order, TWO_SIDED * np.sqrt(np.maximum(loading.covariance.diagonal(), 0.0))))
    halves = TWO_SIDED * np.sqrt(np.maximum(covariance.diagonal(), 0.0))
    half |= dict(zip(("friction_per_length", "cutting_force"), halves))
    samples = 0.5 * (joint.high["puncture_depth"] - joint.low["puncture_depth"])
    half["puncture_indentation"] = math.hypot(half["contact_depth"], samples)
    half["puncture_force"] = _peak_limit(values, loading, samples)
    low = {name: value - float(half.get(name, 0.0)) for name, value in values.items()}
    high = {name: value + float(half.get(name, 0.0)) for name, value in values.items()}
    for name in ("friction_per_length", "cutting_force", *loading.curve.units):
        low[name] = max(low[name], 0.0)
    puncture = "puncture_depth"
    return low | {puncture: joint.low[puncture]}, high | {puncture: joint.high[puncture]}


def _peak_limit(values: dict[str, float], loading: DeformationFit, samples: float) -> float:
    """Half width for the force at the puncture, by the delta method."""
    gradient = loading.curve.gradient(np.float64(values["puncture_indentation"]), values)
    by = np.array([gradient[name] for name in loading.order])
    known = ~np.isinf(loading.covariance.diagonal())
    variance = float(by[known] @ loading.covariance[np.ix_(known, known)] @ by[known])
    return math.hypot(TWO_SIDED * math.sqrt(max(variance, 0.0)), float(gradient["contact_depth"]) * samples)


def _insertion(depth: np.ndarray, before: int, loading: DeformationFit, values: dict[str, float]) -> np.ndarray:
    """The fitted force of the insertion, (n,) [N]; the first ``before`` samples lie before the puncture."""
    embedded_length = depth - values["contact_depth"]  # before the puncture the indentation
    loaded = loading.curve.force(embedded_length, values)
    cut = values["friction_per_length"] * embedded_length + values["cutting_force"]
    return np.where(np.arange(len(depth)) < before, loaded, cut)
