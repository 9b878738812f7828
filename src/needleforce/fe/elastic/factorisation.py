# SPDX-License-Identifier: Apache-2.0
"""Factor of a sparse stiffness, ordered by where its unknowns are: nested dissection (George 1973)."""

import os

import numpy as np
from numpy.typing import ArrayLike

from ...errors import InputError

_LEAF = 60  # unknowns that are not divided further


class Factor:
    """Sparse factor of a symmetric positive definite matrix (n, n), whose unknowns are at places (n, d) [m], near their
    neighbours. Raises InputError if the factor does not fit into the memory that is free."""

    def __init__(self, matrix, places: np.ndarray):  # type: ignore[no-untyped-def]
        from scipy.sparse.linalg import splu

        _check_memory(*places.shape)
        self._order = dissected(matrix.tocsr(), places)
        ordered = matrix.tocsr()[self._order][:, self._order].tocsc()
        options = {"SymmetricMode": True}
        self._factor = splu(ordered, permc_spec="NATURAL", diag_pivot_thresh=0.0, options=options)

    @property
    def size(self) -> int:
        """Numbers in the factor."""
        return int(self._factor.nnz)

    def solve(self, right: ArrayLike) -> np.ndarray:
        """Solution for right-hand sides (n,) or (n, k)."""
        right = np.asarray(right, dtype=float)
        solution = np.empty_like(right)
        solution[self._order] = self._factor.solve(np.ascontiguousarray(right[self._order]))
        return solution


def dissected(matrix, places: np.ndarray) -> np.ndarray:  # type: ignore[no-untyped-def]
    """Order of elimination: halves of the body first, then what lies between them."""
    return np.concatenate(list(_halves(matrix, places, np.arange(len(places)))))


def _halves(matrix, places, numbers):  # type: ignore[no-untyped-def]
    if len(numbers) <= _LEAF:
        yield numbers
        return
    cuts = [cut for axis in range(places.shape[1]) if (cut := _cut(matrix, places[numbers, axis], numbers)) is not None]
    if not cuts:  # all at one place
        yield numbers
        return
    low, high, between = min(cuts, key=lambda cut: len(cut[2]))
    yield from _halves(matrix, places, low)
    yield from _halves(matrix, places, high)
    yield between


def _cut(matrix, along, numbers):  # type: ignore[no-untyped-def]
    """Numbers below the middle of an axis, above it, and those above next to ones below; None if all are there."""
    low = along < np.partition(along, len(along) // 2)[len(along) // 2]
    if not low.any():
        return None
    inside = np.zeros(matrix.shape[0], dtype=bool)
    inside[numbers[low]] = True
    high = numbers[~low]
    rows = matrix[high]
    touching = np.diff(np.concatenate([[0], np.cumsum(inside[rows.indices])])[rows.indptr]) > 0
    return numbers[low], high[~touching], high[touching]


def _check_memory(unknowns: int, dimension: int) -> None:
    needed, free = memory_of_factor(unknowns, dimension), _free_memory()
    if free is not None and needed > 0.9 * free:
        step = "Use larger cells away from the needle, an axisymmetric mesh, or another computer."
        limit = f"the factor would need {needed / 1e9:.1f} GB and {free / 1e9:.1f} GB are free"
        raise InputError("mesh", f"of {unknowns} unknowns", limit, next_step=step)


def memory_of_factor(unknowns: int, dimension: int) -> float:
    """Memory of a factor [bytes], about: n log n numbers in the plane, n^(4/3) in space (George 1973), as measured."""
    numbers = 12.0 * unknowns * np.log2(unknowns + 2.0) if dimension == 2 else 40.0 * unknowns ** (4.0 / 3.0)
    return 24.0 * numbers  # 8 bytes of a number and 4 of its index, twice: lower and upper


def _free_memory() -> float | None:
    """Of the computer [bytes]; None where it is not reported."""
    try:
        with open("/proc/meminfo", encoding="ascii") as lines:
            return next(1024.0 * float(line.split()[1]) for line in lines if line.startswith("MemAvailable"))
    except (OSError, StopIteration):
        pass
    try:
        return float(os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    except (AttributeError, OSError, ValueError):
        return None
