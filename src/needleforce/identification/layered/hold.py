# SPDX-License-Identifier: Apache-2.0
"""The time constants of relaxation, by the decay of the force in the holds."""

import itertools

import numpy as np

from .binned_cycle import BinnedCycle

DEFAULT_TIMES_S = (0.3, 3.0)  # [s] for recordings without a hold
SPEED_AT_REST = 1e-4  # [m/s] as in the engine
MIN_BINS = 8  # of a hold, for a level and two exponentials with samples to spare
SHORTEST = 0.01  # [of the hold] its first bins show no shorter time, and none of it a longer one than itself
MIN_RATIO = 2.0  # of the two times: nearer ones have the same decay
GRID, ZOOMS = 9, 4  # times in each direction, and how often the grid is narrowed


def relaxation_times(cycles: tuple[BinnedCycle, ...]) -> tuple[float, float]:
    """The two time constants [s] with which the force of all holds decays, by least squares.

    At rest every layer relaxes alike, so that the force of a run is a level and two exponentials whatever the layers
    are. Level and amplitudes of each run are projected out; the times are common.

    Parameters
    ----------
    cycles : tuple of BinnedCycle
        The repeats; those without a hold, or with fewer than ``MIN_BINS`` bins in it, are left out.

    Returns
    -------
    tuple of float
        The shorter and the longer time; ``DEFAULT_TIMES_S`` without a hold.
    """
    holds = [_hold(cycle) for cycle in cycles if at_rest(cycle).sum() >= MIN_BINS]
    if not holds:
        return DEFAULT_TIMES_S
    length = float(np.median([time[-1] for time, _, _ in holds]))
    low, high = np.log(SHORTEST * length), np.log(length)
    middle, half = np.full(2, 0.5 * (low + high)), 0.5 * (high - low)
    for _ in range(ZOOMS):
        axes = [np.clip(np.linspace(at - half, at + half, GRID), low, high) for at in middle]
        pairs = np.array([pair for pair in itertools.product(*axes) if pair[1] - pair[0] >= np.log(MIN_RATIO)])
        squares = sum(_squares(hold, np.exp(pairs)) for hold in holds)
        middle, half = pairs[int(np.argmin(squares))], 2.0 * half / (GRID - 1)
    return float(np.exp(middle[0])), float(np.exp(middle[1]))


def at_rest(cycle: BinnedCycle) -> np.ndarray:
    """True (m,) for bins of the hold before and after which the needle does not move: where it still settles, or has
    begun to withdraw, the force changes with the travel."""
    speed = np.abs(np.diff(cycle.depth, prepend=cycle.depth[0])) / cycle.dt
    still = speed < SPEED_AT_REST
    return (cycle.stroke == 1) & still & np.append(still[1:], True)


def _hold(cycle: BinnedCycle) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time [s] since rest began, weighted force over the scale, and weights (bins,) of one hold."""
    here = at_rest(cycle)
    weight = cycle.weight[here]
    time = np.cumsum(cycle.dt)[here]
    return time - time[0], weight * cycle.force[here], weight


def _squares(hold: tuple[np.ndarray, np.ndarray, np.ndarray], times: np.ndarray) -> np.ndarray:
    """Sums of squares (pairs,) that a level and two exponentials with ``times`` (pairs, 2) [s] leave."""
    since, force, weight = hold
    decay = np.exp(-since[:, None] / times[:, None, :])
    columns = weight[:, None] * np.concatenate([np.ones((len(times), len(since), 1)), decay], axis=2)
    along = np.einsum("pbk,b->pk", np.linalg.qr(columns)[0], force)
    return force @ force - (along**2).sum(axis=1)
