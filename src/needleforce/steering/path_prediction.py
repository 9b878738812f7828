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
from .simple_predictors import SIMPLE, both, predicted_simply, regression_error, response_shown
from .steering_parameters import Parameter, deviations_of
from .tip_paths import TipPath
from .tissue_prior import Spread, TissuePrior

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


def _planes(covariance: np.ndarray) -> np.ndarray:
    return np.kron(np.eye(2), covariance)


def _prior_covariance(known: Sequence[Sensitive]) -> np.ndarray:
    blocks = [[between(a.readings, b.readings, a is b, noise=a is b) for b in known] for a in known]
    slopes = both(np.concatenate([each.slopes for each in known], axis=1))
    return _planes(np.block(blocks)) + slopes.T @ slopes


def expected_errors(
    known: Sequence[Sensitive], entry: Sensitive, there: Sensitive, deviations: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Residuals of the tip of one insertion that follow from other, known ones and from its own entry, the rows of it
    that were read: mean and standard deviation ``there``, (n, 2) each [m]. ``deviations`` (p,) are those of the
    identified parameters from the means of their priors, in standard deviations."""
    given = [*known, entry]
    residuals = both(np.concatenate([each.residuals for each in given]))
    slopes = both(np.concatenate([each.slopes for each in given], axis=1))
    own = both(there.slopes)
    cross = np.vstack([between(each.readings, there.readings, each is entry) for each in given])
    joint = _planes(cross) + slopes.T @ own
    weights = np.linalg.solve(_prior_covariance(given), np.column_stack([residuals - deviations @ slopes, joint]))
    mean = deviations @ own + joint.T @ weights[:, 0]
    before = np.diag(_planes(between(there.readings, there.readings, True))) + np.sum(own**2, axis=0)
    variance = before - np.sum(joint * weights[:, 1:], axis=0)
    n = len(there.readings.depth)
    return mean.reshape(2, n).T, np.sqrt(np.maximum(variance, 0.0)).reshape(2, n).T


def weight_between(mechanics: float, regression: float) -> float:
    """Weight of the mechanics, from 0 to 1, that leaves the least of errors of these sizes and the usual correlation;
    that of the regression is the rest."""
    ratio = regression / mechanics
    return min(max((ratio**2 - _CORRELATION * ratio) / (1.0 + ratio**2 - 2.0 * _CORRELATION * ratio), 0.0), 1.0)


def expected_weight(mechanics: np.ndarray, regression: np.ndarray) -> float:
    """The same from standard deviations along an insertion, of which those of the mechanics are smaller than errors in
    a tissue that was never seen."""
    return weight_between(*(float(np.sqrt(np.mean(sd**2))) for sd in (math.sqrt(GELS_RATIO) * mechanics, regression)))


def together(weight: float, mechanics: np.ndarray, regression: np.ndarray) -> np.ndarray:
    """Standard deviation of a weighted prediction from those of both."""
    one, other = weight * mechanics, (1.0 - weight) * regression
    return np.sqrt(one**2 + other**2 + 2.0 * _CORRELATION * one * other)


@dataclass(frozen=True)
class LeftOut:
    """One insertion as the others predict it: lateral errors by predictor (n, 2), expected size of those of the
    mechanics (n, 2) [m]."""

    errors: dict[str, np.ndarray]
    sd: np.ndarray
    weight: float  # of the mechanics by the errors that are expected

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
    covariance: np.ndarray | None = None  # (p, p) of the errors, in standard deviations of the wide priors
    prior: TissuePrior | None = None  # what earlier tissues showed

    def tip(self, path: TipPath, by: str = "prediction") -> np.ndarray:
        """Position of the tip (n, 3) [m] for the motion of the base and the entry: by the weighted ``"prediction"``,
        the ``"mechanics"`` alone or one of ``SIMPLE``. Raises InputError if there is no such predictor, or if the
        needle buckles on the way or is too short for it."""
        one_of("by", by, ("prediction", "mechanics", *SIMPLE))
        if by in SIMPLE:
            across = self._simply(by, self.insertions, path)
        else:
            across, weight = self._by_mechanics(path), self.weight_for(path) if by == "prediction" else 1.0
            if weight < 1.0:
                simple = self._simply("regression", self.insertions, path)
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
        sd = self._mechanics_error(path, path.entry if read is None else read)
        if self.compares or weight == 1.0 or not self.insertions:
            return sd * self.error_scale(weight)
        sd, regression = sd * self.error_scale(1.0), self._regression_error(path)
        return together(self.weight_for(path), sd, regression)

    def weight_for(self, path: TipPath) -> float:
        """Weight of the mechanics in the prediction of an insertion, from 0 to 1: the one that left-out steered
        insertions show, and where there are none, of the errors that are expected of both."""
        if self.compares or not self.insertions:
            return self.weight
        return expected_weight(self._mechanics_error(path, path.entry), self._regression_error(path))

    def weight_in(self, each: "LeftOut") -> float:
        """The same in a left-out insertion."""
        return self.weight if self.compares else each.weight

    def _mechanics_error(self, path: TipPath, read: np.ndarray) -> np.ndarray:
        rows, depth = np.union1d(path.compared, read), np.maximum(path.depth, 0.0)
        _, sd = self._expected(self._known, self._linearised(path, rows), np.searchsorted(rows, read))
        return np.interp(depth, depth[rows], sd.mean(axis=1))

    def _regression_error(self, path: TipPath) -> np.ndarray:
        return regression_error(self.insertions, path, self._response)

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
        """Weight of the mechanics by the errors of left-out steered insertions (geometric mean); 1 if there are no
        two."""
        if not self.compares:
            return 1.0
        sizes = (np.mean([math.log(each.rms(by)) for each in self.judged]) for by in ("mechanics", "regression"))
        return weight_between(*map(math.exp, sizes))

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
        errors = {by: self._simply(by, others, path)[path.compared] - tip for by in SIMPLE}
        weight = expected_weight(sd, regression_error(others, path, self._response)[path.compared])
        return LeftOut(errors | {"mechanics": mean - here.positions().residuals}, sd, weight)

    def _expected(self, known: Sequence[Sensitive], here: Sensitive, read: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        # without insertions that state it again, what was identified is in the covariance
        known_of = self._before.deviations(self._deviations) if self.insertions else np.zeros(len(self.parameters))
        return expected_errors(known, here.rows(read), here.positions(), known_of)

    def _simply(self, by: str, training: Sequence[TipPath], path: TipPath) -> np.ndarray:
        return predicted_simply(by, training, path, self._response)

    @property
    def _response(self) -> Spread | None:
        return self.prior and self.prior.response

    @cached_property
    def _deviations(self) -> np.ndarray:
        return deviations_of(self.parameters, self.values)

    @cached_property
    def _before(self) -> Spread:
        """What was known of the parameters before the fit."""
        return self.prior.spread if self.prior else Spread.wide(len(self.parameters))

    @property
    def found(self) -> Spread:
        """What the fit knows of the parameters, in standard deviations of the wide priors."""
        assert self.covariance is not None
        return Spread(self._deviations, self.covariance)

    @property
    def response_found(self) -> Spread:
        """What its insertions show of the response of a regression to the base."""
        return response_shown(self.insertions, self._response)

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
        elif self.prior:
            stacked = np.einsum("jk,jmd->kmd", self._before.root, stacked)
        return Sensitive(readings_of(path, rows), here, stacked)
