# SPDX-License-Identifier: Apache-2.0
"""The tip of an insertion that was not in the fit, from its base's motion and its entry, with its uncertainty: by the
mechanics and by a regression on the motion of the base, each with the weight that left-out insertions give it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..checks import one_of
from ..errors import InputError
from .path_errors import POSITION_NOISE, PathErrors, PathReadings, between
from .path_simulation import SimulatedPath, Simulation
from .steering_parameters import Parameter, deviations_of
from .tip_paths import TipPath

SIMPLE = ("unicycle", "bicycle", "regression")
"""Predictors without mechanics, of one, two and four coefficients a direction, the last ones common to both."""
_UNIT = 0.1  # [m] of depth, so that coefficients are about 1
_RIDGE = 1e-5  # [m^2]; with errors of 1 mm, coefficients of 0.3 or more are hardly shrunk
_CORRELATION = 0.4  # correlation of the errors of mechanics and regression in recorded insertions: 0.38, 0.42 and 0.45
# mean square of the errors of held-out insertions over the expected one, the larger of two gels (2.2 and 1.3), and how
# many gels have shown it, which leaves a new one that much doubt (docs/evidence/steering.md)
GELS_RATIO = 2.2
GELS = 2


def readings_of(path: TipPath, rows: np.ndarray | None = None) -> PathReadings:
    """Where tip and slope were read, in the rows that are compared or others."""
    rows = path.compared if rows is None else rows
    return PathReadings(np.maximum(path.depth[rows], 0.0), path.slope is not None)


def residuals_of(simulated: SimulatedPath, path: TipPath, rows: np.ndarray | None = None) -> np.ndarray:
    """What was read less what is simulated, (n, 2), or (2 n, 2) with the slopes below [m], [1].

    Positions begin at 0 in the first row, as the frame of a tracker need not be that of the base.
    """
    rows = path.compared if rows is None else rows
    position = (path.tip[:, :2] - simulated.tip - _start(simulated, path))[rows]
    return position if path.slope is None else np.vstack([position, (path.slope - simulated.slope)[rows]])


def _start(simulated: SimulatedPath, path: TipPath) -> np.ndarray:
    return path.tip[0, :2] - simulated.tip[0]


@dataclass(frozen=True)
class Sensitive:
    """Readings of one insertion, linear in the parameters."""

    readings: PathReadings
    residuals: np.ndarray  # (m, 2) what was read less what is simulated
    slopes: np.ndarray  # (p, m, 2) of the residuals, by each parameter in standard deviations of its prior

    def rows(self, depths: np.ndarray) -> "Sensitive":
        """Those at some of the depths, by index; of a sloped one the slopes there, too."""
        n = len(self.readings.depth)
        index = np.append(depths, n + depths) if self.readings.sloped else depths
        readings = PathReadings(self.readings.depth[depths], self.readings.sloped)
        return Sensitive(readings, self.residuals[index], self.slopes[:, index])

    def positions(self) -> "Sensitive":
        """Without the slopes."""
        n = len(self.readings.depth)
        return Sensitive(PathReadings(self.readings.depth, False), self.residuals[:n], self.slopes[:, :n])


def _both(values: np.ndarray) -> np.ndarray:
    """(..., m, 2) as (..., 2 m): x, then y, whose parameters are the same."""
    return np.concatenate([values[..., 0], values[..., 1]], axis=-1)


def _planes(covariance: np.ndarray) -> np.ndarray:
    return np.kron(np.eye(2), covariance)


def _prior_covariance(known: Sequence[Sensitive]) -> np.ndarray:
    blocks = [[between(a.readings, b.readings, a is b, noise=a is b) for b in known] for a in known]
    slopes = _both(np.concatenate([each.slopes for each in known], axis=1))
    return _planes(np.block(blocks)) + slopes.T @ slopes


def expected_errors(
    known: Sequence[Sensitive], entry: Sensitive, there: Sensitive, deviations: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Residuals of the tip of one insertion that follow from other, known ones and from its own entry, the rows of it
    that were read: mean and standard deviation ``there``, (n, 2) each [m]. ``deviations`` (p,) are those of the
    identified parameters from the means of their priors, in standard deviations."""
    given = [*known, entry]
    residuals = _both(np.concatenate([each.residuals for each in given]))
    slopes = _both(np.concatenate([each.slopes for each in given], axis=1))
    own = _both(there.slopes)
    cross = np.vstack([between(each.readings, there.readings, each is entry) for each in given])
    joint = _planes(cross) + slopes.T @ own
    weights = np.linalg.solve(_prior_covariance(given), np.column_stack([residuals - deviations @ slopes, joint]))
    mean = deviations @ own + joint.T @ weights[:, 0]
    before = np.diag(_planes(between(there.readings, there.readings, True))) + np.sum(own**2, axis=0)
    variance = before - np.sum(joint * weights[:, 1:], axis=0)
    n = len(there.readings.depth)
    return mean.reshape(2, n).T, np.sqrt(np.maximum(variance, 0.0)).reshape(2, n).T


