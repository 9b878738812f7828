# SPDX-License-Identifier: Apache-2.0
"""The condensed stiffness of a path as a sum over the labels of a tissue, for small changes of their moduli."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_array

from .condensed import CondensedTissue
from .needle_path import NeedlePath
from .tissue import Tissue


@dataclass(frozen=True, eq=False)
class StiffnessByLabel:
    """A condensed tissue and how its compliance changes with the moduli of its labels.

    Attributes
    ----------
    condensed : CondensedTissue
        With the moduli of the tissue.
    shares : ndarray, shape (k, n, n)
        Stiffness of the path that each label contributes [N/m], and last that of the others.

    Notes
    -----
    With the displacements U for unit forces at the path, ``dS = -U' dK U`` exactly. The shares are
    ``S^-1 U' K_i U S^-1``: their sum is the stiffness, and scaled by factors of the moduli they are Rayleigh's bound on
    it, with the right value and slope. A common factor of all moduli is exact.
    """

    condensed: CondensedTissue
    shares: np.ndarray

    def compliance(self, logarithms: np.ndarray) -> np.ndarray:
        """Of the path (n, n) [m/N], for logarithms (k - 1,) of the factors of the moduli."""
        factors = np.append(np.exp(logarithms), 1.0)
        found = np.linalg.inv(np.tensordot(factors, self.shares, axes=1))
        return 0.5 * (found + found.T)


def stiffness_by_label(tissue: Tissue, path: NeedlePath, labels: Sequence[str]) -> StiffnessByLabel:
    """Condense a tissue onto a path and divide its stiffness among labels; without any all have one factor.

    Raises
    ------
    InputError
        As of ``Tissue.condense``.
    """
    condensed = tissue.condense(path)
    total = np.linalg.inv(condensed.compliance)
    if not labels:
        return StiffnessByLabel(condensed, np.stack([total, np.zeros_like(total)]))
    displaced = tissue.solve(path.loads(tissue).toarray()) @ total
    shares = [_symmetric(displaced.T @ (_stiffness_of(tissue, label) @ displaced)) for label in labels]
    return StiffnessByLabel(condensed, np.stack([*shares, total - sum(shares)]))


def _stiffness_of(tissue: Tissue, label: str) -> csc_array:
    """Of the cells with a label alone."""
    here = tissue.mesh.labels.astype(str) == label
    shear, lame = tissue.moduli()
    return tissue.elements.stiffness(np.where(here, shear, 0.0), np.where(here, lame, 0.0))


def _symmetric(matrix: np.ndarray) -> np.ndarray:
    return 0.5 * (matrix + matrix.T)
