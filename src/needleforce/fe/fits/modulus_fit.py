# SPDX-License-Identifier: Apache-2.0
"""Moduli from an indentation curve with the specimen's true geometry: finite, on a base, in layers."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...display.quantities import plain
from ...identification.estimates import Estimate, EstimateResult
from ...identification.indentation import fit_indentation
from ...identification.statistics.noise import TWO_SIDED, noise_of
from ...mechanics.contact import contact
from ...vocabulary import SMALLEST
from ..elastic.surface_contact import press
from ..elastic.tissue import Tissue
from ..materials import check_labels

_DEPTHS = 16  # at which the contact is solved
_STEP = 0.05  # of the logarithm of a modulus, in a derivative
_SHALLOWEST = 0.08  # share of the deepest, below which the half-space's shape is used


@dataclass(frozen=True, repr=False)
class ModulusFit(EstimateResult):
    """Moduli found from a curve, with 95 % intervals.

    Attributes
    ----------
    young_modulus, low, high : dict of str to float
        Of each label that was found [Pa].
    contact_depth, contact_low, contact_high : float
        Where the curve meets the surface [m].
    half_space_modulus : float
        What Sneddon's contact on a half-space finds from the same curve [Pa].
    geometry_factor : float
        That over the modulus found, where one number was found: the effect of thickness and boundaries.
    rmse : float
        Of the residual [N].
    solutions : int
        How often the contact was solved for a set of moduli.
    """

    young_modulus: dict[str, float]
    low: dict[str, float]
    high: dict[str, float]
    contact_depth: float
    contact_low: float
    contact_high: float
    half_space_modulus: float
    geometry_factor: float
    rmse: float
    solutions: int

    @property
    def estimates(self) -> tuple[Estimate, ...]:
        """The moduli of the labels [Pa] and the depth of contact [m]."""
        contact = Estimate("contact_depth", self.contact_depth, "m", self.contact_low, self.contact_high)
        return (*modulus_estimates(self.young_modulus, self.low, self.high), contact)

    def _heading(self) -> str:
        return f"ModulusFit: residual {plain(self.rmse, 'N')} rms, {self.solutions} solutions of the contact"

    def document(self) -> dict:
        """The numbers for JSON."""
        names = ("half_space_modulus", "geometry_factor", "rmse", "solutions")
        return super().document() | {name: getattr(self, name) for name in names}


def modulus_estimates(values: dict[str, float], low: dict[str, float], high: dict[str, float]) -> list[Estimate]:
    """The Young modulus [Pa] of each label as an estimate."""
    named = ((label, f"young_modulus_{label}" if label else "young_modulus") for label in values)
    return [Estimate(name, values[label], "Pa", low[label], high[label]) for label, name in named]


def fit_modulus(
    tissue: Tissue,
    tip: Any,
    depth: ArrayLike,
    force: ArrayLike,
    *,
    reach: float,
    labels: Sequence[str] = (),
) -> ModulusFit:
    """Find moduli so that a tip pressed into the solid has a measured force.

    Parameters
    ----------
    tissue : Tissue
        Geometry, supports and Poisson ratios of the specimen; its moduli are where the search begins.
    tip : Tip
        One of ``nf.tips``.
    depth, force : array_like, shape (n,)
        One approach in the order of time [m], [N], with some free travel before contact.
    reach : float
        Radius within which contact is looked for [m], as in ``press``.
    labels : sequence of str, optional
        Layers whose moduli are found apart, the others keep theirs; by default all are scaled together, which takes
        one solution.

    Returns
    -------
    ModulusFit
        Moduli with intervals, and the half-space's for the same curve.

    Raises
    ------
    InputError
        If the arrays are no curve, a label is unknown, or the contact does not fit the mesh.

    Notes
    -----
    Least squares for moduli, depth of contact and a constant force without contact; intervals count the
    autocorrelation of the residual, as those of ``fit_indentation``.
    """
    start = fit_indentation(depth, force, tip, poisson_ratio=_ratio(tissue))
    check_labels(labels, tissue.materials)
    problem = _Problem(
        tissue, tip, depth=np.asarray(depth, float), force=np.asarray(force, float), reach=reach, labels=tuple(labels)
    )
    numbers, jacobian, residual = problem.solved(start.contact_depth.value)
    return problem.result(numbers, jacobian, residual, float(start.young_modulus.value))


def _ratio(tissue: Tissue) -> float:
    """Poisson ratio at the surface."""
    centres = tissue.mesh.points[tissue.mesh.cells].mean(axis=1)[:, -1]
    return tissue.materials[str(tissue.mesh.labels[centres.argmin()])].poisson_ratio


@dataclass
class _Problem:
    tissue: Tissue
    tip: Any
    depth: np.ndarray
    force: np.ndarray
    reach: float
    labels: tuple[str, ...]
    contact_depth: float = 0.0  # before the search [m]
    solutions: int = 0

    def solved(self, contact_depth: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Logarithms of moduli over their start, depth of contact, and force without contact; slopes; residual."""
        from scipy.optimize import least_squares

        count = max(len(self.labels), 1)
        self.contact_depth = contact_depth - 0.05 * (self.depth.max() - contact_depth)
        scale = np.append(np.ones(count), [0.02 * np.ptp(self.depth), 0.02 * np.ptp(self.force)])
        numbers = np.append(np.zeros(count), [contact_depth, float(np.median(self.force[self.depth < contact_depth]))])
        numbers[:count] = self._first(numbers)
        for _ in range(6 if self.labels else 1):
            curves = self._curves(numbers[:count])
            found = least_squares(lambda x, c=curves, n=numbers: self._residual(x, c, n), numbers, x_scale=scale)
            moved = np.abs(found.x[:count] - numbers[:count]).max()
            numbers = found.x
            if moved < 1e-3:
                break
        return numbers, found.jac, found.fun

    def _first(self, numbers: np.ndarray) -> np.ndarray:
        """All moduli scaled so that the force at the deepest is met."""
        deepest = self.depth.max() - numbers[-2]
        self.solutions += 1
        force = press(self.tissue, self.tip, deepest, self.reach).force[0]
        ratio = max(self.force[self.depth.argmax()] - numbers[-1], SMALLEST) / force
        return np.full(len(numbers) - 2, np.log(ratio))

    def _curves(self, logarithms: np.ndarray) -> list[Any]:
        """Force by indentation for these moduli, and for each of them a little larger."""
        if not self.labels:
            return [self._curve(np.zeros(1))]
        return [
            self._curve(logarithms + step) for step in (np.zeros(len(logarithms)), *_STEP * np.eye(len(logarithms)))
        ]

    def _residual(self, numbers: np.ndarray, curves: list[Any], around: np.ndarray) -> np.ndarray:
        indentation = np.maximum(self.depth - numbers[-2], 0.0)
        if not self.labels:
            return numbers[-1] + np.exp(numbers[0]) * curves[0](indentation) - self.force
        here = curves[0](indentation)
        model = here.copy()
        for k, curve in enumerate(curves[1:]):
            model += (curve(indentation) - here) / _STEP * (numbers[k] - around[k])
        return numbers[-1] + model - self.force

    def _curve(self, logarithms: np.ndarray) -> Any:
        """Force [N] as a function of indentation [m]: solved at some depths, below them the shape of a half-space."""
        from scipy.interpolate import PchipInterpolator

        self.solutions += 1
        deepest = 1.05 * (self.depth.max() - self.contact_depth)
        depths = np.linspace(_SHALLOWEST, 1.0, _DEPTHS) * deepest
        tissue = self.tissue.scaled(dict(zip(self.labels, np.exp(logarithms)))) if self.labels else self.tissue
        forces = press(tissue, self.tip, depths, self.reach).force
        below = np.linspace(0.0, _SHALLOWEST, 8)[:-1] * deepest
        shape = contact(self.tip, depth=np.append(below, depths[0]), reduced_modulus=1.0).force
        return PchipInterpolator(np.append(below, depths), np.append(shape[:-1] / shape[-1] * forces[0], forces))

    def result(self, numbers, jacobian, residual, half_space):  # type: ignore[no-untyped-def]
        """Values with intervals."""
        noise = noise_of(residual, len(residual), lost=len(numbers))
        half = TWO_SIDED * np.sqrt(noise.long_run * np.diagonal(np.linalg.pinv(jacobian.T @ jacobian)))
        labels = self.labels or tuple(self.tissue.materials)
        index = {label: (k if self.labels else 0) for k, label in enumerate(labels)}

        def value(label: str, by: float) -> float:
            k = index[label]
            return self.tissue.materials[label].young_modulus * float(np.exp(numbers[k] + by * half[k]))

        found = {label: value(label, 0.0) for label in labels}
        return ModulusFit(
            young_modulus=found,
            low={label: value(label, -1.0) for label in labels},
            high={label: value(label, 1.0) for label in labels},
            contact_depth=float(numbers[-2]),
            contact_low=float(numbers[-2] - half[-2]),
            contact_high=float(numbers[-2] + half[-2]),
            half_space_modulus=half_space,
            geometry_factor=half_space / next(iter(found.values())) if len(found) == 1 else float("nan"),
            rmse=float(np.sqrt(np.mean(residual**2))),
            solutions=self.solutions,
        )
