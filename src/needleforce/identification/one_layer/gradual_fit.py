# SPDX-License-Identifier: Apache-2.0
"""The fit of a gradual rupture to one recording: loading curve, onset and course of the rupture, friction and cutting
at once, with their intervals; see ``gradual_search`` for the model."""

import math
from collections.abc import Iterator
from copy import copy
from dataclasses import dataclass, replace

import numpy as np

from ...errors import InputError
from ..statistics.noise import TWO_SIDED, DriftEffect, Noise, noise_of, sandwich
from ..statistics.regression import inverse
from ..strokes import Strokes
from .cycle_values import CycleFit, CycleResiduals, PunctureSamples, limits
from .deformation_fit import DeformationFit
from .gradual_search import (
    AMPLITUDE,
    CUTTING,
    EXPONENT,
    FINE_BLOCKS,
    FRICTION,
    N_LINEAR,
    ZERO,
    GradualProblem,
    Samples,
    columns,
    not_negative,
    refined,
    refuse_sharp,
    sharp_free,
)
from .loading_curves import FITS
from .staged_fit import MAX_CONTACT_SHIFT

MIN_SHARE = 0.05  # of the contact that the rupture loses; below, nothing ruptures
RESOLUTION_M = 1e-6  # without noise the errors are those of rounding
PEAK_GRID = 2001  # depths at which the peak of the model is searched


@dataclass(frozen=True, eq=False, kw_only=True)
class FirstLayer:
    """The samples of the first layer: ``strokes`` with all of its fall, ``reduced`` without it.

    ``peak`` is the sample of the force peak and ``end`` that where the insertion of this layer ends; ``several`` is
    True if there are more punctures below. ``filter_length`` is that of the average filter, and ``drift`` that of the
    zero, which was subtracted, at the samples of ``strokes``.
    """

    strokes: Strokes
    reduced: Strokes
    peak: int
    end: int
    several: bool
    filter_length: int
    drift: DriftEffect | None


def fit_gradual(
    sharp: CycleFit, loading: DeformationFit, layer: FirstLayer, law: str, known: float | None
) -> tuple[CycleFit, DeformationFit]:
    """The gradual rupture of one recording, and the same as the fit of its loading curve.

    ``sharp`` is the complete fit with a sharp rupture and ``loading`` the loading curve of the same law, from which the
    search starts; ``known`` [m] is a saturation depth that is not fitted. Raises InputError where a sharp rupture
    explains the samples as well: by a BIC in independent samples that is not lower by 10, very strong evidence.

    Where the strokes do not agree on one contact depth, or with several punctures, the insertion alone gives the
    contact and its rupture, and both strokes friction and cutting with these: a staged fit.
    """
    curve, strokes, reduced, end, peak = FITS[law], layer.strokes, layer.reduced, layer.end, layer.peak
    contact, depth_peak = loading.values["contact_depth"], float(strokes.depth_in[peak])
    unit, scale = depth_peak - contact, float(strokes.force_in[peak]) - loading.values["force_offset"]
    if not (unit > 0.0 and scale > 0.0):
        raise InputError("force before the puncture", "not rising with depth", "no rupture can be fitted")
    depth = np.concatenate([strokes.depth_in[:end], strokes.depth_out])
    force = np.concatenate([strokes.force_in[:end], strokes.force_out])
    samples = Samples(x=(depth - contact) / unit, force=force / scale, n_in=end, filter_length=layer.filter_length)
    given = () if known is None or not curve.shape else (known / unit,)
    problem = GradualProblem(curve, samples, given, EXPONENT)
    numbers = problem.best()
    refuse_sharp(
        scale * problem.solved(numbers)[0], sharp, loading, strokes, end=end, filter_length=layer.filter_length
    )
    problem, numbers = refined(problem, numbers)
    drift = layer.drift
    if drift is not None:
        lever = drift.lever
        drift = replace(drift, lever=np.concatenate([lever[:end], lever[len(strokes.depth_in) :]]))
    made = GradualEstimates(problem, numbers, contact=contact, unit=unit, scale=scale, drift=drift)
    if len(strokes.depth_out):
        alone = made.insertion_alone(end)
        if layer.several or not _agree(made, alone):
            made = alone.staged(samples)
    return made.cycle(law, sharp, reduced), made.loading(law, loading, reduced, peak)