def _entry_line(path: TipPath) -> np.ndarray:
    """The straight path from the entry, (n, 2) [m]: mean place and slope of at most two rows before the base moves."""
    rows = path.entry[:2]
    slope = np.zeros(2) if path.slope is None else path.slope[rows].mean(axis=0)
    return path.tip[rows, :2].mean(axis=0) + np.outer(path.depth - path.depth[rows].mean(), slope)


def _columns(by: str, path: TipPath) -> np.ndarray:
    """What each coefficient adds to the straight path, x and then y (2 n, c): entry angle, curvature, and the response
    to the base, at once and to where it was on the way, by powers of the depth."""
    depth = np.maximum(path.depth, 0.0)[:, None] / _UNIT
    columns = np.kron(np.eye(2), depth**2 if by == "unicycle" else np.hstack([depth, depth**2]))
    if by != "regression":
        return columns
    moved = path.base - path.base[0]
    parts = [moved]
    for power in range(3):
        slope = depth**power * moved
        steps = 0.5 * np.diff(depth, axis=0) * (slope[1:] + slope[:-1])
        parts.append(np.vstack([np.zeros(2), np.cumsum(steps, axis=0)]))
    return np.column_stack([columns, *(_both(part) for part in parts)])


def predicted_simply(by: str, training: Sequence[TipPath], path: TipPath) -> np.ndarray:
    """Tip across (n, 2) [m] by one of ``SIMPLE``, whose coefficients fit the training insertions."""
    columns = [_columns(by, each).reshape(2, len(each), -1)[:, each.compared] for each in training]
    sides = [_both((each.tip[:, :2] - _entry_line(each))[each.compared]) for each in training]
    rows = np.vstack([each.reshape(-1, each.shape[-1]) for each in columns])
    gram = rows.T @ rows + _RIDGE * np.eye(rows.shape[1])
    found = np.linalg.solve(gram, rows.T @ np.concatenate(sides))
    return _entry_line(path) + (_columns(by, path) @ found).reshape(2, -1).T


@dataclass(frozen=True)
class LeftOut:
    """One insertion as the others predict it: lateral errors by predictor (n, 2), expected size of those of the
    mechanics (n, 2) [m]."""

    errors: dict[str, np.ndarray]
    sd: np.ndarray

    def rms(self, by: str, weight: float = 1.0) -> float:
        """Root mean square lateral error [m] of one predictor, or of a ``"prediction"`` with a weight."""
        error = self.weighted(weight) if by == "prediction" else self.errors[by]
        return float(np.sqrt(np.mean(np.sum(error**2, axis=1))))

    def weighted(self, weight: float) -> np.ndarray:
        """Errors of a prediction with a weight of the mechanics."""
        return weight * self.errors["mechanics"] + (1.0 - weight) * self.errors["regression"]

    def ratio(self, weight: float) -> float:
        """Mean square of the errors of a prediction over the expected one."""
        return float(np.mean(self.weighted(weight) ** 2 / (self.sd**2 + POSITION_NOISE**2)))


