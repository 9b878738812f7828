# SPDX-License-Identifier: Apache-2.0
"""Forces within bounds that move nodes as wanted: which of them stick, and which slide at a bound."""

import numpy as np

from ...errors import InputError

_TRIES = 3  # turns in which all nodes may change together without progress


def bounded_forces(
    compliance: np.ndarray, wanted: np.ndarray, bounds: tuple[np.ndarray, np.ndarray], slip: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Forces that move nodes by ``wanted`` where they are within their bounds, and by less where they are at one.

    Parameters
    ----------
    compliance : ndarray, shape (n, n)
        Symmetric, positive definite [m/N].
    wanted : ndarray, shape (n,)
        [m]
    bounds : (ndarray, ndarray), each (n,)
        Lowest and highest forces [N].
    slip : ndarray of int, shape (n,)
        Guess: -1 at the lower bound, 1 at the upper one, 0 within.

    Returns
    -------
    forces : ndarray, shape (n,)
        [N]
    slip : ndarray of int, shape (n,)
        What holds.

    Notes
    -----
    Block principal pivoting, one node at a time where that makes no progress: ends for any positive definite matrix.
    Júdice & Pires (1994), Comput. Oper. Res. 21, 587-596, with two bounds in place of one.
    """
    low, high = bounds
    slip, free = slip.copy(), high > low
    small = 1e-12 * (np.abs(wanted).max() + np.abs(compliance).max() * max(np.abs(high).max(), np.abs(low).max()))
    fewest, tries = len(wanted) + 1, _TRIES
    for _ in range(100 * len(wanted)):
        forces, short = _with(compliance, wanted, bounds, np.where(free, slip, 1))
        own = small / np.diag(compliance)
        change = _change(slip, short, np.stack([forces - low + own, high - forces + own]), small) * free
        wrong = np.flatnonzero(change)
        if not len(wrong):
            return np.clip(forces, low, high), np.where(free, slip, 0)
        fewest, tries = (len(wrong), _TRIES) if len(wrong) < fewest else (fewest, tries - 1)
        if tries < 0:
            wrong = wrong[-1:]
        slip[wrong] += change[wrong]
    raise InputError("friction", "without balance", f"in {100 * len(wanted)} turns", next_step="Use a shorter step.")


def _with(
    compliance: np.ndarray, wanted: np.ndarray, bounds: tuple[np.ndarray, np.ndarray], slip: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Forces when nodes stick and slip as given, and by how much each node falls short of what is wanted."""
    sticks = np.flatnonzero(slip == 0)
    forces = np.where(slip < 0, bounds[0], bounds[1])
    forces[sticks] = 0.0
    short = wanted - compliance @ forces
    if len(sticks):
        forces[sticks] = np.linalg.solve(compliance[np.ix_(sticks, sticks)], short[sticks])
        short = wanted - compliance @ forces
    return forces, short


def _change(slip: np.ndarray, short: np.ndarray, room: np.ndarray, small: float) -> np.ndarray:
    """By how much the slip of each node must change."""
    leaves = (slip == 0) * ((room[1] < 0.0).astype(int) - (room[0] < 0.0))
    return leaves + ((slip < 0) & (short > small)).astype(int) - ((slip > 0) & (short < -small))
