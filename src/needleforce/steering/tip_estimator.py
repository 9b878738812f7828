# SPDX-License-Identifier: Apache-2.0
"""Tip and shape in the loop: the identified needle corrected by its base wrench and by late readings of its tip."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .. import core
from ..checks import PLACE, in_range
from ..errors import InputError
from ..models.flexible_insertion import FlexibleInsertion
from ..models.model import Model
from .path_errors import PathReadings
from .path_simulation import SimulatedPath
from .steering_model import SteeringModel, steering_model
from .steering_parameters import ALIGNED
from .tip_paths import TipPath

MAX_MODES = 6
_SHARE = 1e-3  # of the variance of the tip: modes with less are left out
_KNOWN = 101  # depths at which the expected error is handed to the core
_DEEPEST = 0.3  # [m]
_NO_PART_OF_THE_NEEDLE = (*ALIGNED, "surface", "lever")  # parameters of tracker and table


@dataclass(frozen=True)
class TipEstimate:
    """Where the tip is.

    Attributes
    ----------
    tip : ndarray, shape (3,)
        In the frame of the tip readings [m].
    covariance : ndarray, shape (2, 2)
        Of its position across [m^2].
    slope : ndarray, shape (2,)
        Of the needle at the tip [1].
    force : float
        Axial force [N]; 0 without a model of it.
    wrench : ndarray, shape (6,)
        Of the tissue on the needle at the base, of the likeliest needle [N], [N m].
    status : str
        Of the step.
    """

    tip: np.ndarray
    covariance: np.ndarray
    slope: np.ndarray
    force: float
    wrench: np.ndarray
    status: str

    @property
    def sd(self) -> float:
        """Standard deviation of the tip across, the mean of both directions [m]."""
        return float(np.sqrt(0.5 * np.trace(self.covariance)))


class TipEstimator:
    """Estimates the tip while the needle moves; its loop is in the core, without heap and with bounded cost.

    A Kalman filter on the identified needle: modes of its parameters, by what they do to the tip, the pose of the
    insertion and errors of the path that the mechanics leave. Base wrenches and tip readings correct it; readings may
    be late and seldom.

    Parameters
    ----------
    model : SteeringModel or FlexibleInsertion
        ``found.model`` of an identified needle, or an insertion with given parameters, which has no modes.
    entry : array_like, shape (3,)
        About where the tip enters the tissue, in the frame of the tip readings [m].
    modes : int
        Of the parameters, at most 6; those with less than 0.1 % of the variance of the tip are left out. Each costs
        one more step of the needle.
    axial : Model, optional
        Laws of the axial force, for an identified needle.
    options : dict, optional
        Of ``FlexibleInsertion``, such as ``elements``.
    **uncertainty : float
        Of ``core.PathUncertainty``: ``tip_noise``, ``slope_noise`` ... ``longest_delay``.

    Raises
    ------
    InputError
        If a value is outside its range.
    """

    def __init__(
        self,
        model: SteeringModel | FlexibleInsertion,
        *,
        entry: ArrayLike = (0.0, 0.0, 0.0),
        modes: int = 4,
        axial: Model | None = None,
        options: dict[str, Any] | None = None,
        **uncertainty: float,
    ):
        if modes not in range(MAX_MODES + 1):
            raise InputError("modes", modes, f"must be a whole number from 0 to {MAX_MODES}", next_step="Give 4.")
        if isinstance(model, FlexibleInsertion) and model.planar:
            raise InputError("model", "planar", "must be in space", next_step="Give planar=False to FlexibleInsertion.")
        self.model, self.entry = (
            steering_model(model, axial),
            in_range("entry", entry, PLACE, "Give x, y, z in m.", (3,)),
        )
        given = not self.model.identified
        if given and options:
            step = "Give them to FlexibleInsertion."
            raise InputError("options", ", ".join(options), "a given insertion has its own", next_step=step)
        self._modes = np.zeros((len(self.model.predictor.parameters), 0)) if given else self._directions()[:, :modes]
        needles = [model] if given else [
            SteeringModel(self.model.form, values, self.model.needle, self.model.predictor).insertion(
                axial, **({"path_spacing": 2e-4, "elements": 30, "max_travel": 0.02} | (options or {}))
            )
            for values in (self.model.values, *(self._moved(mode) for mode in self._modes.T))
        ]  # fmt: skip
        likely, *varied = (each._core.copy() for each in needles)  # type: ignore[union-attr]
        self._core = core.TipEstimator(likely, varied, core.PathUncertainty(**uncertainty))
        depth = np.linspace(0.0, _DEEPEST, _KNOWN)
        self._core.expect(np.ascontiguousarray(self._known_error(depth)), float(depth[1]))
        self._surface = self.model.values.get("surface", 0.0)
        self._roll = self.model.roll
        self._sensor = np.array([self.model.values.get(f"sensor_{across}", 0.0) for across in "xy"])

    def step(
        self,
        depth: float,
        lateral: Sequence[float] = (0.0, 0.0),
        *,
        roll: float = 0.0,
        tilt: Sequence[float] = (0.0, 0.0),
        dt: float,
    ) -> TipEstimate:
        """One cycle; never raises.

        Parameters
        ----------
        depth : float
            Of the base, from the same zero as in the insertions of the fit [m].
        lateral, roll, tilt : float
            Of the base, as in ``FlexibleInsertion.step`` [m], [rad], [1].
        dt : float
            Time since the last cycle [s].

        Returns
        -------
        TipEstimate
            With the status of the step; a refused one changes nothing.
        """
        base = (depth - self._surface, tuple(lateral), tuple(tilt), roll + self._roll)
        return self._estimate(self._core.step(*base, dt))

    def read_tip(self, tip: ArrayLike, *, age: float = 0.0, slope: ArrayLike | None = None) -> bool:
        """Take a reading of the tip.

        Parameters
        ----------
        tip : array_like, shape (3,)
            Position [m]; its part along the insertion is not used.
        age : float
            How long ago it was measured [s].
        slope : array_like, shape (2,), optional
            Slope of the tip as its sensor shows it [1].

        Returns
        -------
        bool
            False if it was not used: older than ``longest_delay``, not finite, or beyond what noise and errors
            explain (1 in 3 million); then ``rejected`` counts it. Slopes beyond that are left out alone.

        Raises
        ------
        InputError
            If it has another number of values.
        """
        across = _numbers("tip", tip, 3)[:2] - self.entry[:2]
        slopes = np.zeros(0) if slope is None else _numbers("slope of the tip", slope, 2) - self._sensor
        return self._core.tip(tuple(map(float, across)), float(age), list(map(float, slopes)))

    def read_wrench(self, wrench: ArrayLike) -> bool:
        """Take a wrench at the base.

        Parameters
        ----------
        wrench : array_like, shape (6,)
            Of the tissue on the needle, now [N], [N m]; a ``WrenchSensor`` turns readings into it. It counts once in a
            millimetre of motion.

        Returns
        -------
        bool
            False if it was not used: too soon, after a refused step, not finite, or beyond what noise and errors of the
            mechanics explain (1 in 3 million).

        Raises
        ------
        InputError
            If it has another number of values.
        """
        return self._core.wrench(tuple(map(float, _numbers("wrench", wrench, 6))))

    def shape(self) -> np.ndarray:
        """The needle from the base to the tip as estimated, (n, 3) [m]."""
        return self._core.shape() + self.entry

    @property
    def estimate(self) -> TipEstimate:
        """After the last step or reading."""
        return self._estimate(self._core.estimate())

    @property
    def rejected(self) -> int:
        """Readings of the tip in a row that noise and errors do not explain: another frame, or another needle."""
        return self._core.rejected()

    @property
    def values(self) -> dict[str, float]:
        """The parameters as the readings so far suggest them."""
        return self._moved(self._modes @ self._core.modes()[: self._modes.shape[1]])

    def reset(self) -> None:
        """Back to before the first contact."""
        self._core.reset()

    def _estimate(self, found: Any) -> TipEstimate:
        xx, xy, yy = found.covariance
        sample = found.sample
        return TipEstimate(
            tip=found.tip + self.entry,
            covariance=np.array([[xx, xy], [xy, yy]]),
            slope=found.slope,
            force=sample.force,
            wrench=sample.wrench,
            status=sample.status,
        )

    def _known_error(self, depth: np.ndarray) -> np.ndarray:
        """Expected error of a new insertion, given those of the fit, with the axis of the tracker, (n, 2) [m]."""
        axis = np.array([self.model.values.get(f"axis_{across}", 0.0) for across in "xy"])
        nothing = PathReadings(np.zeros(1), sloped=False)
        return self.model.predictor.common_error(nothing, depth) + np.outer(depth, axis)

    def _moved(self, mode: np.ndarray) -> dict[str, float]:
        """The values with the deviations of a mode, in standard deviations of the priors."""
        values = dict(self.model.values)
        for parameter, share in zip(self.model.predictor.parameters, mode):
            if share and parameter.name not in _NO_PART_OF_THE_NEEDLE:
                number = parameter.inside(values[parameter.name]) + parameter.spread * float(share)
                values[parameter.name] = float(np.clip(parameter.outside(number), parameter.low, parameter.high))
        return values

    def _directions(self) -> np.ndarray:
        """Directions of the parameters (p, k) by which the tip is uncertain, each a standard deviation long; the one
        that matters most first."""
        predictor = self.model.predictor
        kept = [k for k, parameter in enumerate(predictor.parameters) if parameter.name not in _NO_PART_OF_THE_NEEDLE]
        if not kept or predictor.covariance is None:
            return np.zeros((len(predictor.parameters), 0))
        factor = np.linalg.cholesky(predictor.covariance[np.ix_(kept, kept)])
        effects = self._effects()[kept]
        left, sizes, _ = np.linalg.svd(factor.T @ effects, full_matrices=False)
        count = int(np.sum(sizes**2 > _SHARE * np.sum(sizes**2)))
        directions = np.zeros((len(predictor.parameters), count))
        directions[kept] = factor @ left[:, :count]
        return directions

    def _effects(self) -> np.ndarray:
        """Change of the tip by each parameter in a steered insertion, (p, n): the base goes back and forth."""
        depth = np.linspace(0.0, 0.1, 21)
        base = 3e-3 * np.column_stack([np.sin(depth / 0.02), np.sin(depth / 0.03)])
        path = TipPath("probe", base, np.column_stack([base, depth]), None)
        here = self.model.simulated(path)
        return np.array(
            [(_across(self._probed(p, path)) - _across(here)) / 0.05 for p in self.model.predictor.parameters]
        )

    def _probed(self, parameter: Any, path: TipPath) -> SimulatedPath:
        values = self.model.values
        number = parameter.inside(values[parameter.name]) + 0.05 * parameter.spread
        return self.model.predictor.simulate(values | {parameter.name: parameter.outside(number)}, path)


def _numbers(quantity: str, values: ArrayLike, count: int) -> np.ndarray:
    numbers = np.asarray(values, dtype=float)
    if numbers.shape != (count,):
        raise InputError(quantity, repr(values), f"must be {count} numbers", next_step="Give them in SI units.")
    return numbers


def _across(simulated: SimulatedPath) -> np.ndarray:
    return (simulated.tip - simulated.tip[0]).ravel()
