# SPDX-License-Identifier: Apache-2.0
"""What trades off within a recording: correlations of the estimates, and sentences on those known only together."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

TOGETHER = 0.95  # a third of either's error is left when the other is known
PLACES = {"contact_depth"}  # counted from an arbitrary zero: no product of it means anything


@dataclass(frozen=True, eq=False)
class Correlations:
    """Correlations ``matrix`` (p, p) of the estimates ``names`` within a recording, from their covariance, and the
    relative standard errors (p,), of one recording."""

    names: tuple[str, ...]
    matrix: np.ndarray
    relative_errors: np.ndarray

    def sentences(self) -> tuple[str, ...]:
        """One plain sentence for each pair that is known only together."""
        pairs = combinations(range(len(self.names)), 2)
        return tuple(self._sentence(i, k) for i, k in pairs if abs(self.matrix[i, k]) >= TOGETHER)

    def _sentence(self, i: int, k: int) -> str:
        r, (a, b) = float(self.matrix[i, k]), self.relative_errors[[i, k]]
        said = f"{self.names[i]} and {self.names[k]} are known only together, with a correlation of {r:.2f}"
        error = float(np.sqrt(max(a * a + b * b - 2.0 * abs(r) * a * b, 0.0)))
        if {self.names[i], self.names[k]} & PLACES or not error < min(a, b):
            better = 1.0 / np.sqrt(max(1.0 - r * r, 1e-12))
            return f"{said}: if one were given, the other would be known {better:.2g} times as well."
        form, each = "product" if r < 0.0 else "quotient", f"{100.0 * a:.2g} % and {100.0 * b:.2g} %"
        return (
            f"{said}: a recording tells their {form} to {100.0 * error:.2g} %, by themselves {each} (standard errors)."
        )


def correlations_of(recordings: Sequence) -> Correlations | None:
    """The correlations of the recordings' cycles, their covariances averaged; None without a cycle that has one.

    They tell what one recording cannot separate. Repeats add scatter of their own, whose correlations few repeats do
    not show.
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


def known_together(recordings: Sequence) -> tuple[str, ...]:
    """What these recordings tell only together, one sentence a pair."""
    found = correlations_of(recordings)
    return () if found is None else found.sentences()
