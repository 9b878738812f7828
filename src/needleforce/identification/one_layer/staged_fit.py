# SPDX-License-Identifier: Apache-2.0
"""The staged fit: the loading curve first, then friction and cutting with its contact depth.

The complete fit uses one contact depth for loading and withdrawal. Where the one-layer model does not hold below the
puncture (layers, relaxation, a surface that moves), this biases the contact depth. The staged fit does not.
"""

import dataclasses
import math
from collections.abc import Iterable

import numpy as np

from ...errors import InputError
from ...mechanics.foundation import FORMS
from ..statistics.noise import TWO_SIDED, DriftEffect, noise_of
from ..statistics.regression import inverse
from ..strokes import Strokes
from ..two_pass.result import FrictionForm
from ..two_pass.second_pass import MIN_BINS, bin_means, friction_forms, shape
from .cycle_values import CycleFit, CycleResiduals, limits
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


def fit_by_stages(
    joint: CycleFit,
    loading: DeformationFit,
    strokes: Strokes,
    filter_length: int,
    drift: DriftEffect | None = None,
) -> CycleFit:
    """The cycle with the given loading curve, the puncture of ``joint``, and a new fit of friction and cutting."""
    after = joint.puncture.before + joint.puncture.left_out
    contact = loading.values["contact_depth"]
    embedded_length_in = strokes.depth_in[after:] - contact
    embedded_length_out = np.maximum(strokes.depth_out - contact, 0.0)
    zero = loading.values["force_offset"]
    form = _bent(loading.curve.foundation, strokes, contact, after, zero)
    shapes = [_shape(form, lengths) for lengths in (embedded_length_in, embedded_length_out)]
    design = np.vstack(
        [
            np.column_stack([shapes[0], np.ones_like(embedded_length_in)]),
            np.column_stack([-shapes[1], np.zeros_like(embedded_length_out)]),
        ]
    )
    force = np.concatenate([strokes.force_in[after:], strokes.force_out]) - zero
    (friction, cutting), held = _not_negative(design, force)
    residual = force - design @ (friction, cutting)
    given = _by_loading(design, friction, len(embedded_length_in), embedded_length_out)
    more = _derivatives(form, embedded_length_in, embedded_length_out, friction)
    covariance = _covariance(np.column_stack([design, *more]), residual, len(embedded_length_in), filter_length)
    if not np.isfinite(covariance).all():  # the recording does not determine the bend: friction for the best one
        covariance = _covariance(design, residual, len(embedded_length_in), filter_length)
    by_drift = np.zeros(2)
    if drift is not None:  # the lever is that of all samples of both strokes
        used = np.concatenate([drift.lever[after : len(strokes.depth_in)], drift.lever[len(strokes.depth_in) :]])
        by_drift = DriftEffect(lever=used, error=drift.error).change(inverse(design.T @ design), design.T)
    covariance = _with_loading(loading, covariance[:2, :2], given, by_drift)
    values = _values(joint, loading, friction, cutting)
    low, high = _limits(values, joint, loading, covariance[-2:, -2:])
    modelled = _insertion(strokes.depth_in, joint.puncture.before, loading, values, form)
    if form is not None:
        values, low, high = form.values | values, low | form.low, high | form.high
    return dataclasses.replace(
        joint,
        law=loading.law,
        values=values,
        low=low,
        high=high,
        covariance=covariance,
        order=(*loading.order, "friction_per_length", "cutting_force"),
        residuals=CycleResiduals(
            insertion=strokes.force_in - zero - modelled,
            withdrawal=strokes.force_out - zero + friction * shapes[1],
            noises=(loading.noise, joint.residuals.noises[1]),
        ),
        warnings=(*loading.held, *held),
        saturation_sought="saturation_depth" in loading.order,
        by_stages=True,
        options=None,
    )


def _not_negative(design: np.ndarray, force: np.ndarray) -> tuple[np.ndarray, tuple[str, ...]]:
    """Friction and cutting, neither below 0, and a sentence for each that is held at 0, with its best value."""
    best = np.linalg.lstsq(design, force, rcond=None)[0]
    held = tuple(
        f"The {name} is held at 0: least squares give {value:.3g} {unit}, which is unphysical."
        for name, unit, value in zip(("friction per length", "cutting force"), ("N/m", "N"), best)
        if value < 0.0
    )
    if held:
        from scipy.optimize import nnls  # a tenth of a second that most fits do not need

        best = nnls(design, force)[0]
    return best, held


def _covariance(design: np.ndarray, residual: np.ndarray, n_insertion: int, filter_length: int) -> np.ndarray:
    """Covariance (2, 2) of friction and cutting, from the noise of each stroke; the insertion comes first."""
    parts = [slice(0, n_insertion), slice(n_insertion, None)]
    grams = [design[part].T @ design[part] for part in parts]
    noises = [noise_of(residual[part], len(residual[part]), filter_length, 1.0) for part in parts]
    bread = inverse(sum(grams))
    return bread @ sum(noise.long_run * gram for noise, gram in zip(noises, grams)) @ bread


def _by_loading(design: np.ndarray, friction: float, n_insertion: int, embedded_out: np.ndarray) -> np.ndarray:
    """Derivatives (2, 2) of friction and cutting by what the loading curve gives them: contact depth and zero."""
    by_contact = np.concatenate([np.full(n_insertion, -friction), np.where(embedded_out > 0.0, friction, 0.0)])
    columns = np.column_stack([by_contact, np.ones(len(design))])
    return -inverse(design.T @ design) @ design.T @ columns