@dataclass(frozen=True)
class PathPredictor:
    """Predicts other insertions of the same tissue, from those of a fit; a needle whose parameters are given has
    none."""

    simulate: Simulation  # parameters and the motion of an insertion -> its tip by the mechanics
    values: dict[str, float]  # the identified parameters
    insertions: tuple[TipPath, ...] = ()
    parameters: Sequence[Parameter] = ()  # with their priors
    covariance: np.ndarray | None = None  # (p, p) of the errors, in standard deviations of the priors

    def tip(self, path: TipPath, by: str = "prediction") -> np.ndarray:
        """Position of the tip (n, 3) [m] for the motion of the base and the entry: by the weighted ``"prediction"``,
        the ``"mechanics"`` alone or one of ``SIMPLE``. Raises InputError if there is no such predictor, or if the
        needle buckles on the way or is too short for it."""
        one_of("by", by, ("prediction", "mechanics", *SIMPLE))
        if by in SIMPLE:
            across = predicted_simply(by, self.insertions, path)
        else:
            across, weight = self._by_mechanics(path), self.weight if by == "prediction" else 1.0
            if weight < 1.0:
                simple = predicted_simply("regression", self.insertions, path)
                across = weight * across + (1.0 - weight) * simple
        return np.column_stack([across, path.tip[:, 2]])

    def _by_mechanics(self, path: TipPath) -> np.ndarray:
        simulated = self.simulate(self.values, path)
        if simulated.lost.any():
            depth = f"{1e3 * path.depth[int(np.argmax(simulated.lost))]:.1f} mm"
            limit = "the needle buckles or does not reach it"
            raise InputError(f"depth of {path.name}", depth, limit, next_step="Leave out the rows from there on.")
        return simulated.tip + _start(simulated, path) + self.expected_error(simulated, path, path.entry)

    def expected_error(self, simulated: SimulatedPath, path: TipPath, read: np.ndarray) -> np.ndarray:
        """Expected difference between the tip of an insertion and the simulated one from the first row on, (n, 2) [m],
        given the insertions of the fit and the rows of this one that were read, by index."""
        seen = residuals_of(simulated, path, read)
        return self._errors.expected(self._residuals, readings_of(path, read), seen, np.maximum(path.depth, 0.0))

    def common_error(self, entry: PathReadings, depth: np.ndarray) -> np.ndarray:
        """Expected error of another insertion that enters at 0, given those of the fit, (n, 2) [m]."""
        return self._errors.expected(self._residuals, entry, np.zeros((len(entry), 2)), depth)

    def uncertainty(self, path: TipPath, read: np.ndarray | None = None, weight: float | None = None) -> np.ndarray:
        """Standard deviation of the tip in each lateral direction if some rows were read, by index; by default those of
        the entry, (n,) [m]. ``weight`` is that of the mechanics, by default of the prediction; 1 for plans."""
        read = path.entry if read is None else read
        rows, depth = np.union1d(path.compared, read), np.maximum(path.depth, 0.0)
        _, sd = self._expected(self._known, self._linearised(path, rows), np.searchsorted(rows, read))
        return np.interp(depth, depth[rows], sd.mean(axis=1)) * self.error_scale(weight)

    def rms(self, path: TipPath) -> float:
        """Root mean square of the lateral error of the prediction [m]."""
        return float(np.sqrt(np.mean(np.sum((self.tip(path) - path.tip)[:, :2] ** 2, axis=1))))

    @cached_property
    def left_out(self) -> dict[str, "LeftOut"]:
        """Insertion -> what is predicted of it from the other insertions and its entry; the mechanics linear in the
        parameters. Empty for one insertion."""
        return {path.name: self._left_out(k) for k, path in enumerate(self.insertions) if len(self.insertions) > 1}

    @property
    def compares(self) -> bool:
        """Whether left-out insertions show how well a steered one is predicted from another steered one."""
        return sum(path.steered for path in self.insertions) > 1

    @property
    def judged(self) -> list["LeftOut"]:
        """The left-out insertions that show it: the steered ones; all, if there are not two of these."""
        shown = [path for path in self.insertions if path.steered or not self.compares]
        return [self.left_out[path.name] for path in shown if self.left_out]

    @cached_property
    def weight(self) -> float:
        """Weight of the mechanics in a prediction, from 0 to 1; that of the regression is the rest. Errors of the sizes
        of those in the left-out steered insertions (geometric mean) and of the usual correlation leave the least."""
        if not self.compares:
            return 1.0
        ratio = math.exp(np.mean([math.log(each.rms("regression") / each.rms("mechanics")) for each in self.judged]))
        return min(max((ratio**2 - _CORRELATION * ratio) / (1.0 + ratio**2 - 2.0 * _CORRELATION * ratio), 0.0), 1.0)

    def error_scale(self, weight: float | None = None) -> float:
        """Factor by which errors exceed the expected ones, so that 1.96 of them hold 95 %: from left-out insertions, as
        many of the gels on which the laws were chosen, and Student's distribution for their small number."""
        from scipy.stats import t

        ratios = [each.ratio(self.weight if weight is None else weight) for each in self.judged]
        freedom = GELS + len(ratios)
        return math.sqrt((GELS * GELS_RATIO + sum(ratios)) / freedom) * float(t.ppf(0.975, freedom)) / 1.96

    def _left_out(self, k: int) -> "LeftOut":
        here, path, others = self._known[k], self.insertions[k], self.insertions[:k] + self.insertions[k + 1 :]
        mean, sd = self._expected(self._known[:k] + self._known[k + 1 :], here, np.arange(path.entry_rows))
        tip = path.tip[path.compared, :2]
        errors = {by: predicted_simply(by, others, path)[path.compared] - tip for by in SIMPLE}
        return LeftOut(errors | {"mechanics": mean - here.positions().residuals}, sd)

    def _expected(self, known: Sequence[Sensitive], here: Sensitive, read: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        # without insertions that state it again, what was identified is in the covariance
        deviations = deviations_of(self.parameters, self.values) if self.insertions else np.zeros(len(self.parameters))
        return expected_errors(known, here.rows(read), here.positions(), deviations)

    @cached_property
    def _errors(self) -> PathErrors:
        return PathErrors([readings_of(path) for path in self.insertions])

    @cached_property
    def _residuals(self) -> list[np.ndarray]:
        return [each.residuals for each in self._known]

    @cached_property
    def _known(self) -> list[Sensitive]:
        return [self._linearised(path, path.compared) for path in self.insertions]

    def _linearised(self, path: TipPath, rows: np.ndarray) -> Sensitive:
        here = residuals_of(self.simulate(self.values, path), path, rows)
        slopes = []
        for parameter in self.parameters:
            number, step = parameter.inside(self.values[parameter.name]), parameter.step * parameter.spread
            step = step if parameter.outside(number + step) <= parameter.high else -step
            moved = self.values | {parameter.name: parameter.outside(number + step)}
            slopes.append((residuals_of(self.simulate(moved, path), path, rows) - here) * (parameter.spread / step))
        stacked = np.array(slopes).reshape(len(slopes), *here.shape)
        if not self.insertions and self.covariance is not None:
            stacked = np.einsum("jk,jmd->kmd", np.linalg.cholesky(self.covariance), stacked)
        return Sensitive(readings_of(path, rows), here, stacked)