def _agree(made: "GradualEstimates", alone: "GradualEstimates") -> bool:
    """Whether both strokes have the contact depth of the insertion alone within its error, Hausman's test."""
    place = alone.order.index("contact_depth")
    error = math.sqrt(max(float(alone.covariance[place, place]), 0.0))
    difference = abs(made.values["contact_depth"] - alone.values["contact_depth"])
    return difference <= MAX_CONTACT_SHIFT * error + RESOLUTION_M


class GradualEstimates:
    """The values of a fit in SI with their covariance."""

    def __init__(
        self,
        problem: GradualProblem,
        numbers: np.ndarray,
        *,
        contact: float,
        unit: float,
        scale: float,
        drift: DriftEffect | None,
    ):
        self.problem, self.numbers, self.contact, self.unit, self.scale = problem, numbers, contact, unit, scale
        self.drift = drift
        self.residual, self.coefficients = problem.solved(numbers)
        self.values = self._values(numbers, self.coefficients)
        self.order = tuple(name for name in self._order())
        self.noises = self._noises()
        self.search_covariance, self.known = self._search_covariance()
        self.covariance = self._covariance()
        self._check()

    def insertion_alone(self, end: int) -> "GradualEstimates":
        """The fit of the insertion alone, its first ``end`` samples."""
        all_samples, drift = self.problem.samples, self.drift
        samples = replace(all_samples, x=all_samples.x[:end], force=all_samples.force[:end])
        problem = GradualProblem(self.problem.curve, samples, self.problem.known, self.problem.exponent)
        numbers = problem.minimum(self.numbers, samples.blocks(FINE_BLOCKS), 20)[0]
        numbers = problem.minimum(numbers, samples, 5)[0]
        drift = None if drift is None else replace(drift, lever=drift.lever[:end])
        return GradualEstimates(problem, numbers, contact=self.contact, unit=self.unit, scale=self.scale, drift=drift)

    def staged(self, samples: Samples) -> "GradualEstimates":
        """The fit with friction and cutting, and their errors, from all ``samples`` for its contact and rupture."""
        made, last = copy(self), [FRICTION, CUTTING]
        made.problem = GradualProblem(self.problem.curve, samples, self.problem.known, self.problem.exponent)
        design = columns(self.problem.curve, self.problem.shape(self.numbers), samples)
        rest = samples.force - design[:, [AMPLITUDE, ZERO]] @ self.coefficients[[AMPLITUDE, ZERO]]
        made.coefficients = self.coefficients.copy()
        made.coefficients[last] = not_negative(design[:, last], rest)
        made.residual = samples.force - design @ made.coefficients
        made.noises = made._noises()
        made.values = made._values(self.numbers, made.coefficients)
        made.search_covariance, made.known = made._staged_covariance(self)
        made.covariance = made._covariance()
        made._check()
        return made

    def _staged_covariance(self, alone: "GradualEstimates") -> tuple[np.ndarray, np.ndarray]:
        """As ``_search_covariance``: friction and cutting have their own errors and those of what ``alone`` gives."""
        jacobian = self.scale * self.problem.jacobian(self.numbers, self.coefficients)
        own = np.array([k for k in (FRICTION, CUTTING) if self.coefficients[k] != 0.0], int)
        given = np.array([k for k in range(len(jacobian)) if k not in (FRICTION, CUTTING)])
        found, known = alone.search_covariance.copy(), alone.known.copy()
        found[[FRICTION, CUTTING]] = found[:, [FRICTION, CUTTING]] = 0.0
        known[[FRICTION, CUTTING]] = False
        known[own] = True
        n, mine = self.problem.samples.n_in, jacobian[own]
        grams = np.array([part @ part.T for part in (mine[:, :n], mine[:, n:])])
        bread = inverse(grams.sum(axis=0))
        by = -bread @ mine @ jacobian[given].T
        across = by @ found[np.ix_(given, given)]
        found[np.ix_(own, given)], found[np.ix_(given, own)] = across, across.T
        found[np.ix_(own, own)] = sandwich(bread, grams, self.noises) + across @ by.T
        return found, known

    def _check(self) -> None:
        values = self.values
        h, curve = values["rupture_onset"], self.problem.curve
        loaded = float(curve.force(np.float64(h), values))
        after = values["friction_per_length"] * h + values["cutting_force"]
        if not loaded - after > MIN_SHARE * loaded:
            raise InputError("force at the onset of the rupture", f"{loaded:.3g} N",
                             f"friction and cutting take {after:.3g} N: nothing ruptures")  # fmt: skip

    def _values(self, numbers: np.ndarray, coefficients: np.ndarray) -> dict[str, float]:
        shape, curve, unit, scale = self.problem.shape(numbers), self.problem.curve, self.unit, self.scale
        (name,) = curve.amplitudes
        own = {key: x * unit**each.power for (key, each), x in zip(curve.shape.items(), shape.curve)}
        (per,) = curve.basis(np.float64(unit), *own.values())  # the amplitude of a scaled curve, in SI
        (scaled,) = curve.basis(np.float64(1.0), *shape.curve)
        return {
            name: float(coefficients[AMPLITUDE] * scale * scaled / per),
            **own,
            "contact_depth": self.contact + unit * shape.place,
            "force_offset": float(coefficients[ZERO] * scale),
            "friction_per_length": float(coefficients[FRICTION] * scale / unit),
            "cutting_force": float(coefficients[CUTTING] * scale),
            "rupture_onset": unit * shape.onset,
            "rupture_length": unit * shape.length,
            "rupture_exponent": shape.exponent,
        }

    def _order(self) -> Iterator[str]:
        yield from self.problem.curve.amplitudes
        yield from ("friction_per_length", "cutting_force", "force_offset", "contact_depth", "rupture_onset",
                    "rupture_length")  # fmt: skip
        yield from () if self.problem.known else self.problem.curve.shape
        yield from ("rupture_exponent",) if self.problem.exponent is None else ()

    def _noises(self) -> list[Noise]:
        n, length = self.problem.samples.n_in, self.problem.samples.filter_length
        parts = self.scale * self.residual[:n], self.scale * self.residual[n:]
        return [noise_of(part, len(part), length, lost) for part, lost in zip(parts, (len(self.order) - 1.0, 1.0))]

    def _search_covariance(self) -> tuple[np.ndarray, np.ndarray]:
        """Covariance (p, p) of coefficients and numbers of the search, scaled, 0 where one has no effect on the force
        or is held at 0, and a mask (p,) of those that have."""
        jacobian = self.scale * self.problem.jacobian(self.numbers, self.coefficients)
        n = self.problem.samples.n_in
        known = np.einsum("ij,ij->i", jacobian, jacobian) > 0.0
        known[:N_LINEAR] &= (self.coefficients != 0.0) | (np.arange(N_LINEAR) == ZERO)
        some = np.flatnonzero(known)
        grams = np.array([part @ part.T for part in (jacobian[some, :n], jacobian[some, n:])])
        found = np.zeros((len(jacobian), len(jacobian)))
        bread = inverse(grams.sum(axis=0))
        found[np.ix_(some, some)] = sandwich(bread, grams, self.noises)
        if self.drift is not None:
            change = self.drift.change(bread, jacobian[some])
            found[np.ix_(some, some)] += np.outer(change, change)
        return found, known

    def _covariance(self) -> np.ndarray:
        """Covariance (p, p) in SI of the values in ``order``, infinite where unknown."""
        by = self._by_numbers()
        found = by @ self.search_covariance @ by.T
        found[~self.known] = found[:, ~self.known] = 0.0
        found[~self.known, ~self.known] = np.inf
        return found

    def _by_numbers(self) -> np.ndarray:
        """Derivatives (p, p) of the values in ``order`` by the coefficients and numbers of the search."""
        numbers = np.concatenate([self.coefficients, self.numbers])
        base = np.array([self.values[name] for name in self.order])
        rows = []
        for k in range(len(numbers)):
            step = np.zeros(len(numbers))
            step[k] = 1e-6
            moved = self._values(*np.split(numbers + step, [N_LINEAR])[::-1])
            rows.append((np.array([moved[name] for name in self.order]) - base) / 1e-6)
        return np.array(rows).T

    def force(self, depth: np.ndarray, numbers: np.ndarray, coefficients: np.ndarray) -> np.ndarray:
        """Force (n,) [N] of the insertion at ``depth`` (n,) [m], without the sensor's zero."""
        at = Samples(x=(depth - self.contact) / self.unit, force=depth, n_in=len(depth))
        return self.scale * (
            columns(self.problem.curve, self.problem.shape(numbers), at)[:, :ZERO] @ coefficients[:ZERO]
        )

    def peak(self, numbers: np.ndarray, coefficients: np.ndarray) -> tuple[float, float]:
        """Depth [m] and force [N] of the peak of the model, the first maximum after the onset; the start of the rupture
        where the force falls from there on."""
        shape = self.problem.shape(numbers)
        ends = shape.place + shape.onset + np.array([0.0, 3.0 * shape.length])
        depth = np.linspace(*(self.contact + self.unit * ends), PEAK_GRID)
        force = self.force(depth, numbers, coefficients)
        falls = np.flatnonzero(np.diff(force) < 0.0)
        if not len(falls):
            raise InputError("force after the onset of the rupture", "rising", "a puncture needs a fall of the force")
        return float(depth[falls[0]]), float(force[falls[0]])

    def cycle(self, law: str, sharp: CycleFit, reduced: Strokes) -> CycleFit:
        """The fit as that of a cycle; its puncture is the peak."""
        depth, force = self.peak(self.numbers, self.coefficients)
        contact = self.values["contact_depth"]
        values = self.values | {
            "puncture_depth": depth,
            "puncture_indentation": depth - contact,
            "puncture_force": force,
        }
        half = dict(zip(self.order, TWO_SIDED * np.sqrt(np.maximum(self.covariance.diagonal(), 0.0))))
        half |= self._half_of_peak(reduced)
        low, high = limits(values, half)
        for name in (*FITS[law].parameters, "friction_per_length", "cutting_force"):
            low[name] = max(low[name], 0.0)
        residual_in = (
            reduced.force_in - values["force_offset"] - self.force(reduced.depth_in, self.numbers, self.coefficients)
        )
        friction = values["friction_per_length"] * np.maximum(reduced.depth_out - contact, 0.0)
        before = int(np.searchsorted(reduced.depth_in, depth))
        return CycleFit(
            law=law,
            values=values,
            low=low,
            high=high,
            order=self.order,
            covariance=self.covariance,
            puncture=PunctureSamples(before, max(before - 1, 0), min(before, len(reduced.depth_in) - 1)),
            residuals=CycleResiduals(
                insertion=residual_in,
                withdrawal=reduced.force_out - values["force_offset"] + friction,
                noises=tuple(self.noises),
            ),
            warnings=sharp_free(sharp.warnings),
            saturation_sought="saturation_depth" in self.order,
            by_stages=True,
        )

    def _half_of_peak(self, reduced: Strokes) -> dict[str, float]:
        """Half widths of the peak's depth, indentation and force, by the delta method with all parameters."""
        numbers = np.concatenate([self.coefficients, self.numbers])
        at = lambda x: self.peak(*np.split(x, [N_LINEAR])[::-1])  # noqa: E731
        by = []
        for k in range(len(numbers)):
            step = np.zeros(len(numbers))
            step[k] = 1e-3 * max(abs(numbers[k]), 1e-2)
            by.append((np.array(at(numbers + step)) - np.array(at(numbers - step))) / (2.0 * step[k]))
        return _widths(np.array(by).T, self.search_covariance, self.unit, reduced)

    def loading(self, law: str, loading: DeformationFit, reduced: Strokes, peak: int) -> DeformationFit:
        """The fit as that of the loading curve: its residual on the samples up to the peak."""
        depth, force = reduced.depth_in[: peak + 1], reduced.force_in[: peak + 1]
        residual = force - self.values["force_offset"] - self.force(depth, self.numbers, self.coefficients)
        return DeformationFit(
            law=law, values=self.values, order=self.order, covariance=self.covariance,
            noise=noise_of(residual, len(residual), self.problem.samples.filter_length, len(self.order)),
            peak=loading.peak, held=(), by_drift=np.zeros(len(self.order)),
        )  # fmt: skip


def _widths(by: np.ndarray, covariance: np.ndarray, unit: float, reduced: Strokes) -> dict:
    """Half widths from the derivatives ``by`` (2, p) of depth and force of the peak."""
    variance = by @ covariance @ by.T
    place = N_LINEAR  # of the contact among the numbers
    indentation = by[0].copy()
    indentation[place] -= unit
    gap = float(np.median(np.diff(reduced.depth_in))) if len(reduced.depth_in) > 1 else 0.0
    half = {"puncture_depth": variance[0, 0], "puncture_indentation": float(indentation @ covariance @ indentation)}
    found = {name: math.hypot(TWO_SIDED * math.sqrt(max(x, 0.0)), 0.5 * gap) for name, x in half.items()}
    return found | {"puncture_force": TWO_SIDED * math.sqrt(max(float(variance[1, 1]), 0.0))}
