# SPDX-License-Identifier: Apache-2.0
"""Young modulus of a needle from the readings of a bending test, large deflections included."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..core import Needle
from ..display.quantities import percent, plain, quantity
from ..errors import InputError
from ..identification.estimates import Estimate, EstimateResult
from ..identification.statistics.noise import INTERVAL, student_quantile
from .elastica import tip_compliance, tip_of_cantilever
from .stress_fit import ROUNDING, inflation_of
from .stress_result import MAX_MISFIT

MIN_READINGS = 3
MIN_CORRELATED = 12  # readings of a cantilever that show whether their residuals are correlated
MIN_SPARE_FOR_CLAMP = 2  # readings more than unknowns, to find a clamp compliance
SMALL_DEFLECTION = 0.1  # [1] F a^2 / (E I), about twice the slope at the force
SOFTER_STARTS = (0.5, 0.2)  # [of the modulus for small deflections] further starting values
_STEP = 1e-5  # relative, of the derivatives of the readings


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class BendingFit(EstimateResult):
    """Young modulus of a needle from bending.

    Attributes
    ----------
    young_modulus, low, high : float
        E and its interval [Pa].
    bending_stiffness, stiffness_low, stiffness_high : float
        E I and its interval [N m^2].
    slack : float
        Deflection without load [m]: play in the hub, or travel before contact.
    clamp_compliance, clamp_low, clamp_high : float
        Rotation of the clamp per moment and its interval [rad/(N m)]; equal where it was given or is taken as 0.
    small_deflection_modulus : float
        What the formula for small deflections gives for the same readings [Pa].
    misfit : float
        Root mean square residual over the largest deflection, of three-point bending over the largest force [1].
    used : numpy.ndarray
        True (n,) for the readings used.
    notes : tuple of str
        Limits and warnings, in sentences.
    """

    young_modulus: float
    low: float
    high: float
    bending_stiffness: float
    stiffness_low: float
    stiffness_high: float
    slack: float
    clamp_compliance: float = 0.0
    clamp_low: float = 0.0
    clamp_high: float = 0.0
    small_deflection_modulus: float
    misfit: float
    used: np.ndarray = field(repr=False)
    notes: tuple[str, ...] = ()

    @property
    def estimates(self) -> tuple[Estimate, ...]:
        """``needle_young_modulus`` [Pa] where the section is known, otherwise ``bending_stiffness`` [N m^2], and
        ``clamp_compliance`` [rad/(N m)] if found."""
        source = f"bending, large deflections, {int(self.used.sum())} readings; misfit {percent(self.misfit)}"
        stiffness = (self.bending_stiffness, "N m^2", self.stiffness_low, self.stiffness_high)
        modulus = (self.young_modulus, "Pa", self.low, self.high)
        known = math.isfinite(self.young_modulus)
        found = [
            Estimate("needle_young_modulus", *modulus, source=source, identifiable=self.low > 0.0)
            if known
            else Estimate("bending_stiffness", *stiffness, source=source, identifiable=self.stiffness_low > 0.0),
            Estimate(
                "clamp_compliance", self.clamp_compliance, "rad/(N m)", self.clamp_low, self.clamp_high, source=source
            ),
        ]
        return tuple(each for each in found if math.isfinite(each.value) and each.value != 0.0)

    def _heading(self) -> str:
        return f"Bending of a needle, {int(self.used.sum())} readings"

    def _cells(self) -> tuple[Sequence[str], Sequence[Sequence[str]]]:
        stiffness = quantity(self.bending_stiffness, self.stiffness_low, self.stiffness_high, "N m^2")
        rows = [("bending stiffness E I", str(stiffness)), ("slack", plain(self.slack, "m"))]
        if self.young_modulus == self.young_modulus:
            rows.insert(0, ("Young's modulus", str(quantity(self.young_modulus, self.low, self.high, "Pa"))))
            rows.append(("by the formula for small deflections", plain(self.small_deflection_modulus, "Pa")))
        if self.clamp_compliance:
            limits = (self.clamp_compliance, self.clamp_low, self.clamp_high)
            rows.append(("clamp compliance", str(quantity(*limits, "rad/(N m)"))))
        return ("quantity", f"value, {INTERVAL}"), [*rows, ("misfit", f"{percent(self.misfit)} of the peak")]

    def document(self) -> dict:
        """The numbers for JSON: ``parameters`` as of every other result, what else was found next to them."""
        return super().document() | {
            "bending_stiffness_Nm2": self.bending_stiffness,
            "bending_stiffness_interval_Nm2": [self.stiffness_low, self.stiffness_high],
            "slack_m": self.slack,
            "small_deflection_modulus_Pa": self.small_deflection_modulus,
            "misfit": self.misfit,
            "readings": int(self.used.sum()),
            "notes": list(self.notes),
        }


def needle_modulus(
    force: ArrayLike,
    position: ArrayLike,
    deflection: ArrayLike,
    needle: Needle,
    *,
    clamp_compliance: float | None = None,
) -> BendingFit:
    """Young modulus of a clamped needle from the deflections of its tip, large ones included.

    Parameters
    ----------
    force, position, deflection : array_like
        Force (n,) [N], its distance (n,) [m] from the clamp, and deflection of the tip (n,) [m].
    needle : Needle
        Section and length are used, its modulus is not.
    clamp_compliance : float, optional
        Rotation of the clamp per moment [rad/(N m)]. Default: 0, or a third unknown where the readings show it, that is
        if it is above 0 by its 97.5 % limit; a rigid clamp then gets one in 2.5 % of tests.

    Returns
    -------
    BendingFit

    Raises
    ------
    InputError
        With fewer than three readings, and for impossible ones.

    Notes
    -----
    Least squares of ``elastica_deflection`` plus slack in the hub; errors are assumed proportional to the deflection.
    A compliance c adds c F a L, a bending needle F a^2 (3 L - a)/(6 E I): they differ only if the position does.
    """
    force, position, deflection = (np.asarray(column, float) for column in (force, position, deflection))
    _refuse_impossible(force, position, deflection, needle)
    problem = _Cantilever(force, position, deflection, needle, clamp_compliance or 0.0)
    fit = problem.solved(clamp=False)
    shown = fit is None or fit.misfit > ROUNDING
    free = shown and clamp_compliance is None and len(force) >= 3 + MIN_SPARE_FOR_CLAMP and len(np.unique(position)) > 1
    if free:
        softer = problem.solved(clamp=True)
        fit = softer if softer is not None and softer.clamp_low > 0.0 else fit
    if fit is None:
        raise _no_stiffness()
    notes = [*_clamp_note(fit, problem, clamp_compliance), *small_deflection_note(fit), *_misfit_note(fit)]
    return replace(fit, notes=tuple(notes))


class _Cantilever:
    """The readings over the measured deflection, as a function of ln E, slack and clamp compliance."""

    def __init__(
        self, force: np.ndarray, position: np.ndarray, deflection: np.ndarray, needle: Needle, compliance: float
    ):
        self.force, self.position, self.deflection = force, position, deflection
        self.needle, self.compliance = needle, compliance

    def start(self, clamp: bool) -> np.ndarray | None:
        """``linear``, with fewer unknowns or a rigid clamp where large deflections give no stiffness otherwise."""
        found = (self.linear(*each) for each in ((clamp, self.compliance), (False, self.compliance), (False, 0.0)))
        return next((each for each in found if each is not None), None)

    def linear(self, clamp: bool, given: float) -> np.ndarray | None:
        """1/E, slack and compliance for small deflections, or with the ``given`` one; None without a positive
        stiffness."""
        columns = [self.force * tip_compliance(self.position, self.needle), np.ones_like(self.force)]
        known = given * self.force * self.position * self.needle.length
        if clamp:
            columns.append(self.force * self.position * self.needle.length)
        design = np.column_stack(columns) / self.deflection[:, None]
        scale = np.linalg.norm(design, axis=0)
        values = np.linalg.lstsq(design / scale, 1.0 - known / self.deflection, rcond=None)[0] / scale
        return values if values[0] > 0.0 else None

    def predicted(self, x: np.ndarray) -> np.ndarray:
        compliance = max(x[2], 0.0) if len(x) > 2 else self.compliance
        stiffness = math.exp(x[0]) * self.needle.second_moment
        return x[1] + tip_of_cantilever(self.force, self.position, self.needle.length, stiffness, compliance)

    def residual(self, x: np.ndarray) -> np.ndarray:
        return self.predicted(x) / self.deflection - 1.0

    def solved(self, clamp: bool) -> BendingFit | None:
        """The fit with slack, and with a clamp compliance if ``clamp``; None if the readings do not determine it."""
        small = self.start(clamp)
        if small is None:
            return None
        guess = np.array([-math.log(small[0]), small[1], max(small[2], 0.0) if len(small) > 2 else 0.0][: 2 + clamp])
        # a clamp compliance [rad/(N m)] that bends as much as the needle
        clamping = float(np.median(self.position)) * small[0] / self.needle.second_moment
        size = np.array([1.0, float(np.abs(self.deflection).max()), clamping][: 2 + clamp])
        # far beyond small deflections the first guess is too stiff, and the fit may end at a rod that does not bend
        load = np.abs(self.force) * self.position**2 * small[0] / self.needle.second_moment
        softer = SOFTER_STARTS if load.max() > SMALL_DEFLECTION else ()
        starts = [guess] + [np.r_[guess[0] + math.log(factor), 0.0, guess[2:]] for factor in softer]
        found = min((self._from(start, size) for start in starts), key=lambda each: each.cost)
        x, jacobian = found.x * size, found.jac / size
        gram = (jacobian * size).T @ (jacobian * size)
        if not np.linalg.cond(gram) < 1e12:
            return None
        load = np.argsort(np.abs(self.force) * self.position, kind="stable")
        # what yields or slips leaves residuals that are correlated along the load
        inflation = inflation_of([found.fun[load]], len(x)) if len(load) >= MIN_CORRELATED else 1.0
        spare = max(int(len(self.force) / inflation) - len(x), 1)
        variance = 2.0 * found.cost / (len(self.force) - len(x)) * inflation
        half = student_quantile(spare) * np.sqrt(variance * np.diagonal(np.linalg.inv(gram))) * size
        modulus, compliance = math.exp(x[0]), x[2] if clamp else self.compliance
        spread = half[2] if clamp else 0.0
        rms = math.sqrt(float(np.mean((self.residual(x) * self.deflection) ** 2)))
        return BendingFit(
            young_modulus=modulus,
            low=modulus * math.exp(-half[0]),
            high=modulus * math.exp(half[0]),
            bending_stiffness=modulus * self.needle.second_moment,
            stiffness_low=modulus * math.exp(-half[0]) * self.needle.second_moment,
            stiffness_high=modulus * math.exp(half[0]) * self.needle.second_moment,
            slack=float(x[1]),
            clamp_compliance=float(compliance),
            clamp_low=float(compliance - spread),
            clamp_high=float(compliance + spread),
            small_deflection_modulus=1.0 / small[0],
            misfit=rms / float(np.abs(self.deflection).max()),
            used=np.ones(len(self.force), bool),
        )

    def _from(self, start: np.ndarray, size: np.ndarray) -> Any:
        """Least squares from one starting value, in units of ``size``."""
        from scipy.optimize import least_squares

        options = {"xtol": 1e-12, "ftol": 1e-14, "gtol": 1e-14, "diff_step": _STEP, "max_nfev": 100}
        shift = np.append(0.0, np.ones(len(size) - 1))  # steps of derivatives are shares of a number: none may be 0
        found = least_squares(lambda z: self.residual((z - shift) * size), start / size + shift, **options)
        found.x = found.x - shift
        return found


def _clamp_note(fit: BendingFit, problem: _Cantilever, given: float | None) -> list[str]:
    """What a clamp compliance that the readings do not show would change."""
    if fit.clamp_low > 0.0 and given is None:
        return [f"The clamp turns by {fit.clamp_compliance:.3g} rad/(N m), which the readings show."]
    if given is not None or len(np.unique(problem.position)) > 1:
        return []
    return ["All forces act at one position: the readings do not show whether the clamp turns, which would lower E."]


def small_deflection_note(fit: BendingFit) -> list[str]:
    """The warning that the formula for small deflections would be off by more than the interval."""
    other = fit.small_deflection_modulus
    if fit.low <= other <= fit.high:
        return []
    return [
        f"The deflections are large: the formula for small ones would give {other:.4g} Pa, "
        f"{100.0 * (other / fit.young_modulus - 1.0):+.2g} %, outside the interval."
    ]


def _misfit_note(fit: BendingFit) -> list[str]:
    """The warning that the readings are not those of an elastic needle."""
    if fit.misfit <= MAX_MISFIT:
        return []
    return [
        f"The misfit is {percent(fit.misfit)} of the largest deflection, above {percent(MAX_MISFIT)}: the needle "
        "yields or slips in the clamp, or the columns do not belong together."
    ]


def _no_stiffness() -> InputError:
    limit, step = "the needle would have no stiffness", "Check the columns, their units and signs."
    return InputError("tip_deflection", "not growing with the load", limit, next_step=step)


def _refuse_impossible(force: np.ndarray, position: np.ndarray, deflection: np.ndarray, needle: Needle) -> None:
    if len(force) < MIN_READINGS:
        limit = f"at least {MIN_READINGS} are needed"
        raise InputError("number of bending readings", len(force), limit, next_step="Give more.")
    for row, (a, tip) in enumerate(zip(position, deflection), 1):
        if not 0.0 < a <= needle.length:
            limit = f"it must be above 0 and at most the needle's length {needle.length:g} m"
            step = "Give the distance of the force from the clamp, or correct the needle's length."
            raise InputError("position", f"{a:g} m", limit, f"reading {row}", step)
        if tip == 0.0 or not abs(tip) < needle.length:
            limit = f"a loaded needle bends, by less than its length {needle.length:g} m"
            step = "Correct or remove this reading."
            raise InputError("tip_deflection", f"{tip:g} m", limit, f"reading {row}", step)
    if not force @ deflection > 0.0:
        raise _no_stiffness()