def _with_loading(
    loading: DeformationFit, covariance: np.ndarray, given: np.ndarray, by_drift: np.ndarray
) -> np.ndarray:
    """The covariance of the loading curve's parameters, friction and cutting (p + 2, p + 2): friction and cutting have
    the errors of the contact depth, of the zero and of its drift as well."""
    rows = [loading.order.index(name) for name in ("contact_depth", "force_offset")]
    p = len(loading.order)
    found = np.zeros((p + 2, p + 2))
    found[:p, :p] = loading.covariance
    known = np.isfinite(loading.covariance.diagonal())
    if known[rows].all() and np.isfinite(given).all():
        across = np.where(known[:, None], loading.covariance[:, rows], 0.0) @ given.T
        across += np.outer(np.where(known, loading.by_drift, 0.0), by_drift)
        found[:p, p:], found[p:, :p] = across, across.T
        shared = np.outer(given @ loading.by_drift[rows], by_drift)
        covariance = covariance + given @ loading.covariance[np.ix_(rows, rows)] @ given.T
        covariance += shared + shared.T + np.outer(by_drift, by_drift)
    found[p:, p:] = covariance
    return found


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
    low, high = limits(values, half)
    for name in ("friction_per_length", "cutting_force", *loading.curve.parameters):
        low[name] = max(low[name], 0.0)
    puncture = "puncture_depth"
    return low | {puncture: joint.low[puncture]}, high | {puncture: joint.high[puncture]}


def _peak_limit(values: dict[str, float], loading: DeformationFit, samples: float) -> float:
    """Half width for the force at the puncture, by the delta method."""
    gradient = loading.curve.gradient(np.float64(values["puncture_indentation"]), values)
    by = np.array([float(gradient.get(name, 0.0)) for name in loading.order])
    known = ~np.isinf(loading.covariance.diagonal())
    variance = float(by[known] @ loading.covariance[np.ix_(known, known)] @ by[known])
    return math.hypot(TWO_SIDED * math.sqrt(max(variance, 0.0)), float(gradient["contact_depth"]) * samples)


def _insertion(
    depth: np.ndarray, before: int, loading: DeformationFit, values: dict[str, float], form: FrictionForm | None
) -> np.ndarray:
    """The fitted force of the insertion, (n,) [N]; the first ``before`` samples lie before the puncture."""
    embedded_length = depth - values["contact_depth"]  # before the puncture the indentation
    loaded = loading.curve.force(embedded_length, values)
    cut = values["friction_per_length"] * _shape(form, np.maximum(embedded_length, 0.0)) + values["cutting_force"]
    return np.where(np.arange(len(depth)) < before, loaded, cut)


def forms_after_puncture(
    strokes: Strokes, contact: float, after: int, zero: float, forms: Iterable[str] = FORMS
) -> tuple[FrictionForm, ...]:
    """Friction of the insertion from sample ``after`` on and of the withdrawal under each form of the foundation, with
    a cutting force; ``contact`` [m] is where embedding starts, ``zero`` [N] the sensor's zero. Empty with too few
    bins of 0.25 mm."""
    embedded = [strokes.depth_in[after:] - contact, strokes.depth_out - contact]
    binned = [
        bin_means(length, force, max(float(length.min(initial=0.0)), 0.0), float(length.max(initial=0.0)))
        for length, force in zip(embedded, (strokes.force_in[after:] - zero, strokes.force_out - zero))
    ]
    lengths, force = (np.concatenate(part) for part in zip(*binned))
    inwards = np.arange(len(lengths)) < len(binned[0][0])
    return friction_forms(lengths, force, inwards[:, None].astype(float), np.where(inwards, 1.0, -1.0), forms)


def _bent(foundation: str, strokes: Strokes, contact: float, after: int, zero: float) -> FrictionForm | None:
    """The fit of a nonlinear foundation; None for a linear one."""
    if foundation == "linear":
        return None
    found = forms_after_puncture(strokes, contact, after, zero, (foundation,))
    if not found:
        limit = f"at least {MIN_BINS} bins of 0.25 mm are needed to fit a foundation"
        raise InputError("travel after the puncture", "too short", limit, next_step="Insert deeper.")
    return found[0]


def _shape(form: FrictionForm | None, lengths: np.ndarray, **other: float) -> np.ndarray:
    """Friction over friction per length (n,) [m] at embedded lengths (n,) [m]; ``other`` values of its parameters."""
    if form is None:
        return lengths
    values = form.values | other
    return shape(form.form, values["settlement_ratio"], lengths, np.array([values["deflection_length"]]))[0]


def _derivatives(
    form: FrictionForm | None, inwards: np.ndarray, outwards: np.ndarray, friction: float
) -> list[np.ndarray]:
    """The force's derivatives (n,) by settlement ratio and deflection length, of both strokes."""
    found = []
    for name in () if form is None else ("settlement_ratio", "deflection_length"):
        step = 1e-4 * max(form.values[name], 1e-3)
        more = [_shape(form, lengths, **{name: form.values[name] + step}) for lengths in (inwards, outwards)]
        own = [_shape(form, lengths) for lengths in (inwards, outwards)]
        found.append(friction / step * np.concatenate([more[0] - own[0], own[1] - more[1]]))
    return found
