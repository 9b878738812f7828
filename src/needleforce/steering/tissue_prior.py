# SPDX-License-Identifier: Apache-2.0
"""What identified tissues show of the next one: how parameters, and the response of the tip to the base, spread over
tissues."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Union

import numpy as np

from ..errors import InputError

if TYPE_CHECKING:
    from .steering_model import SteeringModel
    from .tip_path_fit import SteeringFit

ROBUST_FROM = 2.0  # standard deviations, from which on what deviates counts linearly
RESPONSES = 4  # coefficients of the response of a regression to the motion of the base


@dataclass(frozen=True, eq=False)
class Spread:
    """A normal distribution of several numbers: mean (p,) and covariance (p, p)."""

    mean: np.ndarray
    covariance: np.ndarray

    @classmethod
    def wide(cls, count: int) -> "Spread":
        """Of numbers in units of their own standard deviations, independent."""
        return cls(np.zeros(count), np.eye(count))

    @cached_property
    def root(self) -> np.ndarray:
        """The symmetric root of the covariance, whose directions are the closest to the numbers themselves."""
        values, vectors = np.linalg.eigh(self.covariance)
        return vectors * np.sqrt(values) @ vectors.T

    def deviations(self, numbers: np.ndarray) -> np.ndarray:
        """Independent deviations from the mean, in standard deviations, (p,)."""
        return np.linalg.solve(self.root, numbers - self.mean)

    def apart(self, found: "Spread") -> np.ndarray:
        """What was found, as independent deviations from the mean over the root of both variances, (p,)."""
        errors = np.linalg.solve(self.root, np.linalg.solve(self.root, found.covariance).T)
        return self.deviations(found.mean) / np.sqrt(1.0 + np.diag(errors))

    def widened(self, found: "Spread") -> "Spread":
        """So wide that what data found without it lies at most two standard deviations, with the errors, from the
        mean."""
        off = np.maximum(np.abs(self.apart(found)) / ROBUST_FROM, 1.0)
        return Spread(self.mean, self.root * off**2 @ self.root)


@dataclass(frozen=True, eq=False)
class TissuePrior:
    """What earlier tissues show of the next one, before anything is measured in it.

    Attributes
    ----------
    form : str
        ``"linear"`` or ``"yielding"``, of the fits from which it was learnt.
    names : tuple of str
        The parameters, in the order of ``spread``.
    spread : Spread
        Of the parameters over tissues, in standard deviations of the wide priors from their means; of logarithms where
        a parameter is positive.
    response : Spread
        Of the four coefficients with which a regression answers to the motion of the base.
    tissues : int
        From how many it was learnt.
    """

    form: str
    names: tuple[str, ...]
    spread: Spread
    response: Spread
    tissues: int

    def widened(self, found: Spread) -> "TissuePrior":
        """As wide as what the data of a tissue found without it requires."""
        return replace(self, spread=self.spread.widened(found))

    def contradicted(self, found: Spread) -> dict[str, float]:
        """Parameter -> how many standard deviations what was found lies outside, where these are more than two."""
        off = np.abs(self.spread.apart(found))
        return {name: float(each) for name, each in zip(self.names, off) if each > ROBUST_FROM}


def prior(fits: Sequence[Union["SteeringFit", "SteeringModel"]]) -> TissuePrior:
    """Learn what several tissues have in common, so that less has to be measured in the next one.

    Parameters
    ----------
    fits : sequence of SteeringFit or SteeringModel
        One a tissue: of ``nf.steering.identify`` for tip paths, or of ``nf.steering.load``; of one form, and all of
        needles that are held in the same way.

    Returns
    -------
    TissuePrior
        For ``nf.steering.identify(insertions, needle, prior=...)``.

    Raises
    ------
    InputError
        If there is no fit, or they are of several forms.

    Notes
    -----
    Mean and covariance are those of a mixture: what each tissue shows with its own errors, so that what it does not
    show stays open, and the wide prior, which counts as one tissue more. Of x and y the means are 0 and the spreads the
    same, as a tissue has no direction.
    """
    models = [getattr(each, "model", each) for each in fits]
    predictors = [model.predictor for model in models]
    groups = {(model.form, tuple(each.name for each in model.predictor.parameters)) for model in models}
    if len(groups) != 1 or not all(predictor.insertions for predictor in predictors):
        given = " and ".join(sorted(f"{form} with {len(names)} parameters" for form, names in groups)) or "nothing"
        step = "Identify all from tip paths, with the same model and held."
        raise InputError("fits of a prior", given, "one form is needed, from tip paths", next_step=step)
    form, names = groups.pop()
    spread = _over_tissues([each.found for each in predictors], names)
    response = _over_tissues([each.response_found for each in predictors])
    return TissuePrior(form, names, spread, response, len(predictors))


def _over_tissues(tissues: Sequence[Spread], names: Sequence[str] = ()) -> Spread:
    """Mean and covariance of numbers in a further tissue: of a mixture of what each tissue shows, and of the wide
    prior, once."""
    count = len(tissues[0].mean)
    each = [Spread.wide(count), *tissues]
    mean = _without_direction(np.mean([one.mean for one in each], axis=0), names)
    apart = np.array([one.mean for one in each]) - mean
    within = np.mean([one.covariance for one in each], axis=0)
    return Spread(mean, _evenly(within + apart.T @ apart / len(each), names))


def _sides(names: Sequence[str]) -> list[list[int]]:
    """Indices of x and y of each parameter that has both."""
    known = list(names)
    return [[k, known.index(f"{name[:-2]}_y")] for k, name in enumerate(known) if name.endswith("_x")]


def _without_direction(mean: np.ndarray, names: Sequence[str]) -> np.ndarray:
    for pair in _sides(names):
        mean[pair] = 0.0
    return mean


def _evenly(covariance: np.ndarray, names: Sequence[str]) -> np.ndarray:
    for pair in _sides(names):
        variance = np.diag(covariance)[pair].mean()
        covariance[pair], covariance[:, pair] = 0.0, 0.0
        covariance[pair, pair] = variance
    return covariance
