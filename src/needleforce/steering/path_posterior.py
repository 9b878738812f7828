# SPDX-License-Identifier: Apache-2.0
"""Uncertainty of a predicted tip: parameters and unexplained errors together, linear about the identified values."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .path_errors import PathReadings, between


@dataclass(frozen=True)
class Sensitive:
    """Readings of one insertion, linear in the parameters.

    Attributes
    ----------
    readings : PathReadings
        Where tip and slope were read.
    residuals : ndarray, shape (m, 2)
        What was read less what is simulated.
    slopes : ndarray, shape (p, m, 2)
        Change of the residuals by each parameter, in units of the standard deviation of its prior.
    """

    readings: PathReadings
    residuals: np.ndarray
    slopes: np.ndarray

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
    """Residuals of the tip of one insertion that follow from other insertions and from its own entry.

    Parameters
    ----------
    known : sequence of Sensitive
        The other insertions.
    entry, there : Sensitive
        The rows of this insertion that were read, and the positions that are sought.
    deviations : ndarray, shape (p,)
        Of the identified parameters from the means of their priors, in standard deviations.

    Returns
    -------
    mean, sd : ndarray, shape (n, 2)
        Expected residual and its standard deviation [m].
    """
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
