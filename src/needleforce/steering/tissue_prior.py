# SPDX-License-Identifier: Apache-2.0
"""What identified tissues show of the next one: how parameters, and the response of the tip to the base, spread over
tissues."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

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
