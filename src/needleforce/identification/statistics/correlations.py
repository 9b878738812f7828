# SPDX-License-Identifier: Apache-2.0
"""Correlations of the estimates within a recording, and sentences on parameters that are identified only together."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

MIN_CORRELATION = 0.95  # from here on, less than a third of either standard error is left when the other is known
WITHOUT_PRODUCT = {"contact_depth"}  # measured from an arbitrary zero: its products have no meaning


@dataclass(frozen=True, eq=False)
class Correlations:
    """Correlations of the estimates within a recording.

    Attributes
    ----------
    names : tuple of str
        Names (p,) of the estimates.
    matrix : numpy.ndarray
        Their correlations (p, p) [1], -1 to 1, from the covariance of the fit.
    relative_errors : numpy.ndarray
        Their standard errors over their values (p,) [1], of one recording.
    """

    names: tuple[str, ...]
    matrix: np.ndarray
    relative_errors: np.ndarray

    def sentences(self) -> tuple[str, ...]:
        """One sentence for each pair of parameters that is identified only together.

        Returns
        -------
        tuple of str
            Empty where no correlation is 0.95 or more.
        """
        pairs = combinations(range(len(self.names)), 2)
        return tuple(self._sentence(i, k) for i, k in pairs if abs(self.matrix[i, k]) >= MIN_CORRELATION)

    def _sentence(self, i: int, k: int) -> str:
        r, (a, b) = float(self.matrix[i, k]), self.relative_errors[[i, k]]
        pair = f"{self.names[i]} and {self.names[k]} are identified only together, with a correlation of {r:.2f}"
        error = float(np.sqrt(max(a * a + b * b - 2.0 * abs(r) * a * b, 0.0)))
        if {self.names[i], self.names[k]} & WITHOUT_PRODUCT or not error < min(a, b):
            better = 1.0 / np.sqrt(max(1.0 - r * r, 1e-12))
            return f"{pair}: if one is known, the standard error of the other is {better:.2g} times smaller."
        form, each = "product" if r < 0.0 else "quotient", f"{100.0 * a:.2g} % and {100.0 * b:.2g} %"
        return f"{pair}: the standard error of their {form} is {100.0 * error:.2g} %, of each alone {each}."


def correlations_of(recordings: Sequence[Any]) -> Correlations | None:
    """The correlations of the recordings' cycles, their covariances averaged; None without a cycle that has one.

    They show what one recording cannot separate. The scatter between repeats has correlations too, but a few repeats
    do not determine them.
    """
    cycles = [each.cycle for each in recordings if each.cycle is not None]
    cycles = [cycle for cycle in cycles if np.isfinite(cycle.covariance).all()]
    cycles = [cycle for cycle in cycles if cycle.covariance_order == cycles[0].covariance_order]
    if not cycles:
        return None
    names = cycles[0].covariance_order
    covariance = np.mean([cycle.covariance for cycle in cycles], axis=0)
    sd = np.sqrt(covariance.diagonal())
    if not sd.all():
        return None
    values = np.mean([[cycle.values[name] for name in names] for cycle in cycles], axis=0)
    relative = np.divide(sd, np.abs(values), out=np.full(len(sd), np.nan), where=values != 0.0)
    return Correlations(names, covariance / np.outer(sd, sd), relative)


def identified_together(recordings: Sequence[Any]) -> tuple[str, ...]:
    """One sentence for each pair of parameters that these recordings identify only together."""
    found = correlations_of(recordings)
    return () if found is None else found.sentences()
