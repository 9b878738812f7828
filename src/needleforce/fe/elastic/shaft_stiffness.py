# SPDX-License-Identifier: Apache-2.0
"""How stiffly tissue resists a shaft: what axial laws call the stiffness of dragged tissue, and the share of labels."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ...checks import above_zero
from ...errors import InputError
from ..materials import Elastic
from ..mesh.block import axisymmetric_block
from .condensed import MAX_NODES, CondensedTissue
from .needle_path import NeedlePath
from .tissue import Tissue

_MAX_DEPTH = 0.3  # of a shaft [m]
_LARGE = 10.0  # depth and radius of a block that stands for a half-space, in embedded lengths


def shaft_stiffness(
    depth: ArrayLike,
    radius: float,
    material: Elastic,
    *,
    block_radius: float | None = None,
    block_depth: float | None = None,
    base: str = "fixed",
    sides: str = "free",
) -> np.ndarray:
    """Axial force per displacement of a straight shaft that sticks to the tissue along its embedded length.

    It is the slope of force over depth just after a reversal, before the shaft slips, and the ``stiffness`` of
    ``nf.laws.DraggedTissue``.

    Parameters
    ----------
    depth : array_like
        Embedded lengths [m], at least four radii, of any shape.
    radius : float
        Of the shaft [m].
    material : Elastic
        Of the tissue.
    block_radius, block_depth : float, optional
        Of the specimen [m]; by default ten times the deepest, as good as a half-space.
    base, sides : str
        Its supports: ``"fixed"``, ``"sliding"`` or ``"free"``.

    Returns
    -------
    ndarray
        Stiffness [N/m], proportional to the modulus.

    Raises
    ------
    InputError
        If a length is out of range, or the block is not held.

    Notes
    -----
    Finite elements with cells of the radius along the shaft, within about 3 % of the limit; Randolph & Wroth (1978)
    have a closed form for a half-space (``closed_forms.bonded_shaft_stiffness``), within a tenth.
    """
    lengths = np.asarray(depth, dtype=float)
    deepest = float(lengths.max(initial=0.0))
    wide = _LARGE * deepest if block_radius is None else block_radius
    deep = _LARGE * deepest if block_depth is None else block_depth
    _check(lengths, radius, wide, deep)
    mesh = axisymmetric_block(wide, deep, radius, needle_depth=deepest)
    tissue = Tissue(mesh, material, symmetry="axisymmetric", supports={"bottom": base, "sides": sides})
    found = []
    for length in lengths.ravel():
        nodes = int(np.clip(np.ceil(length / (2.0 * radius)), 4, MAX_NODES - 1))
        found.append(tissue.condense(NeedlePath(length, length / nodes, radius)).bonded_stiffness(length))
    return np.reshape(found, lengths.shape)


def modulus_of_shaft_stiffness(stiffness: ArrayLike, depth: ArrayLike, radius: float, **geometry) -> np.ndarray:  # type: ignore[no-untyped-def]
    """Young modulus [Pa] of tissue that resists a shaft with a measured stiffness [N/m].

    Parameters
    ----------
    stiffness : array_like
        Slope of force over depth just after a reversal [N/m].
    depth : array_like
        Embedded lengths [m].
    radius : float
        Of the shaft [m].
    **geometry
        ``poisson_ratio`` (0.49 by default) and the keywords of ``shaft_stiffness``.

    Returns
    -------
    ndarray
        [Pa]
    """
    ratio = geometry.pop("poisson_ratio", 0.49)
    unit = shaft_stiffness(depth, radius, Elastic(1.0, ratio), **geometry)
    return np.asarray(stiffness, dtype=float) / unit


def _check(lengths: np.ndarray, radius: float, wide: float, deep: float) -> None:
    above_zero("radius", radius, "m")
    if not lengths.size:
        raise InputError("depth", "empty", "must be lengths", next_step="Give embedded lengths in m.")
    if lengths.max() > _MAX_DEPTH:
        raise InputError(
            "depth", f"{lengths.max():g} m", f"must be at most {_MAX_DEPTH:g} m", next_step="Give it in m."
        )
    if not np.all(lengths >= 4.0 * radius) or not np.all(np.isfinite(lengths)):
        limit = f"must be at least four radii, {4e3 * radius:g} mm"
        raise InputError("depth", f"{1e3 * lengths.min():g} mm", limit, next_step="Give embedded lengths in m.")
    if not (deep > lengths.max() and wide > 2.0 * radius):
        size, limit = (
            f"{1e3 * wide:g} mm wide and {1e3 * deep:g} mm deep",
            f"the shaft is {1e3 * lengths.max():g} mm deep",
        )
        raise InputError("block", size, limit)


@dataclass(frozen=True, eq=False)
class StiffnessByLabel:
    """A condensed tissue and how its compliance changes with the moduli of its labels: the stiffness of the path that
    each label contributes, and last that of the others.

    With the displacements U for unit forces at the path, ``dS = -U' dK U`` exactly. The shares are ``S^-1 U' K_i U
    S^-1``: their sum is the stiffness, and scaled by factors of the moduli they are Rayleigh's bound on it, with the
    right value and slope. A common factor of all moduli is exact.
    """

    condensed: CondensedTissue
    shares: np.ndarray  # (k, n, n) [N/m]

    def compliance(self, logarithms: np.ndarray) -> np.ndarray:
        """Of the path (n, n) [m/N], for logarithms (k - 1,) of the factors of the moduli."""
        factors = np.append(np.exp(logarithms), 1.0)
        found = np.linalg.inv(np.tensordot(factors, self.shares, axes=1))
        return 0.5 * (found + found.T)


def stiffness_by_label(tissue: Tissue, path: NeedlePath, labels: Sequence[str]) -> StiffnessByLabel:
    """Condense a tissue onto a path and divide its stiffness among labels; without any all have one factor. Raises
    InputError as ``Tissue.condense``."""
    condensed = tissue.condense(path)
    total = np.linalg.inv(condensed.compliance)
    if not labels:
        return StiffnessByLabel(condensed, np.stack([total, np.zeros_like(total)]))
    displaced, at = tissue.solve(path.loads(tissue).toarray()) @ total, tissue.mesh.labels.astype(str)
    parts = [[np.where(at == label, each, 0.0) for each in tissue.moduli()] for label in labels]
    shares = [displaced.T @ (tissue.elements.stiffness(*part) @ displaced) for part in parts]
    shares = [0.5 * (share + share.T) for share in shares]
    return StiffnessByLabel(condensed, np.stack([*shares, total - sum(shares)]))
