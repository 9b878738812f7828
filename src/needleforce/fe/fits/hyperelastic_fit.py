# SPDX-License-Identifier: Apache-2.0
"""Moduli of hyperelastic tissue from the curve of a plate or a flat end, next to what linear theory finds.

The force of a solid is proportional to a common factor of its moduli. Its stiffness, force by indentation, is solved at
some depths; its logarithm is linear in the logarithm of that factor, and nearly so in what else is found.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...checks import finite_number
from ...display.quantities import plain
from ...errors import InputError
from ...identification.estimates import Estimate, EstimateResult
from ...identification.indentation import MIN_FREE_SAMPLES, MIN_RISE_SIGMA, checked_curve
from ...identification.one_layer.deformation_fit import FLIP_SIGN
from ...identification.statistics.noise import TWO_SIDED, noise_of
from ..hyperelastic.tissue import HyperelasticTissue
from ..materials import Hyperelastic, NeoHookean, check_labels
from .insertion_search import AS_GOOD, misfit, uncertainty
from .pressed_solid import HyperelasticParameters, PressedSolid, StraightLine, young_modulus

_MAX_CHANGE = 1.5  # of one, in a turn
_MAX_TURNS = 10
_SETTLED, _SETTLED_SHARE = 1e-3, 0.02  # change of one in the last turn, or that over half of its interval
_MARGIN = 0.05  # of the indentation, that is solved in addition where the contact is searched
_CONTACTS = 1.0, 1.3, 0.7  # [of the indentation of a straight line] where the search begins
_SLOW, _QUICKER = 8, 24  # cosines along a curve: of a misfit, and of the noise next to them
_MISFIT = 5.0  # ratio of their mean squares, F(8, 24): noise exceeds it in 1 of 1000
_MAX_RETURN = 0.02  # of the curve's length, by which a depth may be above one before


@dataclass(frozen=True, repr=False)
class HyperelasticFit(EstimateResult):
    """Moduli found from a curve, with 95 % intervals, and what linear theory finds from the same.

    Attributes
    ----------
    materials : dict of str to NeoHookean or MooneyRivlin
        Of all labels, for a ``HyperelasticTissue``.
    young_modulus : dict of str to float
        At small strain, of each label that was found [Pa].
    low, high : dict of str to dict of str to float
        Label that was found -> ``"shear_modulus"``, and of a Mooney-Rivlin material ``"c10"`` and ``"c01"`` -> limit of
        the interval [Pa]; 0 or -inf and inf where the curve does not determine it.
    contact_depth, contact_low, contact_high : float
        Where the curve meets the surface [m]; limits are NaN if it was given.
    linear_young_modulus : dict of str to float
        What the linear solid of the same geometry finds from the same curve, in the ratio of the moduli found [Pa].
    closed_form : str
        ``"uniform compression"``, ``"half-space"``, or ``"none"`` for a body that has neither.
    closed_form_modulus : float
        What it finds from the same curve: ``F h / (A d)``, or ``(1 - nu^2) F / (2 a d)`` [Pa].
    large_strain_factor : float
        Modulus of the linear solid over the one found: the effect of large strain.
    geometry_factor : float
        Modulus of the closed form over that of the linear solid: the effect of thickness, sides and plates that hold;
        in plane strain of that, too. NaN without a closed form, or if the body has several materials.
    rmse, linear_rmse : float
        Of the residuals of the hyperelastic and of the linear fit [N].
    solutions : int
        How often the curve was solved for a set of moduli.
    warnings : tuple of str
        A misfit beyond the noise, with the place where it is largest, or one that is slow along the curve. Intervals
        then hold what the shallower half of the curve gives, and as much again beyond.
    """

    materials: dict[str, Hyperelastic]
    young_modulus: dict[str, float]
    low: dict[str, dict[str, float]]
    high: dict[str, dict[str, float]]
    contact_depth: float
    contact_low: float
    contact_high: float
    linear_young_modulus: dict[str, float]
    closed_form: str
    closed_form_modulus: float
    large_strain_factor: float
    geometry_factor: float
    rmse: float
    linear_rmse: float
    solutions: int
    warnings: tuple[str, ...] = ()

    @property
    def estimates(self) -> tuple[Estimate, ...]:
        """The shear moduli of the labels [Pa], c10 and c01 of Mooney-Rivlin ones, and the depth of contact [m]."""
        moduli = [
            Estimate(f"{name}_{label}", float(getattr(self.materials[label], name)), "Pa", low, self.high[label][name])
            for label, limits in self.low.items()
            for name, low in limits.items()
        ]
        return (*moduli, Estimate("contact_depth", self.contact_depth, "m", self.contact_low, self.contact_high))

    def _heading(self) -> str:
        young = ", ".join(f"{label} {plain(value, 'Pa')}" for label, value in self.young_modulus.items())
        return f"HyperelasticFit: Young modulus at small strain {young}, residual {plain(self.rmse, 'N')} rms"

    def document(self) -> dict:
        """The numbers for JSON."""
        names = (
            *("young_modulus", "linear_young_modulus", "closed_form", "closed_form_modulus", "large_strain_factor"),
            *("geometry_factor", "rmse", "linear_rmse", "solutions", "warnings"),
        )
        return super().document() | {name: getattr(self, name) for name in names}


def fit_hyperelastic(
    tissue: HyperelasticTissue,
    depth: ArrayLike,
    force: ArrayLike,
    *,
    bonded: bool,
    boundary: str = "top",
    labels: Sequence[str] = (),
    find_c01: bool = False,
    contact_depth: float | None = None,
    steps: int = 10,
) -> HyperelasticFit:
    """Find moduli so that a solid under a plate or a flat end has a measured force.

    Parameters
    ----------
    tissue : HyperelasticTissue
        Geometry, supports and materials; its moduli are where the search begins. Bulk moduli stay in their ratio to
        them.
    depth, force : array_like, shape (n,)
        One approach in the order of time [m], [N], + inwards and + against the motion. The force is that on the mesh: a
        quarter of a body bears a quarter of it.
    bonded : bool
        Whether plate or end hold the surface that they press; without, it slides on them.
    boundary : str, optional
        What is pressed: the whole top, as by a plate, or a boundary of the mesh that is a part of it, as by a flat end.
    labels : sequence of str, optional
        Layers whose moduli are found apart, the others keep theirs; by default all are scaled together, which takes
        one solution.
    find_c01 : bool, optional
        Whether the share of c01 in c10 + c01 is found, one for all Mooney-Rivlin materials; it acts on the curvature
        only, so that c10 and c01 have wider intervals than their sum.
    contact_depth : float, optional
        Depth of the surface [m], of a curve that begins in contact. Without, it is found, from some free travel.
    steps : int, optional
        Depths at which the curve is solved, 4 or more.

    Returns
    -------
    HyperelasticFit
        Materials with intervals, and the moduli of the linear solid and of a closed form for the same curve.

    Raises
    ------
    InputError
        If the arrays are no approach, a label or boundary is unknown, the solid has no solution at the depth of the
        curve, or the search does not converge.

    Notes
    -----
    Least squares for moduli, depth of contact and a constant force without contact; intervals count the
    autocorrelation of the residual, how parts of the curve disagree, and every depth of contact that several starts end
    at and that fits as well. The linear solid and the closed form have a
    straight line with its own depth of contact.

    The boundary is the same at all depths. The surface next to it is free: what folds onto a bonded plate, or meets the
    side of an end, is not held back, and at the edge strain has no limit. The mesh should be fine there; between meshes
    the modulus differs by half a percent at 15 % of the height, by 2 % at 30 % (bonded). An end on which the surface
    slides is for depths up to a tenth of its radius; deeper, the surface creeps out from under its edge. A share of c01
    outside 0 to 1 is extrapolated from there.
    """
    _check_choices(bonded, steps, labels, contact_depth)
    pressed = PressedSolid(tissue, boundary, bonded=bonded, steps=steps)
    parameters = HyperelasticParameters(tissue.materials, tuple(labels), find_c01)
    line = StraightLine(*_checked(depth, force), radius=pressed.radius, given=contact_depth)
    return _StiffnessSearch(pressed, parameters, line).found()


def _check_choices(bonded: object, steps: object, labels: object, contact_depth: object) -> None:
    if not isinstance(bonded, (bool, np.bool_)):
        raise InputError("bonded", repr(bonded)[:60], "must be True or False")
    if not isinstance(steps, (int, np.integer)) or isinstance(steps, bool):
        raise InputError("steps", repr(steps)[:60], "must be a whole number", next_step="Use 10.")
    check_labels(labels)
    if contact_depth is not None:
        finite_number("contact_depth", contact_depth, "Give it in m.")


def _checked(depth: ArrayLike, force: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """One approach, as arrays."""
    depth, force = checked_curve(depth, force)
    above = np.maximum.accumulate(depth) - depth
    if above.max() > _MAX_RETURN * np.ptp(depth):
        place = f"sample {np.argmax(above > _MAX_RETURN * np.ptp(depth))}"
        value, step = f"{1e3 * above.max():.3g} mm above one before", "Give one approach, up to its deepest sample."
        raise InputError("depth", value, "must not return", place, step)
    return depth, force


class _StiffnessSearch:
    """Least squares, in turns in which the logarithm of the stiffness is linear in what is found."""

    def __init__(self, pressed: PressedSolid, parameters: HyperelasticParameters, line: StraightLine):
        self.pressed, self.parameters, self.line = pressed, parameters, line
        self.depth, self.force, self.given = line.depth, line.force, line.given
        self.around = np.zeros(0)  # what is found, where the stiffness was solved
        self.curves: list[Any] = []
        self.solutions = 0

    def found(self) -> HyperelasticFit:
        """From what a straight line finds."""
        start = self.parameters.beginning(self.line.slope / self.pressed.at_rest(self.pressed.tissue))
        contact = [self.line.contact] if self.given is None else []
        values, margin = np.concatenate([start, contact, [self.line.zero]]), _MARGIN * len(contact)
        deepest = (1.0 + margin) * (self.depth.max() - self.line.contact)
        for _ in range(_MAX_TURNS):
            self._solve(values, deepest)
            values, covariance = self._fitted(values)
            needed = self.depth.max() - self._contact(values)
            if needed > deepest * (1.0 + 1e-9):
                deepest = (1.0 + margin) * needed
            elif self._settled(values, covariance):
                return self._result(values, covariance)
        step = "Find fewer moduli, or give a deeper curve with less noise."
        raise InputError("search for moduli", "not converging", f"in {_MAX_TURNS} turns", next_step=step)

    def _contact(self, values: np.ndarray) -> float:
        return float(values[-2]) if self.given is None else self.given

    def _solve(self, values: np.ndarray, deepest: float) -> None:
        """Logarithm of the stiffness for some numbers, then its derivative by each of them."""
        self.around = self.parameters.stable(values[: self.parameters.count])
        here = self._curve(self.around, deepest)
        self.curves = [here]
        for k in range(self.parameters.count):
            if k == self.parameters.common:
                before = self.curves[1:]
                self.curves.append(lambda at, before=before: 1.0 - sum(each(at) for each in before))
                continue
            step = self.parameters.step(self.around, k)
            other = self._curve(self.around + step, deepest)
            self.curves.append(lambda at, other=other, size=step[k]: (other(at) - here(at)) / size)

    def _curve(self, numbers: np.ndarray, deepest: float) -> Any:
        self.solutions += 1
        return self.pressed.stiffness(self.parameters.materials(numbers), deepest)

    def _log_stiffness(self, values: np.ndarray, indentation: np.ndarray) -> np.ndarray:
        logarithm = self.curves[0](indentation)
        for change, curve in zip(values[: self.parameters.count] - self.around, self.curves[1:]):
            logarithm = logarithm + change * curve(indentation)
        return logarithm

    def _model(self, values: np.ndarray) -> np.ndarray:
        indentation = np.maximum(self.depth - self._contact(values), 0.0)
        return values[-1] + indentation * np.exp(self._log_stiffness(values, indentation))

    def _fitted(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values of least squares, and their covariance."""
        from scipy.optimize import least_squares

        count, searched = self.parameters.count, int(self.given is None)
        reach = np.full(count, np.inf if self.parameters.exact else _MAX_CHANGE)
        low = np.concatenate([self.around - reach, [self.depth.min()] * searched, [-np.inf]])
        high = np.concatenate([self.around + reach, [self.depth.max()] * searched, [np.inf]])
        scale = [1.0] * count + [0.02 * np.ptp(self.depth)] * searched + [0.02 * np.ptp(self.force)]
        found = [
            least_squares(
                lambda x: self._model(x) - self.force, start, x_scale=scale, bounds=(low, high), ftol=1e-12, xtol=1e-12
            )
            for start in self._starts(values)
        ]
        best = min(found, key=lambda each: each.cost)
        noise, covariance = uncertainty(best.jac, best.fun)
        as_good = [each.x - best.x for each in found if 2.0 * (each.cost - best.cost) <= AS_GOOD * noise]
        apart = np.max(np.abs(as_good), axis=0) / TWO_SIDED
        return best.x, covariance + np.outer(apart, apart)

    def _shallower_half(self, values: np.ndarray) -> np.ndarray:
        """Values of the curve down to half of its indentation."""
        depth, force, contact = self.depth, self.force, self._contact(values)
        kept = depth <= 0.5 * (contact + depth.max())
        self.depth, self.force = depth[kept], force[kept]
        found, _ = self._fitted(values)
        self.depth, self.force = depth, force
        return found

    def _starts(self, values: np.ndarray) -> list[np.ndarray]:
        """The values, and the same with contacts elsewhere."""
        if self.given is not None:
            return [values]
        places = self.depth.max() - np.array(_CONTACTS) * (self.depth.max() - values[-2])
        return [np.concatenate([values[:-2], [place, values[-1]]]) for place in np.maximum(places, self.depth.min())]

    def _settled(self, values: np.ndarray, covariance: np.ndarray) -> bool:
        """Whether the stiffness was solved for the numbers that were found."""
        numbers = values[: self.parameters.count]
        moved = np.abs(self.parameters.stable(numbers) - self.around)
        half = _half(covariance)[: self.parameters.count]
        return self.parameters.exact or bool(np.all(moved <= np.maximum(_SETTLED, _SETTLED_SHARE * half)))

    def _result(self, values: np.ndarray, covariance: np.ndarray) -> HyperelasticFit:
        rise = self._model(values) - values[-1]
        residual = rise + values[-1] - self.force
        self._check(values, rise, residual)
        leaves = misfit(residual, self.depth) or _slow_misfit(residual)
        if leaves:
            apart = 2.0 * (self._shallower_half(values) - values) / TWO_SIDED
            covariance = covariance + np.outer(apart, apart)
        materials = self.parameters.materials(values)
        limits = {label: self._limits(label, materials[label], covariance) for label in self.parameters.found}
        young = {label: young_modulus(materials[label]) for label in self.parameters.found}
        factor = self.line.slope / float(np.exp(self._log_stiffness(values, np.zeros(1))[0]))
        name, modulus = self.pressed.closed_form(self.line.slope)
        linear = {label: factor * each for label, each in young.items()}
        contact = self._contact(values)
        half = float(_half(covariance)[-2]) if self.given is None else float("nan")
        return HyperelasticFit(
            materials=materials,
            young_modulus=young,
            low={label: {key: low for key, (low, _) in each.items()} for label, each in limits.items()},
            high={label: {key: high for key, (_, high) in each.items()} for label, each in limits.items()},
            contact_depth=contact,
            contact_low=contact - half,
            contact_high=contact + half,
            linear_young_modulus=linear,
            closed_form=name,
            closed_form_modulus=modulus,
            large_strain_factor=factor,
            geometry_factor=modulus / next(iter(linear.values())) if len(materials) == 1 else float("nan"),
            rmse=float(np.sqrt(np.mean(residual**2))),
            linear_rmse=self.line.rmse,
            solutions=self.solutions,
            warnings=(f"{leaves}: there the tissue does what this model has not.",) if leaves else (),
        )

    def _check(self, values: np.ndarray, rise: np.ndarray, residual: np.ndarray) -> None:
        """Raise InputError for a force that does not rise above its noise, or a curve without free travel."""
        noise = noise_of(residual, len(residual), lost=len(values))
        if not np.sum((rise - rise.mean()) ** 2) > MIN_RISE_SIGMA**2 * noise.long_run:
            limit = f"it must rise above its baseline by {MIN_RISE_SIGMA:g} standard errors"
            raise InputError("force", "not rising with depth", limit, next_step=FLIP_SIGN)
        free = int((self.depth <= self._contact(values)).sum())
        if self.given is None and free < MIN_FREE_SAMPLES:
            limit = f"at least {MIN_FREE_SAMPLES} samples of free travel are needed"
            step = "Give a curve that begins above the surface, or the depth of the surface as contact_depth."
            raise InputError("contact depth", f"at the start of the curve ({free} before it)", limit, next_step=step)

    def _limits(self, label: str, material: Hyperelastic, covariance: np.ndarray) -> dict[str, tuple[float, float]]:
        """Interval of each modulus [Pa]."""
        k, share = self.parameters.index(label), self.parameters.scales
        with np.errstate(over="ignore"):
            ends = material.shear_modulus * np.exp(_half(covariance)[k] * np.array([-1.0, 1.0]))
        limits = {"shear_modulus": (float(ends[0]), float(ends[1]))}
        if isinstance(material, NeoHookean):
            return limits
        for name, sign in (("c10", -1.0), ("c01", 1.0)):
            slope = np.zeros(len(covariance))
            slope[k] = getattr(material, name)
            if self.parameters.find_c01:
                slope[share] = sign * (material.c10 + material.c01)
            half = float(_half(np.atleast_2d(slope @ covariance @ slope))[0])
            limits[name] = float(slope[k]) - half, float(slope[k]) + half
        return limits


def _slow_misfit(residual: np.ndarray) -> str:
    """What a fit leaves along the whole curve although it is small next to the noise of a sample; nothing for noise
    that is white or that a few samples share."""
    count = len(residual)
    places = np.pi * (np.arange(count) + 0.5) / count
    waves = np.cos(np.outer(np.arange(1, _SLOW + _QUICKER + 1), places)) @ residual
    ratio = float(np.mean(waves[:_SLOW] ** 2) / np.mean(waves[_SLOW:] ** 2))
    return (
        f"The fit leaves {np.sqrt(ratio):.3g} times the noise in slow waves along the curve" if ratio > _MISFIT else ""
    )


def _half(covariance: np.ndarray) -> np.ndarray:
    """Half widths of intervals; inf where the curve does not determine a number."""
    return np.nan_to_num(TWO_SIDED * np.sqrt(np.diagonal(covariance)), nan=np.inf)
